//! Equilibrium of a list of bonds, for several load cases at once.

use super::conjugate_gradients::System;
use super::linear::{LinearOperator, VectorSpace};
use super::preconditioner::BlockJacobi;
use super::report::{Ending, SolverReport, Stopping};
use super::semidefinite::Semidefinite;
use super::watch::Look;
use crate::operator::{BondList, Field, NodeField};

/// Displacements and rotations by node, L load cases side by side. Sums are over nodes and components, in the list's order.
struct Nodes(usize);

impl<const L: usize> VectorSpace<L> for Nodes {
    type Vector = Field<L>;

    fn zeros(&self) -> Field<L> {
        vec![[[0.0; L]; 6]; self.0]
    }

    #[inline(always)]
    fn dot(&self, a: &Field<L>, b: &Field<L>) -> [f64; L] {
        let mut sum = [0.0; L];
        for (a, b) in a.iter().zip(b) {
            add_products(&mut sum, a, b);
        }
        sum
    }

    #[inline(always)]
    fn add(&self, y: &mut Field<L>, s: &[f64; L], x: &Field<L>) {
        for (y, x) in y.iter_mut().flatten().zip(x.iter().flatten()) {
            for l in 0..L {
                y[l] += s[l] * x[l];
            }
        }
    }

    #[inline(always)]
    fn turn(&self, y: &mut Field<L>, s: &[f64; L], x: &Field<L>) {
        for (y, x) in y.iter_mut().zip(x) {
            for i in 0..6 {
                for l in 0..L {
                    y[i][l] = x[i][l] + s[l] * y[i][l];
                }
            }
        }
    }

    fn not_finite(&self, a: &Field<L>) -> Option<usize> {
        a.iter().position(|node| !node.iter().flatten().all(|x| x.is_finite()))
    }

    /// In one pass.
    #[inline(always)]
    fn advance(&self, s: &[f64; L], [p, q]: [&Field<L>; 2], [x, r]: [&mut Field<L>; 2]) {
        for ((p, q), (x, r)) in p.iter().zip(q).zip(x.iter_mut().zip(r)) {
            for i in 0..6 {
                for l in 0..L {
                    x[i][l] += s[l] * p[i][l];
                    r[i][l] -= s[l] * q[i][l];
                }
            }
        }
    }
}

/// What a node adds to a sum a · b.
#[inline(always)]
pub(super) fn add_products<const L: usize>(sum: &mut [f64; L], a: &NodeField<L>, b: &NodeField<L>) {
    for i in 0..6 {
        for l in 0..L {
            sum[l] += a[i][l] * b[i][l];
        }
    }
}

impl<const L: usize> LinearOperator<Field<L>> for BondList {
    #[inline(always)]
    fn apply(&self, x: &Field<L>, y: &mut Field<L>) {
        BondList::apply(self, x, y);
    }
}

/// Solve K x = b for L load cases. K may be singular (translations always are) as long as b does no work on its zero
/// modes, which forces from strains never do. If K turns out indefinite, the solve ends and the report says so; where whoever
/// sees it ends it, the solve ends where it is. `least` is the r·M⁻¹r of every load case that is rounding: below it a residual
/// counts as zero, however small the right-hand side.
///
/// The same code is compiled for wider vectors where the processor has them; without fused multiply-add, so that the
/// bits do not depend on the processor.
pub fn solve_bonds<const L: usize>(
    list: &BondList,
    preconditioner: &BlockJacobi,
    b: Field<L>,
    least: &[f64; L],
    seen: (&Stopping, Look),
) -> (Field<L>, SolverReport) {
    let negative = preconditioner.negative();
    let work = Work { list, preconditioner, rule: Semidefinite::new(seen, least, negative), r: b };
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has the features that the function was compiled for.
            return unsafe { work.with_avx512() };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { work.with_avx2() };
        }
    }
    work.done()
}

/// A solve before its first step.
struct Work<'a, const L: usize> {
    list: &'a BondList,
    preconditioner: &'a BlockJacobi,
    rule: Semidefinite<'a, L>,
    r: Field<L>,
}

impl<const L: usize> Work<'_, L> {
    /// [`Work::done`] with 512-bit vectors.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn with_avx512(self) -> (Field<L>, SolverReport) {
        self.done()
    }

    /// [`Work::done`] with 256-bit vectors.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn with_avx2(self) -> (Field<L>, SolverReport) {
        self.done()
    }

    #[inline(always)]
    fn done(mut self) -> (Field<L>, SolverReport) {
        let space = Nodes(self.list.nodes());
        let system = System { space: &space, operator: self.list, preconditioner: self.preconditioner };
        let (mut x, mut report) = (self.list.zeros(), SolverReport::begun(0));
        system.solve(&mut self.rule, &mut x, &mut self.r, &mut report);
        if let Ending::NotFinite { node } = &mut report.ending {
            let place = VectorSpace::<L>::not_finite(&space, &self.r).unwrap_or(0);
            *node = (0..space.0).find(|&n| self.list.place(n) == place).unwrap_or(0);
        }
        (x, report)
    }
}
