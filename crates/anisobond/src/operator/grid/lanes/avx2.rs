//! AVX2 with fused multiply-add: 4 numbers, masks as lanes of ones.

use std::arch::x86_64::*;

use super::{Kernel, Lanes};

/// A register of numbers.
#[derive(Clone, Copy)]
pub struct Avx2<T: Register>(T::Register);

/// The register of a number type.
pub trait Register {
    /// The register.
    type Register: Copy;
}

impl Register for f64 {
    type Register = __m256d;
}

macro_rules! avx2 {
    ($real:ty, $n:literal, $mask:ty, $integer:ty, $set:ident, $load:ident, $store:ident, $add:ident, $sub:ident,
     $mul:ident, $div:ident, $sqrt:ident, $fmadd:ident, $fnmadd:ident, $cmp:ident, $and:ident, $andnot:ident, $or:ident, $movemask:ident,
     $seti:ident, $equal:ident, $cast:ident, $lanes:expr) => {
        // SAFETY of all functions: the caller has AVX2 and FMA and aligned valid pointers, by the trait's contract; that
        // is all the intrinsics need.
        impl Lanes for Avx2<$real> {
            type T = $real;
            type Mask = $mask;
            const N: usize = $n;

            #[inline(always)]
            unsafe fn run(kernel: impl Kernel) {
                #[target_feature(enable = "avx2,fma")]
                #[inline(never)]
                unsafe fn alone(kernel: impl Kernel) {
                    // SAFETY: the caller's contract.
                    unsafe { kernel.run() }
                }
                // SAFETY: the caller's contract.
                unsafe { alone(kernel) }
            }
            #[inline(always)]
            unsafe fn splat(x: $real) -> Self {
                Avx2(unsafe { $set(x) })
            }
            #[inline(always)]
            unsafe fn load(from: *const $real) -> Self {
                Avx2(unsafe { $load(from) })
            }
            #[inline(always)]
            unsafe fn store(self, to: *mut $real) {
                unsafe { $store(to, self.0) }
            }
            #[inline(always)]
            unsafe fn add(self, b: Self) -> Self {
                Avx2(unsafe { $add(self.0, b.0) })
            }
            #[inline(always)]
            unsafe fn sub(self, b: Self) -> Self {
                Avx2(unsafe { $sub(self.0, b.0) })
            }
            #[inline(always)]
            unsafe fn mul(self, b: Self) -> Self {
                Avx2(unsafe { $mul(self.0, b.0) })
            }
            #[inline(always)]
            unsafe fn div(self, b: Self) -> Self {
                Avx2(unsafe { $div(self.0, b.0) })
            }
            #[inline(always)]
            unsafe fn sqrt(self) -> Self {
                Avx2(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            unsafe fn mul_add(self, b: Self, c: Self) -> Self {
                Avx2(unsafe { $fmadd(self.0, b.0, c.0) })
            }
            #[inline(always)]
            unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self {
                Avx2(unsafe { $fnmadd(self.0, b.0, c.0) })
            }
            #[inline(always)]
            unsafe fn above(self, b: Self) -> Self::Mask {
                unsafe { $cmp::<_CMP_GT_OQ>(self.0, b.0) }
            }
            #[inline(always)]
            unsafe fn keep(self, mask: Self::Mask) -> Self {
                Avx2(unsafe { $and(mask, self.0) })
            }
            #[inline(always)]
            unsafe fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask {
                unsafe { $and(a, b) }
            }
            #[inline(always)]
            unsafe fn either(a: Self::Mask, b: Self::Mask) -> Self::Mask {
                unsafe { $or(a, b) }
            }
            #[inline(always)]
            unsafe fn but_not(a: Self::Mask, b: Self::Mask) -> Self::Mask {
                unsafe { $andnot(b, a) }
            }
            #[inline(always)]
            unsafe fn bits(mask: Self::Mask) -> u32 {
                unsafe { $movemask(mask) as u32 }
            }
            #[inline(always)]
            unsafe fn mask(bits: u32) -> Self::Mask {
                // Not equal to zero, as the complement of equal.
                unsafe {
                    let none = $equal(_mm256_and_si256($seti(bits as $integer), $lanes), _mm256_setzero_si256());
                    $cast(_mm256_xor_si256(none, _mm256_set1_epi8(-1)))
                }
            }
        }
    };
}

avx2!(
    f64,
    4,
    __m256d,
    i64,
    _mm256_set1_pd,
    _mm256_load_pd,
    _mm256_store_pd,
    _mm256_add_pd,
    _mm256_sub_pd,
    _mm256_mul_pd,
    _mm256_div_pd,
    _mm256_sqrt_pd,
    _mm256_fmadd_pd,
    _mm256_fnmadd_pd,
    _mm256_cmp_pd,
    _mm256_and_pd,
    _mm256_andnot_pd,
    _mm256_or_pd,
    _mm256_movemask_pd,
    _mm256_set1_epi64x,
    _mm256_cmpeq_epi64,
    _mm256_castsi256_pd,
    _mm256_setr_epi64x(1, 2, 4, 8)
);
