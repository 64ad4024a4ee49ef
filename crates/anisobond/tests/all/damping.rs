//! Local damping of bodies on grids: what it takes, and where it leads.

use anisobond::nalgebra::Vector3;
use anisobond::prelude::*;

/// A bar held at one end and pulled at the other by forces that stay, its last layer driven sideways or free.
fn bar(schedule: Schedule, kinematics: Kinematics, driven: bool) -> Problem {
    let grid = Grid::new([12, 4, 4], 1e-3, Vector3::zeros(), [false; 3]).unwrap();
    let bonds = Neighbourhood::sphere(2.5, 1e-3, Influence::Inverse).unwrap();
    let silicon = Material::builtin("Si").unwrap();
    let region = RegionMaterial { name: "bar".into(), stiffness: silicon.stiffness, density: 2330.0, fracture: None };
    let mut problem = Problem::new("bar", Body::full(grid), bonds, vec![region], schedule);
    problem.kinematics = kinematics;
    let layer = |x: u32| (0..192).filter(|node| node % 12 == x).collect::<Vec<u32>>();
    let held = Condition::Displacement { nodes: layer(0), value: [Some(0.0); 3], history: History::Constant };
    let force = vec![Vector3::new(20.0, 3.0, 0.0); 16];
    problem.conditions = vec![held, Condition::Force { nodes: layer(11), force, history: History::Constant }];
    if driven {
        let value = [None, None, Some(2.0)];
        let history = History::Table(vec![(0.0, 0.0), (2e-6, 1.0), (4e-6, -1.0), (6e-6, 0.5)]);
        problem.conditions.push(Condition::Velocity { nodes: layer(9), value, history });
    }
    problem
}

fn moving(duration: f64, local: f64, viscous: f64) -> Schedule {
    let mut schedule = Schedule::motion(duration);
    if let Schedule::Motion { damping, local_damping, .. } = &mut schedule {
        (*damping, *local_damping) = (viscous, local);
    }
    schedule
}

/// What damping takes is in the ledger to rounding, at the default step for every λ, of free and driven nodes, with viscous damping
/// beside it; and it is never given back by more than the half step that a turn begins with.
#[test]
fn local_damping_balances_at_every_strength() {
    for local in [0.1, 0.5, 0.9, 0.99] {
        for (kinematics, bound) in [(Kinematics::Linear, 1e-12), (Kinematics::Finite, 1e-5)] {
            for viscous in [0.0, 1e5] {
                let mut run = Simulation::new(bar(moving(8e-6, local, viscous), kinematics, true)).unwrap();
                let mut lost = 0.0;
                while !run.finished() {
                    run.advance().unwrap();
                    let ledger = run.ledger();
                    assert!(ledger.damping >= lost - 1e-2 * ledger.external.abs(), "{local}: {lost} {ledger:?}");
                    lost = ledger.damping;
                }
                let ledger = run.ledger();
                assert!(ledger.relative_drift() < bound && ledger.damping > 0.0, "{local} {kinematics:?}: {ledger:?}");
            }
        }
    }
}

/// Damped, the bar comes to rest where equilibrium is; undamped it swings on.
#[test]
fn a_damped_bar_comes_to_its_equilibrium() {
    let mut rest = Simulation::new(bar(Schedule::equilibrium(1), Kinematics::Linear, false)).unwrap();
    rest.advance().unwrap();
    let wanted = rest.displacement();
    let largest = |field: &dyn Fn(usize) -> Vector3<f64>| (0..192).map(|node| field(node).norm()).fold(0.0, f64::max);
    let off = |local: f64| {
        let mut run = Simulation::new(bar(moving(2e-4, local, 0.0), Kinematics::Linear, false)).unwrap();
        while !run.finished() {
            run.advance().unwrap();
        }
        let u = run.displacement();
        largest(&|node| u.at(node) - wanted.at(node)) / largest(&|node| wanted.at(node))
    };
    assert!(off(0.5) < 1e-3 && off(0.0) > 0.1, "{} {}", off(0.5), off(0.0));
}

/// The step is that at which local damping damps.
#[test]
fn the_step_is_shorter_by_the_root_of_one_and_lambda() {
    let stable = |local: f64| {
        let run = Simulation::new(bar(moving(1e-6, local, 0.0), Kinematics::Linear, false)).unwrap();
        run.step_evidence().unwrap().stable
    };
    assert!((stable(0.0) / stable(0.44) - 1.2).abs() < 1e-9);
}
