//! The poses of eight bonds' other ends, number by number.

use super::pose::Pose;
use super::rows::LANES;
use crate::operator::grid::lanes::Lanes;

/// Eight poses, each number of all eight together.
#[repr(C, align(64))]
pub(super) struct Others {
    pub displacement: [[f64; LANES]; 3],
    pub turn: [[f64; LANES]; 4],
}

impl Others {
    /// The poses of these numbers.
    ///
    /// # Safety
    /// The instruction set of L.
    #[inline(always)]
    pub(super) unsafe fn gather<L: Lanes<T = f64>>(poses: &[Pose], to: &[u32; LANES]) -> Others {
        #[cfg(target_arch = "x86_64")]
        if L::N == LANES {
            // One comparison for all eight.
            assert!(to.iter().all(|&i| (i as usize) < poses.len()), "a bond leads to a particle that is not there");
            // SAFETY: numbers are within the poses; vectors of eight f64 are those of AVX-512.
            return unsafe { turned_lines(poses.as_ptr(), to) };
        }
        let mut others = Others { displacement: [[0.0; LANES]; 3], turn: [[0.0; LANES]; 4] };
        for l in 0..LANES {
            let other = &poses[to[l] as usize];
            for i in 0..3 {
                others.displacement[i][l] = other.displacement[i];
            }
            for i in 0..4 {
                others.turn[i][l] = other.turn[i];
            }
        }
        others
    }
}

/// Eight cache lines, turned like a matrix in registers: their numbers 0, 1, 2 and 4 … 7.
///
/// # Safety
/// AVX-512 F; all numbers are those of poses.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
#[inline]
unsafe fn turned_lines(poses: *const Pose, to: &[u32; LANES]) -> Others {
    use std::arch::x86_64::*;
    // SAFETY: a pose is 64 aligned bytes, and the caller's numbers are within.
    let line = |l: usize| unsafe { _mm512_load_pd(poses.add(to[l] as usize).cast()) };
    let pairs = [(line(0), line(1)), (line(2), line(3)), (line(4), line(5)), (line(6), line(7))];
    let even = pairs.map(|(a, b)| _mm512_unpacklo_pd(a, b));
    let odd = pairs.map(|(a, b)| _mm512_unpackhi_pd(a, b));
    // Columns c and c + 4 come from the quarters 0 and 2 of each, columns c + 2 and c + 6 from 1 and 3.
    let outer = |t: [__m512d; 4]| (_mm512_shuffle_f64x2::<0x88>(t[0], t[1]), _mm512_shuffle_f64x2::<0x88>(t[2], t[3]));
    let inner = |t: [__m512d; 4]| (_mm512_shuffle_f64x2::<0xdd>(t[0], t[1]), _mm512_shuffle_f64x2::<0xdd>(t[2], t[3]));
    let first = |(a, b): (__m512d, __m512d)| _mm512_shuffle_f64x2::<0x88>(a, b);
    let second = |(a, b): (__m512d, __m512d)| _mm512_shuffle_f64x2::<0xdd>(a, b);
    let (c04, c26, c15, c37) = (outer(even), inner(even), outer(odd), inner(odd));
    // SAFETY: eight numbers either way.
    let numbers = |v: __m512d| unsafe { std::mem::transmute::<__m512d, [f64; LANES]>(v) };
    Others {
        displacement: [first(c04), first(c15), first(c26)].map(numbers),
        turn: [second(c04), second(c15), second(c26), second(c37)].map(numbers),
    }
}
