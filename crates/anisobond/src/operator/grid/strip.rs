//! A strip of rows, the unit of work of a pass: bulk vectors by the kernels, then row by row in natural order, with the
//! special nodes.
//!
//! The order of loops is made for the caches: at a few positions, group by group of bonds, row by row. The neighbours of one
//! row are then mostly those of the row before, in the first cache; those of a strip those of the strip before, in the
//! second.

use std::ops::Range;

use super::ahead::Ahead;
use super::aligned::Aligned;
use super::build::GridBonds;
use super::kernels::{Coefficients, Energy, Linear, Output, Positions, RowView, Single, TOGETHER, bit_of};
use super::lanes::{InstructionSet, Lanes};
use super::padded::Padded;
use super::real::Real;
use super::sweep::Law;
use super::tables::{Tables, Wanted, paired};
use crate::operator::Kinematics;

/// A half bond p of a node that breaks.
pub type Event = (u32, u16);

/// A strip to be done.
pub struct Task<'a, T: Real> {
    /// The bonds.
    pub bonds: &'a GridBonds<T>,
    /// The displacements, in the layout of these bonds.
    pub u: &'a Padded<T>,
    /// How bonds respond.
    pub law: Law,
    /// Constants of this law.
    pub tables: &'a Tables<T>,
    /// The rows.
    pub rows: Range<usize>,
    /// What is wanted of them.
    pub wanted: Wanted,
}

/// Memory of one thread.
pub struct Scratch<T: Real> {
    /// Forces of a strip's slots, by row.
    block: Aligned<T>,
    /// Forces of a row in natural order.
    pub natural: [Vec<T>; 3],
    /// Offsets of neighbours of interior rows, which are all alike, and of each row of the strip that is not.
    offsets: Vec<Offsets>,
    /// Which of them each row has.
    offsets_of: Vec<usize>,
    /// Constants of the mixture and group that were last used, in vectors.
    mixed: Aligned<T>,
    mixed_of: (u32, usize),
    /// Bonds over their threshold.
    over: Vec<(u32, u32, u32)>,
}

/// Where neighbours of a row are, by half bond, from the row on: numbers at +ξ and −ξ, and words of bits at −ξ.
#[derive(Clone, Default)]
struct Offsets {
    plus: Vec<isize>,
    minus: Vec<isize>,
    minus_bits: Vec<isize>,
}

impl<T: Real> Scratch<T> {
    /// For strips of these bonds.
    pub fn new(bonds: &GridBonds<T>) -> Self {
        let (layout, half) = (&bonds.layout, bonds.half.len());
        let rows = layout.strips.iter().map(Range::len).max().unwrap_or(0);
        let mut offsets = vec![Offsets::default(); rows + 1];
        if let Some(row) = (0..layout.rows()).find(|&row| layout.interior(row)) {
            offsets[0].aim(bonds, row);
        }
        Scratch {
            block: Aligned::zeros(rows * 3 * layout.length * layout.lanes),
            natural: std::array::from_fn(|_| vec![T::default(); bonds.row_nodes()]),
            offsets,
            offsets_of: vec![0; rows],
            mixed: Aligned::zeros(4 * half * layout.lanes),
            mixed_of: (0, 0),
            over: Vec::new(),
        }
    }
}

impl Offsets {
    /// The offsets of a row.
    fn aim<T: Real>(&mut self, bonds: &GridBonds<T>, row: usize) {
        let (layout, half) = (&*bonds.layout, &bonds.half);
        let (slots, words) = (layout.slots as isize, bonds.words as isize);
        let rows: Vec<[isize; 2]> = half
            .rows
            .iter()
            .map(|&[dy, dz]| [[dy, dz], [-dy, -dz]].map(|o| layout.row_at(row, o) as isize - row as isize))
            .collect();
        self.plus.clear();
        self.minus.clear();
        self.minus_bits.clear();
        for p in 0..half.len() {
            let [plus, minus] = rows[half.row_of[p]];
            let along = half.offset[p][0] as isize * layout.lanes as isize;
            let (word, _) = bit_of::<T::Word>(half.full[p], half.bonds / 2);
            self.plus.push(plus * 3 * slots + along);
            self.minus.push(minus * 3 * slots - along);
            self.minus_bits.push((minus * words + word as isize) * slots - along);
        }
    }
}

impl<T: Real> Task<'_, T> {
    /// Ask for what is needed next: values of this strip's nodes, and of the plane that enters the reach with the next strip.
    pub fn ask_ahead<V>(&self, fields: [&[V]; 3], ahead: &mut Ahead) {
        let (layout, n2) = (&*self.bonds.layout, self.bonds.layout.nodes[1]);
        let times = layout.length.div_ceil(TOGETHER) * self.bonds.half.groups.len() * self.rows.len();
        ahead.clear();
        fields.into_iter().for_each(|field| ahead.add(field, times));
        let (y, z) = (self.rows.start % n2, self.rows.start / n2);
        let plane = (z + layout.reach[2] + 1) % layout.nodes[2];
        let row = 3 * layout.slots;
        let rows = plane * n2 + y.saturating_sub(layout.reach[1])
            ..plane * n2 + n2.min(y + self.rows.len() + layout.reach[1]);
        ahead.add(&self.u.values.slice()[rows.start * row..rows.end * row], times);
    }
}

/// Forces of a strip's bulk vectors in `scratch`, and the bonds that break. Called through [`Real`], so that the kernels are
/// compiled with this library and not where they are used.
#[inline(always)]
pub fn strip<T: Real>(task: &Task<T>, scratch: &mut Scratch<T>, ahead: &mut Ahead, events: &mut Vec<Event>) {
    match task.bonds.set {
        // SAFETY: the constructor refuses sets that the machine lacks; the layout is for its vectors.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => unsafe { strip_in::<T, T::Avx512>(task, scratch, ahead, events) },
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { strip_in::<T, T::Avx2>(task, scratch, ahead, events) },
        // SAFETY: portable vectors need nothing.
        _ => unsafe { strip_in::<T, T::Portable>(task, scratch, ahead, events) },
    }
}

/// A strip in vectors of one instruction set.
///
/// # Safety
/// The machine has the instruction set, and the layout is for its vectors.
unsafe fn strip_in<T: Real, L: Lanes<T = T>>(
    task: &Task<T>,
    scratch: &mut Scratch<T>,
    ahead: &mut Ahead,
    events: &mut Vec<Event>,
) {
    let (bonds, layout) = (task.bonds, &*task.bonds.layout);
    for (k, row) in task.rows.clone().enumerate() {
        scratch.offsets_of[k] = if layout.interior(row) { 0 } else { k + 1 };
        if !layout.interior(row) {
            scratch.offsets[k + 1].aim(bonds, row);
        }
    }
    for first in (0..layout.length).step_by(TOGETHER) {
        let end = layout.length.min(first + TOGETHER);
        for group in 0..bonds.half.groups.len() {
            for (k, row) in task.rows.clone().enumerate() {
                ahead.advance();
                let mixtures = &bonds.mixture[row * layout.length..(row + 1) * layout.length];
                let mut j = first;
                while j < end {
                    let mixture = mixtures[j];
                    let same = (j..end).find(|&e| mixtures[e] != mixture).unwrap_or(end);
                    if mixture > 0 {
                        // SAFETY: the caller's contract; the positions are in the row.
                        unsafe { positions::<T, L>(task, (k, row), group, mixture, j..same, scratch, events) };
                    }
                    j = same;
                }
            }
        }
    }
}

/// What a group of bonds adds to the forces of a few positions of a row, all of the same mixture of stencils.
///
/// # Safety
/// As [`strip_in`].
#[inline(always)]
unsafe fn positions<T: Real, L: Lanes<T = T>>(
    task: &Task<T>,
    (k, row): (usize, usize),
    group: usize,
    mixture: u32,
    wanted: Range<usize>,
    scratch: &mut Scratch<T>,
    events: &mut Vec<Event>,
) {
    let Task { bonds, u, law, tables, .. } = *task;
    let layout = &*bonds.layout;
    let uniform = bonds.mixtures[mixture as usize - 1].uniform();
    if uniform.is_none() {
        scratch.mix(bonds, tables, mixture, group);
    }
    let per_stencil = tables.per_bond * bonds.half.len();
    let own = match uniform {
        Some(s) => &tables.own[(usize::from(s) - 1) * per_stencil..][..per_stencil],
        None => &scratch.mixed.slice()[..per_stencil * layout.lanes],
    };
    let signed = uniform.is_some_and(|s| tables.signed[usize::from(s) - 1]);
    let coefficients = Coefficients { shared: &tables.shared, own };
    let centre = layout.reach[0] * layout.lanes;
    // SAFETY: the row is one of the body's.
    let (own_u, own_bits) = unsafe {
        let bits = bonds.bits.slice().as_ptr().add(row * bonds.words * layout.slots + centre);
        (u.values.slice().as_ptr().add(row * 3 * layout.slots + centre), bits)
    };
    let offsets = &scratch.offsets[scratch.offsets_of[k]];
    let view = RowView {
        u: own_u,
        bits: own_bits,
        slots: layout.slots,
        plus: &offsets.plus,
        minus: &offsets.minus,
        own_bits: &tables.own_bits,
        minus_bits: &offsets.minus_bits,
        bit: &tables.bit,
    };
    let whole = bonds.whole[row * layout.length..][wanted.clone()].iter().all(|&w| w);
    let length = layout.length;
    let block = &mut scratch.block.slice_mut()[k * 3 * length * layout.lanes..];
    let out = Output { to: block.as_mut_ptr(), length, wanted: wanted.clone(), first: group == 0 };
    // Pairs are taken together: where there are fewer positions, some before them too, whose results are dropped.
    let paired = paired(law, task.wanted);
    let starts = if paired { wanted.start.min(length - TOGETHER)..wanted.start.min(length - TOGETHER) + 1 } else { wanted };
    for j in starts {
        let group = &bonds.half.groups[group];
        let at =
            Positions { row: &view, group, coefficients: &coefficients, j, out: &out, over: &mut scratch.over };
        // SAFETY: the positions are in the row, whose offsets `aim` made for this layout.
        unsafe {
            match (task.wanted, law.kinematics, uniform.is_some()) {
                (Wanted::Energy, Kinematics::Linear, true) => L::run(Energy::<L, true, false>(at)),
                (Wanted::Energy, Kinematics::Linear, false) => L::run(Energy::<L, false, false>(at)),
                (Wanted::Energy, Kinematics::Finite, true) => L::run(Energy::<L, true, true>(at)),
                (Wanted::Energy, Kinematics::Finite, false) => L::run(Energy::<L, false, true>(at)),
                (Wanted::Forces, Kinematics::Linear, true) if law.breaking => L::run(Single::<L, true, true, false>(at)),
                (Wanted::Forces, Kinematics::Linear, false) if law.breaking => {
                    L::run(Single::<L, false, true, false>(at));
                }
                (Wanted::Forces, Kinematics::Linear, true) if !whole => L::run(Linear::<L, true, true, true>(at)),
                (Wanted::Forces, Kinematics::Linear, true) if signed => L::run(Linear::<L, true, false, true>(at)),
                (Wanted::Forces, Kinematics::Linear, true) => L::run(Linear::<L, true, false, false>(at)),
                (Wanted::Forces, Kinematics::Linear, false) => L::run(Linear::<L, false, true, true>(at)),
                (Wanted::Forces, Kinematics::Finite, true) if whole => L::run(Single::<L, true, false, true>(at)),
                (Wanted::Forces, Kinematics::Finite, true) => L::run(Single::<L, true, true, true>(at)),
                (Wanted::Forces, Kinematics::Finite, false) => L::run(Single::<L, false, true, true>(at)),
            }
        }
    }
    for (p, j, lanes) in scratch.over.drain(..) {
        bonds.record(row, j as usize, p as usize, lanes, events);
    }
}

impl<T: Real> Scratch<T> {
    /// Constants of a mixture's lanes as vectors.
    fn mix(&mut self, bonds: &GridBonds<T>, tables: &Tables<T>, mixture: u32, group: usize) {
        if self.mixed_of == (mixture, group) {
            return;
        }
        let lanes = bonds.layout.lanes;
        let per_stencil = tables.per_bond * bonds.half.len();
        let stencils = &bonds.mixtures[mixture as usize - 1].0[..lanes];
        let range = &bonds.half.groups[group].bonds;
        let places = tables.per_bond * range.start..tables.per_bond * range.end;
        let mixed = &mut self.mixed.slice_mut()[places.start * lanes..places.end * lanes];
        for (place, to) in places.zip(mixed.chunks_exact_mut(lanes)) {
            for (to, &s) in to.iter_mut().zip(stencils) {
                *to = tables.own[(usize::from(s) - 1) * per_stencil + place];
            }
        }
        self.mixed_of = (mixture, group);
    }
}

impl<T: Real> GridBonds<T> {
    /// Half bonds that break in a vector, among those that exist and whose nodes are bulk.
    #[cold]
    #[inline(never)]
    fn record(&self, row: usize, j: usize, p: usize, lanes: u32, events: &mut Vec<Event>) {
        let n = self.row_nodes();
        for e in (0..self.layout.lanes).filter(|l| lanes >> l & 1 == 1).map(|l| l * self.layout.length + j) {
            if e < n && self.own_bit(row, e, p) && !self.is_special(row * n + e) {
                events.push(((row * n + e) as u32, p as u16));
            }
        }
    }
}

/// Forces (or energies) of a row of a strip in natural order in `scratch.natural`, and the bonds of its special nodes that
/// break; [`strip`] has been at the strip. Called through [`Real`].
#[inline(always)]
pub fn natural<T: Real>(task: &Task<T>, scratch: &mut Scratch<T>, row: usize, events: &mut Vec<Event>) {
    match task.bonds.set {
        // SAFETY: the constructor refuses sets that the machine lacks.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => unsafe { natural_avx512(task, scratch, row, events) },
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { natural_avx2(task, scratch, row, events) },
        // SAFETY: portable vectors need nothing.
        _ => unsafe { natural_in::<T, T::Portable>(task, scratch, row, events) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl,avx2,fma")]
unsafe fn natural_avx512<T: Real>(task: &Task<T>, scratch: &mut Scratch<T>, row: usize, events: &mut Vec<Event>) {
    // SAFETY: the caller's machine has the instruction set.
    unsafe { natural_in::<T, T::Avx512>(task, scratch, row, events) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn natural_avx2<T: Real>(task: &Task<T>, scratch: &mut Scratch<T>, row: usize, events: &mut Vec<Event>) {
    // SAFETY: the caller's machine has the instruction set.
    unsafe { natural_in::<T, T::Avx2>(task, scratch, row, events) }
}

/// # Safety
/// The machine has the instruction set, and the layout is for its vectors.
#[inline(always)]
unsafe fn natural_in<T: Real, L: Lanes<T = T>>(
    task: &Task<T>,
    scratch: &mut Scratch<T>,
    row: usize,
    events: &mut Vec<Event>,
) {
    let (bonds, layout, n) = (task.bonds, &*task.bonds.layout, task.bonds.row_nodes());
    let size = layout.length * L::N;
    let block = &scratch.block.slice()[(row - task.rows.start) * 3 * size..][..3 * size];
    for (natural, block) in scratch.natural.iter_mut().zip(block.chunks_exact(size)) {
        // SAFETY: the caller's contract; a block is as long as it must be.
        unsafe { L::natural_order(block, natural) };
        if !bonds.full {
            for (f, &s) in natural.iter_mut().zip(&bonds.stencil[row * n..(row + 1) * n]) {
                if s == 0 {
                    *f = T::default();
                }
            }
        }
    }
    let range = bonds.special_from[row] as usize..bonds.special_from[row + 1] as usize;
    for &node in &bonds.special[range] {
        let e = node as usize % n;
        if task.wanted == Wanted::Energy {
            let of = |p| bonds.bond_energy(task.u, task.law.kinematics, node as usize, p);
            scratch.natural[0][e] = T::of((0..bonds.half.len()).map(of).sum());
            continue;
        }
        // SAFETY: the machine has the instruction set.
        let f = unsafe { bonds.special_force::<L>(task.u, task.law, row, e, events) };
        for (to, f) in scratch.natural.iter_mut().zip(f) {
            to[e] = f;
        }
    }
}
