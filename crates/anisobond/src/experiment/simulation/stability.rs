//! The stable step of a motion at finite stretch, looked at again while nodal terms are strained.
//!
//! The largest eigenvalue of M⁻¹K is that of the body at rest; a rigid turn leaves it. The tangent of a nodal term,
//! ΔV (δH (Z:E) : δH + sym(F̄ᵀδH) : Z : sym(F̄ᵀδH)), grows with the strain without a bound that is known ahead. So whenever the
//! largest strain of a node has grown by [`GROWTH`], the eigenvalue is found anew of the body as it is.

use super::{Simulation, Stage, StepEvidence};
use crate::experiment::problem::Schedule;
use crate::operator::Kinematics;
use crate::solver::{damped_step, stable_step};
use crate::{Error, Result};

/// Growth of the largest ‖E‖ of a node (–) from which on the step is looked at again.
const GROWTH: f64 = 0.05;

impl Simulation {
    /// Look at the step again if the nodal terms are strained by so much more than when it was looked at.
    ///
    /// # Errors
    /// A step above the stable one without `force_step`.
    pub(super) fn check_step(&mut self) -> Result<()> {
        let time = self.time();
        let Stage::Motion { evidence, last, .. } = &mut self.stage else { return Ok(()) };
        let strain = last.nodal_strain;
        let Schedule::Motion { force_step: forced, local_damping, .. } = self.problem.schedule else { return Ok(()) };
        if forced
            || self.problem.kinematics != Kinematics::Finite
            || strain.is_nan()
            || strain < self.looked_at + GROWTH
        {
            return Ok(());
        }
        self.looked_at = strain;
        let densities: Vec<f64> = self.problem.regions.iter().map(|r| r.density).collect();
        let stable = damped_step(stable_step(self.bonds.tangent_bound(&self.u.get(), &densities)?), local_damping);
        let StepEvidence { step, .. } = *evidence;
        evidence.stable = evidence.stable.min(stable);
        if step <= stable {
            return Ok(());
        }
        Err(Error::diverged(
            format!(
                "the time step {step:.4e} s is above the stable one of the body as it is strained at t = {time:.4e} s, \
                 {stable:.4e} s (nodal terms: ‖E‖ up to {strain:.2})"
            ),
            "give a smaller step or safety factor, or set force_step = true",
        ))
    }
}
