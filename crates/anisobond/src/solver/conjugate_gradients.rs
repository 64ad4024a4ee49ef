//! Preconditioned conjugate gradients, for one right-hand side or several at once.
//!
//! Right-hand sides share the operator's memory traffic and nothing else: each has its own step lengths. Solving them together,
//! apart or on several threads gives the same bits.

use super::linear::{LinearOperator, Preconditioner, VectorSpace};
use super::report::{Ending, SolverReport};

/// An operator on a space of vectors, with its preconditioner.
pub struct System<'a, S, K, M> {
    /// The vectors.
    pub space: &'a S,
    /// K.
    pub operator: &'a K,
    /// M⁻¹.
    pub preconditioner: &'a M,
}

/// Products of an iteration, of each right-hand side.
pub struct Products<'a, const L: usize, V> {
    /// r · M⁻¹ r.
    pub rz: [f64; L],
    /// p · K p of the direction p.
    pub energy: [f64; L],
    /// p · M p: r ⟂ p makes it the sum of its parts.
    pub size: [f64; L],
    /// The direction p.
    pub direction: &'a V,
}

/// What a solve does next.
pub enum Next {
    /// Another step.
    Step,
    /// Another step, along M⁻¹ r alone, for the residual was computed anew.
    Anew,
    /// Nothing.
    End(Ending),
}

/// How long steps are, and when they end.
pub trait Rule<const L: usize, V> {
    /// At x with the residual r, before the preconditioner.
    fn at(&mut self, x: &V, r: &mut V, report: &mut SolverReport) -> Next {
        let _ = (x, r, report);
        Next::Step
    }

    /// The same where r · M⁻¹ r is known.
    fn measured(&mut self, rz: &[f64; L], report: &mut SolverReport) -> Option<Ending> {
        let _ = (rz, report);
        None
    }

    /// The lengths α of the next step, 0 of a right-hand side that rests. A rule that ends the solve may still move x.
    ///
    /// # Errors
    /// How the solve ends instead.
    fn step(&mut self, products: &Products<L, V>, x: &mut V) -> Result<[f64; L], Ending>;
}

impl<S, K, M> System<'_, S, K, M> {
    /// Solve K x = b from an x whose residual r = b − K x is given; the report goes on from what it counts already, and says how
    /// the solve ended.
    #[inline(always)]
    pub fn solve<const L: usize>(
        &self,
        rule: &mut impl Rule<L, S::Vector>,
        x: &mut S::Vector,
        r: &mut S::Vector,
        report: &mut SolverReport,
    ) where
        S: VectorSpace<L>,
        K: LinearOperator<S::Vector>,
        M: Preconditioner<S::Vector, L>,
    {
        let space = self.space;
        let (mut z, mut p, mut q) = (space.zeros(), space.zeros(), space.zeros());
        let (mut last, mut size) = ([0.0; L], [0.0; L]);
        report.ending = loop {
            match rule.at(x, r, report) {
                Next::Step => {}
                Next::Anew => last = [0.0; L],
                Next::End(ending) => break ending,
            }
            let (applications, rz) = self.preconditioner.apply_and_dot(space, self.operator, r, &mut z);
            report.applications += applications;
            if let Some(ending) = rule.measured(&rz, report) {
                break ending;
            }
            // β = r′·z′/r·z.
            let beta: [f64; L] = std::array::from_fn(|l| if last[l] > 0.0 { rz[l] / last[l] } else { 0.0 });
            space.turn(&mut p, &beta, &z);
            size = std::array::from_fn(|l| rz[l] + beta[l] * beta[l] * size[l]);
            last = rz;
            self.operator.apply(&p, &mut q);
            report.applications += 1;
            let energy = space.dot(&p, &q);
            match rule.step(&Products { rz, energy, size, direction: &p }, x) {
                Ok(alpha) => space.advance(&alpha, [&p, &q], [x, r]),
                Err(ending) => break ending,
            }
            report.iterations += 1;
        };
    }
}
