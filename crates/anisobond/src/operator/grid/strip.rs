//! A strip of rows, the unit of work of a pass: bulk vectors by the kernels, then row by row in natural order, with the
//! special nodes.
//!
//! The order of loops is made for the caches: at a few positions, group by group of bonds, row by row. The neighbours of one
//! row are then mostly those of the row before, in the first cache; those of a strip those of the strip before, in the
//! second.

use std::ops::Range;

use super::ahead::Ahead;
use super::aligned::Aligned;
use super::build::{GridBonds, Mixture};
use super::kernels::{Coefficients, Energy, Linear, Output, Positions, RowView, Single, TOGETHER, TOGETHER_MASKED};
use super::lanes::{InstructionSet, Lanes};
use super::nodal::Nodal;
use super::offsets::Offsets;
use super::padded::Padded;
use super::real::Real;
use super::special::Ends;
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
    /// P of all nodes, if there are nodal terms and forces are wanted.
    pub nodal: Option<&'a Nodal<T>>,
}

/// Memory of one thread.
pub struct Scratch<T: Real> {
    /// Forces of a strip's slots, by row.
    block: Aligned<T>,
    /// Forces of a row in natural order.
    pub natural: [Vec<T>; 3],
    /// Neighbours of those rows of the strip some of whose neighbours are outside the grid.
    offsets: Vec<Offsets>,
    /// Constants of the mixture and group that were last used, in vectors.
    mixed: Aligned<T>,
    mixed_of: (u32, usize),
    /// What is done at once.
    runs: Vec<Run>,
    /// Displacements of the neighbours of a special node.
    ends: Ends<T>,
    /// Nodal forces of a row's slots, and of one component in natural order.
    nodal: Aligned<T>,
    component: Vec<T>,
    /// Bonds over their threshold.
    over: Vec<(u32, u32, u32)>,
}

impl<T: Real> Scratch<T> {
    /// For strips of these bonds.
    pub fn new(bonds: &GridBonds<T>) -> Self {
        let (layout, half) = (&bonds.layout, bonds.half.len());
        let rows = layout.strips.iter().map(Range::len).max().unwrap_or(0);
        Scratch {
            block: Aligned::zeros(rows * 3 * layout.length * layout.lanes),
            natural: std::array::from_fn(|_| vec![T::default(); bonds.row_nodes()]),
            offsets: vec![Offsets::default(); rows],
            mixed: Aligned::zeros(4 * half * layout.lanes),
            mixed_of: (0, 0),
            runs: Vec::new(),
            ends: Ends::new(half),
            nodal: Aligned::zeros(if bonds.has_nodal_term() { 3 * layout.length * layout.lanes } else { 0 }),
            component: vec![T::default(); bonds.row_nodes()],
            over: Vec::new(),
        }
    }
}

impl<T: Real> Task<'_, T> {
    /// Ask for what is needed next: values of this strip's nodes, then the plane of rows that comes into reach with the next
    /// strip, or, towards the end of the third axis, with the strips that begin anew.
    pub fn ask_ahead<V>(&self, fields: [&[V]; 3], ahead: &mut Ahead) {
        let (bonds, layout, [_, n2, n3]) = (self.bonds, &*self.bonds.layout, self.bonds.layout.nodes);
        let (plane, reach) = (self.rows.start / n2, layout.reach[2]);
        ahead.clear();
        // Last added, first asked for.
        if plane + 1 < n3 {
            self.add_plane(self.rows.start + n2..self.rows.end + n2, reach, ahead);
            let whole = &bonds.whole[self.rows.start * layout.length..self.rows.end * layout.length];
            if whole.contains(&false) {
                let row = bonds.words * layout.positions();
                ahead.add(&bonds.bits.slice()[(self.rows.start + n2) * row..(self.rows.end + n2) * row]);
            }
        }
        let left = n3 - 1 - plane;
        if left < reach {
            let start = self.rows.end % n2;
            self.add_plane(start..n2.min(start + self.rows.len()), reach - left - 1, ahead);
        }
        fields.into_iter().for_each(|field| ahead.add(field));
    }

    /// Ask for the displacements that rows reach in the plane so many planes from theirs.
    fn add_plane(&self, rows: Range<usize>, planes: usize, ahead: &mut Ahead) {
        let layout = &*self.bonds.layout;
        let (reach, planes, row) = (layout.reach[1] as i32, planes as i32, 3 * layout.slots);
        let first = layout.row_at(rows.start, [0, planes]);
        if first < layout.rows() {
            ahead.add(&self.u.values.slice()[first * row..(first + rows.len()) * row]);
            let before = (-reach..0).map(|dy| layout.row_at(rows.start, [dy, planes]));
            let behind = (1..=reach).map(|dy| layout.row_at(rows.end - 1, [dy, planes]));
            for beyond in before.chain(behind).filter(|&beyond| beyond < layout.rows()) {
                ahead.add(&self.u.values.slice()[beyond * row..(beyond + 1) * row]);
            }
        }
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
        let of_kind = &bonds.offsets[layout.kind(row)];
        if !of_kind.inside {
            of_kind.move_to(layout, bonds.words, row, &mut scratch.offsets[k]);
        }
    }
    let mut runs = std::mem::take(&mut scratch.runs);
    for first in (0..layout.length).step_by(TOGETHER) {
        runs.clear();
        for (k, row) in task.rows.clone().enumerate() {
            let at = row * layout.length + first..row * layout.length + layout.length.min(first + TOGETHER);
            let mut j = first;
            for same in bonds.mixture[at].chunk_by(|a, b| a == b) {
                let positions = j..j + same.len();
                j = positions.end;
                let whole = bonds.whole[row * layout.length..][positions.clone()].iter().all(|&w| w);
                if same[0] > 0 {
                    runs.push(Run { k, row, positions, mixture: same[0], whole });
                }
            }
        }
        for group in 0..bonds.half.groups.len() {
            for run in &runs {
                // SAFETY: the caller's contract; the positions are in the row.
                unsafe { positions::<T, L>(task, run, group, scratch, ahead, events) };
            }
        }
    }
    scratch.runs = runs;
}

/// A few positions of a row, all of the same mixture of stencils.
struct Run {
    /// The row, in the strip and in the grid.
    k: usize,
    row: usize,
    positions: Range<usize>,
    mixture: u32,
    /// Whether all bonds are there.
    whole: bool,
}

/// What a group of bonds adds to the forces of a run.
///
/// # Safety
/// As [`strip_in`].
#[inline(always)]
unsafe fn positions<T: Real, L: Lanes<T = T>>(
    task: &Task<T>,
    run: &Run,
    group: usize,
    scratch: &mut Scratch<T>,
    ahead: &mut Ahead,
    events: &mut Vec<Event>,
) {
    let Task { bonds, u, law, tables, .. } = *task;
    let &Run { k, row, ref positions, mixture, whole } = run;
    let wanted = positions.clone();
    let layout = &*bonds.layout;
    let Mixture { stencils, uniform } = bonds.mixtures[mixture as usize - 1];
    let uniform = uniform.then_some(stencils[0]);
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
    let of_kind = &bonds.offsets[layout.kind(row)];
    let view = bonds.view(u, row, if of_kind.inside { of_kind } else { &scratch.offsets[k] });
    let length = layout.length;
    let block = &mut scratch.block.slice_mut()[k * 3 * length * layout.lanes..];
    let to = block.as_mut_ptr();
    let together = match paired(law, task.wanted) {
        true if whole && uniform.is_some() => TOGETHER,
        true => TOGETHER_MASKED,
        false => 1,
    };
    for first in wanted.clone().step_by(together) {
        // Where there are fewer positions than are taken together, some before them too, whose results are dropped.
        let j = first.min(length - together);
        let out = Output { to, length, wanted: first..wanted.end.min(first + together), first: group == 0 };
        let group = &bonds.half.groups[group];
        let ahead = ahead.take(group.bonds.len());
        let over = &mut scratch.over;
        let at = Positions { row: &view, group, coefficients: &coefficients, j, ahead, out: &out, over };
        // SAFETY: the positions are in the row, whose offsets `aim` made for this layout.
        unsafe {
            match (task.wanted, law.kinematics, uniform.is_some()) {
                (Wanted::Energy, Kinematics::Linear, true) => L::run(Energy::<L, true, false>(at)),
                (Wanted::Energy, Kinematics::Linear, false) => L::run(Energy::<L, false, false>(at)),
                (Wanted::Energy, Kinematics::Finite, true) => L::run(Energy::<L, true, true>(at)),
                (Wanted::Energy, Kinematics::Finite, false) => L::run(Energy::<L, false, true>(at)),
                (Wanted::Forces, Kinematics::Linear, true) if law.breaking => {
                    L::run(Single::<L, true, true, false>(at))
                }
                (Wanted::Forces, Kinematics::Linear, false) if law.breaking => {
                    L::run(Single::<L, false, true, false>(at));
                }
                (Wanted::Forces, Kinematics::Linear, true) => match (whole, signed) {
                    (true, false) => L::run(Linear::<L, true, false, false>(at)),
                    (true, true) => L::run(Linear::<L, true, false, true>(at)),
                    (false, false) => L::run(Linear::<L, true, true, false>(at)),
                    (false, true) => L::run(Linear::<L, true, true, true>(at)),
                },
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
        let stencils = &bonds.mixtures[mixture as usize - 1].stencils[..lanes];
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
    /// What the kernels read of a row.
    #[inline(always)]
    pub(super) fn view<'a>(&self, u: &Padded<T>, row: usize, offsets: &'a Offsets) -> RowView<'a, T> {
        let layout = &*self.layout;
        // SAFETY: the row is one of the body's.
        let (u, bits) = unsafe {
            let bits = self.bits.slice().as_ptr().add((row * layout.positions() + layout.reach[0]) * self.words);
            (u.values.slice().as_ptr().add(row * 3 * layout.slots + layout.reach[0] * layout.lanes), bits)
        };
        let Offsets { plus, minus, minus_bits, .. } = offsets;
        RowView { u, bits, slots: layout.slots, words: self.words, plus, minus, minus_bits }
    }

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
    let of_kind = &bonds.offsets[layout.kind(row)];
    for place in range {
        let node = bonds.special[place];
        let e = node as usize % n;
        if task.wanted == Wanted::Energy {
            let of = |p| bonds.bond_energy(task.u, task.law.kinematics, node as usize, p);
            scratch.natural[0][e] = T::of((0..bonds.half.len()).map(of).sum());
            continue;
        }
        let offsets = if of_kind.inside { of_kind } else { &scratch.offsets[row - task.rows.start] };
        // SAFETY: the machine has the instruction set; the offsets are those of the row.
        let f = unsafe { bonds.special_force::<L>(task.u, task.law, place, offsets, &mut scratch.ends, events) };
        for (to, f) in scratch.natural.iter_mut().zip(f) {
            to[e] = f;
        }
    }
    if let Some(nodal) = task.nodal {
        let Scratch { natural, nodal: block, component, offsets, .. } = scratch;
        let offsets = if of_kind.inside { of_kind } else { &offsets[row - task.rows.start] };
        // SAFETY: the machine has the instruction set; the offsets are those of the row.
        unsafe { bonds.add_nodal_forces::<L>(nodal, row, offsets, block.slice_mut(), natural, component) };
    }
}
