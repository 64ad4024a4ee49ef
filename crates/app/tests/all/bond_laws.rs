//! Laws of bonds on grids: against a plain list of bonds, in motion and at rest, interrupted or not.

use crate::common;

use std::collections::HashMap;
use std::sync::Arc;

use anisobond::bond_law::{BondLaw, BondState, ElasticPlastic, TableSoftening};
use anisobond::experiment::{FieldName, Outcome, Simulation};
use anisobond::lattice::{Body, Grid, Influence, Neighbourhood};
use anisobond::operator::grid::naive::NaiveBonds;
use anisobond::operator::grid::{FailingBonds, GridBonds, Stencil};
use anisobond::operator::{Kinematics, VectorField};
use anisobond_app::CaseFile;
use common::{Random, energies};
use nalgebra::Vector3;

fn laws() -> Vec<Arc<dyn BondLaw>> {
    vec![
        Arc::new(ElasticPlastic::new(0.15, 4.0).unwrap()),
        Arc::new(ElasticPlastic::new(0.0, 9.0).unwrap()),
        Arc::new(TableSoftening::new(vec![(1.0, 1.0), (1.5, 0.4), (4.0, 0.0)]).unwrap()),
        Arc::new(TableSoftening::exponential(0.6).unwrap()),
    ]
}

/// Forces and energies of a history of displacements, stretched, compressed and stretched again, are those of a plain list of
/// bonds that each follow the scalar law from the start.
#[test]
fn bonds_follow_the_scalar_law() {
    let neighbourhood = Neighbourhood::sphere(2.0, 1e-3, Influence::Inverse).unwrap();
    let grid = Grid::new([9, 6, 5], 1e-3, Vector3::zeros(), [false, false, true]).unwrap();
    let body = Body::full(grid.clone());
    let stencil = vec![1; grid.len()];
    let stencils = vec![Stencil::new(&neighbourhood, &vec![1e20; neighbourhood.bonds().len()]).breaking_at(0.01)];
    let naive = NaiveBonds::whole(&body, &neighbourhood, &stencil, &stencils);
    let list = naive.bonds();
    for (law, kinematics) in
        laws().into_iter().flat_map(|l| [Kinematics::Linear, Kinematics::Finite].map(|k| (l.clone(), k)))
    {
        let grid_bonds =
            GridBonds::<f64>::new(body.clone(), &neighbourhood, stencil.clone(), stencils.clone()).unwrap();
        let mut bonds = FailingBonds::new(grid_bonds, law.clone());
        let mut states: HashMap<(usize, usize), BondState> = HashMap::new();
        let mut random = Random(7);
        let mut u = VectorField::zeros(grid.len());
        let onset = law.onset(0.01);
        for stretch in [0.4, 1.2, 2.5, 0.5, -1.5, -0.2, 3.0, 5.0] {
            for node in 0..u.len() {
                let noise = Vector3::from_fn(|_, _| 1e-4 * onset * random.number());
                u.set(node, &(noise + onset * stretch * body.grid.position(node).x * Vector3::x()));
            }
            let mut padded = bonds.grid().padded();
            padded.set(&u);
            bonds.follow(&padded, kinematics, None, 0.0).unwrap();
            let (mut forces, mut energy) = (VectorField::zeros(u.len()), 0.0);
            for &(i, b, j) in &list {
                let xi = neighbourhood.bonds()[b].xi;
                let eta = u.at(j) - u.at(i);
                let (e, to) = match kinematics {
                    Kinematics::Linear => (xi.normalize().dot(&eta), xi.normalize()),
                    Kinematics::Finite => ((xi + eta).norm() - xi.norm(), (xi + eta).normalize()),
                };
                let (k, length) = (stencils[0].stiffness[b], onset * xi.norm());
                let x = e / length;
                if x > 1.0 || law.yields() && x < -1.0 {
                    states.entry((i, b)).or_insert(law.start());
                }
                let (secant, rest) = match states.get_mut(&(i, b)) {
                    None => (1.0, 0.0),
                    Some(state) => {
                        *state = law.after(state, x);
                        (law.secant(state), state.permanent)
                    }
                };
                let f = secant * k * (e - rest * length);
                energy += 0.5 * f * (e - rest * length);
                forces.set(i, &(forces.at(i) + f * to));
                forces.set(j, &(forces.at(j) - f * to));
            }
            let mut found = VectorField::zeros(u.len());
            bonds.forces_of(&u, kinematics, &mut found);
            let scale = (0..u.len()).map(|n| forces.at(n).norm()).fold(1e-300, f64::max);
            for node in 0..u.len() {
                assert!((found.at(node) - forces.at(node)).norm() < 1e-9 * scale, "{law:?} {kinematics:?} {stretch}");
            }
            if energy > 0.0 {
                let whole = bonds.energy(&padded, kinematics).unwrap();
                assert!((whole / energy - 1.0).abs() < 1e-9, "{law:?} {kinematics:?} {stretch}: {whole} {energy}");
                let by_node: f64 = bonds.node_states(&padded, kinematics).iter().map(|s| s.energy).sum();
                assert!((by_node / energy - 1.0).abs() < 1e-9);
            }
            if kinematics == Kinematics::Linear {
                let work: f64 = (0..u.len()).map(|n| -0.5 * u.at(n).dot(&found.at(n))).sum();
                let less = bonds.energy_of_rest(&padded);
                assert!((work - less - energy).abs() < 1e-9 * energy.max(work), "{law:?} {stretch}");
            }
        }
        assert!(states.len() > 100, "{law:?}: {}", states.len());
    }
}

/// A strip with a notch, of a law and a schedule.
fn strip(law: &str, schedule: &str) -> Simulation {
    let text = format!(
        r#"
material = {{ class = "isotropic", unit = "GPa", engineering = {{ e = 72, nu = 0.25 }} }}
density = "2440 kg/m3"
{law}
body = {{ box = {{ min = "0, -4 mm", max = "8, 4 mm" }} }}
grid = {{ spacing = "0.5 mm", horizon = 2, plane_strain = "z" }}
crack = [{{ line = {{ from = "-1, 0 mm", to = "3, 0 mm" }} }}]
output = {{ frames = 0, probe_every = 1 }}
{schedule}
"#
    );
    Simulation::new(CaseFile::parse(&text, "strip", &[]).unwrap().problem().unwrap()).unwrap()
}

const LAWS: [&str; 4] = [
    "fracture = { energy = '4 J/m2' }\nmodel = { surface_calibration = false, plastic = { hardening = 0.1, ductility = 6 } }",
    "model = { surface_calibration = false, plastic = { yield_stretch = 8e-5, breaking_stretch = 9e-4, hardening = 0.02 } }",
    "fracture = { energy = '4 J/m2' }\nmodel = { surface_calibration = false, softening = { exponential = 1 } }",
    "fracture = { energy = '4 J/m2' }\nmodel = { surface_calibration = false, softening = { table = [[1, 1], [2, 0.3], [5, 0]] } }",
];

const MOVING: &str = r#"
motion = { duration = "5 us", safety = 0.8 }
condition = [{ on = "y-max", velocity = [0, "1 m/s", 0] }, { on = "y-min", velocity = [0, "-1 m/s", 0] }]
"#;

const RESTING: &str = r#"
equilibrium = { steps = 4, tolerance = 1e-8 }
condition = [
  { on = "y-max", thickness = 3, displacement = [0, "0.8 um", 0], history = { table = [[0, 0], [0.75, 1], [1, 0.5]] } },
  { on = "y-min", thickness = 3, displacement = [0, "-0.8 um", 0], history = { table = [[0, 0], [0.75, 1], [1, 0.5]] } },
]
"#;

/// One thread or two, in one go or saved and restored in the middle: the same bits. Energies balance to rounding in motion, and
/// to the solver's tolerance at rest.
#[test]
fn runs_of_every_law_balance_and_go_on() {
    for law in LAWS {
        for (schedule, balance) in [(MOVING, 1e-11), (RESTING, 1e-6)] {
            let run = |threads: usize, interrupted: bool| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let (mut simulation, mut restored) = (strip(law, schedule), false);
                    while !simulation.finished() {
                        simulation.advance().unwrap();
                        if interrupted && !restored && simulation.step() == simulation.steps() / 2 {
                            restored = true;
                            let state = simulation.save();
                            simulation = strip(law, schedule);
                            simulation.restore(state).unwrap();
                        }
                        let drift = simulation.ledger().relative_drift();
                        assert!(drift < balance, "{law}: {drift:.1e} {}", energies(simulation.ledger()));
                    }
                    assert!(matches!(simulation.outcome(), Outcome::Completed), "{law}: {:?}", simulation.outcome());
                    let plastic: f32 = simulation.field(FieldName::PlasticStretch).1.iter().sum();
                    (simulation.save(), simulation.bond_state().departed(), *simulation.ledger(), plastic)
                })
            };
            let (first, departed, ledger, plastic) = run(1, false);
            println!("{law}: {departed} bonds, plastic stretch {plastic:.1e}: {}", energies(&ledger));
            assert!(departed > 10 && ledger.fracture > 0.0, "{departed} {ledger:?}");
            assert_eq!(plastic > 0.0, law.contains("plastic"));
            assert_eq!(first, run(2, false).0);
            assert_eq!(first, run(2, true).0);
        }
    }
}

/// A table of softening from a file is that of the case itself; a file that is not there is named.
#[test]
fn a_curve_may_stand_in_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let case = |table: &str| {
        let path = folder.path().join("case.toml");
        let text = format!(
            "material = \"Si\"\ndensity = \"2330 kg/m3\"\nfracture = {{ energy = \"4 J/m2\" }}\n\
             body = {{ box = {{ min = \"0, 0, 0 mm\", max = \"4, 4, 4 mm\" }} }}\n\
             grid = {{ spacing = \"1 mm\", horizon = 2 }}\nmodel = {{ softening = {{ table = {table} }} }}\n\
             motion = {{ duration = \"1 us\" }}\n"
        );
        std::fs::write(&path, text).unwrap();
        CaseFile::read(&path, &[]).and_then(|case| case.problem())
    };
    std::fs::write(folder.path().join("curve.csv"), "stretch, force\n1, 1\n2.5, 0.2\n6, 0\n").unwrap();
    let [of_file, of_case] =
        ["\"curve.csv\"", "[[1, 1], [2.5, 0.2], [6, 0]]"].map(|t| format!("{:?}", case(t).unwrap().law));
    assert_eq!(of_file, of_case);
    let said = case("\"none.csv\"").unwrap_err().to_string();
    assert!(said.contains("none.csv"), "{said}");
}
