//! AVX-512: 8 numbers, masks in registers of their own.

use std::arch::x86_64::*;

use super::{Kernel, Lanes};

/// A register of numbers.
#[derive(Clone, Copy)]
pub struct Avx512<T: Register>(T::Register);

/// The register of a number type.
pub trait Register {
    /// The register.
    type Register: Copy;
}

impl Register for f64 {
    type Register = __m512d;
}

/// Parts of 128 bits of four registers, transposed.
///
/// # Safety
/// The machine has AVX-512 F, as for the two that follow.
#[inline(always)]
unsafe fn transposed_parts([a, b, c, d]: [__m512d; 4]) -> [__m512d; 4] {
    // SAFETY: the caller's contract.
    unsafe {
        let (ab, cd) = (_mm512_shuffle_f64x2::<0x44>(a, b), _mm512_shuffle_f64x2::<0x44>(c, d));
        let (ab_high, cd_high) = (_mm512_shuffle_f64x2::<0xee>(a, b), _mm512_shuffle_f64x2::<0xee>(c, d));
        [
            _mm512_shuffle_f64x2::<0x88>(ab, cd),
            _mm512_shuffle_f64x2::<0xdd>(ab, cd),
            _mm512_shuffle_f64x2::<0x88>(ab_high, cd_high),
            _mm512_shuffle_f64x2::<0xdd>(ab_high, cd_high),
        ]
    }
}

/// Eight registers of eight numbers, transposed.
#[inline(always)]
unsafe fn transposed_pd(rows: [__m512d; 8]) -> [__m512d; 8] {
    // SAFETY: the caller's contract.
    unsafe {
        let (mut even, mut odd) = ([rows[0]; 4], [rows[0]; 4]);
        for a in 0..4 {
            even[a] = _mm512_unpacklo_pd(rows[2 * a], rows[2 * a + 1]);
            odd[a] = _mm512_unpackhi_pd(rows[2 * a], rows[2 * a + 1]);
        }
        let ([a, c, e, g], [b, d, f, h]) = (transposed_parts(even), transposed_parts(odd));
        [a, b, c, d, e, f, g, h]
    }
}

macro_rules! avx512 {
    ($real:ty, $n:literal, $mask:ty, $set:ident, $load:ident, $store:ident, $add:ident, $sub:ident,
     $mul:ident, $div:ident, $sqrt:ident, $fmadd:ident, $fnmadd:ident, $cmp:ident, $mov:ident, $maskz_sub:ident, $maskz_mul:ident, $rsqrt:ident, $series:expr, $transposed:ident, $storeu:ident) => {
        // SAFETY of all functions: the caller has AVX-512 F, DQ, BW and VL and aligned valid pointers, by the trait's
        // contract; that is all the intrinsics need.
        impl Lanes for Avx512<$real> {
            type T = $real;
            type Mask = $mask;
            const N: usize = $n;

            #[inline(always)]
            unsafe fn run(kernel: impl Kernel) {
                #[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl,avx2,fma")]
                #[inline(never)]
                unsafe fn alone(kernel: impl Kernel) {
                    unsafe { kernel.run() }
                }
                unsafe { alone(kernel) }
            }
            #[inline(always)]
            unsafe fn natural_order(block: &[$real], natural: &mut [$real]) {
                let length = block.len() / $n;
                for j in (0..length).step_by($n) {
                    // Vectors beyond the block are not read; what stands for them is not written.
                    let mut vectors = [unsafe { $set(0.0) }; $n];
                    for (vector, from) in vectors.iter_mut().zip(block[j * $n..].chunks_exact($n)) {
                        *vector = unsafe { $load(from.as_ptr()) };
                    }
                    let lanes = unsafe { $transposed(vectors) };
                    let count = $n.min(length - j);
                    for (lane, vector) in lanes.into_iter().enumerate() {
                        let Some(to) = natural.get_mut(lane * length + j..) else { break };
                        if to.len() >= $n && count == $n {
                            unsafe { $storeu(to.as_mut_ptr(), vector) };
                        } else {
                            let mut part = [0.0; $n];
                            unsafe { $storeu(part.as_mut_ptr(), vector) };
                            to.iter_mut().zip(&part[..count]).for_each(|(to, &from)| *to = from);
                        }
                    }
                }
            }
            #[inline(always)]
            unsafe fn splat(x: $real) -> Self {
                Avx512(unsafe { $set(x) })
            }
            #[inline(always)]
            unsafe fn load(from: *const $real) -> Self {
                Avx512(unsafe { $load(from) })
            }
            #[inline(always)]
            unsafe fn store(self, to: *mut $real) {
                unsafe { $store(to, self.0) }
            }
            #[inline(always)]
            unsafe fn add(self, b: Self) -> Self {
                Avx512(unsafe { $add(self.0, b.0) })
            }
            #[inline(always)]
            unsafe fn sub(self, b: Self) -> Self {
                Avx512(unsafe { $sub(self.0, b.0) })
            }
            #[inline(always)]
            unsafe fn mul(self, b: Self) -> Self {
                Avx512(unsafe { $mul(self.0, b.0) })
            }
            #[inline(always)]
            unsafe fn div(self, b: Self) -> Self {
                Avx512(unsafe { $div(self.0, b.0) })
            }
            #[inline(always)]
            unsafe fn sqrt(self) -> Self {
                Avx512(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            unsafe fn mul_add(self, b: Self, c: Self) -> Self {
                Avx512(unsafe { $fmadd(self.0, b.0, c.0) })
            }
            #[inline(always)]
            unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self {
                Avx512(unsafe { $fnmadd(self.0, b.0, c.0) })
            }
            #[inline(always)]
            unsafe fn above(self, b: Self) -> Self::Mask {
                unsafe { $cmp::<_CMP_GT_OQ>(self.0, b.0) }
            }
            // √x = x y with y = 1/√x from an estimate y₀ good to 14 bits and, with e = 1 − x y₀², the series
            // y = y₀ (1 + e/2 + 3e²/8 + 5e³/16 …): the divider, slower than all this, is left to the division that follows.
            #[inline(always)]
            unsafe fn roots<const C: usize>(x: [Self; C]) -> [Self; C] {
                unsafe {
                    let series: &[$real] = &$series;
                    let (mut root, mut e, mut sum) = (x, x, x);
                    for c in 0..C {
                        e[c].0 = $rsqrt(x[c].0);
                    }
                    for c in 0..C {
                        root[c].0 = $mul(x[c].0, e[c].0);
                    }
                    for c in 0..C {
                        e[c].0 = $fnmadd(root[c].0, e[c].0, $set(1.0));
                        sum[c].0 = $set(series[0]);
                    }
                    for &term in &series[1..] {
                        for c in 0..C {
                            sum[c].0 = $fmadd(sum[c].0, e[c].0, $set(term));
                        }
                    }
                    for c in 0..C {
                        e[c].0 = $mul(root[c].0, e[c].0);
                    }
                    for c in 0..C {
                        root[c].0 = $fmadd(e[c].0, sum[c].0, root[c].0);
                    }
                    root
                }
            }
            #[inline(always)]
            unsafe fn sub_where(self, b: Self, mask: Self::Mask) -> Self {
                Avx512(unsafe { $maskz_sub(mask, self.0, b.0) })
            }
            #[inline(always)]
            unsafe fn mul_where(self, b: Self, mask: Self::Mask) -> Self {
                Avx512(unsafe { $maskz_mul(mask, self.0, b.0) })
            }
            #[inline(always)]
            unsafe fn keep(self, mask: Self::Mask) -> Self {
                Avx512(unsafe { $mov(mask, self.0) })
            }
            #[inline(always)]
            unsafe fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask {
                a & b
            }
            #[inline(always)]
            unsafe fn either(a: Self::Mask, b: Self::Mask) -> Self::Mask {
                a | b
            }
            #[inline(always)]
            unsafe fn but_not(a: Self::Mask, b: Self::Mask) -> Self::Mask {
                a & !b
            }
            #[inline(always)]
            unsafe fn bits(mask: Self::Mask) -> u32 {
                u32::from(mask)
            }
            #[inline(always)]
            unsafe fn mask(bits: u32) -> Self::Mask {
                bits as $mask
            }
        }
    };
}

avx512!(
    f64,
    8,
    __mmask8,
    _mm512_set1_pd,
    _mm512_load_pd,
    _mm512_store_pd,
    _mm512_add_pd,
    _mm512_sub_pd,
    _mm512_mul_pd,
    _mm512_div_pd,
    _mm512_sqrt_pd,
    _mm512_fmadd_pd,
    _mm512_fnmadd_pd,
    _mm512_cmp_pd_mask,
    _mm512_maskz_mov_pd,
    _mm512_maskz_sub_pd,
    _mm512_maskz_mul_pd,
    _mm512_rsqrt14_pd,
    [5.0 / 16.0, 3.0 / 8.0, 0.5],
    transposed_pd,
    _mm512_storeu_pd
);
