//! The kernels of bulk vectors: all lanes have whole stencils, though perhaps not the same, and every bond of a lane's
//! node goes to a node of the same stencil or to none.
//!
//! Neighbours at +ξ and −ξ are taken together; a few positions of a row share the loads of a bond's constants.

use super::lanes::Lanes;
use super::law::{Constants, bond};
use super::real::{Real, Word};
use super::sweep::{TOGETHER, TOGETHER_SINGLE};

/// What the kernels read of a row. Offsets count numbers (words) from position 0, lane 0 of the row's first component
/// (word); those of an interior row are the same for all interior rows.
pub struct RowView<'a, T: Real> {
    /// Displacements of the row, at position 0.
    pub u: *const T,
    /// Bits of half bonds of the row, at position 0.
    pub bits: *const T::Word,
    /// Slots of a row, the distance of components and of words.
    pub slots: usize,
    /// By half bond: nodes at +ξ.
    pub plus: &'a [isize],
    /// By half bond: nodes at −ξ.
    pub minus: &'a [isize],
    /// By half bond: the word of the node's own bit.
    pub own_bits: &'a [isize],
    /// By half bond: the word of the bit of the node at −ξ.
    pub minus_bits: &'a [isize],
    /// By half bond: the bit in both.
    pub bit: &'a [T::Word],
    /// Ranges of half bonds by pattern of components.
    pub patterns: &'a [(u8, std::ops::Range<usize>)],
}

/// Constants of bonds as the kernels read them: of one stencil, or by lane.
pub struct Coefficients<'a, T: Real> {
    /// Constants that all stencils share, `shared` numbers per half bond.
    pub shared: &'a [T],
    /// Constants of the stencil: `own` numbers per half bond, or as many vectors.
    pub own: &'a [T],
}

/// Where forces go: component a of position j is vector (a length + j) of `to`; only positions `wanted` are written.
pub struct Output<T> {
    /// The row's block of forces.
    pub to: *mut T,
    /// Positions of a row.
    pub length: usize,
    /// Positions that are written, of those that are taken together.
    pub wanted: std::ops::Range<usize>,
}

/// The displacements of J positions of a row from j on. No closures here nor elsewhere in the kernels: they would not be
/// compiled for the instruction set.
#[inline(always)]
unsafe fn displacements<L: Lanes, const J: usize>(row: &RowView<L::T>, j: usize) -> [[L; 3]; J] {
    // SAFETY: the caller's contract: the row has positions j … j + J − 1, all slots of which exist.
    unsafe {
        let mut u = [[L::splat(L::T::default()); 3]; J];
        for jj in 0..J {
            for a in 0..3 {
                u[jj][a] = L::load(row.u.add(a * row.slots + (j + jj) * L::N));
            }
        }
        u
    }
}

/// A number for all lanes, or a vector.
#[inline(always)]
unsafe fn number<L: Lanes, const UNIFORM: bool>(from: &[L::T], place: usize) -> L {
    // SAFETY: the caller's contract: `from` holds that number, or vectors up to that one, aligned.
    unsafe {
        match UNIFORM {
            true => L::splat(*from.get_unchecked(place)),
            false => L::load(from.as_ptr().add(place * L::N)),
        }
    }
}

/// Linear forces f = Σ k n (n·(u₊ + u₋ − 2u)) of some positions from j on. With bits, absent and broken bonds are left
/// out: f = Σ k n (n·(b₊(u₊ − u) + b₋(u₋ − u))).
///
/// `coefficients.own` holds √|k| n, and the sign of k, which is not read unless SIGNED.
///
/// # Safety
/// As [`Lanes`]; all offsets of the row are valid, for positions up to j + TOGETHER − 1; so is the output.
#[inline(always)]
pub unsafe fn linear<L: Lanes, const UNIFORM: bool, const MASKED: bool, const SIGNED: bool>(
    row: &RowView<L::T>,
    coefficients: &Coefficients<L::T>,
    j: usize,
    out: &Output<L::T>,
) {
    // SAFETY: the caller's contract.
    unsafe {
        let mut centre = displacements::<L, TOGETHER>(row, j);
        if !MASKED {
            for jj in 0..TOGETHER {
                for a in 0..3 {
                    centre[jj][a] = centre[jj][a].add(centre[jj][a]);
                }
            }
        }
        let mut f = [[L::splat(L::T::default()); 3]; TOGETHER];
        for (pattern, range) in row.patterns {
            let (r, c) = (range.clone(), coefficients);
            match pattern {
                1 => part::<L, UNIFORM, MASKED, SIGNED, true, false, false>(row, c, r, j, &centre, &mut f),
                2 => part::<L, UNIFORM, MASKED, SIGNED, false, true, false>(row, c, r, j, &centre, &mut f),
                3 => part::<L, UNIFORM, MASKED, SIGNED, true, true, false>(row, c, r, j, &centre, &mut f),
                4 => part::<L, UNIFORM, MASKED, SIGNED, false, false, true>(row, c, r, j, &centre, &mut f),
                5 => part::<L, UNIFORM, MASKED, SIGNED, true, false, true>(row, c, r, j, &centre, &mut f),
                6 => part::<L, UNIFORM, MASKED, SIGNED, false, true, true>(row, c, r, j, &centre, &mut f),
                _ => part::<L, UNIFORM, MASKED, SIGNED, true, true, true>(row, c, r, j, &centre, &mut f),
            }
        }
        write(&f, j, out);
    }
}

/// Vectors to memory.
#[inline(always)]
unsafe fn write<L: Lanes, const J: usize>(f: &[[L; 3]; J], j: usize, out: &Output<L::T>) {
    for jj in 0..J {
        if j + jj >= out.wanted.start && j + jj < out.wanted.end {
            for a in 0..3 {
                // SAFETY: the caller's contract.
                unsafe { f[jj][a].store(out.to.add((a * out.length + j + jj) * L::N)) };
            }
        }
    }
}

/// The bonds of one pattern: components of n that are zero are not read.
#[inline(always)]
unsafe fn part<
    L: Lanes,
    const UNIFORM: bool,
    const MASKED: bool,
    const SIGNED: bool,
    const X: bool,
    const Y: bool,
    const Z: bool,
>(
    row: &RowView<L::T>,
    coefficients: &Coefficients<L::T>,
    range: std::ops::Range<usize>,
    j: usize,
    centre: &[[L; 3]; TOGETHER],
    f: &mut [[L; 3]; TOGETHER],
) {
    let used = [X, Y, Z];
    // SAFETY: the caller's contract.
    unsafe {
        let zero = L::splat(L::T::default());
        let u = row.u.add(j * L::N);
        let bits = row.bits.add(j * L::N);
        for p in range {
            let plus = u.offset(*row.plus.get_unchecked(p));
            let minus = u.offset(*row.minus.get_unchecked(p));
            let mut m = [zero; 3];
            for a in 0..3 {
                if used[a] {
                    m[a] = number::<L, UNIFORM>(coefficients.own, 4 * p + a);
                }
            }
            let mut sign = zero;
            if SIGNED {
                sign = number::<L, UNIFORM>(coefficients.own, 4 * p + 3);
            }
            for jj in 0..TOGETHER {
                let at = jj * L::N;
                let (mut here, mut there) = (None, None);
                if MASKED {
                    let bit = L::splat_word(*row.bit.get_unchecked(p));
                    here = Some(L::common(L::words(bits.offset(*row.own_bits.get_unchecked(p)).add(at)), bit));
                    there = Some(L::common(L::words(bits.offset(*row.minus_bits.get_unchecked(p)).add(at)), bit));
                }
                // −√|k| n·(u₊ + u₋ − 2u): the differences are formed before anything is summed, so that a rigid
                // translation costs nothing exactly.
                let mut stretch: Option<L> = None;
                for a in 0..3 {
                    if used[a] {
                        let (up, um) = (L::load(plus.add(a * row.slots + at)), L::load(minus.add(a * row.slots + at)));
                        let r = match (here, there) {
                            (Some(here), Some(there)) => {
                                centre[jj][a].sub_where(up, here).add(centre[jj][a].sub_where(um, there))
                            }
                            _ => centre[jj][a].sub(up).sub(um),
                        };
                        stretch = Some(match stretch {
                            None => m[a].mul(r),
                            Some(sum) => m[a].mul_add(r, sum),
                        });
                    }
                }
                if let Some(mut stretch) = stretch {
                    if SIGNED {
                        stretch = stretch.mul(sign);
                    }
                    for a in 0..3 {
                        if used[a] {
                            f[jj][a] = m[a].neg_mul_add(stretch, f[jj][a]);
                        }
                    }
                }
            }
        }
    }
}

/// Forces of some positions from j on with every bond on its own, because it may break or turns: linear or finite.
/// `broken(p, jj, lanes)` is told the half bonds p, from the node on, that break now, as bits of lanes.
///
/// `coefficients.shared` holds n or ξ, and 1/|ξ|²; `own` holds k and the threshold.
///
/// # Safety
/// As [`linear`].
#[inline(always)]
pub unsafe fn single<L: Lanes, const UNIFORM: bool, const MASKED: bool, const FINITE: bool>(
    row: &RowView<L::T>,
    coefficients: &Coefficients<L::T>,
    j: usize,
    out: &Output<L::T>,
    mut broken: impl FnMut(usize, usize, u32),
) {
    // SAFETY: the caller's contract.
    unsafe {
        let u = displacements::<L, TOGETHER_SINGLE>(row, j);
        let mut f = [[L::splat(L::T::default()); 3]; TOGETHER_SINGLE];
        for p in 0..row.plus.len() {
            let plus = row.u.offset(*row.plus.get_unchecked(p)).add(j * L::N);
            let minus = row.u.offset(*row.minus.get_unchecked(p)).add(j * L::N);
            let constants = Constants {
                branch: [
                    number::<L, true>(coefficients.shared, 4 * p),
                    number::<L, true>(coefficients.shared, 4 * p + 1),
                    number::<L, true>(coefficients.shared, 4 * p + 2),
                ],
                per_square: number::<L, true>(coefficients.shared, 4 * p + 3),
                stiffness: number::<L, UNIFORM>(coefficients.own, 2 * p),
            };
            let threshold = number::<L, UNIFORM>(coefficients.own, 2 * p + 1);
            for jj in 0..TOGETHER_SINGLE {
                let at = jj * L::N;
                // The bond at −ξ is seen from its other end: the same numbers there and here.
                let (mut there, mut here) = (u[jj], u[jj]);
                for a in 0..3 {
                    there[a] = L::load(plus.add(a * row.slots + at)).sub(u[jj][a]);
                    here[a] = u[jj][a].sub(L::load(minus.add(a * row.slots + at)));
                }
                let (measure_plus, to_plus, mut pull_plus) = bond::<L, FINITE>(&there, &constants);
                let (measure_minus, to_minus, mut pull_minus) = bond::<L, FINITE>(&here, &constants);
                if MASKED {
                    let bit = L::splat_word(*row.bit.get_unchecked(p));
                    let bits = row.bits.add(j * L::N + at);
                    let own = L::words(bits.offset(*row.own_bits.get_unchecked(p)));
                    let other = L::words(bits.offset(*row.minus_bits.get_unchecked(p)));
                    pull_plus = pull_plus.keep(L::common(own, bit));
                    pull_minus = pull_minus.keep(L::common(other, bit));
                }
                let (over_plus, over_minus) = (measure_plus.above(threshold), measure_minus.above(threshold));
                if L::bits(over_plus) | L::bits(over_minus) != 0 {
                    // Broken before or absent: without force already, and the bits say so to whoever keeps count.
                    pull_plus = pull_plus.keep(L::but_not(L::mask(u32::MAX), over_plus));
                    pull_minus = pull_minus.keep(L::but_not(L::mask(u32::MAX), over_minus));
                    broken(p, jj, L::bits(over_plus));
                }
                for a in 0..3 {
                    f[jj][a] = pull_plus.mul_add(to_plus[a], f[jj][a]);
                    f[jj][a] = pull_minus.neg_mul_add(to_minus[a], f[jj][a]);
                }
            }
        }
        write(&f, j, out);
    }
}

/// Bits set in a word of bits by half bond p.
pub fn bit_of<W: Word>(full: usize, half: usize) -> (usize, W) {
    let place = full - half;
    (place / W::BITS, W::bit(place % W::BITS))
}
