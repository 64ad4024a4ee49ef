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

/// The constants of a bond: direction n (linear) or ξ (m; finite), 1/|ξ|² (1/m²; finite), stiffness k (N/m) or k/|ξ|²
/// (N/m³; finite).
#[derive(Clone, Copy)]
pub struct Constants<L> {
    /// n or ξ.
    pub branch: [L; 3],
    /// 1/|ξ|².
    pub per_square: L,
    /// k or k/|ξ|²: see [`stiffness`].
    pub stiffness: L,
}

/// Measure of stretch, direction and factor of the force of a bond.
pub type Pull<L> = (L, [L; 3], L);

/// A bond's measure of stretch, which is compared with [`threshold`], and the direction and factor of its force, without
/// [`stiffness`]: linear n·η, n, n·η (P eqs 14-15);
/// finite d = |ξ+η|² − |ξ|² = η·(2ξ+η), ξ+η, d/(1 + q + √(1+q)) with q = d/|ξ|² (P eq 5): |ξ|² times
/// 1 − |ξ|/|ξ+η| = 1 − 1/√(1+q), without cancellation.
///
/// Bonds are taken C at a time, step by step: their long chains of operations then overlap.
///
/// # Safety
/// As [`Lanes`].
#[inline(always)]
pub unsafe fn bonds<L: Lanes, const FINITE: bool, const C: usize>(
    eta: &[[L; 3]; C],
    constants: &Constants<L>,
) -> [Pull<L>; C] {
    // SAFETY: the caller's contract.
    unsafe {
        let branch = constants.branch;
        let zero = L::splat(L::T::default());
        let mut out = [(zero, branch, zero); C];
        if !FINITE {
            for c in 0..C {
                let stretch = dot(&eta[c], &branch);
                out[c] = (stretch, branch, stretch);
            }
            return out;
        }
        let one = L::splat(L::T::of(1.0));
        let mut d = [zero; C];
        for a in 0..3 {
            for c in 0..C {
                out[c].1[a] = branch[a].add(eta[c][a]);
                let sum = out[c].1[a].add(branch[a]);
                d[c] = if a == 0 { eta[c][a].mul(sum) } else { eta[c][a].mul_add(sum, d[c]) };
            }
        }
        let mut square = d;
        for c in 0..C {
            square[c] = d[c].mul_add(constants.per_square, one);
        }
        let root = L::roots(square);
        for c in 0..C {
            square[c] = square[c].add(root[c]);
        }
        for c in 0..C {
            out[c].0 = d[c];
            out[c].2 = d[c].div(square[c]);
        }
        out
    }
}

/// What a bond's factor of force is multiplied by: k (N/m), at finite stretch k/|ξ|² (N/m³).
#[inline(always)]
pub fn stiffness<T: Real>(finite: bool, k: T, per_square: T) -> T {
    if finite { k * per_square } else { k }
}

/// The measure of stretch above which a bond breaks, from its critical stretch s (–) and length (m): linear s|ξ|,
/// finite (1 + s)²|ξ|² − |ξ|² = s (2 + s) |ξ|².
#[inline(always)]
pub fn threshold<T: Real>(finite: bool, critical: T, length: T) -> T {
    match finite {
        true => critical * (critical + T::of(2.0)) * (length * length),
        false => critical * length,
    }
}

/// Mean of what both ends say.
#[inline(always)]
pub fn mean<T: Real>(a: T, b: T) -> T {
    T::of(0.5) * (a + b)
}
