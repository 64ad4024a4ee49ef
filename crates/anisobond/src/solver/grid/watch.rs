//! When a non-linear solve ends.

use super::conjugate_gradients::{Ending, GridSolverReport, ended};
use super::vectors::norm;
use crate::operator::VectorField;
use crate::solver::{Look, Stopping};

/// A residual that counts as less is below this part of the least so far.
const LESS: f64 = 0.999;

/// Watches the residual from iteration to iteration.
pub(super) struct ResidualWatch<'a> {
    stopping: &'a Stopping,
    look: Look<'a>,
    /// What residuals are relative to.
    scale: f64,
    /// Iterations without a new least residual after which a solve has stagnated.
    patience: usize,
    least: f64,
    since: usize,
}

impl<'a> ResidualWatch<'a> {
    pub(super) fn new(stopping: &'a Stopping, look: Look<'a>, scale: f64, patience: usize) -> Self {
        ResidualWatch { stopping, look, scale, patience, least: f64::INFINITY, since: 0 }
    }

    /// Notes the residual r in the report; whether the solve has ended, and how, is in it too.
    pub(super) fn ends(&mut self, r: &VectorField, report: &mut GridSolverReport) -> bool {
        report.residual = if self.scale > 0.0 { norm(r) / self.scale } else { 0.0 };
        let ending = ended(r, report.residual, report.iterations, self.stopping);
        if let Some(ending @ (Ending::NotFinite { .. } | Ending::Converged)) = ending {
            report.ending = ending;
            return true;
        }
        if report.residual < LESS * self.least {
            (self.least, self.since) = (report.residual, 0);
        } else {
            self.since += 1;
        }
        let stagnated = self.since > self.patience;
        let ending = ending.or_else(|| (!(self.look)(report.iterations, report.residual)).then_some(Ending::Stopped));
        match (stagnated, ending) {
            (true, _) => report.ending = Ending::Stagnated,
            (false, Some(ending)) => report.ending = ending,
            (false, None) => return false,
        }
        true
    }
}
