//! The cavity of the cross-anisotropy document on coarse lattices; `anisobond verify cavity` runs the shipped cases.

use std::path::Path;

use anisobond::experiment::cavity::{Cavity, CavityBody, CavityStatics, Rays, statics, waves};
use anisobond::tensor::Stiffness;
use anisobond_app::{CaseFile, LatticeKind};
use nalgebra::Vector3;

const ACROSS: [Vector3<f64>; 2] = [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 0.0, 1.0)];

/// A shipped case on a lattice at a dip, coarsened.
fn body(name: &str, lattice: &str, dip: f64, sets: &[&str]) -> (CavityBody, Stiffness) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases").join(name);
    let mut all = vec![format!("lattice={lattice}"), format!("orientation.dip={dip}")];
    all.extend(sets.iter().map(|s| s.to_string()));
    let case = CaseFile::read(path, &all).unwrap_or_else(|e| panic!("{e}"));
    match case.lattice() {
        LatticeKind::Grid => {
            let problem = case.problem().unwrap_or_else(|e| panic!("{e}"));
            let stiffness = problem.regions[0].stiffness;
            (CavityBody::Grid(Box::new(problem)), stiffness)
        }
        LatticeKind::Packing => {
            let problem = case.packing_problem().unwrap_or_else(|e| panic!("{e}"));
            (CavityBody::Packing(Box::new(problem)), case.measured_stiffness().unwrap())
        }
    }
}

fn at_rest(lattice: &str, dip: f64, sets: &[&str]) -> CavityStatics {
    let (body, stiffness) = body("cavity.toml", lattice, dip, sets);
    let cavity = Cavity::new(&stiffness, &Vector3::y(), 0.3, 1e6).unwrap();
    statics(body, &cavity, ACROSS).unwrap()
}

/// Observations two and three on a coarse grid and a coarse packing: the wall moves more along the softer direction, and
/// along the hole where the axis of anisotropy leaves the section, as much as the closed form of the lattice's own tensor
/// says. Without the dip nothing moves along the hole.
#[test]
fn walls_move_as_the_closed_form_says() {
    let coarse = ["grid.spacing=60 mm", "packing.radius=60 mm", "packing.number=150"];
    for (lattice, ratio, axial) in [("grid", 0.03, 0.05), ("packing", 0.08, 0.10)] {
        let s = at_rest(lattice, 25.0, &coarse);
        assert!((s.ratio / s.closed_ratio - 1.0).abs() < ratio, "{lattice}: {s:?}");
        assert!((s.axial / s.closed_axial - 1.0).abs() < axial && s.closed_axial > 0.2, "{lattice}: {s:?}");
        assert!(s.field_error < 0.15, "{lattice}: {s:?}");
        assert!(s.ratio > 1.5);
    }
    let s = at_rest("grid", 0.0, &coarse);
    assert!((s.closed_ratio - 1.9475).abs() < 5e-5 && (s.ratio / s.closed_ratio - 1.0).abs() < 0.03, "{s:?}");
    assert!(s.axial.abs() < 1e-6 && s.closed_axial.abs() < 1e-9, "{s:?}");
    // Dip the other way: the other sign.
    let s = at_rest("grid", -25.0, &coarse);
    assert!(s.axial < -0.2 && s.closed_axial < -0.2, "{s:?}");
}

/// Observation one on a coarse grid and a coarse packing: the wave arrives faster along the layers, as fast as Christoffel's
/// tensor of the lattice's own stiffness says.
#[test]
fn waves_are_faster_along_the_layers() {
    let coarse = ["grid.spacing=60 mm", "packing.radius=60 mm", "packing.number=150"];
    let shorter = ["condition.0.history.pulse=['0 ms', '5 ms']", "motion.duration=16 ms"];
    for lattice in ["grid", "packing"] {
        let (body, stiffness) = body("cavity-waves.toml", lattice, 25.0, &[&coarse[..], &shorter[..]].concat());
        let cavity = Cavity::new(&stiffness, &Vector3::y(), 0.3, 1e6).unwrap();
        let rays = Rays::new(&stiffness, 2650.0, &cavity).unwrap();
        let w = waves(body, &cavity, &rays, &ACROSS, [0.9, 1.8]).unwrap();
        assert!((w.ratio / w.christoffel_ratio - 1.0).abs() < 0.05, "{lattice}: {w:?}");
        assert!(w.arrivals.iter().all(|a| (a.speed / a.christoffel - 1.0).abs() < 0.08), "{lattice}: {w:?}");
    }
}
