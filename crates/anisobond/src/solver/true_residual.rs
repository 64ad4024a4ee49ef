//! The rule of solves whose residual is computed anew before they end.

use super::conjugate_gradients::{Next, Products, Rule};
use super::linear::VectorSpace;
use super::progress::Progress;
use super::report::{Ending, SolverReport};

/// Steps go on until ‖b − K x‖, computed anew, meets the tolerance: the residual of the recurrence drifts, and only the true one
/// counts. K must be positive along every step.
pub struct TrueResidual<'a, S, F> {
    /// The vectors.
    pub space: &'a S,
    /// Computes r = b − K x of an x, by one application of K.
    pub residual: F,
    /// How far the solve is.
    pub progress: Progress<'a>,
}

impl<S: VectorSpace<1>, F: Fn(&S::Vector, &mut S::Vector)> Rule<1, S::Vector> for TrueResidual<'_, S, F> {
    fn at(&mut self, x: &S::Vector, r: &mut S::Vector, report: &mut SolverReport) -> Next {
        self.progress.note(self.space, r, report);
        let mut next = Next::Step;
        if let Some(ending) = self.progress.over(self.space, r, report) {
            (self.residual)(x, r);
            report.applications += 1;
            self.progress.note(self.space, r, report);
            if ending != Ending::Converged || self.progress.is_small(report) {
                return Next::End(ending);
            }
            next = Next::Anew;
        }
        self.progress.given_up(report).map_or(next, Next::End)
    }

    fn step(&mut self, products: &Products<1, S::Vector>, _: &mut S::Vector) -> Result<[f64; 1], Ending> {
        let ([rz], [curvature]) = (products.rz, products.energy);
        // A number that is none shows in the next residual.
        if curvature.is_finite() && curvature <= 0.0 {
            return Err(Ending::NegativeCurvature { curvature });
        }
        Ok([rz / curvature])
    }
}
