//! Vectors of numbers of one instruction set, as the kernels see them.
//!
//! Kernels are written once over [`Lanes`], inlined into a function compiled for the instruction set, and chosen at run
//! time. AVX-512 and AVX2 use fused multiply-add, the portable vectors do not: results of different instruction sets
//! differ by rounding, results of one do not depend on anything else.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod portable;

#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub use avx512::Avx512;
pub use portable::Portable;

/// Without those instruction sets nothing is chosen but the portable vectors.
#[cfg(not(target_arch = "x86_64"))]
pub type Avx512<T> = Portable<T, 4>;
/// As [`Avx512`].
#[cfg(not(target_arch = "x86_64"))]
pub type Avx2<T> = Portable<T, 4>;

use super::kernels::Kernel;
use super::real::Real;

/// An instruction set that has kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// AVX-512 F, DQ, BW and VL: 8 numbers.
    Avx512,
    /// AVX2 with fused multiply-add: 4 and 8.
    Avx2,
    /// Whatever the compiler makes of arrays of 4 and 8.
    Portable,
}

impl InstructionSet {
    /// The widest that this machine has.
    pub fn best() -> Self {
        [InstructionSet::Avx512, InstructionSet::Avx2]
            .into_iter()
            .find(|set| set.available())
            .unwrap_or(InstructionSet::Portable)
    }

    /// Whether this machine has it.
    pub fn available(self) -> bool {
        match self {
            InstructionSet::Portable => true,
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => {
                InstructionSet::Avx2.available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// Numbers in a vector.
    pub fn lanes<T: Real>(self) -> usize {
        match self {
            InstructionSet::Avx512 => T::Avx512::N,
            InstructionSet::Avx2 => T::Avx2::N,
            InstructionSet::Portable => T::Portable::N,
        }
    }
}

/// A vector of numbers.
///
/// # Safety
/// All functions need the instruction set of the implementing type; pointers must be valid for N numbers and, for
/// AVX-512 and AVX2, aligned to the vector.
#[allow(clippy::missing_safety_doc)]
pub trait Lanes: Copy {
    /// Numbers.
    type T: Real;
    /// One truth value per lane.
    type Mask: Copy;
    /// Number of lanes.
    const N: usize;

    /// The same number in all lanes.
    unsafe fn splat(x: Self::T) -> Self;
    /// Aligned load.
    unsafe fn load(from: *const Self::T) -> Self;
    /// Aligned store.
    unsafe fn store(self, to: *mut Self::T);
    /// self + b.
    unsafe fn add(self, b: Self) -> Self;
    /// self − b.
    unsafe fn sub(self, b: Self) -> Self;
    /// self · b.
    unsafe fn mul(self, b: Self) -> Self;
    /// self / b.
    unsafe fn div(self, b: Self) -> Self;
    /// √self.
    unsafe fn sqrt(self) -> Self;
    /// self · b + c, fused where the set has it.
    unsafe fn mul_add(self, b: Self, c: Self) -> Self;
    /// c − self · b, fused where the set has it.
    unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self;
    /// Where self > b; never where either is not a number.
    unsafe fn above(self, b: Self) -> Self::Mask;
    /// √x, for x ≥ 0, within a few units of the last place; at 0 it may be no number.
    #[inline(always)]
    unsafe fn roots<const C: usize>(mut x: [Self; C]) -> [Self; C] {
        for c in 0..C {
            // SAFETY: the caller's contract.
            x[c] = unsafe { x[c].sqrt() };
        }
        x
    }
    /// self − b where the mask is set, else 0.
    #[inline(always)]
    unsafe fn sub_where(self, b: Self, mask: Self::Mask) -> Self {
        // SAFETY: the caller's contract.
        unsafe { self.sub(b).keep(mask) }
    }
    /// self · b where the mask is set, else 0.
    #[inline(always)]
    unsafe fn mul_where(self, b: Self, mask: Self::Mask) -> Self {
        // SAFETY: the caller's contract.
        unsafe { self.mul(b).keep(mask) }
    }
    /// Numbers of a block of whole vectors in natural order: lane l of vector j of L to place l·L + j, as far as there are
    /// places.
    #[inline(always)]
    unsafe fn natural_order(block: &[Self::T], natural: &mut [Self::T]) {
        let length = block.len() / Self::N;
        for (lane, part) in natural.chunks_mut(length).enumerate() {
            for (to, vector) in part.iter_mut().zip(block.chunks_exact(Self::N)) {
                *to = vector[lane];
            }
        }
    }
    /// Run a kernel as a function of its own, compiled for the instruction set.
    unsafe fn run(kernel: impl Kernel);
    /// self where the mask is set, else 0.
    unsafe fn keep(self, mask: Self::Mask) -> Self;
    /// a and b.
    unsafe fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// a or b.
    unsafe fn either(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// a and not b.
    unsafe fn but_not(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// The mask as bits, lane 0 lowest.
    unsafe fn bits(mask: Self::Mask) -> u32;
    /// The mask of such bits.
    unsafe fn mask(bits: u32) -> Self::Mask;
}
