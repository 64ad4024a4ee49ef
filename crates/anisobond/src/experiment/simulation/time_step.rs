//! The time step of a motion, and how many there are.

use serde::{Deserialize, Serialize};

use crate::experiment::problem::{Problem, Schedule};
use crate::operator::grid::GridBonds;
use crate::solver::{damped_step, stable_step};
use crate::{Error, Result};

/// The time step of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepEvidence {
    /// Time step (s).
    pub step: f64,
    /// The largest stable one (s).
    pub stable: f64,
}

impl StepEvidence {
    /// As [`steps_in`].
    pub(super) fn steps_in(&self, duration: f64) -> Result<u64> {
        steps_in(duration, self.step)
    }
}

/// More time steps than this no machine does in a lifetime.
const MOST_TIME_STEPS: f64 = 1e12;

/// Whole steps (s) in a duration (s), at least one.
///
/// # Errors
/// More than 10¹², or numbers of which none follow.
pub(in crate::experiment) fn steps_in(duration: f64, step: f64) -> Result<u64> {
    let steps = (duration / step).round();
    if !step.is_finite() || step <= 0.0 {
        return Err(Error::input(
            format!("the time step is {step} s"),
            "check density, stiffness and spacing: the body's nodes have no bonds, or numbers at the limits",
        ));
    }
    if steps.is_nan() || steps > MOST_TIME_STEPS {
        return Err(Error::input(
            format!("{duration:e} s are {steps:.1e} time steps of {step:e} s"),
            format!("give a shorter duration, or larger nodes: at most {MOST_TIME_STEPS:.0e} steps are done"),
        ));
    }
    Ok((steps as u64).max(1))
}

/// The largest stable step and the one used.
pub(super) fn time_step(problem: &Problem, bonds: &GridBonds<f64>) -> Result<StepEvidence> {
    let Schedule::Motion { step, safety, force_step, local_damping, .. } = problem.schedule else {
        return Err(Error::input("equilibrium has no time step", "give a duration"));
    };
    let densities: Vec<f64> = problem.regions.iter().map(|r| r.density).collect();
    let stable = damped_step(stable_step(bonds.eigenvalue_bound(&densities)?), local_damping);
    let step = step.unwrap_or(safety * stable);
    if step > stable && !force_step {
        return Err(Error::input(
            format!("the time step {step:.4e} s is above the stable one, {stable:.4e} s"),
            "leave the step out, give a smaller one, or set force_step = true",
        ));
    }
    Ok(StepEvidence { step, stable })
}
