//! Bonds that soften: against a plain list of bonds, the wanted energy, and runs that are interrupted.

use crate::common;

use std::collections::HashMap;
use std::sync::Arc;

use anisobond::bond_law::LinearSoftening;
use anisobond::calibration::{Calibrator, CrackPlanes, CriticalStretches, LowerBound, fracture_energy};
use anisobond::experiment::Simulation;
use anisobond::lattice::{Body, Grid, Influence, Neighbourhood};
use anisobond::operator::grid::naive::NaiveBonds;
use anisobond::operator::grid::{FailingBonds, GridBonds, Stencil};
use anisobond::operator::{GridOperator, Kinematics, VectorField};
use anisobond::tensor::Stiffness;
use anisobond_app::CaseFile;
use common::{Random, energies};
use nalgebra::Vector3;

/// A body of two stencils with holes, periodic along z.
fn body() -> (Body, Neighbourhood, Vec<u16>, Vec<Stencil>) {
    let neighbourhood = Neighbourhood::sphere(2.0, 1e-3, Influence::Inverse).unwrap();
    let grid = Grid::new([11, 7, 5], 1e-3, Vector3::zeros(), [false, false, true]).unwrap();
    let mut body = Body::full(grid.clone());
    body.region[20] = 0;
    let stencil: Vec<u16> = (0..grid.len())
        .map(|n| if body.region[n] == 0 { 0 } else { 1 + u16::from(grid.coordinates(n)[0] > 6) })
        .collect();
    let c = vec![1e20; neighbourhood.bonds().len()];
    let stencils = vec![
        Stencil::new(&neighbourhood, &c).breaking_at(0.01),
        Stencil::new(&neighbourhood, &c.iter().map(|c| 0.5 * c).collect::<Vec<_>>()).breaking_at(0.02),
    ];
    (body, neighbourhood, stencil, stencils)
}

/// Forces, energies and damage of a history of displacements are those of a plain list of bonds, each of which remembers its
/// largest elongation and follows the triangle of force and elongation: up to its top at s_c/√r, down to zero at s_c √r.
#[test]
fn softening_agrees_with_a_list_of_bonds() {
    let ratio = 3.0;
    let (body, neighbourhood, stencil, stencils) = body();
    for kinematics in [Kinematics::Linear, Kinematics::Finite] {
        let grid = GridBonds::<f64>::new(body.clone(), &neighbourhood, stencil.clone(), stencils.clone()).unwrap();
        let mut bonds = FailingBonds::new(grid, Arc::new(LinearSoftening::new(ratio).unwrap()));
        let naive = NaiveBonds::whole(&body, &neighbourhood, &stencil, &stencils);
        let list = naive.bonds();
        let half = |node: usize, b: usize| {
            let s = &stencils[usize::from(stencil[node]) - 1];
            (s.stiffness[b], s.critical[b])
        };
        let mut largest: HashMap<(usize, usize), f64> = HashMap::new();
        let mut random = Random(5);
        let mut u = VectorField::zeros(stencil.len());
        for step in 0..8 {
            for node in (0..u.len()).filter(|&n| stencil[n] > 0) {
                let add = Vector3::from_fn(|_, _| 2.5e-5 * (random.number()));
                let stretch = Vector3::new(
                    if step < 6 { 2e-3 * body.grid.position(node).x } else { -0.006 * body.grid.position(node).x },
                    0.0,
                    0.0,
                );
                u.set(node, &(u.at(node) + add + stretch));
            }
            let mut padded = bonds.grid().padded();
            padded.set(&u);
            bonds.follow(&padded, kinematics, None, 0.0).unwrap();
            let mut forces = VectorField::zeros(u.len());
            let (mut energy, mut spent) = (0.0, vec![[0.0, 0.0]; u.len()]);
            for &(i, b, j) in &list {
                let xi = neighbourhood.bonds()[b].xi;
                let (eta, there) = (u.at(j) - u.at(i), half(j, neighbourhood.bonds().len() - 1 - b));
                let here = half(i, b);
                let (k, critical) = (0.5 * (here.0 + there.0), 0.5 * (here.1 + there.1));
                let (e, to) = match kinematics {
                    Kinematics::Linear => (xi.normalize().dot(&eta), xi.normalize()),
                    Kinematics::Finite => ((xi + eta).norm() - xi.norm(), (xi + eta).normalize()),
                };
                let [top, end] = [critical / ratio.sqrt(), critical * ratio.sqrt()].map(|s| s * xi.norm());
                let most = largest.entry((i, b)).or_insert(0.0);
                *most = most.max(e);
                let force_at_most =
                    if *most <= top { k * *most } else { k * top * ((end - *most) / (end - top)).max(0.0) };
                let secant = if *most <= top { k } else { force_at_most / *most };
                energy += 0.5 * secant * e * e;
                let f = secant * e * to;
                forces.set(i, &(forces.at(i) + f));
                forces.set(j, &(forces.at(j) - f));
                for node in [i, j] {
                    spent[node][0] += ((*most - top) / (end - top)).clamp(0.0, 1.0);
                    spent[node][1] += 1.0;
                }
            }
            let mut found = VectorField::zeros(u.len());
            bonds.forces_of(&u, kinematics, &mut found);
            let scale = (0..u.len()).map(|n| forces.at(n).norm()).fold(0.0, f64::max);
            let n = u.len();
            let mut swept = VectorField::zeros(n);
            let [x, y, z] = &mut swept.components;
            bonds
                .sweep(&padded, kinematics, [x, y, z], |_, from, to| {
                    to.into_iter().zip(from).for_each(|(to, from)| to.copy_from_slice(from));
                })
                .unwrap();
            for node in 0..n {
                assert!((found.at(node) - forces.at(node)).norm() < 1e-9 * scale, "{kinematics:?} {step} {node}");
                assert!((swept.at(node) - forces.at(node)).norm() < 1e-9 * scale, "{kinematics:?} {step} {node}");
            }
            assert!((bonds.energy(&padded, kinematics).unwrap() / energy - 1.0).abs() < 1e-9);
            let by_node: f64 = bonds.node_states(&padded, kinematics).iter().map(|s| s.energy).sum();
            assert!((by_node / energy - 1.0).abs() < 1e-9);
            for (damage, [sum, count]) in bonds.damage().iter().zip(&spent) {
                assert!((damage - sum / f64::max(*count, 1.0)).abs() < 1e-9);
            }
            // The diagonal block is what a displacement of the node alone brings.
            if kinematics == Kinematics::Linear {
                for node in [0, 37, 101] {
                    let (mut one, mut f) = (VectorField::zeros(n), VectorField::zeros(n));
                    one.set(node, &Vector3::new(1e-6, 2e-6, -1e-6));
                    bonds.forces(&one, &mut f);
                    let expected = -(bonds.diagonal_block(node) * one.at(node));
                    assert!((f.at(node) - expected).norm() < 1e-9 * expected.norm().max(1e-12));
                }
            }
        }
        println!("{kinematics:?}: {} soften", bonds.departed());
        assert!(bonds.departed() > 50 && bonds.grid().unbroken() < list.len() - bonds.departed());
    }
}

/// Two halves pulled apart slowly lose the wanted energy, whatever the law.
#[test]
fn two_softening_halves_lose_the_wanted_energy() {
    let neighbourhood = Neighbourhood::sphere(2.0, 1e-3, Influence::Inverse).unwrap();
    let c = Calibrator::new(&neighbourhood)
        .calibrate(&Stiffness::isotropic(48e9, 28.8e9), LowerBound::Value(0.0))
        .unwrap()
        .micromodulus;
    let critical = CriticalStretches::uniform(&neighbourhood, &c, 10.0, CrackPlanes::All).unwrap().stretch;
    let side = 8;
    let grid = Grid::new([side; 3], 1e-3, Vector3::zeros(), [true; 3]).unwrap();
    let formula = fracture_energy(&neighbourhood, &c, &critical, &Vector3::x()).unwrap();
    for (ratio, growth) in [(1.5, 1.01), (4.0, 1.01), (4.0, 1.005)] {
        let stencil = Stencil { critical: critical.clone(), ..Stencil::new(&neighbourhood, &c) };
        let bonds = GridBonds::<f64>::new(Body::full(grid.clone()), &neighbourhood, vec![1; grid.len()], vec![stencil]);
        let mut bonds = FailingBonds::new(bonds.unwrap(), Arc::new(LinearSoftening::new(ratio).unwrap()));
        let finite = critical.iter().copied().filter(|s| s.is_finite()).fold(0.0, f64::max);
        let (mut separation, mut energy, mut broken) = (1e-4 * finite * 1e-3, 0.0, 0);
        while separation < 12.0 * finite * 1e-3 {
            let mut u = VectorField::zeros(grid.len());
            for node in (0..grid.len()).filter(|&n| grid.coordinates(n)[0] >= side / 2) {
                u.set(node, &Vector3::new(separation, 0.0, 0.0));
            }
            let failure = bonds.fail(&u, &u, Kinematics::Linear, 0.0);
            energy += failure.energy;
            broken += failure.broken;
            separation *= growth;
        }
        let over = energy / (side as f64 * 1e-3).powi(2) / formula - 1.0;
        println!("ratio {ratio}, steps of {growth}: over by {over:.4}, {broken} broken");
        assert!((0.0..2.1 * (growth - 1.0)).contains(&over), "{over}");
        assert_eq!(bonds.departed(), 0);
    }
}

/// A run of softening bonds; {…} is filled in.
fn strip(schedule: &str) -> Simulation {
    let text = format!(
        r#"
material = {{ class = "isotropic", unit = "GPa", engineering = {{ e = 72, nu = 0.25 }} }}
density = "2440 kg/m3"
fracture = {{ energy = "4 J/m2" }}
body = {{ box = {{ min = "0, -4 mm", max = "8, 4 mm" }} }}
grid = {{ spacing = "0.5 mm", horizon = 2, plane_strain = "z" }}
crack = [{{ line = {{ from = "-1, 0 mm", to = "3, 0 mm" }} }}]
model = {{ surface_calibration = false, softening = {{ linear = 4 }} }}
output = {{ frames = 0, probe_every = 1 }}
{schedule}
"#
    );
    Simulation::new(CaseFile::parse(&text, "strip", &[]).unwrap().problem().unwrap()).unwrap()
}

const MOVING: &str = r#"
motion = { duration = "5 us", safety = 0.8 }
condition = [{ on = "y-max", velocity = [0, "1 m/s", 0] }, { on = "y-min", velocity = [0, "-1 m/s", 0] }]
"#;

const RESTING: &str = r#"
equilibrium = { steps = 3, tolerance = 1e-6 }
condition = [
  { on = "y-max", thickness = 3, displacement = [0, "0.8 um", 0] },
  { on = "y-min", thickness = 3, displacement = [0, "-0.8 um", 0] },
]
"#;

/// One thread or two, in one go or saved and restored in the middle: the same bits.
#[test]
fn softening_runs_do_not_depend_on_threads_or_interruptions() {
    for schedule in [MOVING, RESTING] {
        let run = |threads: usize, interrupted: bool| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut simulation = strip(schedule);
                while !simulation.finished() {
                    simulation.advance().unwrap();
                    if interrupted && simulation.step() == simulation.steps() / 2 {
                        let state = simulation.save();
                        simulation = strip(schedule);
                        simulation.restore(state).unwrap();
                    }
                }
                (simulation.save(), simulation.bond_state().departed(), *simulation.ledger())
            })
        };
        let (first, softened, ledger) = run(1, false);
        println!("a strip of which {softened} bonds soften: {}", energies(&ledger));
        assert!(softened > 20 && ledger.broken_bonds > 10, "{softened} {ledger:?}");
        assert_eq!(first, run(2, false).0);
        assert_eq!(first, run(2, true).0);
    }
}
