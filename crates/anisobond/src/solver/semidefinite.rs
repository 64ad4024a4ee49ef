//! The rule of solves of semidefinite operators, for several right-hand sides.

use super::conjugate_gradients::{Products, Rule};
use super::report::{Ending, SolverReport, Stopping};
use super::watch::Look;

/// A direction p of no more energy than this part of p·Mp is a free motion.
const FREE: f64 = 1e-12;

/// Residual of a singular system that rounding may leave.
const ROUNDING: f64 = 1e-9;

/// p·Kp/p·Mp below minus this is negative energy, not rounding; the spectrum of M⁻¹K is of order 1.
const NEGATIVE: f64 = 1e-10;

/// Steps go on until √(r·M⁻¹r) of every right-hand side meets the tolerance; K may be singular as long as b does no work on its
/// zero modes. One that has converged takes no more steps. If K turns out indefinite, the solve ends.
pub struct Semidefinite<'a, const L: usize> {
    stopping: &'a Stopping,
    look: Look<'a>,
    /// The r·M⁻¹r that is rounding.
    least: [f64; L],
    start: Option<[f64; L]>,
    residual: f64,
    finite: bool,
    /// Negative energy that was met.
    negative: Option<f64>,
}

impl<'a, const L: usize> Semidefinite<'a, L> {
    /// `least` is the r·M⁻¹r of every right-hand side that is rounding: below it a residual counts as zero, however small the
    /// right-hand side. `negative` is what is known of negative energy before the first step.
    pub fn new((stopping, look): (&'a Stopping, Look<'a>), least: &[f64; L], negative: Option<f64>) -> Self {
        Semidefinite { stopping, look, least: *least, start: None, residual: 0.0, finite: true, negative }
    }

    /// √(r·z) relative to the start; 0 where r·z is no more than rounding, as that of a right-hand side of zero.
    fn relative(&self, rz: &[f64; L]) -> [f64; L] {
        let start = self.start.unwrap_or(*rz);
        let left = |l: usize| if rz[l] <= self.least[l] { 0.0 } else { (rz[l] / start[l]).sqrt() };
        std::array::from_fn(|l| if start[l] > 0.0 { left(l) } else { 0.0 })
    }

    /// How a solve ends whose residual is to be accepted below a tolerance.
    fn ending(&self, accepted: f64, otherwise: Ending) -> Ending {
        match self.negative {
            Some(curvature) => Ending::NegativeCurvature { curvature },
            None if !self.finite => Ending::NotFinite { node: 0 },
            None if self.residual <= accepted => Ending::Converged,
            None => otherwise,
        }
    }
}

impl<const L: usize, V> Rule<L, V> for Semidefinite<'_, L> {
    fn measured(&mut self, rz: &[f64; L], report: &mut SolverReport) -> Option<Ending> {
        self.start.get_or_insert(*rz);
        let relative = self.relative(rz);
        self.residual = relative.into_iter().fold(0.0, f64::max);
        self.finite = rz.iter().all(|r| r.is_finite());
        report.residual = self.residual;
        let goes_on = (self.look)(report.iterations, self.residual);
        let otherwise = match (report.iterations >= self.stopping.most_iterations, goes_on) {
            (true, _) => Ending::MostIterations,
            (false, false) => Ending::Stopped,
            (false, true) if self.negative.is_none() && relative.iter().any(|r| *r > self.stopping.tolerance) => {
                return None;
            }
            (false, true) => Ending::Stagnated,
        };
        Some(self.ending(self.stopping.tolerance, otherwise))
    }

    fn step(&mut self, products: &Products<L, V>, _: &mut V) -> Result<[f64; L], Ending> {
        let Products { rz, energy, size, .. } = products;
        self.negative = (0..L).filter(|&l| energy[l] < -NEGATIVE * size[l]).map(|l| energy[l]).reduce(f64::min);
        let relative = self.relative(rz);
        let moves = |l: usize| relative[l] > self.stopping.tolerance && energy[l] > FREE * size[l];
        let alpha: [f64; L] = std::array::from_fn(|l| if moves(l) { rz[l] / energy[l] } else { 0.0 });
        if alpha.iter().all(|a| *a == 0.0) {
            // What is left of every residual pulls at free motions alone, by rounding.
            return Err(self.ending(self.stopping.tolerance.max(ROUNDING), Ending::Stagnated));
        }
        Ok(alpha)
    }
}
