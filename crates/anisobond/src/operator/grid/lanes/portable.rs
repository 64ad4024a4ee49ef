//! Arrays, which every compiler turns into the vectors it knows.

use super::{Kernel, Lanes};

/// N numbers; no fused multiply-add, because without an instruction for it that is a slow function call.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub struct Portable<T, const N: usize>([T; N]);

macro_rules! portable {
    ($real:ty, $n:literal) => {
        // SAFETY of all functions: plain arithmetic; pointers are valid by the trait's contract.
        impl Lanes for Portable<$real, $n> {
            type T = $real;
            type Mask = [bool; $n];
            const N: usize = $n;

            #[inline(always)]
            unsafe fn run(kernel: impl Kernel) {
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
                Portable([x; $n])
            }
            #[inline(always)]
            unsafe fn load(from: *const $real) -> Self {
                // SAFETY: valid for N numbers by the trait's contract.
                Portable(unsafe { from.cast::<[$real; $n]>().read() })
            }
            #[inline(always)]
            unsafe fn store(self, to: *mut $real) {
                // SAFETY: valid for N numbers by the trait's contract.
                unsafe { to.cast::<[$real; $n]>().write(self.0) }
            }
            #[inline(always)]
            unsafe fn add(self, b: Self) -> Self {
                Portable(std::array::from_fn(|l| self.0[l] + b.0[l]))
            }
            #[inline(always)]
            unsafe fn sub(self, b: Self) -> Self {
                Portable(std::array::from_fn(|l| self.0[l] - b.0[l]))
            }
            #[inline(always)]
            unsafe fn mul(self, b: Self) -> Self {
                Portable(std::array::from_fn(|l| self.0[l] * b.0[l]))
            }
            #[inline(always)]
            unsafe fn div(self, b: Self) -> Self {
                Portable(std::array::from_fn(|l| self.0[l] / b.0[l]))
            }
            #[inline(always)]
            unsafe fn sqrt(self) -> Self {
                Portable(self.0.map(<$real>::sqrt))
            }
            #[inline(always)]
            unsafe fn mul_add(self, b: Self, c: Self) -> Self {
                Portable(std::array::from_fn(|l| self.0[l] * b.0[l] + c.0[l]))
            }
            #[inline(always)]
            unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self {
                Portable(std::array::from_fn(|l| c.0[l] - self.0[l] * b.0[l]))
            }
            #[inline(always)]
            unsafe fn above(self, b: Self) -> Self::Mask {
                std::array::from_fn(|l| self.0[l] > b.0[l])
            }
            #[inline(always)]
            unsafe fn keep(self, mask: Self::Mask) -> Self {
                Portable(std::array::from_fn(|l| if mask[l] { self.0[l] } else { 0.0 }))
            }
            #[inline(always)]
            unsafe fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask {
                std::array::from_fn(|l| a[l] & b[l])
            }
            #[inline(always)]
            unsafe fn either(a: Self::Mask, b: Self::Mask) -> Self::Mask {
                std::array::from_fn(|l| a[l] | b[l])
            }
            #[inline(always)]
            unsafe fn but_not(a: Self::Mask, b: Self::Mask) -> Self::Mask {
                std::array::from_fn(|l| a[l] & !b[l])
            }
            #[inline(always)]
            unsafe fn bits(mask: Self::Mask) -> u32 {
                (0..$n).fold(0, |bits, l| bits | u32::from(mask[l]) << l)
            }
            #[inline(always)]
            unsafe fn mask(bits: u32) -> Self::Mask {
                std::array::from_fn(|l| bits >> l & 1 == 1)
            }
        }
    };
}

portable!(f64, 4);
