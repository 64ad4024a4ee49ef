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
            let mut largest = to[0];
            for &i in to {
                largest = largest.max(i);
            }
            assert!((largest as usize) < poses.len(), "a bond leads to a particle that is not there");
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
    // Macros, not closures: those are inlined or not as the compiler likes, and ten times slower where they are not.
    macro_rules! line {
        // SAFETY: a pose is 64 aligned bytes, and the caller's numbers are within.
        ($l:literal) => {
            unsafe { _mm512_load_pd(poses.add(to[$l] as usize).cast()) }
        };
    }
    macro_rules! numbers {
        // SAFETY: eight numbers either way.
        ($v:expr) => {
            unsafe { std::mem::transmute::<__m512d, [f64; LANES]>($v) }
        };
    }
    macro_rules! quarters {
        ($which:literal, $a:expr, $b:expr) => {
            _mm512_shuffle_f64x2::<$which>($a, $b)
        };
    }
    let (a, b, c, d) = (line!(0), line!(1), line!(2), line!(3));
    let (e, f, g, h) = (line!(4), line!(5), line!(6), line!(7));
    // Columns 0 2 4 6 and 1 3 5 7 of each pair of lines.
    let (ab, cd) = (_mm512_unpacklo_pd(a, b), _mm512_unpacklo_pd(c, d));
    let (ef, gh) = (_mm512_unpacklo_pd(e, f), _mm512_unpacklo_pd(g, h));
    let (ab1, cd1) = (_mm512_unpackhi_pd(a, b), _mm512_unpackhi_pd(c, d));
    let (ef1, gh1) = (_mm512_unpackhi_pd(e, f), _mm512_unpackhi_pd(g, h));
    // Columns c and c + 4 come from the quarters 0 and 2 of each, columns c + 2 and c + 6 from 1 and 3.
    let (c04, c04_) = (quarters!(0x88, ab, cd), quarters!(0x88, ef, gh));
    let (c26, c26_) = (quarters!(0xdd, ab, cd), quarters!(0xdd, ef, gh));
    let (c15, c15_) = (quarters!(0x88, ab1, cd1), quarters!(0x88, ef1, gh1));
    let (c37, c37_) = (quarters!(0xdd, ab1, cd1), quarters!(0xdd, ef1, gh1));
    Others {
        displacement: [
            numbers!(quarters!(0x88, c04, c04_)),
            numbers!(quarters!(0x88, c15, c15_)),
            numbers!(quarters!(0x88, c26, c26_)),
        ],
        turn: [
            numbers!(quarters!(0xdd, c04, c04_)),
            numbers!(quarters!(0xdd, c15, c15_)),
            numbers!(quarters!(0xdd, c26, c26_)),
            numbers!(quarters!(0xdd, c37, c37_)),
        ],
    }
}
