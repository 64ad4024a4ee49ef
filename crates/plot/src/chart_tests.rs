//! Properties of charts, polar curves and pictures of lattices.

use nalgebra::{Matrix6, Vector3};

use super::drawing::Mark;
use super::tests::reach;
use super::*;
use anisobond::lattice::{Lattice, Packing};
use anisobond::tensor::Stiffness;

fn scalar(name: &str, unit: &str) -> Scalar {
    Scalar { name: name.into(), unit: unit.into() }
}

fn series(name: &str, points: &[[f64; 2]]) -> Series {
    Series { name: name.into(), points: points.to_vec(), style: Style::MarkedLine }
}

fn chart_of(points: &[[f64; 2]]) -> anisobond::Result<Chart> {
    let (x, y) = (scalar("radius", "m"), scalar("stiffness & <more>", "Pa"));
    Chart::new("a \"chart\"", "", vec![Panel { x, y, series: vec![series("measured", points)] }])
}

fn cross() -> Stiffness {
    let mut c = Matrix6::zeros();
    for (a, b, value) in [(0, 0, 130.), (1, 1, 130.), (2, 2, 55.), (0, 2, 28.), (1, 2, 28.), (0, 1, 40.)] {
        c[(a, b)] = value * 1e6;
        c[(b, a)] = value * 1e6;
    }
    (c[(3, 3)], c[(4, 4)], c[(5, 5)]) = (32.2e6, 32.2e6, 45e6);
    Stiffness::from_voigt(&c).unwrap()
}

fn rows() -> Vec<StiffnessRow> {
    let row = |i: u32| StiffnessRow {
        contact_radius: 1.2 + 0.2 * f64::from(i),
        prescribed: cross(),
        lattice: cross().scaled(1.002),
        measured: cross().scaled(1.0 - 0.3 * (-f64::from(i)).exp()),
    };
    // Not sorted: the chart does that.
    (0..9).rev().map(row).collect()
}

fn pictures() -> Vec<(&'static str, Picture)> {
    let alone = |points: &[[f64; 2]]| chart_of(points).unwrap().picture();
    let many: Vec<Series> =
        (0..12).map(|i| series(&format!("a series of number {i}"), &[[0.0, f64::from(i)]])).collect();
    let panel = Panel { x: scalar("x", ""), y: scalar("y", ""), series: many };
    vec![
        ("one point", alone(&[[3.0, 4.0]])),
        ("at zero", alone(&[[0.0, 0.0]])),
        ("equal", alone(&[[1.0, 5e9], [2.0, 5e9], [3.0, 5e9]])),
        ("nearly equal", alone(&[[1.0, 1.0], [1.0 + 1e-15, 1.0 + 1e-15]])),
        ("signed", alone(&[[-3e-3, -2e9], [2e-3, 7e8]])),
        ("huge", alone(&[[1e90, -1e100], [1e-90, 1e100]])),
        ("tiny", alone(&[[1e-300, 1e-300], [2e-300, 3e-300]])),
        ("long legend", Chart::new("long ".repeat(80), "too ".repeat(99), vec![panel]).unwrap().picture()),
        ("document", stiffness_chart("C", "s", &rows(), &[(1, 1)]).unwrap().picture()),
        ("two", stiffness_chart("C", "s", &rows(), &[(1, 1), (3, 3)]).unwrap().picture()),
        (
            "seven",
            stiffness_chart("C", "", &rows(), &[(1, 1), (2, 2), (3, 3), (4, 4), (5, 5), (1, 2), (1, 3)])
                .unwrap()
                .picture(),
        ),
        (
            "polar",
            directional_picture("E", "s", &[("prescribed", &cross()), ("measured", &cross().scaled(0.9))]).unwrap(),
        ),
        ("polar alone", directional_picture("", "", &[("isotropic", &Stiffness::isotropic(1e9, 1e9))]).unwrap()),
    ]
}

#[test]
fn every_picture_is_well_formed_whole_and_legible() {
    for (name, picture) in pictures() {
        let svg = picture.svg();
        roxmltree::Document::parse(&svg).unwrap();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        assert!(picture.png(400).unwrap().starts_with(b"\x89PNG"), "{name}");
        let marks: Vec<&Mark> = picture.0.groups.iter().flat_map(|group| &group.marks).collect();
        for mark in &marks {
            let [left, top, right, bottom] = reach(mark);
            let inside =
                left >= 4.0 && top >= 4.0 && right <= picture.0.size[0] - 4.0 && bottom <= picture.0.size[1] - 4.0;
            assert!(inside, "{name}: {mark:?} in {:?}", picture.0.size);
        }
        let words: Vec<&&Mark> = marks.iter().filter(|mark| matches!(mark, Mark::Text { .. })).collect();
        for (index, a) in words.iter().enumerate() {
            for b in &words[..index] {
                let ([l, t, r, d], [l2, t2, r2, d2]) = (reach(a), reach(b));
                assert!(l >= r2 || l2 >= r || t >= d2 || t2 >= d, "{name}: {a:?} and {b:?}");
            }
        }
    }
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    for points in [&[][..], &[[f64::NAN, 1.0]], &[[1.0, f64::INFINITY]], &[[1.0, 1.0], [2e100, 1.0]]] {
        let message = chart_of(points).unwrap_err().to_string();
        assert!(message.contains("stiffness & <more> over radius"), "{message}");
    }
    assert!(Chart::new("", "", Vec::new()).is_err());
    assert!(stiffness_chart("", "", &[], &[(1, 1)]).is_err());
    assert!(stiffness_chart("", "", &rows(), &[(0, 7)]).unwrap_err().to_string().contains("C07"));
    assert!(directional_picture("", "", &[]).map(drop).is_err());
    let singular = Stiffness::from_mandel(Matrix6::zeros());
    assert!(directional_picture("", "", &[("flat", &singular)]).map(drop).unwrap_err().to_string().contains("flat"));
}

#[test]
fn the_data_stand_beside_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    let chart = stiffness_chart("C", "", &rows(), &[(1, 1), (3, 3)]).unwrap();
    chart.write(folder.path().join("chart.svg")).unwrap();
    let text = std::fs::read_to_string(folder.path().join("chart.csv")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 10);
    assert!(lines[0].starts_with("Contact radius I_R,C₁₁ (Pa): prescribed,C₁₁ (Pa): lattice"), "{}", lines[0]);
    assert!(lines[1].starts_with("1.2,130000000,"), "{}", lines[1]);
    // Two results at one x are two rows.
    let twice = chart_of(&[[1.0, 2.0], [1.0, 3.0], [0.0, 1.0]]).unwrap().csv().unwrap();
    assert_eq!(twice.lines().skip(1).collect::<Vec<_>>(), ["0,1", "1,2", "1,3"]);
    assert!(chart.write(folder.path().join("chart.pdf")).unwrap_err().to_string().contains(".svg or .png"));
    let polar = directional_csv(&[("prescribed", &cross())]).unwrap();
    assert_eq!(polar.lines().count(), 1 + 3 * 360);
    assert!(polar.lines().nth(1).unwrap().starts_with("yz,0,110018850.14"), "{:?}", polar.lines().nth(1));
}

#[test]
fn units_get_the_prefix_that_suits() {
    for (unit, magnitude, title) in [
        ("Pa", 130e6, "(MPa)"),
        ("Pa", 0.0, "(Pa)"),
        ("m", 2e-3, "(mm)"),
        ("N/m⁶", 3e21, "(10²¹ N/m⁶)"),
        ("", 2.8, ""),
        ("", 5000.0, ""),
        ("", 3e7, "(10⁶)"),
        ("Pa", 1e30, "(10³⁰ Pa)"),
    ] {
        assert_eq!(super::chart::prefixed(unit, magnitude).0, title, "{magnitude} {unit}");
    }
}

#[test]
fn bonds_across_the_cell_are_drawn_half_on_both_sides() {
    let centres = vec![Vector3::new(0.1, 0.5, 0.5), Vector3::new(0.9, 0.5, 0.5), Vector3::new(0.5, 0.5, 0.5)];
    let packing = Packing::new(Some(Vector3::repeat(1.0)), centres, vec![0.1; 3]).unwrap();
    let lattice = Lattice::new(packing, 1.1).unwrap();
    assert_eq!(lattice.contacts.len(), 1);
    let scalar = || scalar("k", "N/m");
    let bonds = lattice_scene(&lattice, &[2.0], scalar(), "t", LatticeView::Bonds).unwrap();
    let ends: Vec<[f64; 2]> = bonds.rods.iter().map(|rod| rod.ends.map(|end| end.x)).collect();
    assert_eq!(ends.len(), 2);
    assert!(ends[0][0] == 0.1 && ends[0][1].abs() < 1e-12 && ends[1][0] == 0.9 && (ends[1][1] - 1.0).abs() < 1e-12);
    // A sphere without a bond has no colour.
    let spheres = lattice_scene(&lattice, &[2.0], scalar(), "t", LatticeView::Spheres).unwrap();
    assert_eq!(spheres.balls.iter().map(|ball| ball.value).collect::<Vec<_>>(), [Some(2.0), Some(2.0), None]);
    for scene in [bonds, spheres] {
        roxmltree::Document::parse(&scene.svg()).unwrap();
    }
    for values in [&[][..], &[1.0, 2.0], &[f64::NAN]] {
        for what in [LatticeView::Bonds, LatticeView::Spheres] {
            assert!(lattice_scene(&lattice, values, scalar(), "t", what).is_err());
        }
    }
}
