//! Vectors of the space, one in each lane.

use super::rows::LANES;
use crate::operator::grid::lanes::Lanes;

/// Three components of as many vectors as there are lanes.
#[derive(Clone, Copy)]
pub(super) struct Three<L>(pub [L; 3]);

/// # Safety
/// All functions need the instruction set of L.
#[allow(clippy::missing_safety_doc)]
impl<L: Lanes<T = f64>> Three<L> {
    #[inline(always)]
    pub(super) unsafe fn zero() -> Self {
        // SAFETY: the caller's contract, here and below.
        Three([unsafe { L::splat(0.0) }; 3])
    }

    /// Lanes from `part` on of eight aligned vectors.
    #[inline(always)]
    pub(super) unsafe fn load(from: &[[f64; LANES]; 3], part: usize) -> Self {
        unsafe { Three([L::load(&from[0][part]), L::load(&from[1][part]), L::load(&from[2][part])]) }
    }

    /// The first three of four.
    #[inline(always)]
    pub(super) unsafe fn load4(from: &[[f64; LANES]; 4], part: usize) -> Self {
        unsafe { Three([L::load(&from[0][part]), L::load(&from[1][part]), L::load(&from[2][part])]) }
    }

    #[inline(always)]
    pub(super) unsafe fn add(self, b: Self) -> Self {
        let ([x, y, z], [u, v, w]) = (self.0, b.0);
        unsafe { Three([x.add(u), y.add(v), z.add(w)]) }
    }

    #[inline(always)]
    pub(super) unsafe fn sub(self, b: Self) -> Self {
        let ([x, y, z], [u, v, w]) = (self.0, b.0);
        unsafe { Three([x.sub(u), y.sub(v), z.sub(w)]) }
    }

    /// s·self.
    #[inline(always)]
    pub(super) unsafe fn times(self, s: L) -> Self {
        let [x, y, z] = self.0;
        unsafe { Three([x.mul(s), y.mul(s), z.mul(s)]) }
    }

    /// self + s·b.
    #[inline(always)]
    pub(super) unsafe fn add_times(self, s: L, b: Self) -> Self {
        let ([x, y, z], [u, v, w]) = (self.0, b.0);
        unsafe { Three([s.mul_add(u, x), s.mul_add(v, y), s.mul_add(w, z)]) }
    }

    /// self − s·b.
    #[inline(always)]
    pub(super) unsafe fn sub_times(self, s: L, b: Self) -> Self {
        let ([x, y, z], [u, v, w]) = (self.0, b.0);
        unsafe { Three([s.neg_mul_add(u, x), s.neg_mul_add(v, y), s.neg_mul_add(w, z)]) }
    }

    #[inline(always)]
    pub(super) unsafe fn dot(self, b: Self) -> L {
        let ([x, y, z], [u, v, w]) = (self.0, b.0);
        unsafe { x.mul_add(u, y.mul_add(v, z.mul(w))) }
    }

    #[inline(always)]
    pub(super) unsafe fn cross(self, b: Self) -> Self {
        let ([x, y, z], [u, v, w]) = (self.0, b.0);
        unsafe { Three([z.neg_mul_add(v, y.mul(w)), x.neg_mul_add(w, z.mul(u)), y.neg_mul_add(u, x.mul(v))]) }
    }

    /// Zero where the mask is not set.
    #[inline(always)]
    pub(super) unsafe fn keep(self, mask: L::Mask) -> Self {
        let [x, y, z] = self.0;
        unsafe { Three([x.keep(mask), y.keep(mask), z.keep(mask)]) }
    }
}
