//! When a solve is over, by its residual.

use super::linear::VectorSpace;
use super::report::{Ending, SolverReport, Stopping};
use super::watch::Look;

/// A residual that counts as less is below this part of the least so far.
const LESS: f64 = 0.999;

/// The residual of a solve, from iteration to iteration.
pub struct Progress<'a> {
    stopping: &'a Stopping,
    look: Look<'a>,
    /// What residuals are relative to.
    scale: f64,
    /// Iterations without a new least residual after which a solve has stagnated.
    patience: usize,
    least: f64,
    since: usize,
}

impl<'a> Progress<'a> {
    /// Of a solve whose residuals are relative to a scale; it stagnates after so many iterations without a new least one.
    pub fn new((stopping, look): (&'a Stopping, Look<'a>), scale: f64, patience: usize) -> Self {
        Progress { stopping, look, scale, patience, least: f64::INFINITY, since: 0 }
    }

    /// Note the residual r in the report.
    pub fn note<S: VectorSpace<1>>(&self, space: &S, r: &S::Vector, report: &mut SolverReport) {
        report.residual = if self.scale == 0.0 { 0.0 } else { space.norm(r)[0] / self.scale };
    }

    /// Whether the noted residual meets the tolerance.
    pub fn is_small(&self, report: &SolverReport) -> bool {
        report.residual <= self.stopping.tolerance
    }

    /// How the solve ends with the noted residual r, or as its iterations are done.
    pub fn over<S: VectorSpace<1>>(&self, space: &S, r: &S::Vector, report: &SolverReport) -> Option<Ending> {
        if !report.residual.is_finite() {
            return Some(Ending::NotFinite { node: space.not_finite(r).unwrap_or(0) });
        }
        if self.is_small(report) {
            return Some(Ending::Converged);
        }
        (report.iterations >= self.stopping.most_iterations).then_some(Ending::MostIterations)
    }

    /// How a solve ends that is not over: it stagnates, or is told to stop.
    pub fn given_up(&mut self, report: &SolverReport) -> Option<Ending> {
        if report.residual < LESS * self.least {
            (self.least, self.since) = (report.residual, 0);
        } else {
            self.since += 1;
            if self.since > self.patience {
                return Some(Ending::Stagnated);
            }
        }
        (!(self.look)(report.iterations, report.residual)).then_some(Ending::Stopped)
    }

    /// Note the residual r in the report; whether the solve has ended, and how, is in it too.
    pub fn ends<S: VectorSpace<1>>(&mut self, space: &S, r: &S::Vector, report: &mut SolverReport) -> bool {
        self.note(space, r, report);
        let ending = self.over(space, r, report).or_else(|| self.given_up(report));
        report.ending = ending.unwrap_or(report.ending);
        ending.is_some()
    }
}
