//! Pressure and traction on surfaces, on grids and on packings: the true area, in balance.

use std::f64::consts::PI;

use anisobond::experiment::Condition;
use anisobond_app::{CaseFile, LatticeKind};
use nalgebra::Vector3;

/// Forces of the first condition with the places of their nodes.
fn loads(case: &CaseFile) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let (conditions, places): (_, Box<dyn Fn(u32) -> Vector3<f64>>) = match case.lattice() {
        LatticeKind::Grid => {
            let p = case.problem().unwrap();
            let grid = p.body.grid.clone();
            (p.conditions, Box::new(move |n| grid.position(n as usize)))
        }
        LatticeKind::Packing => {
            let p = case.packing_problem().unwrap();
            let conditions = p.conditions.clone();
            (conditions, Box::new(move |s| p.position(s as usize)))
        }
    };
    let Condition::Force { nodes, force, .. } = &conditions[0] else { panic!() };
    (nodes.iter().map(|&n| places(n)).collect(), force.clone())
}

/// A case of named solids on a grid and on a packing, the first condition a load.
fn case(solids: &str, body: &str, load: &str, lattice: &str, spacing: f64, more: &str) -> CaseFile {
    let own = match lattice {
        "grid" => format!("[grid]\nspacing = '{spacing} mm'\n{more}"),
        _ => format!(
            "[packing]\nradius = '{} mm'\nnumber = 100\nseed = 3\ncontact_radius = 1.6\nfuzz = 0.2\n{more}",
            0.5 * spacing
        ),
    };
    let text = format!(
        "material = {{ class = 'isotropic', unit = 'GPa', engineering = {{ e = 20, nu = 0.25 }} }}\n{own}\n{solids}\n\
         [body]\n{body}\n[[condition]]\n{load}\n[equilibrium]\n"
    );
    CaseFile::parse(&text, "surface.toml", &[]).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

const MIDDLE: &str = "intersection = ['core']";

/// Solids, body and place of a pressure, with the area (mm²); its resultant over the pressure (mm²).
fn table() -> Vec<(&'static str, &'static str, &'static str, f64, [f64; 3])> {
    let ball = 4.0 * PI * 81.0;
    vec![
        (
            "core = { cylinder = { axis = 'z', radius = '8 mm', length = '20 mm' } }",
            MIDDLE,
            "'core'",
            2.0 * PI * 8.0 * 28.0,
            [0.0; 3],
        ),
        ("core = { box = { size = '12, 16, 20 mm' } }", MIDDLE, "'core'", 1504.0, [0.0; 3]),
        (
            "core = { box = { size = '12, 16, 20 mm' }, rotate = { axis = [1, 2, 3], angle = 35 }, move = '3, 0, 1 mm' }",
            MIDDLE,
            "'core'",
            1504.0,
            [0.0; 3],
        ),
        ("core = { sphere = { radius = '9 mm' } }", MIDDLE, "'core'", ball, [0.0; 3]),
        // A hole through a block: only what is in the block.
        (
            "core = { cylinder = { axis = [0, 0.6, 0.8], radius = '4 mm' } }",
            "difference = [{ box = { size = '20, 40, 12 mm' } }, 'core']",
            "'core'",
            2.0 * PI * 4.0 * 15.0,
            [0.0; 3],
        ),
        // A notch at an edge: a quarter of a cylinder, its pressure pushes into the block.
        (
            "core = { cylinder = { axis = 'z', centre = '10, 10, 0 mm', radius = '6 mm' } }",
            "difference = [{ box = { size = '20, 20, 16 mm' } }, 'core']",
            "'core'",
            0.5 * PI * 6.0 * 16.0,
            [-96.0, -96.0, 0.0],
        ),
        // Half a ball, and the plane that cut it.
        (
            "core = { sphere = { radius = '9 mm' } }\nbelow = { halfspace = { point = '0, 0, 0 mm', normal = 'z' } }",
            "intersection = ['core', 'below']",
            "'core'",
            0.5 * ball,
            [0.0, 0.0, PI * 81.0],
        ),
        (
            "core = { sphere = { radius = '9 mm' } }\nbelow = { halfspace = { point = '0, 0, 0 mm', normal = 'z' } }",
            "intersection = ['core', 'below']",
            "'below'",
            PI * 81.0,
            [0.0, 0.0, -PI * 81.0],
        ),
        // Two boxes that share a plane: the shared part of it is no surface, what is flush counts once.
        (
            "core = { union = [{ box = { min = '0, 0, 0 mm', max = '10, 10, 12 mm' } }, { box = { min = '10, 0, 0 mm', max = '20, 10, 12 mm' } }] }",
            MIDDLE,
            "'core'",
            2.0 * (200.0 + 240.0 + 120.0),
            [0.0; 3],
        ),
        // The end of a rod that is also that of the box around it.
        (
            "rod = { cylinder = { axis = 'z', radius = '7 mm', length = '20 mm' } }\n\
             core = { intersection = ['rod', { box = { size = '20, 20, 20 mm' } }] }",
            MIDDLE,
            "'core'",
            2.0 * PI * 7.0 * 27.0,
            [0.0; 3],
        ),
    ]
}

#[test]
fn pressure_acts_on_the_true_area_of_every_solid() {
    for (solids, body, on, area, resultant) in table() {
        for (lattice, spacing) in [("grid", 1.6), ("packing", 2.2)] {
            let load = format!("on = {on}\npressure = '10 MPa'");
            let case = case(&format!("[solids]\n{solids}"), body, &load, lattice, spacing, "");
            let (places, force) = loads(&case);
            let sum: f64 = force.iter().map(Vector3::norm).sum();
            let place = format!("{lattice}, {spacing} mm: {solids}");
            assert!((sum / (10.0 * area) - 1.0).abs() < 0.01, "{place}: {sum} for {}", 10.0 * area);
            let total: Vector3<f64> = force.iter().sum();
            let wanted = 10.0 * Vector3::from(resultant);
            assert!((total - wanted).norm() < 2e-3 * sum, "{place}: {total} for {wanted}");
            // A pressure all around turns nothing; one in a slanted hole does.
            if body == MIDDLE {
                let moment: Vector3<f64> = places.iter().zip(&force).map(|(x, f)| x.cross(f)).sum();
                assert!(moment.norm() < 2e-3 * sum * 10e-3, "{place}: {moment}");
            }
        }
    }
}

/// Faces by name: the total is traction × area, and it acts in the middle.
#[test]
fn tractions_on_faces_act_on_their_area_and_in_their_middle() {
    let tower = "union = [{ box = { min = '-20, -20, 0 mm', max = '20, 20, 6 mm' } }, { box = { min = '0, 0, 6 mm', max = '9, 9, 12 mm' } }]";
    for (body, face, area, middle) in [
        ("cylinder = { axis = 'z', radius = '8 mm', length = '20 mm' }", "z-max", PI * 64.0, [0.0, 0.0, 10.0]),
        ("box = { size = '12, 16, 20 mm' }", "x-min", 320.0, [-6.0, 0.0, 0.0]),
        (
            "difference = [{ box = { size = '20, 20, 20 mm' } }, { cylinder = { axis = 'z', centre = '4, 0, 0 mm', radius = '5 mm' } }]",
            "z-min",
            400.0 - PI * 25.0,
            [-4.0 * PI * 25.0 / (400.0 - PI * 25.0), 0.0, -10.0],
        ),
        (tower, "z-max", 81.0, [4.5, 4.5, 12.0]),
    ] {
        let case = case("", body, &format!("on = '{face}'\ntraction = [0, 0, '10 MPa']"), "packing", 2.0, "");
        let (places, force) = loads(&case);
        let total: Vector3<f64> = force.iter().sum();
        assert!(
            (total - Vector3::z() * 10.0 * area).norm() < 1e-3 * 10.0 * area,
            "{body}: {total} for {}",
            10.0 * area
        );
        let moment: Vector3<f64> = places.iter().zip(&force).map(|(x, f)| x.cross(f)).sum();
        let exact = (Vector3::from(middle) * 1e-3).cross(&total);
        assert!((moment - exact).norm() < 1e-3 * 10e-3 * total.norm(), "{body}: {moment} for {exact}");
    }
}

/// Along periodic axes only what is in the cell counts.
#[test]
fn a_hole_through_a_periodic_body() {
    let turned = "difference = [{ box = { size = '30, 30 mm' } }, 'hole']";
    let more = "periodic = ['z']\n";
    for lattice in ["grid", "packing"] {
        let more = if lattice == "grid" { "plane_strain = 'z'" } else { more };
        let solids = "[solids]\nhole = { cylinder = { axis = 'z', radius = '6 mm' } }";
        let case = case(solids, turned, "on = 'hole'\npressure = '10 MPa'", lattice, 2.0, more);
        let thick = match case.lattice() {
            LatticeKind::Grid => 2e-3,
            LatticeKind::Packing => case.packing_problem().unwrap().model.packing.cell().unwrap().z,
        };
        let (_, force) = loads(&case);
        let sum: f64 = force.iter().map(Vector3::norm).sum();
        let exact = 10e6 * 2.0 * PI * 6e-3 * thick;
        assert!(
            (sum / exact - 1.0).abs() < 0.01 && force.iter().sum::<Vector3<f64>>().norm() < 1e-6 * sum,
            "{sum} {exact}"
        );
    }
}

/// A solid whose surface lies inside of the body is none of its surface.
#[test]
fn a_surface_inside_of_the_body_is_refused() {
    let solids = "[solids]\ncore = { sphere = { radius = '4 mm' } }";
    for lattice in ["grid", "packing"] {
        let case =
            case(solids, "box = { size = '20, 20, 20 mm' }", "on = 'core'\npressure = '1 MPa'", lattice, 2.0, "");
        let said = match case.lattice() {
            LatticeKind::Grid => case.problem().unwrap_err(),
            LatticeKind::Packing => case.packing_problem().unwrap_err(),
        };
        assert!(said.to_string().contains("surface is a surface of the body"), "{said}");
    }
}
