//! One pass over all rows: forces, and bonds that break.

use rayon::prelude::*;

use super::build::GridBonds;
use super::kernels::{Coefficients, Energy, Linear, Output, Over, Positions, RowView, Single, bit_of};
use super::lanes::{InstructionSet, Lanes};
use super::law::{mean, threshold};
use super::padded::Padded;
use super::real::Real;
use super::stencil::MOST_LANES;
use crate::operator::Kinematics;

/// Positions of a row that share the loads of a bond's constants: where bonds are taken in pairs, and one by one. A part
/// of a row is never shorter.
pub(super) const TOGETHER: usize = 4;
pub(super) const TOGETHER_SINGLE: usize = 1;

/// How bonds respond in a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Law {
    /// Linear or finite stretch.
    pub kinematics: Kinematics,
    /// Whether bonds above their critical stretch break. They break in tension only.
    pub breaking: bool,
}

/// Bonds that broke in a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Broken {
    /// Number.
    pub count: usize,
    /// Elastic energy that they held (J).
    pub energy: f64,
}

/// A half bond p of a node that breaks.
pub type Event = (u32, u16);

/// Memory of one thread.
pub struct Scratch<T: Real> {
    /// Forces of a row's slots.
    block: super::aligned::Aligned<T>,
    /// Forces of a row in natural order.
    pub natural: [Vec<T>; 3],
    plus: Vec<isize>,
    minus: Vec<isize>,
    own_bits: Vec<isize>,
    minus_bits: Vec<isize>,
    /// Rows at +ξ and −ξ, by `HalfBonds::rows`.
    rows: Vec<[isize; 2]>,
    /// Whether the offsets are those of interior rows, which are all alike.
    interior: bool,
    /// Constants of the mixture that was last used, in vectors.
    mixed: super::aligned::Aligned<T>,
    mixed_of: u32,
    over: Over,
}

/// Constants of all stencils, made once per pass.
pub struct Tables<T: Real> {
    /// Shared by all stencils.
    pub shared: Vec<T>,
    /// By stencil: `per_bond` numbers per half bond.
    pub own: Vec<T>,
    pub per_bond: usize,
    /// By stencil: whether any stiffness is negative.
    pub signed: Vec<bool>,
    pub bit: Vec<T::Word>,
}

impl<T: Real> GridBonds<T> {
    /// Forces (N) of displacements, row by row in parallel: `visit` is given a row's number j + n₂k, its forces in
    /// natural order (zero where there is no node) and the row's part of three arrays of one value per node, and returns
    /// what is gathered by row. Bonds do not break.
    pub fn sweep<V: Send, R: Send>(
        &self,
        u: &Padded<T>,
        kinematics: Kinematics,
        fields: [&mut [V]; 3],
        visit: impl Fn(usize, [&[T]; 3], [&mut [V]; 3]) -> R + Sync,
    ) -> Vec<R> {
        self.pass(u, Law { kinematics, breaking: false }, fields, visit).0
    }

    /// As [`GridBonds::sweep`]; bonds stretched above their critical stretch break, are without force already in this
    /// pass, and are counted. Both ends of a bond decide identically.
    pub fn sweep_breaking<V: Send, R: Send>(
        &mut self,
        u: &Padded<T>,
        kinematics: Kinematics,
        fields: [&mut [V]; 3],
        visit: impl Fn(usize, [&[T]; 3], [&mut [V]; 3]) -> R + Sync,
    ) -> (Broken, Vec<R>) {
        let (result, events) = self.pass(u, Law { kinematics, breaking: self.breakable }, fields, visit);
        let energy =
            events.iter().map(|&(node, p)| self.bond_energy(u, kinematics, node as usize, usize::from(p))).sum();
        let broken = Broken { count: events.len(), energy };
        self.clear(events.into_iter().map(|(node, p)| (node as usize, usize::from(p))));
        (broken, result)
    }

    pub(super) fn pass<V: Send, R: Send>(
        &self,
        u: &Padded<T>,
        law: Law,
        fields: [&mut [V]; 3],
        visit: impl Fn(usize, [&[T]; 3], [&mut [V]; 3]) -> R + Sync,
    ) -> (Vec<R>, Vec<Event>) {
        assert!(std::sync::Arc::ptr_eq(&u.layout, &self.layout), "displacements of other bonds");
        let n = self.row_nodes();
        let tables = self.tables(law, Wanted::Forces);
        let pulls = self.nodal_pulls(u);
        let [x, y, z] = fields;
        let rows = x.chunks_mut(n).zip(y.chunks_mut(n)).zip(z.chunks_mut(n)).enumerate();
        let mut rows: Vec<(usize, [&mut [V]; 3])> = rows.map(|(row, ((x, y), z))| (row, [x, y, z])).collect();
        rows.sort_unstable_by_key(|(row, _)| self.layout.place_in_blocks(*row));
        let mut visited: Vec<(usize, R, Vec<Event>)> = rows
            .into_par_iter()
            .with_min_len(8)
            .map_init(
                || self.scratch(),
                |scratch, (row, fields)| {
                    let mut events = Vec::new();
                    self.aim(row, scratch);
                    T::row(
                        &Task { bonds: self, u, law, tables: &tables, row, wanted: Wanted::Forces },
                        scratch,
                        &mut events,
                    );
                    if let Some(pulls) = &pulls {
                        for e in 0..n {
                            let force = self.nodal_force(pulls, row * n + e);
                            for (f, add) in scratch.natural.iter_mut().zip(force.iter()) {
                                f[e] += T::of(*add);
                            }
                        }
                    }
                    let [fx, fy, fz] = &scratch.natural;
                    (row, visit(row, [fx, fy, fz], fields), events)
                },
            )
            .collect();
        visited.sort_unstable_by_key(|(row, ..)| *row);
        let mut events = Vec::new();
        let results = visited
            .into_iter()
            .map(|(_, result, mut broken)| {
                events.append(&mut broken);
                result
            })
            .collect();
        (results, events)
    }

    /// Energy (J) of the bonds without nodal terms, summed in f64 by nodes and rows in their order.
    pub(super) fn bonds_energy(&self, u: &Padded<T>, kinematics: Kinematics) -> f64 {
        let law = Law { kinematics, breaking: false };
        let tables = self.tables(law, Wanted::Energy);
        let rows: Vec<f64> = (0..self.layout.rows())
            .into_par_iter()
            .with_min_len(8)
            .map_init(
                || self.scratch(),
                |scratch, row| {
                    self.aim(row, scratch);
                    let task = Task { bonds: self, u, law, tables: &tables, row, wanted: Wanted::Energy };
                    T::row(&task, scratch, &mut Vec::new());
                    scratch.natural[0].iter().map(|e| e.f64()).sum()
                },
            )
            .collect();
        rows.iter().sum()
    }

    fn scratch(&self) -> Scratch<T> {
        let (layout, half) = (&self.layout, self.half.len());
        Scratch {
            block: super::aligned::Aligned::zeros(3 * layout.length * layout.lanes),
            natural: std::array::from_fn(|_| vec![T::default(); self.row_nodes()]),
            plus: vec![0; half],
            minus: vec![0; half],
            own_bits: vec![0; half],
            minus_bits: vec![0; half],
            rows: Vec::new(),
            interior: false,
            mixed: super::aligned::Aligned::zeros(4 * half * layout.lanes),
            mixed_of: 0,
            over: Over { list: vec![(0, 0, 0); half * TOGETHER_SINGLE + 1], count: 0 },
        }
    }

    /// Whether bonds are taken in pairs ±ξ.
    fn paired(law: Law) -> bool {
        law == Law { kinematics: Kinematics::Linear, breaking: false }
    }

    fn tables(&self, law: Law, wanted: Wanted) -> Tables<T> {
        let (half, bonds) = (&self.half, self.half.bonds);
        let paired = wanted == Wanted::Forces && Self::paired(law);
        let finite = law.kinematics == Kinematics::Finite;
        let mut shared = Vec::new();
        for p in (0..half.len()).filter(|_| !paired) {
            let branch = if finite { &half.branch } else { &half.direction };
            shared.extend(branch.iter().map(|b| b.slice()[p]));
            shared.push(half.per_square.slice()[p]);
        }
        let mut own = Vec::new();
        let mut signed = vec![false; self.stencils.len()];
        for s in 0..self.stencils.len() {
            for (p, &b) in half.full.iter().enumerate() {
                let of = |values: &[T]| mean(values[s * bonds + b], values[s * bonds + half.opposite(b)]);
                let k = of(&self.stiffness);
                if paired {
                    let root = k.f64().abs().sqrt();
                    own.extend(half.xi[p].normalize().iter().map(|n| T::of(root * n)));
                    own.push(T::of(k.f64().signum()));
                    signed[s] |= k < T::default();
                } else if wanted == Wanted::Energy {
                    let square = if finite { half.xi[p].norm_squared() } else { 1.0 };
                    own.extend([T::of(0.5 * k.f64() * square), T::default()]);
                } else {
                    let limit = threshold(finite, of(&self.critical), half.length.slice()[p]);
                    own.extend([k, if law.breaking { limit } else { T::of(f64::INFINITY) }]);
                }
            }
        }
        let bit = half.full.iter().map(|&b| bit_of::<T::Word>(b, bonds / 2).1).collect();
        Tables { shared, own, signed, per_bond: if paired { 4 } else { 2 }, bit }
    }

    /// Offsets of neighbouring rows from a row.
    fn aim(&self, row: usize, scratch: &mut Scratch<T>) {
        let layout = &*self.layout;
        let interior = layout.interior(row);
        if interior && scratch.interior {
            return;
        }
        scratch.interior = interior;
        let slots = layout.slots as isize;
        scratch.rows.clear();
        scratch.rows.extend(
            self.half.rows.iter().map(|&[dy, dz]| {
                [[dy, dz], [-dy, -dz]].map(|offset| layout.row_at(row, offset) as isize - row as isize)
            }),
        );
        let words = self.words as isize;
        for p in 0..self.half.len() {
            let [plus, minus] = scratch.rows[self.half.row_of[p]];
            let along = self.half.offset[p][0] as isize * layout.lanes as isize;
            let (word, _) = bit_of::<T::Word>(self.half.full[p], self.half.bonds / 2);
            let word = word as isize;
            scratch.plus[p] = plus * 3 * slots + along;
            scratch.minus[p] = minus * 3 * slots - along;
            scratch.own_bits[p] = word * slots;
            scratch.minus_bits[p] = (minus * words + word) * slots - along;
        }
    }

    /// Constants of a mixture's lanes as vectors.
    fn mix(&self, tables: &Tables<T>, mixture: u32, scratch: &mut Scratch<T>) {
        if scratch.mixed_of == mixture {
            return;
        }
        let lanes = self.layout.lanes;
        let per_stencil = tables.per_bond * self.half.len();
        let stencils = &self.mixtures[mixture as usize - 1].0[..lanes];
        for (place, to) in scratch.mixed.slice_mut()[..per_stencil * lanes].chunks_exact_mut(lanes).enumerate() {
            for (to, &s) in to.iter_mut().zip(stencils) {
                *to = tables.own[(usize::from(s) - 1) * per_stencil + place];
            }
        }
        scratch.mixed_of = mixture;
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

/// What a pass is after.
#[derive(Clone, Copy, PartialEq)]
enum Wanted {
    Forces,
    /// Of the half bonds from each node on, as the first component.
    Energy,
}

/// A row to be done.
pub struct Task<'a, T: Real> {
    bonds: &'a GridBonds<T>,
    u: &'a Padded<T>,
    law: Law,
    tables: &'a Tables<T>,
    row: usize,
    wanted: Wanted,
}

/// Forces of one row, in natural order in `scratch.natural`, and the bonds that break; `aim` has been at the row.
///
/// Called through [`Real`], so that the kernels are compiled with this library and not where they are used.
#[inline(always)]
pub fn row<T: Real>(task: &Task<T>, scratch: &mut Scratch<T>, events: &mut Vec<Event>) {
    match task.bonds.set {
        // SAFETY: the constructor refuses sets that the machine lacks.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => unsafe { row_avx512(task, scratch, events) },
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { row_avx2(task, scratch, events) },
        // SAFETY: portable vectors need nothing.
        _ => unsafe { row_in::<T, T::Portable>(task, scratch, events) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl,avx2,fma")]
unsafe fn row_avx512<T: Real>(task: &Task<T>, scratch: &mut Scratch<T>, events: &mut Vec<Event>) {
    // SAFETY: the caller's machine has the instruction set.
    unsafe { row_in::<T, T::Avx512>(task, scratch, events) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn row_avx2<T: Real>(task: &Task<T>, scratch: &mut Scratch<T>, events: &mut Vec<Event>) {
    // SAFETY: the caller's machine has the instruction set.
    unsafe { row_in::<T, T::Avx2>(task, scratch, events) }
}

/// A row in vectors of one instruction set.
///
/// # Safety
/// The machine has the instruction set, and the layout is for its vectors.
#[inline(always)]
unsafe fn row_in<T: Real, L: Lanes<T = T>>(task: &Task<T>, scratch: &mut Scratch<T>, events: &mut Vec<Event>) {
    let Task { bonds, law, row, .. } = *task;
    let layout = &*bonds.layout;
    let together =
        if task.wanted == Wanted::Forces && GridBonds::<T>::paired(law) { TOGETHER } else { TOGETHER_SINGLE };
    let mixtures = &bonds.mixture[row * layout.length..(row + 1) * layout.length];
    let mut j = 0;
    while j < layout.length {
        let mixture = mixtures[j];
        let end = (j..layout.length).find(|&e| mixtures[e] != mixture).unwrap_or(layout.length);
        if mixture > 0 {
            for at in (j..end).step_by(together) {
                // SAFETY: the caller's contract; the positions are in the row.
                unsafe { positions::<T, L>(task, mixture, at..end.min(at + together), together, scratch, events) };
            }
        }
        j = end;
    }
    match L::N {
        4 => collect::<T, 4>(bonds, row, scratch),
        8 => collect::<T, 8>(bonds, row, scratch),
        _ => collect::<T, MOST_LANES>(bonds, row, scratch),
    }
    let range = bonds.special_from[row] as usize..bonds.special_from[row + 1] as usize;
    for &node in &bonds.special[range] {
        let e = node as usize % bonds.row_nodes();
        if task.wanted == Wanted::Energy {
            let of = |p| bonds.bond_energy(task.u, law.kinematics, node as usize, p);
            scratch.natural[0][e] = T::of((0..bonds.half.len()).map(of).sum());
            continue;
        }
        // SAFETY: the machine has the instruction set.
        let f = unsafe { bonds.special_force::<L>(task.u, law, row, e, events) };
        for (to, f) in scratch.natural.iter_mut().zip(f) {
            to[e] = f;
        }
    }
}

/// Forces of a few positions of a row, all of the same mixture of stencils. The kernels take `together` positions: where
/// there are fewer, some before them too, whose results are dropped.
///
/// # Safety
/// As [`row_in`].
#[inline(always)]
unsafe fn positions<T: Real, L: Lanes<T = T>>(
    task: &Task<T>,
    mixture: u32,
    wanted: std::ops::Range<usize>,
    together: usize,
    scratch: &mut Scratch<T>,
    events: &mut Vec<Event>,
) {
    let Task { bonds, u, law, tables, row, .. } = *task;
    let layout = &*bonds.layout;
    let uniform = bonds.mixtures[mixture as usize - 1].uniform();
    if uniform.is_none() {
        bonds.mix(tables, mixture, scratch);
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
    let view = RowView {
        u: own_u,
        bits: own_bits,
        slots: layout.slots,
        plus: &scratch.plus,
        minus: &scratch.minus,
        own_bits: &scratch.own_bits,
        minus_bits: &scratch.minus_bits,
        bit: &tables.bit,
        patterns: &bonds.half.patterns,
    };
    let start = wanted.start.min(layout.length - together);
    let whole = bonds.whole[row * layout.length..][wanted.clone()].iter().all(|&w| w);
    let out = Output { to: scratch.block.slice_mut().as_mut_ptr(), length: layout.length, wanted: wanted.clone() };
    scratch.over.count = 0;
    let at = Positions { row: &view, coefficients: &coefficients, j: start, out: &out, over: &mut scratch.over };
    // SAFETY: positions start … start + together − 1 are in the row, whose offsets `aim` made for this layout.
    unsafe {
        match (task.wanted, law.kinematics, uniform.is_some()) {
            (Wanted::Energy, Kinematics::Linear, true) => L::run(Energy::<L, true, false>(at)),
            (Wanted::Energy, Kinematics::Linear, false) => L::run(Energy::<L, false, false>(at)),
            (Wanted::Energy, Kinematics::Finite, true) => L::run(Energy::<L, true, true>(at)),
            (Wanted::Energy, Kinematics::Finite, false) => L::run(Energy::<L, false, true>(at)),
            (Wanted::Forces, Kinematics::Linear, true) if law.breaking => L::run(Single::<L, true, true, false>(at)),
            (Wanted::Forces, Kinematics::Linear, false) if law.breaking => L::run(Single::<L, false, true, false>(at)),
            (Wanted::Forces, Kinematics::Linear, true) if !whole => L::run(Linear::<L, true, true, true>(at)),
            (Wanted::Forces, Kinematics::Linear, true) if signed => L::run(Linear::<L, true, false, true>(at)),
            (Wanted::Forces, Kinematics::Linear, true) => L::run(Linear::<L, true, false, false>(at)),
            (Wanted::Forces, Kinematics::Linear, false) => L::run(Linear::<L, false, true, true>(at)),
            (Wanted::Forces, Kinematics::Finite, true) if whole => L::run(Single::<L, true, false, true>(at)),
            (Wanted::Forces, Kinematics::Finite, true) => L::run(Single::<L, true, true, true>(at)),
            (Wanted::Forces, Kinematics::Finite, false) => L::run(Single::<L, false, true, true>(at)),
        }
    }
    for &(p, j, lanes) in &scratch.over.list[..scratch.over.count] {
        if wanted.contains(&(j as usize)) {
            bonds.record(row, j as usize, p as usize, lanes, events);
        }
    }
}

/// Forces of a row from slots to natural order; zero where there is no node.
#[inline(always)]
fn collect<T: Real, const N: usize>(bonds: &GridBonds<T>, row: usize, scratch: &mut Scratch<T>) {
    let (layout, n) = (&*bonds.layout, bonds.row_nodes());
    let blocks = scratch.block.slice().chunks_exact(layout.length * N);
    for (natural, block) in scratch.natural.iter_mut().zip(blocks) {
        for (lane, part) in natural.chunks_mut(layout.length).enumerate() {
            for (to, vector) in part.iter_mut().zip(block.as_chunks::<N>().0) {
                *to = vector[lane];
            }
        }
        if !bonds.full {
            for (f, &s) in natural.iter_mut().zip(&bonds.stencil[row * n..(row + 1) * n]) {
                if s == 0 {
                    *f = T::default();
                }
            }
        }
    }
}
