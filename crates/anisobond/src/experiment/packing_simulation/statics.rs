//! Equilibrium of a body of spheres under loads that grow.

use nalgebra::Vector3;

use super::loading::Loading;
use super::loose::Joined;
use super::problem::PackingProblem;
use crate::experiment::outcome::{StepLook, WithinStep};
use crate::experiment::problem::Schedule;
use crate::experiment::simulation::Ledger;
use crate::operator::Kinematics;
use crate::operator::particles::{Particles, Sums};
use crate::solver::particles::{SpheresAtRest, equilibrium_seen};
use crate::solver::{SolverReport, Stopping};
use crate::{Error, Result};

/// Most iterations of a solve.
const MOST_ITERATIONS: usize = 100_000;

/// Relative residual of the equilibrium that a motion starts from.
const START_TOLERANCE: f64 = 1e-8;

/// Force and moment that loads and supports put on each sphere, and where they have brought it.
pub(super) struct External {
    pub force: Vec<[Vector3<f64>; 2]>,
    pub displacement: Vec<Vector3<f64>>,
    pub rotation: Vec<Vector3<f64>>,
}

/// A body on its way through its load steps.
pub(super) struct Rest {
    pub particles: Particles,
    pub sums: Sums,
    pub ledger: Ledger,
    pub external: External,
    pub last: Option<SolverReport>,
    /// Load steps done, and in all.
    pub step: u64,
    pub steps: u64,
}

impl Rest {
    /// # Errors
    /// What equilibrium of packings cannot do.
    pub(super) fn new(problem: &PackingProblem) -> Result<Self> {
        let Schedule::Equilibrium { steps, relaxation, .. } = problem.schedule else {
            return Err(Error::input("motion has no load steps", "leave the duration out"));
        };
        let wrong = |problem: &str, remedy: &str| Err(Error::input(problem, remedy));
        if relaxation {
            return wrong("packings are not relaxed in equilibrium", "leave relaxation out, or use damped motion");
        }
        if problem.servo.is_some() {
            return wrong("a servo drives a cell in motion", "give a duration instead of load steps");
        }
        if problem.model.strength.is_some() || problem.model.contact.is_some() {
            return wrong(
                "bonds that break and contacts need motion, but the body is to be in equilibrium",
                "leave strength and contact out, or give a duration with damping instead of load steps",
            );
        }
        if problem.model.kinematics == Kinematics::Finite {
            return wrong("equilibrium of packings is that of small displacements", "use linear kinematics, or motion");
        }
        let particles = Particles::new(problem.model.clone())?;
        let (n, zero) = (particles.len(), Vector3::zeros());
        Ok(Rest {
            particles,
            sums: Sums::default(),
            ledger: Ledger::default(),
            external: External { force: vec![[zero; 2]; n], displacement: vec![zero; n], rotation: vec![zero; n] },
            last: None,
            step: 0,
            steps: steps as u64,
        })
    }

    /// The next load step.
    ///
    /// # Errors
    /// An equilibrium that is not found; interruption, with nothing done.
    pub(super) fn advance(
        &mut self,
        problem: &PackingProblem,
        loading: &Loading,
        joined: &Joined,
        look: StepLook,
    ) -> Result<()> {
        let factor = (self.step + 1) as f64 / self.steps as f64;
        let place = format!("load step {} of {}", self.step + 1, self.steps);
        let settled = settled(problem, loading, joined, factor, look).map_err(|e| e.at(place))?;
        let mut force = settled.reaction.clone();
        for load in loading.loads(factor) {
            force[load.sphere as usize][0] += load.force;
            force[load.sphere as usize][1] += load.moment;
        }
        self.last = Some(settled.report);
        let (external, mut work) = (&self.external, 0.0);
        for sphere in 0..force.len() {
            let u = settled.displacement[sphere] - external.displacement[sphere];
            let theta = settled.rotation[sphere] - external.rotation[sphere];
            let [f, m] = [0, 1].map(|k| 0.5 * (force[sphere][k] + external.force[sphere][k]));
            work += f.dot(&u) + m.dot(&theta);
            self.particles.move_by(sphere, &u);
            self.particles.turn_by(sphere, &theta);
        }
        self.external = External { force, displacement: settled.displacement, rotation: settled.rotation };
        self.sums = self.particles.evaluate(0.0)?;
        self.step += 1;
        self.ledger.strain = settled.energy;
        self.ledger.external += work;
        Ok(())
    }
}

/// Equilibrium at a load factor, or at a time (s).
///
/// # Errors
/// As [`equilibrium_seen`].
pub(super) fn settled(
    problem: &PackingProblem,
    loading: &Loading,
    joined: &Joined,
    at: f64,
    look: StepLook,
) -> Result<SpheresAtRest> {
    let tolerance = match problem.schedule {
        Schedule::Equilibrium { tolerance, .. } => tolerance,
        Schedule::Motion { .. } => START_TOLERANCE,
    };
    let stopping = Stopping { tolerance, most_iterations: MOST_ITERATIONS };
    let seen = |iterations, residual| look(&WithinStep { iterations, residual, ..WithinStep::default() });
    let supports = loading.supports(at, &joined.floaters);
    equilibrium_seen(&problem.model, &supports, &loading.loads(at), &stopping, &seen)
}
