//! Preconditioned conjugate gradients for several right-hand sides at once.
//!
//! The load cases share the bonds' memory traffic and nothing else: each has its own step lengths, and one that has
//! converged takes no more steps. Solving them together, apart or on several threads gives the same bits.

use serde::{Deserialize, Serialize};

use super::preconditioner::BlockJacobi;
use super::watch::{Look, Watch};
use crate::operator::{BondList, Field, NodeField};

/// A direction p of no more energy than this part of p·Mp is a free motion.
const FREE: f64 = 1e-12;

/// Residual of a singular system that rounding may leave.
const ROUNDING: f64 = 1e-9;

/// p·Kp/p·Mp below minus this is negative energy, not rounding; the spectrum of M⁻¹K is of order 1.
const NEGATIVE: f64 = 1e-10;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stopping {
    /// Largest √(r·M⁻¹r) accepted, relative to that of the right-hand side.
    pub tolerance: f64,
    /// Most iterations.
    pub most_iterations: usize,
}

impl Default for Stopping {
    fn default() -> Self {
        Stopping { tolerance: 1e-8, most_iterations: 20_000 }
    }
}

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolverReport {
    /// Iterations of the slowest load case.
    pub iterations: usize,
    /// Largest √(r·M⁻¹r) of the load cases, relative to that of the right-hand side; 0 where all that is left is rounding.
    pub residual: f64,
    /// Whether every load case met the tolerance.
    pub converged: bool,
    /// Whether a direction of negative energy was met: K is not positive semidefinite, the body not stable, and the
    /// solve was given up. Where random loads converge without meeting one, there is none beyond the tolerance: the
    /// part of a load along a negative mode could only have grown.
    pub negative_curvature: bool,
}

impl SolverReport {
    /// Both solves as one: the worse of each.
    pub fn and(self, other: SolverReport) -> SolverReport {
        SolverReport {
            iterations: self.iterations.max(other.iterations),
            residual: self.residual.max(other.residual),
            converged: self.converged && other.converged,
            negative_curvature: self.negative_curvature || other.negative_curvature,
        }
    }
}

/// Solve K x = b for L load cases. K may be singular (translations always are) as long as b does no work on its zero
/// modes, which forces from strains never do. If K turns out indefinite, the solve ends and the report says so.
pub fn conjugate_gradients<const L: usize>(
    list: &BondList,
    preconditioner: &BlockJacobi,
    b: &[NodeField<L>],
    stopping: &Stopping,
) -> (Field<L>, SolverReport) {
    conjugate_gradients_watched(list, preconditioner, b, &[0.0; L], stopping, &Watch::default())
}

/// [`conjugate_gradients`] under a watch. Told to stop, the solve ends where it is; the report says that it has not
/// converged. `least` is the r·M⁻¹r of every load case that is rounding: below it a residual counts as zero, however small
/// the right-hand side.
pub fn conjugate_gradients_watched<const L: usize>(
    list: &BondList,
    preconditioner: &BlockJacobi,
    b: &[NodeField<L>],
    least: &[f64; L],
    stopping: &Stopping,
    watch: &Watch,
) -> (Field<L>, SolverReport) {
    let look = |iterations: usize, _: f64| {
        if iterations > 0 {
            watch.count();
        }
        !watch.stopped()
    };
    conjugate_gradients_seen(list, preconditioner, b, least, stopping, &look)
}

/// [`conjugate_gradients_watched`], seen at every iteration by whoever may end it.
///
/// The same code is compiled for wider vectors where the processor has them; without fused multiply-add, so that the
/// bits do not depend on the processor.
pub fn conjugate_gradients_seen<const L: usize>(
    list: &BondList,
    preconditioner: &BlockJacobi,
    b: &[NodeField<L>],
    least: &[f64; L],
    stopping: &Stopping,
    look: Look,
) -> (Field<L>, SolverReport) {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has the features that the function was compiled for.
            return unsafe { with_avx512(list, preconditioner, b, least, stopping, look) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { with_avx2(list, preconditioner, b, least, stopping, look) };
        }
    }
    iterate(list, preconditioner, b, least, stopping, look)
}

/// [`iterate`] with 512-bit vectors.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn with_avx512<const L: usize>(
    list: &BondList,
    preconditioner: &BlockJacobi,
    b: &[NodeField<L>],
    least: &[f64; L],
    stopping: &Stopping,
    look: Look,
) -> (Field<L>, SolverReport) {
    iterate(list, preconditioner, b, least, stopping, look)
}

/// [`iterate`] with 256-bit vectors.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<const L: usize>(
    list: &BondList,
    preconditioner: &BlockJacobi,
    b: &[NodeField<L>],
    least: &[f64; L],
    stopping: &Stopping,
    look: Look,
) -> (Field<L>, SolverReport) {
    iterate(list, preconditioner, b, least, stopping, look)
}

/// The method.
#[inline(always)]
fn iterate<const L: usize>(
    list: &BondList,
    preconditioner: &BlockJacobi,
    b: &[NodeField<L>],
    least: &[f64; L],
    stopping: &Stopping,
    look: Look,
) -> (Field<L>, SolverReport) {
    let mut x = list.zeros();
    let mut r = b.to_vec();
    let mut p = list.zeros();
    let mut q = list.zeros();
    let mut z = list.zeros();
    let start = precondition(preconditioner, &r, &mut z);
    p.copy_from_slice(&z);
    let mut rz = start;
    // p·Mp: r ⟂ p makes it the sum of its parts.
    let mut size = start;
    let mut negative_curvature = preconditioner.indefinite();
    let (mut iterations, mut idle, mut goes_on) = (0, false, look(0, 1.0));
    while active(&rz, &start, least, stopping)
        && iterations < stopping.most_iterations
        && !negative_curvature
        && goes_on
    {
        list.apply(&p, &mut q);
        let energy = dot(&p, &q);
        negative_curvature = (0..L).any(|l| energy[l] < -NEGATIVE * size[l]);
        let alpha = step_length(&rz, &energy, &size, &start, least, stopping);
        // What is left of every residual pulls at free motions alone, by rounding.
        idle = alpha.iter().all(|a| *a == 0.0);
        if idle {
            break;
        }
        advance(&alpha, &p, &q, &mut x, &mut r);
        let rz_next = precondition(preconditioner, &r, &mut z);
        let beta = ratio(&rz_next, &rz);
        turn(&beta, &z, &mut p);
        size = std::array::from_fn(|l| rz_next[l] + beta[l] * beta[l] * size[l]);
        rz = rz_next;
        iterations += 1;
        goes_on = look(iterations, relative(&rz, &start, least).into_iter().fold(0.0, f64::max));
    }
    let residual = relative(&rz, &start, least).into_iter().fold(0.0, f64::max);
    let accepted = if idle { stopping.tolerance.max(ROUNDING) } else { stopping.tolerance };
    let converged = residual <= accepted && rz.iter().all(|r| r.is_finite()) && !negative_curvature;
    (x, SolverReport { iterations, residual, converged, negative_curvature })
}

/// √(r·z) relative to the start; 0 where r·z is no more than rounding, as that of a right-hand side of zero.
fn relative<const L: usize>(rz: &[f64; L], start: &[f64; L], least: &[f64; L]) -> [f64; L] {
    let left = |l: usize| if rz[l] <= least[l] { 0.0 } else { (rz[l] / start[l]).sqrt() };
    std::array::from_fn(|l| if start[l] > 0.0 { left(l) } else { 0.0 })
}

/// Whether any load case is still above the tolerance.
fn active<const L: usize>(rz: &[f64; L], start: &[f64; L], least: &[f64; L], stopping: &Stopping) -> bool {
    relative(rz, start, least).iter().any(|r| *r > stopping.tolerance)
}

/// α = r·z/p·Kp; 0 for a load case that has converged, or whose direction costs no energy beside p·Mp.
fn step_length<const L: usize>(
    rz: &[f64; L],
    pq: &[f64; L],
    size: &[f64; L],
    start: &[f64; L],
    least: &[f64; L],
    stopping: &Stopping,
) -> [f64; L] {
    let relative = relative(rz, start, least);
    let moves = |l: usize| relative[l] > stopping.tolerance && pq[l] > FREE * size[l];
    std::array::from_fn(|l| if moves(l) { rz[l] / pq[l] } else { 0.0 })
}

/// β = r′·z′/r·z.
fn ratio<const L: usize>(next: &[f64; L], rz: &[f64; L]) -> [f64; L] {
    std::array::from_fn(|l| if rz[l] > 0.0 { next[l] / rz[l] } else { 0.0 })
}

/// Σ a·b over nodes and components, in node order.
#[inline(always)]
fn dot<const L: usize>(a: &[NodeField<L>], b: &[NodeField<L>]) -> [f64; L] {
    let mut sum = [0.0; L];
    for (a, b) in a.iter().zip(b) {
        for (a, b) in a.iter().zip(b) {
            for l in 0..L {
                sum[l] += a[l] * b[l];
            }
        }
    }
    sum
}

/// x += α p, r −= α q.
#[inline(always)]
fn advance<const L: usize>(
    alpha: &[f64; L],
    p: &[NodeField<L>],
    q: &[NodeField<L>],
    x: &mut [NodeField<L>],
    r: &mut [NodeField<L>],
) {
    for ((p, q), (x, r)) in p.iter().zip(q).zip(x.iter_mut().zip(r)) {
        for i in 0..6 {
            for l in 0..L {
                x[i][l] += alpha[l] * p[i][l];
                r[i][l] -= alpha[l] * q[i][l];
            }
        }
    }
}

/// z = M⁻¹ r; returns r·z.
#[inline(always)]
fn precondition<const L: usize>(m: &BlockJacobi, r: &[NodeField<L>], z: &mut [NodeField<L>]) -> [f64; L] {
    let mut sum = [0.0; L];
    for (node, (r, z)) in r.iter().zip(z).enumerate() {
        *z = m.apply(node, r);
        for i in 0..6 {
            for l in 0..L {
                sum[l] += r[i][l] * z[i][l];
            }
        }
    }
    sum
}

/// p = z + β p.
#[inline(always)]
fn turn<const L: usize>(beta: &[f64; L], z: &[NodeField<L>], p: &mut [NodeField<L>]) {
    for (z, p) in z.iter().zip(p) {
        for i in 0..6 {
            for l in 0..L {
                p[i][l] = z[i][l] + beta[l] * p[i][l];
            }
        }
    }
}
