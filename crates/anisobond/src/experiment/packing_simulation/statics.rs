//! Equilibrium of a body of spheres under loads that grow.

use nalgebra::Vector3;

use super::{PackingSimulation, Stage};
use crate::experiment::problem::Schedule;
use crate::operator::Kinematics;
use crate::solver::Stopping;
use crate::solver::particles::{Equilibrium, equilibrium};
use crate::{Error, Result};

/// Most iterations of a solve.
const MOST_ITERATIONS: usize = 100_000;

/// Relative residual of the equilibrium that a motion starts from.
const START_TOLERANCE: f64 = 1e-8;

/// Force and moment that loads and supports put on each sphere, and where they have brought it; empty before the first
/// load step.
#[derive(Default)]
pub(super) struct External {
    pub force: Vec<[Vector3<f64>; 2]>,
    pub displacement: Vec<Vector3<f64>>,
    pub rotation: Vec<Vector3<f64>>,
}

impl PackingSimulation {
    pub(super) fn begin_equilibrium(&mut self) -> Result<()> {
        let Schedule::Equilibrium { steps, relaxation, .. } = self.problem.schedule else { return Ok(()) };
        let wrong = |problem: &str, remedy: &str| Err(Error::input(problem, remedy));
        if steps == 0 {
            return wrong("equilibrium in 0 load steps", "give at least 1 step");
        }
        if self.loading.has_velocities() {
            return wrong(
                "a velocity is prescribed, but the body is to be in equilibrium",
                "prescribe a displacement, or give a duration instead of load steps",
            );
        }
        if relaxation {
            return wrong("packings are not relaxed in equilibrium", "leave relaxation out, or use damped motion");
        }
        if self.problem.servo.is_some() {
            return wrong("a servo drives a cell in motion", "give a duration instead of load steps");
        }
        if self.problem.model.strength.is_some() || self.problem.model.contact.is_some() {
            return wrong(
                "bonds that break and contacts need motion, but the body is to be in equilibrium",
                "leave strength and contact out, or give a duration with damping instead of load steps",
            );
        }
        if self.problem.model.kinematics == Kinematics::Finite {
            return wrong("equilibrium of packings is that of small displacements", "use linear kinematics, or motion");
        }
        self.steps = steps as u64;
        let (n, zero) = (self.particles.len(), Vector3::zeros());
        let external = External { force: vec![[zero; 2]; n], displacement: vec![zero; n], rotation: vec![zero; n] };
        self.stage = Stage::Equilibrium { external, last: None };
        Ok(())
    }

    /// Equilibrium at a load factor, or at a time (s).
    pub(super) fn settled(&self, at: f64) -> Result<Equilibrium> {
        let tolerance = match self.problem.schedule {
            Schedule::Equilibrium { tolerance, .. } => tolerance,
            Schedule::Motion { .. } => START_TOLERANCE,
        };
        let stopping = Stopping { tolerance, most_iterations: MOST_ITERATIONS };
        let supports = self.loading.supports(at, &self.joined.floaters);
        equilibrium(&self.problem.model, &supports, &self.loading.loads(at), &stopping)
    }

    /// Take an equilibrium as the state, from the start.
    pub(super) fn take(&mut self, settled: &Equilibrium) {
        for (sphere, (u, theta)) in settled.displacement.iter().zip(&settled.rotation).enumerate() {
            self.particles.move_by(sphere, u);
            self.particles.turn_by(sphere, theta);
        }
    }

    pub(super) fn advance_equilibrium(&mut self) -> Result<()> {
        let factor = (self.step + 1) as f64 / self.steps as f64;
        let place = format!("load step {} of {}", self.step + 1, self.steps);
        let settled = self.settled(factor).map_err(|e| e.at(place))?;
        let mut force = settled.reaction.clone();
        for load in self.loading.loads(factor) {
            force[load.sphere as usize][0] += load.force;
            force[load.sphere as usize][1] += load.moment;
        }
        let Stage::Equilibrium { external, last } = &mut self.stage else { return Ok(()) };
        *last = Some(settled.report);
        let mut work = 0.0;
        for sphere in 0..force.len() {
            let u = settled.displacement[sphere] - external.displacement[sphere];
            let theta = settled.rotation[sphere] - external.rotation[sphere];
            let [f, m] = [0, 1].map(|k| 0.5 * (force[sphere][k] + external.force[sphere][k]));
            work += f.dot(&u) + m.dot(&theta);
            self.particles.move_by(sphere, &u);
            self.particles.turn_by(sphere, &theta);
        }
        let (displacement, rotation) = (settled.displacement, settled.rotation);
        *external = External { force, displacement, rotation };
        self.sums = self.particles.evaluate(0.0)?;
        self.step += 1;
        self.ledger.strain = settled.energy;
        self.ledger.external += work;
        Ok(())
    }
}
