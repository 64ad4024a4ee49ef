//! The kernels of bulk vectors: all lanes have whole stencils, though perhaps not the same, and every bond of a lane's
//! node goes to a node of the same stencil or to none.
//!
//! Neighbours at +ξ and −ξ are taken together; a few positions of a row share the loads of a bond's constants.

use std::ops::Range;

use super::ahead::ask;
use super::lanes::Lanes;
use super::law::{Constants, bonds};
use super::real::{Real, Word};
use super::stencil::Group;

/// Positions of a row that share the loads of a bond's constants, where bonds are taken in pairs, without and with bits: more
/// need more registers than there are. A part of a row is never shorter.
pub const TOGETHER: usize = 4;
pub const TOGETHER_MASKED: usize = 2;

/// What the kernels read of a row. Offsets count numbers (words) from position 0, lane 0 of the row's first component
/// (word); those of an interior row are the same for all interior rows.
pub struct RowView<'a, T: Real> {
    /// Displacements of the row, at position 0.
    pub u: *const T,
    /// Bits of half bonds of the row, at position 0.
    pub bits: *const T::Word,
    /// Slots of a row, the distance of components.
    pub slots: usize,
    /// Words of a position.
    pub words: usize,
    /// By half bond: nodes at +ξ.
    pub plus: &'a [isize],
    /// By half bond: nodes at −ξ.
    pub minus: &'a [isize],
    /// By half bond: the word of the nodes at −ξ.
    pub minus_bits: &'a [isize],
}

/// Constants of bonds as the kernels read them: of one stencil, or by lane.
pub struct Coefficients<'a, T: Real> {
    /// Constants that all stencils share, `shared` numbers per half bond.
    pub shared: &'a [T],
    /// Constants of the stencil: `own` numbers per half bond, or as many vectors.
    pub own: &'a [T],
}

/// A kernel at a few positions of a row, compiled as a function of its own, whose registers no other kernel shares.
pub trait Kernel {
    /// Do it.
    ///
    /// # Safety
    /// As [`Lanes`]; all offsets of the row are valid for the positions from j on that are taken together; so is the output.
    unsafe fn run(self);
}

/// Positions of a row from j on, their bonds and where results go.
pub struct Positions<'a, T: Real> {
    /// The row.
    pub row: &'a RowView<'a, T>,
    /// The bonds that are taken.
    pub group: &'a Group,
    /// Constants of bonds.
    pub coefficients: &'a Coefficients<'a, T>,
    /// First position.
    pub j: usize,
    /// Memory to be asked for meanwhile, a line per bond: see [`super::ahead::Ahead::take`].
    pub ahead: usize,
    /// Forces, or energies.
    pub out: &'a Output<T>,
    /// Bonds over their threshold: half bond p, position, lanes as bits.
    pub over: &'a mut Vec<(u32, u32, u32)>,
}

/// Where forces go: component a of position j is vector (a length + j) of `to`; only positions `wanted` are written.
pub struct Output<T> {
    /// The row's block of forces.
    pub to: *mut T,
    /// Positions of a row.
    pub length: usize,
    /// Positions that are written, of those that are taken together.
    pub wanted: Range<usize>,
    /// Whether nothing has been written yet, to which other bonds add.
    pub first: bool,
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
pub struct Linear<'a, L: Lanes, const UNIFORM: bool, const MASKED: bool, const SIGNED: bool>(pub Positions<'a, L::T>);

impl<L: Lanes, const UNIFORM: bool, const MASKED: bool, const SIGNED: bool> Kernel
    for Linear<'_, L, UNIFORM, MASKED, SIGNED>
{
    #[inline(always)]
    unsafe fn run(self) {
        // SAFETY: the caller's contract.
        unsafe {
            if MASKED {
                linear::<L, UNIFORM, MASKED, SIGNED, TOGETHER_MASKED>(&self.0);
            } else {
                linear::<L, UNIFORM, MASKED, SIGNED, TOGETHER>(&self.0);
            }
        }
    }
}

#[inline(always)]
unsafe fn linear<L: Lanes, const UNIFORM: bool, const MASKED: bool, const SIGNED: bool, const J: usize>(
    at: &Positions<L::T>,
) {
    // SAFETY: the caller's contract.
    unsafe {
        let mut centre = displacements::<L, J>(at.row, at.j);
        if !MASKED {
            for jj in 0..J {
                for a in 0..3 {
                    centre[jj][a] = centre[jj][a].add(centre[jj][a]);
                }
            }
        }
        let mut f = read::<L, J>(at.j, at.out);
        for (pattern, range) in &at.group.patterns {
            let r = range.clone();
            match pattern {
                1 => part::<L, UNIFORM, MASKED, SIGNED, J, true, false, false>(at, r, &centre, &mut f),
                2 => part::<L, UNIFORM, MASKED, SIGNED, J, false, true, false>(at, r, &centre, &mut f),
                3 => part::<L, UNIFORM, MASKED, SIGNED, J, true, true, false>(at, r, &centre, &mut f),
                4 => part::<L, UNIFORM, MASKED, SIGNED, J, false, false, true>(at, r, &centre, &mut f),
                5 => part::<L, UNIFORM, MASKED, SIGNED, J, true, false, true>(at, r, &centre, &mut f),
                6 => part::<L, UNIFORM, MASKED, SIGNED, J, false, true, true>(at, r, &centre, &mut f),
                _ => part::<L, UNIFORM, MASKED, SIGNED, J, true, true, true>(at, r, &centre, &mut f),
            }
        }
        write(&f, at.j, at.out);
    }
}

/// What bonds taken before have left at J positions from j on.
#[inline(always)]
unsafe fn read<L: Lanes, const J: usize>(j: usize, out: &Output<L::T>) -> [[L; 3]; J] {
    // SAFETY: the caller's contract: the block has room for these positions.
    unsafe {
        let mut f = [[L::splat(L::T::default()); 3]; J];
        if !out.first {
            for jj in 0..J {
                for a in 0..3 {
                    f[jj][a] = L::load(out.to.add((a * out.length + j + jj) * L::N));
                }
            }
        }
        f
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
    const J: usize,
    const X: bool,
    const Y: bool,
    const Z: bool,
>(
    at: &Positions<L::T>,
    range: Range<usize>,
    centre: &[[L; 3]; J],
    f: &mut [[L; 3]; J],
) {
    let used = [X, Y, Z];
    let Positions { row, coefficients, j, ahead, .. } = *at;
    let begin = at.group.bonds.start;
    // SAFETY: the caller's contract.
    unsafe {
        let zero = L::splat(L::T::default());
        let u = row.u.add(j * L::N);
        for p in range {
            ask(ahead, p - begin);
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
            for jj in 0..J {
                let at = jj * L::N;
                let (mut here, mut there) = (None, None);
                if MASKED {
                    here = Some(own_bits::<L>(row, j + jj, p));
                    there = Some(minus_bits::<L>(row, j + jj, p));
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

/// Forces of position j with every bond on its own, because it may break or turns: linear or finite. If any half bonds,
/// from the node on, break now, they are listed.
///
/// `coefficients.shared` holds n or ξ, and 1/|ξ|²; `own` holds the stiffness and the threshold.
pub struct Single<'a, L: Lanes, const UNIFORM: bool, const MASKED: bool, const FINITE: bool>(pub Positions<'a, L::T>);

impl<L: Lanes, const UNIFORM: bool, const MASKED: bool, const FINITE: bool> Kernel
    for Single<'_, L, UNIFORM, MASKED, FINITE>
{
    #[inline(always)]
    unsafe fn run(self) {
        let Positions { row, group, coefficients, j, ahead, out, over } = self.0;
        // SAFETY: the caller's contract.
        unsafe {
            let [u] = displacements::<L, 1>(row, j);
            let [mut f] = read::<L, 1>(j, out);
            let mut any = L::mask(0);
            for p in group.bonds.clone() {
                ask(ahead, p - group.bonds.start);
                let plus = row.u.offset(*row.plus.get_unchecked(p)).add(j * L::N);
                let minus = row.u.offset(*row.minus.get_unchecked(p)).add(j * L::N);
                let constants = constants::<L, UNIFORM>(coefficients, p);
                let threshold = number::<L, UNIFORM>(coefficients.own, 2 * p + 1);
                // The bond at −ξ is seen from its other end: the same numbers there and here.
                let (mut there, mut here) = (u, u);
                for a in 0..3 {
                    there[a] = L::load(plus.add(a * row.slots)).sub(u[a]);
                    here[a] = u[a].sub(L::load(minus.add(a * row.slots)));
                }
                let (mut own, mut other) = (L::mask(u32::MAX), L::mask(u32::MAX));
                if MASKED {
                    own = own_bits::<L>(row, j, p);
                    other = minus_bits::<L>(row, j, p);
                }
                let [ahead, behind] = bonds::<L, FINITE, 2>(&[there, here], &constants);
                let (measure, to, factor) = ahead;
                let breaks = L::both(own, measure.above(threshold));
                any = L::either(any, breaks);
                let pull = constants.stiffness.mul_where(factor, L::but_not(own, breaks));
                for a in 0..3 {
                    f[a] = pull.mul_add(to[a], f[a]);
                }
                let (measure, to, factor) = behind;
                let pull = constants.stiffness.mul_where(factor, L::but_not(other, measure.above(threshold)));
                for a in 0..3 {
                    f[a] = pull.neg_mul_add(to[a], f[a]);
                }
            }
            write(&[f], j, out);
            if L::bits(any) != 0 {
                list::<L, UNIFORM, FINITE>(row, group, coefficients, j, over);
            }
        }
    }
}

/// List the half bonds that break at position j, of nodes from which they are unbroken.
#[inline(always)]
unsafe fn list<L: Lanes, const UNIFORM: bool, const FINITE: bool>(
    row: &RowView<L::T>,
    group: &Group,
    coefficients: &Coefficients<L::T>,
    j: usize,
    over: &mut Vec<(u32, u32, u32)>,
) {
    // SAFETY: the caller's contract.
    unsafe {
        let [u] = displacements::<L, 1>(row, j);
        for p in group.bonds.clone() {
            let (eta, constants) = (ahead::<L>(row, &u, j, p), constants::<L, UNIFORM>(coefficients, p));
            let [(measure, ..)] = bonds::<L, FINITE, 1>(&[eta], &constants);
            let above = measure.above(number::<L, UNIFORM>(coefficients.own, 2 * p + 1));
            let lanes = L::bits(L::both(own_bits::<L>(row, j, p), above));
            if lanes != 0 {
                over.push((p as u32, j as u32, lanes));
            }
        }
    }
}

/// Displacements at +ξ of half bond p, relative to those of position j.
#[inline(always)]
unsafe fn ahead<L: Lanes>(row: &RowView<L::T>, u: &[L; 3], j: usize, p: usize) -> [L; 3] {
    // SAFETY: the caller's contract.
    unsafe {
        let plus = row.u.offset(*row.plus.get_unchecked(p)).add(j * L::N);
        let mut eta = *u;
        for a in 0..3 {
            eta[a] = L::load(plus.add(a * row.slots)).sub(u[a]);
        }
        eta
    }
}

/// Where half bond p of the nodes at position j is unbroken.
#[inline(always)]
pub unsafe fn own_bits<L: Lanes>(row: &RowView<L::T>, j: usize, p: usize) -> L::Mask {
    // SAFETY: the caller's contract.
    unsafe { L::mask((*row.bits.add(j * row.words + p)).bits()) }
}

/// Where the bonds at −ξ, half bonds p of the nodes there, are unbroken.
#[inline(always)]
pub unsafe fn minus_bits<L: Lanes>(row: &RowView<L::T>, j: usize, p: usize) -> L::Mask {
    // SAFETY: the caller's contract.
    unsafe { L::mask((*row.bits.offset(*row.minus_bits.get_unchecked(p)).add(j * row.words)).bits()) }
}

/// Constants of half bond p.
#[inline(always)]
unsafe fn constants<L: Lanes, const UNIFORM: bool>(from: &Coefficients<L::T>, p: usize) -> Constants<L> {
    // SAFETY: the caller's contract.
    unsafe {
        Constants {
            branch: [
                number::<L, true>(from.shared, 4 * p),
                number::<L, true>(from.shared, 4 * p + 1),
                number::<L, true>(from.shared, 4 * p + 2),
            ],
            per_square: number::<L, true>(from.shared, 4 * p + 3),
            stiffness: number::<L, UNIFORM>(from.own, 2 * p),
        }
    }
}

/// Energies of the half bonds from the nodes on, of one position: ½ k (n·η)², or ½ k |ξ|² s² with
/// s = √(1+q) − 1 = q/(1 + √(1+q)) and q = η·(2ξ+η)/|ξ|². Component 0 of the output.
///
/// `coefficients.shared` as of [`Single`]; `own` holds ½ k or ½ k/|ξ|², and nothing.
pub struct Energy<'a, L: Lanes, const UNIFORM: bool, const FINITE: bool>(pub Positions<'a, L::T>);

impl<L: Lanes, const UNIFORM: bool, const FINITE: bool> Kernel for Energy<'_, L, UNIFORM, FINITE> {
    #[inline(always)]
    unsafe fn run(self) {
        let Positions { row, group, coefficients, j, out, .. } = self.0;
        // SAFETY: the caller's contract.
        unsafe {
            let [u] = displacements::<L, 1>(row, j);
            let [mut sum] = read::<L, 1>(j, out);
            let one = L::splat(L::T::of(1.0));
            for p in group.bonds.clone() {
                let (eta, constants) = (ahead::<L>(row, &u, j, p), constants::<L, UNIFORM>(coefficients, p));
                let [(mut measure, ..)] = bonds::<L, FINITE, 1>(&[eta], &constants);
                if FINITE {
                    let [root] = L::roots([measure.mul_add(constants.per_square, one)]);
                    measure = measure.div(one.add(root));
                }
                let energy = constants.stiffness.mul_where(measure.mul(measure), own_bits::<L>(row, j, p));
                sum[0] = sum[0].add(energy);
            }
            write(&[sum], j, out);
        }
    }
}
