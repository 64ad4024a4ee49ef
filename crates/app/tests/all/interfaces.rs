//! Regions that meet: materials in series and thin layers against closed forms, what breaks between them, and pre-cracks along
//! lines of the lattice.

use anisobond::experiment::{Crack, FieldName, Simulation};
use anisobond::lattice::{Influence, Neighbourhood};
use anisobond::tensor::Stiffness;
use anisobond_app::CaseFile;
use nalgebra::{Matrix3, Vector3};

fn simulated(text: &str) -> Simulation {
    let mut simulation = Simulation::new(CaseFile::parse(text, "bar", &[]).unwrap().problem().unwrap()).unwrap();
    while !simulation.finished() {
        simulation.advance().unwrap();
    }
    simulation
}

/// An isotropic material: Young's modulus (GPa) and Poisson's ratio.
type Isotropic = (f64, f64);

fn stiffness((e, nu): Isotropic) -> Stiffness {
    let e = e * 1e9;
    Stiffness::isotropic(e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
}

/// Traction (11, 12, 13; Pa) in the middle of a bar along x, periodic across, of nodes 1 mm apart: `a` outside, `b` from
/// node `from` up to node `to` of `count`. Six nodes at each end move as they do under the tractions 1, 0.3, −0.2 MPa.
fn traction(a: Isotropic, b: Isotropic, [from, to]: [usize; 2], count: usize) -> Vector3<f64> {
    let material = |(e, nu): Isotropic| {
        format!("material = {{ class = \"isotropic\", unit = \"GPa\", engineering = {{ e = {e}, nu = {nu} }} }}")
    };
    let load = Vector3::new(1e6, 0.3e6, -0.2e6);
    // Slope of the displacement along x.
    let slope = |m: Isotropic| {
        let c = stiffness(m);
        let full = Matrix3::from_fn(|i, j| c.component(0, i, j, 0));
        full.try_inverse().unwrap() * load
    };
    let at = |x: f64| {
        let inside = (x.min(to as f64) - from as f64).max(0.0);
        (slope(b) * inside + slope(a) * (x - inside)) * 1e-3
    };
    let held = (0..6).chain(count - 6..count).map(|i| {
        let [x, y, z]: [f64; 3] = at(i as f64 + 0.5).into();
        format!(
            "[[condition]]\non = {{ box = {{ min = \"{:.2}, -9, -9 mm\", max = \"{:.2}, 9, 9 mm\" }} }}\ndisplacement = [\"{x:e} m\", \"{y:e} m\", \"{z:e} m\"]\n",
            i as f64 + 0.2,
            i as f64 + 0.8
        )
    });
    let text = format!(
        "body = {{ box = {{ min = \"0, 0, 0 mm\", max = \"{count}, 1, 1 mm\" }} }}\n\
         grid = {{ spacing = \"1 mm\", horizon = 3, periodic = [\"y\", \"z\"] }}\nmodel = {{ bonds = \"hybrid\" }}\n\
         equilibrium = {{ tolerance = 1e-9 }}\n[[region]]\nname = \"b\"\n{}\n\
         solid = {{ box = {{ min = \"{from}, -9, -9 mm\", max = \"{to}, 9, 9 mm\" }} }}\n[[region]]\nname = \"a\"\n{}\n{}",
        material(b),
        material(a),
        held.collect::<String>()
    );
    let (components, stress) = simulated(&text).field(FieldName::Stress);
    let middle = count / 4 * components;
    // xx yy zz xy yz xz
    let [xx, xy, xz] = [0, 3, 5].map(|a| f64::from(stress[middle + a]));
    Vector3::new(xx, xy, xz).component_div(&load)
}

/// Two materials in series, at a ratio of stiffnesses of 1 to 24; soft layers of a few nodes.
#[test]
fn layers_across_are_springs_in_series() {
    let stiff = (72.0, 0.25);
    for soft in [(3.0, 0.35), (3.6, 0.25), (40.0, 0.2)] {
        let halves = traction(stiff, soft, [32, 64], 64);
        assert!((halves - Vector3::repeat(1.0)).amax() < 0.006, "{soft:?}: {halves:?}");
    }
    for (layer, most) in [(2, 0.08), (4, 0.05), (8, 0.03)] {
        let found = traction(stiff, (3.0, 0.35), [20, 20 + layer], 40);
        assert!((found.x - 1.0).abs() < most, "{layer}: {found:?}");
    }
    // Equal materials are one, to rounding.
    let same = traction(stiff, stiff, [20, 24], 40);
    assert!((same - Vector3::repeat(1.0)).amax() < 1e-6, "{same:?}");
}

/// A weak layer between tough ones: every bond through it takes the energy of the weak, each interface says so, and unbreakable
/// nodes still keep their bonds.
#[test]
fn an_interface_is_as_tough_as_the_weaker() {
    let case = |arms: &str, more: &str| {
        let text = format!(
            "material = {{ class = \"isotropic\", unit = \"GPa\", engineering = {{ e = 70, nu = 0.25 }} }}\n\
             body = {{ box = {{ min = \"0, -6 mm\", max = \"10, 6 mm\" }} }}\n\
             grid = {{ spacing = \"0.5 mm\", horizon = 3, plane_strain = \"z\", periodic = [\"x\"] }}\n\
             equilibrium = {{ steps = 1 }}\n[[region]]\nname = \"mid\"\n\
             solid = {{ box = {{ min = \"-1, -0.5 mm\", max = \"61, 0.5 mm\" }} }}\nfracture = {{ energy = \"50 J/m2\" }}\n\
             [[region]]\nname = \"arms\"\n{arms}\n[[condition]]\non = \"y-min\"\ndisplacement = [0, 0, 0]\n{more}"
        );
        Simulation::new(CaseFile::parse(&text, "layer", &[]).unwrap().problem().unwrap()).unwrap()
    };
    for arms in ["fracture = { energy = \"1000 J/m2\" }", ""] {
        let simulation = case(arms, "");
        let [interface] = simulation.interfaces() else { panic!("{:?}", simulation.interfaces()) };
        assert_eq!(interface.regions, ["mid".to_owned(), "arms".to_owned()]);
        // Two faces of 10 mm by one layer.
        assert!((interface.area / (2.0 * 10e-3 * 0.5e-3) - 1.0).abs() < 1e-9, "{}", interface.area);
        let fracture = interface.fracture.unwrap();
        assert!((fracture.wanted.unwrap() - 50.0).abs() < 1e-9);
        // In a layer of two nodes bonds that pass through it have both ends in the arms.
        assert!((20.0..51.0).contains(&fracture.reached), "{fracture:?}");
    }
    let spared = case("", "[[unbreakable]]\non = \"all\"\n");
    assert_eq!(spared.interfaces()[0].unbreakable, spared.interfaces()[0].bonds);
}

/// Cracks whose tips and plane are on nodes, in a hundred directions of the lattice: what is cut has the mirror symmetry of the
/// body and of the crack, does not depend on which end of a bond is asked, and is what a crack cuts that is a little farther on the
/// side away from its normal.
#[test]
fn cracks_along_lines_of_the_lattice_cut_as_cracks_beside_them() {
    for spacing in [1e-3, 0.7, 3.3e-9] {
        let neighbourhood = Neighbourhood::sphere(3.0, spacing, Influence::Inverse).unwrap();
        let tolerance = Crack::TIE * spacing;
        let place = |i: i32, j: i32| spacing * Vector3::new(f64::from(i) + 0.5, f64::from(j) + 0.5, 0.5);
        let mut seed = 7u32;
        let mut random = |n: i32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 16) as i32 % n
        };
        for _ in 0..34 {
            let (tip, way) = ((random(5) + 3, random(5) + 3), (random(9) - 4, random(9) - 4));
            if way == (0, 0) {
                continue;
            }
            let (from, to) = (place(tip.0, tip.1), place(tip.0 + way.0, tip.1 + way.1));
            let line = |from: Vector3<f64>, to: Vector3<f64>| {
                let reach = 1e3 * (to - from).norm().max(from.norm()) * Vector3::z();
                Crack::Parallelogram { corner: from - reach, a: to - from, b: 2.0 * reach }
            };
            let crack = line(from, to);
            let along = (to - from).normalize();
            let aside = -1e-5 * spacing * along.cross(&Vector3::z());
            let beside = line(from + aside - 1e-3 * spacing * along, to + aside + 1e-3 * spacing * along);
            let mut cut = 0;
            for (i, j) in (0..12).flat_map(|i| (0..12).map(move |j| (i, j))) {
                let p = place(i, j);
                for bond in &neighbourhood.bonds()[61..] {
                    let q = p + bond.xi;
                    let cuts = crack.cuts(&p, &q, tolerance);
                    let mirrored = p + bond.xi.component_mul(&Vector3::new(1.0, 1.0, -1.0));
                    assert_eq!(cuts, crack.cuts(&p, &mirrored, tolerance), "{way:?} {:?}", bond.offset);
                    assert_eq!(cuts, crack.cuts(&q, &p, tolerance), "{way:?} {:?}", bond.offset);
                    assert_eq!(cuts, beside.cuts(&p, &q, tolerance), "{way:?} {:?} from {i} {j}", bond.offset);
                    cut += usize::from(cuts);
                }
            }
            assert!(cut > 10);
        }
    }
}

/// In plane strain nothing leaves the plane, and a crack through nodes opens as one beside them.
#[test]
fn a_crack_through_nodes_stays_in_the_plane() {
    let opened = |from: &str, to: &str| {
        let simulation = simulated(&format!(
            "material = {{ class = \"isotropic\", unit = \"GPa\", engineering = {{ e = 20, nu = 0.25 }} }}\n\
             body = {{ box = {{ size = \"24, 24 mm\" }} }}\ngrid = {{ spacing = \"1 mm\", plane_strain = \"z\" }}\n\
             equilibrium = {{ tolerance = 1e-10 }}\ncrack = [{{ line = {{ from = \"{from}\", to = \"{to}\" }} }}]\n\
             [[condition]]\non = \"y-max\"\ntraction = [0, \"10 MPa\", 0]\n[[condition]]\non = \"y-min\"\n\
             traction = [0, \"-10 MPa\", 0]\n"
        ));
        simulation.displacement()
    };
    // The normal a × z of the line points to its right: nodes on it count there.
    for (on, off) in [
        (["-4.5, -4.5 mm", "3.5, 3.5 mm"], ["-4.5021, -4.5019 mm", "3.5019, 3.5021 mm"]),
        (["-4.5, -2.5 mm", "3.5, 1.5 mm"], ["-4.5041, -2.5018 mm", "3.5039, 1.5022 mm"]),
    ] {
        let (on, off) = (opened(on[0], on[1]), opened(off[0], off[1]));
        let largest = on.components[1].iter().fold(0.0f64, |m, u| m.max(u.abs()));
        assert!(on.components[2].iter().all(|u| u.abs() < 1e-9 * largest));
        for (a, b) in on.components.iter().zip(&off.components) {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6 * largest));
        }
    }
}
