//! One bond, in vectors: how far it is stretched, and its force. Both ends of a bond, and all paths of the kernels,
//! take these same operations, so that they decide identically whether it breaks.

use super::lanes::Lanes;
use super::real::Real;

/// Σ a b, in the order of the components.
///
/// # Safety
/// As [`Lanes`].
#[inline(always)]
pub unsafe fn dot<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> L {
    // SAFETY: the caller's contract.
    unsafe { a[2].mul_add(b[2], a[1].mul_add(b[1], a[0].mul(b[0]))) }
}

/// The constants of a bond: direction n (linear) or ξ (m; finite), 1/|ξ|² (1/m²; finite), stiffness k (N/m).
#[derive(Clone, Copy)]
pub struct Constants<L> {
    /// n or ξ.
    pub branch: [L; 3],
    /// 1/|ξ|².
    pub per_square: L,
    /// k.
    pub stiffness: L,
}

/// A bond's measure of stretch, which is compared with [`threshold`], and the direction and factor of its force:
/// linear n·η, n, k n·η (P eqs 14-15);
/// finite q = (|ξ+η|² − |ξ|²)/|ξ|², ξ+η, k (1 − |ξ|/|ξ+η|) (P eq 5), with 1 − 1/√(1+q) = q/(1 + q + √(1+q)), in which
/// nothing cancels.
///
/// # Safety
/// As [`Lanes`].
#[inline(always)]
pub unsafe fn bond<L: Lanes, const FINITE: bool>(eta: &[L; 3], c: &Constants<L>) -> (L, [L; 3], L) {
    // SAFETY: the caller's contract.
    unsafe {
        if !FINITE {
            let stretch = dot(eta, &c.branch);
            return (stretch, c.branch, c.stiffness.mul(stretch));
        }
        let one = L::splat(L::T::of(1.0));
        let to = [c.branch[0].add(eta[0]), c.branch[1].add(eta[1]), c.branch[2].add(eta[2])];
        let sum = [to[0].add(c.branch[0]), to[1].add(c.branch[1]), to[2].add(c.branch[2])];
        let q = dot(eta, &sum).mul(c.per_square);
        let square = one.add(q);
        let part = q.div(square.add(square.root()));
        (q, to, c.stiffness.mul(part))
    }
}

/// The measure of stretch above which a bond breaks, from its critical stretch s (–) and length (m): linear s|ξ|,
/// finite (1 + s)² − 1.
#[inline(always)]
pub fn threshold<T: Real>(finite: bool, critical: T, length: T) -> T {
    match finite {
        true => critical * (critical + T::of(2.0)),
        false => critical * length,
    }
}

/// Mean of what both ends say.
#[inline(always)]
pub fn mean<T: Real>(a: T, b: T) -> T {
    T::of(0.5) * (a + b)
}
