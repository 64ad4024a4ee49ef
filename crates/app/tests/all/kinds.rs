//! Every kind of error, by work that fails so.

use crate::common::jittered;
use crate::common::spheres::{free, free_model, network};

use anisobond::experiment::Simulation;
use anisobond::experiment::element_test::ElementTest;
use anisobond::experiment::particles::{MotionPlan, ParticleMotion};
use anisobond::operator::Kinematics;
use anisobond::operator::particles::Particles;
use anisobond::solver::Stopping;
use anisobond::solver::particles::{PointLoad, Support, equilibrium, stable_step};
use anisobond::{Error, ErrorKind, Result};
use anisobond_app::CaseFile;
use nalgebra::Vector3;

/// A bar of 8 × 4 × 4 nodes, pulled down at one end.
fn bar(more: &str) -> Result<Simulation> {
    let text = format!(
        "material = 'Pyroceram'\ndensity = '2600 kg/m3'\n[body]\nbox = {{ min = '0, 0, 0 mm', max = '8, 4, 4 mm' }}\n\
         [grid]\nspacing = '1 mm'\nhorizon = 2\n\
         [[condition]]\non = 'x-max'\ntraction = '0, -1, 0 MPa'\n{more}"
    );
    Simulation::new(CaseFile::parse(&text, "bar.toml", &[])?.problem()?)
}

const HELD: &str = "[[condition]]\non = 'x-min'\nthickness = 2\ndisplacement = [0, 0, 0]\n";

fn held(more: &str) -> Result<Simulation> {
    bar(&format!("{HELD}{more}"))
}

/// The error of a simulation that goes on until it has one.
fn run(simulation: Result<Simulation>, goes_on: bool) -> Result<()> {
    let mut simulation = simulation?;
    while !simulation.finished() {
        simulation.advance_seen(&|_| goes_on)?;
    }
    Ok(())
}

fn thrown() -> Result<()> {
    let mut particles = Particles::new(free_model(3, 59, Kinematics::Finite))?;
    particles.set_velocity(5, &Vector3::new(0.1, 0.0, 0.0));
    let step = Some(2.0 * stable_step(&particles)?);
    let mut motion =
        ParticleMotion::new(particles, &MotionPlan { step, force_step: true, ..MotionPlan::default() }, free)?;
    (0..5000).try_for_each(|_| motion.advance(free))
}

/// Spheres of which the first is pulled, and the last is held or not.
fn spheres(held: bool, most_iterations: usize) -> Result<()> {
    let model = free_model(3, 53, Kinematics::Linear);
    let last = Support { sphere: model.packing.len() as u32 - 1, value: [Some(0.0); 6] };
    let supports = if held { vec![last] } else { vec![] };
    let stopping = Stopping { most_iterations, ..Stopping::default() };
    equilibrium(&model, &supports, &[PointLoad::force(0, Vector3::x())], &stopping).map(drop)
}

fn floating() -> Result<()> {
    let (_, mut network) = network(&jittered(3, 23, 0.2), 1.4);
    network.nodes.push(Vector3::repeat(0.5));
    ElementTest::default().run(&network).map(drop)
}

#[test]
fn an_error_says_for_programs_what_it_is() {
    let failures = [
        ("a key that is none", held("[equilibrium]\nload = 1\n").map(drop), ErrorKind::Input),
        (
            "a step above the stable one",
            held("[motion]\nduration = '1 ms'\nstep = '1 us'\n").map(drop),
            ErrorKind::Input,
        ),
        (
            "a motion that explodes",
            run(held("[motion]\nduration = '1 ms'\nstep = '1 us'\nforce_step = true\n"), true),
            ErrorKind::Diverged,
        ),
        ("a sphere thrown out", thrown(), ErrorKind::Diverged),
        (
            "an equilibrium to no tolerance",
            run(held("[equilibrium]\ntolerance = 1e-300\n"), true),
            ErrorKind::NotConverged,
        ),
        ("spheres in two iterations", spheres(true, 2), ErrorKind::NotConverged),
        ("spheres that nothing holds", spheres(false, 20_000), ErrorKind::Mechanism),
        ("a body that nothing holds", bar("[equilibrium]\n").map(drop), ErrorKind::Mechanism),
        ("a node without a bond", floating(), ErrorKind::Mechanism),
        ("a file that is not there", CaseFile::read("nowhere/case.toml", &[]).map(drop), ErrorKind::File),
        ("a load step that is stopped", run(held("[equilibrium]\n"), false), ErrorKind::Interrupted),
    ];
    for (what, failure, kind) in failures {
        let error: Error = failure.expect_err(what);
        assert_eq!(error.kind(), kind, "{what}: {error}");
    }
}
