//! What a run would take, from a few passes over its bonds.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::loading::Loading;
use super::motion::Motion;
use super::reactions::Reactions;
use super::resolution::parts;
use super::{assemble, damping_of, time_step};
use crate::Result;
use crate::experiment::problem::{Problem, Schedule};
use crate::operator::grid::FailingBonds;
use crate::operator::{GridOperator, VectorField};

/// Passes that are timed, and others before them.
const PASSES: usize = 3;
const BEFORE: usize = 1;

/// Passes that took so long are enough.
const ENOUGH: Duration = Duration::from_millis(200);

/// Passes over the bonds that the solution of one load step takes where none breaks: about 70 iterations, each with coarse
/// grids and sums of vectors that take as long as the bonds.
const PASSES_PER_LOAD_STEP: f64 = 150.0;

/// Steps of a run and the time that they would take on this machine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RunCost {
    /// Largest stable time step (s); `None` in equilibrium.
    pub stable_step_s: Option<f64>,
    /// Time step of the run (s); `None` in equilibrium.
    pub step_s: Option<f64>,
    /// Time steps, or load steps.
    pub steps: u64,
    /// Expected time (s), output not counted; in equilibrium of load steps in which no bond breaks.
    pub expected_seconds: f64,
}

impl RunCost {
    /// Calibrate the bonds of a problem and time a few passes over them.
    ///
    /// # Errors
    /// What would keep the problem from being run: what [`Problem::checked`] refuses, materials that cannot be calibrated,
    /// conditions that contradict each other, a step above the stable one.
    pub fn of(problem: &Problem) -> Result<Self> {
        RunCost::with_warnings(problem).map(|(cost, _)| cost)
    }

    /// The same, with what a user should know of the problem before it is run: materials that bonds do not reach, dimensions that too
    /// few nodes resolve, parts that nothing joins.
    ///
    /// # Errors
    /// As [`RunCost::of`].
    pub fn with_warnings(problem: &Problem) -> Result<(Self, Vec<String>)> {
        problem.check()?;
        let (mut bonds, regions, _) = assemble::bonds(problem)?;
        let warnings = [assemble::warnings(&regions), problem.coarse(), parts(&bonds)].concat();
        Ok((RunCost::timed(problem, &mut bonds)?, warnings))
    }

    fn timed(problem: &Problem, bonds: &mut FailingBonds) -> Result<Self> {
        let loading = Loading::new(problem)?;
        let still = VectorField::zeros(problem.body.grid.len());
        match problem.schedule {
            Schedule::Motion { duration, .. } => {
                let evidence = time_step(problem, bonds.grid())?;
                let mut motion = Motion::new(problem, still, evidence.step, damping_of(&problem.schedule));
                let (mut u, mut unread) = (bonds.grid().padded(), Reactions::default());
                let seconds = per_pass(|| {
                    motion.drift(&mut u);
                    motion.kick(problem, &loading, bonds, &u, (0.0, evidence.step), false, &mut unread)?;
                    Ok(())
                })?;
                let steps = evidence.steps_in(duration)?;
                Ok(RunCost {
                    stable_step_s: Some(evidence.stable),
                    step_s: Some(evidence.step),
                    steps,
                    expected_seconds: steps as f64 * seconds,
                })
            }
            Schedule::Equilibrium { steps, .. } => {
                let mut forces = still.clone();
                let seconds = per_pass(|| {
                    bonds.forces(&still, &mut forces);
                    Ok(())
                })?;
                let expected_seconds = steps as f64 * PASSES_PER_LOAD_STEP * seconds;
                Ok(RunCost { stable_step_s: None, step_s: None, steps: steps as u64, expected_seconds })
            }
        }
    }
}

/// Seconds of one pass, the least of a few: others may keep the machine busy.
fn per_pass(mut pass: impl FnMut() -> Result<()>) -> Result<f64> {
    (0..BEFORE).try_for_each(|_| pass())?;
    let (start, mut least) = (Instant::now(), f64::INFINITY);
    for _ in 0..PASSES {
        let began = Instant::now();
        pass()?;
        least = least.min(began.elapsed().as_secs_f64());
        if start.elapsed() > ENOUGH {
            break;
        }
    }
    Ok(least)
}
