//! What a run on a packing would take, from a few of its steps.

use std::time::Instant;

use super::{Loading, PackingProblem, PackingSimulation, step_of};
use crate::Result;
use crate::experiment::problem::Schedule;
use crate::experiment::simulation::{RunCost, steps_in};
use crate::operator::particles::Particles;

/// Steps that are timed, after one that is not.
const STEPS: usize = 3;

/// Passes over the bonds that one load step takes, sums of vectors counted as passes: iterations grow with the number of
/// spheres across the body.
const PASSES_ACROSS: f64 = 25.0;

/// Bytes of a sphere and of a bond in a run.
const BYTES_PER_SPHERE: u64 = 600;

impl PackingProblem {
    /// Bring the spheres to their start and time a few steps.
    ///
    /// # Errors
    /// As [`PackingSimulation::new`].
    pub fn cost(&self) -> Result<RunCost> {
        self.check()?;
        match self.schedule {
            Schedule::Motion { duration, .. } => {
                let mut particles = Particles::new(self.model.clone())?;
                let evidence = step_of(self, &particles)?;
                Loading::new(self)?;
                let steps = steps_in(duration, evidence.step)?;
                particles.evaluate(0.0)?;
                let start = Instant::now();
                for _ in 0..STEPS {
                    particles.evaluate(evidence.step)?;
                }
                let seconds = start.elapsed().as_secs_f64() / STEPS as f64;
                Ok(RunCost {
                    stable_step_s: Some(evidence.stable),
                    step_s: Some(evidence.step),
                    steps,
                    expected_seconds: 1.3 * steps as f64 * seconds,
                })
            }
            Schedule::Equilibrium { steps, .. } => {
                PackingSimulation::new(self.clone())?;
                let mut particles = Particles::new(self.model.clone())?;
                let start = Instant::now();
                particles.evaluate(0.0)?;
                let passes = PASSES_ACROSS * (self.model.packing.len() as f64).cbrt();
                let expected_seconds = steps as f64 * passes * start.elapsed().as_secs_f64();
                Ok(RunCost { stable_step_s: None, step_s: None, steps: steps as u64, expected_seconds })
            }
        }
    }

    /// Estimate of the memory of a run (bytes).
    pub fn memory(&self) -> u64 {
        // Two half bonds and the model's own.
        let per_bond = (Particles::BYTES_PER_BOND + 96) as u64;
        self.model.packing.len() as u64 * BYTES_PER_SPHERE + self.model.bonds.len() as u64 * per_bond
    }
}
