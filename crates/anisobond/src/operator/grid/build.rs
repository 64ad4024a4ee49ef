//! The bonds of a body, prepared for the kernels.

use std::collections::HashMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, OnceLock};

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::aligned::Aligned;
use super::lanes::InstructionSet;
use super::layout::{Layout, NONE};
use super::offsets::Offsets;
use super::padded::Padded;
use super::real::{Real, Word};
use super::stencil::{HalfBonds, MOST_LANES, Stencil};
use super::surroundings::Surroundings;
use crate::calibration::StrainAverage;
use crate::lattice::{Body, Neighbourhood};
use crate::{Error, Result};

/// Bits per node at most, horizon ratio about 7.8.
const MOST_HALF_BONDS: usize = 1024;

/// The bonds of a body on a grid, with one bit per half bond.
///
/// Displacements are stored as `T`; everything that is given or returned is f64, SI units.
#[derive(Debug)]
pub struct GridBonds<T: Real = f64> {
    pub(super) body: Body,
    pub(super) neighbourhood: Neighbourhood,
    pub(super) set: InstructionSet,
    pub(super) layout: Arc<Layout>,
    pub(super) half: HalfBonds<T>,
    /// Neighbours of rows, by kind of row.
    pub(super) offsets: Vec<Offsets>,
    /// Stencil of each node; 0 is none.
    pub(super) stencil: Vec<u16>,
    pub(super) stencils: Vec<Stencil>,
    /// Whether the grid has no empty place.
    pub(super) full: bool,
    /// k (N/m) and s_c (–) by stencil and bond.
    pub(super) stiffness: Vec<T>,
    pub(super) critical: Vec<T>,
    /// Words of bits per position of a row, at least one per half bond.
    pub(super) words: usize,
    /// Bits of half bonds, by row, position, half bond and lane; one row of zeros behind.
    pub(super) bits: Aligned<T::Word>,
    /// By row and position: whether all bonds of the vector's bulk lanes exist and are unbroken.
    pub(super) whole: Vec<bool>,
    /// By row and position: 0 where no lane is bulk, else 1 + place in `mixtures`.
    pub(super) mixture: Vec<u32>,
    /// Stencils of the lanes of bulk vectors.
    pub(super) mixtures: Vec<Mixture>,
    /// Nodes that are not bulk, ascending, and where those of each row begin.
    pub(super) special: Vec<u32>,
    pub(super) special_from: Vec<u32>,
    /// Constants of their bonds.
    pub(super) surroundings: Surroundings<T>,
    /// Whether any bond can break.
    pub(super) breakable: bool,
    /// By node, if there are nodal terms: whether a bond of it has failed, which ends its nodal term.
    pub(super) torn: Vec<bool>,
    /// K⁻¹ (1/m²) of a whole neighbourhood, of the nodal term.
    pub(super) shape_inverse: Matrix3<f64>,
    /// The diagonal block of K (N/m) of nodes in the bulk, by stencil, once it has been asked for.
    pub(super) bulk_block: Vec<OnceLock<Matrix3<f64>>>,
    /// Displacements between calls of the linear operator.
    pub(super) scratch: Mutex<Option<Padded<T>>>,
    /// P of the nodal term between passes.
    pub(super) nodal_scratch: Mutex<Option<[Padded<T>; 3]>>,
    /// Passes over all bonds for forces.
    pub(super) passes: AtomicU64,
    /// Bits of the largest ‖E‖ of a node in the last pass.
    pub(super) nodal_strain: AtomicU64,
}

/// Stencils of a vector's lanes; lanes that are not bulk have that of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Mixture {
    /// By lane.
    pub stencils: [u16; MOST_LANES],
    /// Whether they are one.
    pub uniform: bool,
}

impl<T: Real> GridBonds<T> {
    /// The bonds of a body: `stencil` by node counts from 1, 0 where there is no node; the kernels are those of the widest
    /// instruction set of this machine.
    ///
    /// A bond has the mean of what its two ends say of it, and one that passes through several regions of the body what
    /// their layers make of it; the first stencils are then those of the regions' bulk, in their order.
    ///
    /// # Errors
    /// As [`GridBonds::with_instructions`].
    pub fn new(body: Body, neighbourhood: &Neighbourhood, stencil: Vec<u16>, stencils: Vec<Stencil>) -> Result<Self> {
        GridBonds::with_instructions(InstructionSet::best(), body, neighbourhood, stencil, stencils)
    }

    /// As [`GridBonds::new`], with the kernels of a given instruction set.
    ///
    /// # Errors
    /// An instruction set that the machine lacks; a spacing of the grid other than the neighbourhood's; a number of stencil
    /// indices other than that of the nodes, a neighbourhood turned against the grid, indices of no stencil, nodes of the body without a stencil or stencils without a
    /// node; stencils that do not fit the neighbourhood or whose numbers are not finite; in a body of several regions fewer
    /// stencils than regions; more than 1024 half bonds;
    /// a nodal term where the bonds lie in a plane.
    pub fn with_instructions(
        set: InstructionSet,
        body: Body,
        neighbourhood: &Neighbourhood,
        stencil: Vec<u16>,
        stencils: Vec<Stencil>,
    ) -> Result<Self> {
        check(set, &body, neighbourhood, &stencil, &stencils)?;
        let half = HalfBonds::<T>::new(neighbourhood);
        let layout = Arc::new(Layout::new(&body.grid, half.reach, set.lanes::<T>(), size_of::<T>()));
        let words = half.len().next_multiple_of(16);
        let all = |values: fn(&Stencil) -> &Vec<f64>| {
            stencils.iter().flat_map(|s| values(s).iter().map(|&x| T::of(x))).collect::<Vec<T>>()
        };
        let shape =
            neighbourhood.bonds().iter().fold(Matrix3::zeros(), |k, b| k + b.influence * b.xi * b.xi.transpose());
        if stencils.iter().any(|s| s.nodal.is_some()) {
            // Refuses bonds in a plane.
            StrainAverage::new(neighbourhood)?;
        }
        let mut bonds = GridBonds {
            torn: vec![false; if stencils.iter().any(|s| s.nodal.is_some()) { stencil.len() } else { 0 }],
            shape_inverse: shape.try_inverse().unwrap_or_default(),
            stiffness: all(|s| &s.stiffness),
            critical: all(|s| &s.critical),
            breakable: stencils.iter().any(|s| s.critical.iter().any(|c| c.is_finite())),
            bits: Aligned::zeros((layout.rows() + 1) * words * layout.positions()),
            whole: vec![false; layout.rows() * layout.length],
            mixture: vec![0; layout.rows() * layout.length],
            mixtures: vec![],
            special: vec![],
            special_from: vec![],
            surroundings: Surroundings::none(),
            bulk_block: stencils.iter().map(|_| OnceLock::new()).collect(),
            scratch: Mutex::new(None),
            nodal_scratch: Mutex::new(None),
            passes: AtomicU64::new(0),
            nodal_strain: AtomicU64::new(0),
            offsets: Offsets::by_kind(&layout, &half, words),
            neighbourhood: neighbourhood.clone(),
            full: stencil.iter().all(|&s| s > 0),
            body,
            set,
            layout,
            half,
            stencil,
            stencils,
            words,
        };
        bonds.connect();
        bonds.sort_nodes();
        bonds.surroundings = Surroundings::new(&bonds);
        bonds.find_whole();
        Ok(bonds)
    }

    /// Displacements of zero in the kernels' layout.
    pub fn padded(&self) -> Padded<T> {
        Padded::zeros(&self.layout)
    }

    /// The neighbourhood.
    pub fn neighbourhood(&self) -> &Neighbourhood {
        &self.neighbourhood
    }

    /// The stencils; that of a node is number [`GridBonds::stencil_of`] − 1.
    pub fn stencils(&self) -> &[Stencil] {
        &self.stencils
    }

    /// Stencil of each node, counting from 1; 0 is no node.
    pub fn stencil_of(&self) -> &[u16] {
        &self.stencil
    }

    /// Whether any bond can break.
    pub fn breakable(&self) -> bool {
        self.breakable
    }

    /// The instruction set of the kernels.
    pub fn instructions(&self) -> InstructionSet {
        self.set
    }

    /// Number of nodes that are not taken a vector at a time: those with a bond to another stencil.
    pub fn special_nodes(&self) -> usize {
        self.special.len()
    }

    /// Bytes of memory of bits and tables, displacements excluded.
    pub fn bytes(&self) -> usize {
        self.bits.bytes()
            + self.whole.len()
            + self.torn.len()
            + 4 * (self.mixture.len() + self.special.len() + self.special_from.len())
            + 2 * (self.stencil.len() + self.body.region.len())
            + self.surroundings.bytes()
            + self.mixtures.len() * size_of::<Mixture>()
            + 2 * size_of::<T>() * self.stiffness.len()
    }

    /// Number of nodes along the first axis.
    pub(super) fn row_nodes(&self) -> usize {
        self.layout.nodes[0]
    }

    /// The node at an offset from an element of a row; `None` where there is none.
    #[inline]
    pub(super) fn node_at(&self, row: usize, element: usize, [dx, dy, dz]: [i32; 3]) -> Option<usize> {
        let to = self.layout.row_at(row, [dy, dz]);
        let slot = self.layout.slot(element) as i64 + i64::from(dx) * self.layout.lanes as i64;
        let e = self.layout.element[slot as usize];
        let node = to * self.row_nodes() + e as usize;
        (to < self.layout.rows() && e != NONE && self.stencil[node] > 0).then_some(node)
    }

    /// A bit for every half bond that has both ends.
    fn connect(&mut self) {
        let (layout, half, words, n) = (self.layout.clone(), &self.half, self.words, self.row_nodes());
        let stencil = &self.stencil;
        let rows = &mut self.bits.slice_mut()[..layout.rows() * words * layout.positions()];
        rows.par_chunks_mut(words * layout.positions()).enumerate().for_each(|(row, bits)| {
            for p in 0..half.len() {
                let [dx, dy, dz] = half.offset[p];
                let to = layout.row_at(row, [dy, dz]);
                if to == layout.rows() {
                    continue;
                }
                for e in 0..n {
                    let slot = layout.slot(e);
                    let other = layout.element[(slot as i64 + i64::from(dx) * layout.lanes as i64) as usize];
                    if other != NONE && stencil[row * n + e] > 0 && stencil[to * n + other as usize] > 0 {
                        for &slot in layout.copies(e) {
                            let slot = slot as usize;
                            bits[slot / layout.lanes * words + p] |= T::Word::bit(slot % layout.lanes);
                        }
                    }
                }
            }
        });
    }

    /// Bulk nodes by vector, special ones in a list.
    fn sort_nodes(&mut self) {
        let n = self.row_nodes();
        let (layout, one) = (self.layout.clone(), self.stencils.len() == 1);
        let bulk = if one { Vec::new() } else { self.body.grid.uniform_around(&self.stencil, self.half.reach) };
        let is_special = |row: usize, e: usize, s: u16| {
            !one && !bulk[row * n + e]
                && self.half.offset.iter().any(|&offset| {
                    [offset, offset.map(|x| -x)]
                        .into_iter()
                        .any(|offset| self.node_at(row, e, offset).is_some_and(|other| self.stencil[other] != s))
                })
        };
        let special: Vec<Vec<u32>> = (0..layout.rows())
            .into_par_iter()
            .map(|row| {
                let here = |&e: &usize| self.stencil[row * n + e] > 0 && is_special(row, e, self.stencil[row * n + e]);
                (0..n).filter(here).map(|e| (row * n + e) as u32).collect()
            })
            .collect();
        let mut places: HashMap<Mixture, u32> = HashMap::new();
        self.special_from.push(0);
        for (row, special) in special.into_iter().enumerate() {
            for j in 0..layout.length {
                let mut lanes = [0; MOST_LANES];
                for (lane, to) in lanes.iter_mut().enumerate().take(layout.lanes) {
                    let e = lane * layout.length + j;
                    if e < n && special.binary_search(&((row * n + e) as u32)).is_err() {
                        *to = self.stencil[row * n + e];
                    }
                }
                if let Some(some) = lanes.into_iter().find(|&s| s > 0) {
                    let stencils = lanes.map(|s| if s > 0 { s } else { some });
                    let mixture = Mixture { stencils, uniform: stencils.iter().all(|&s| s == some) };
                    let next = self.mixtures.len() as u32 + 1;
                    let place = *places.entry(mixture).or_insert(next);
                    if place == next {
                        self.mixtures.push(mixture);
                    }
                    self.mixture[row * layout.length + j] = place;
                }
            }
            self.special.extend(special);
            self.special_from.push(self.special.len() as u32);
        }
    }

    /// Whether a node is in the list of special ones.
    pub(super) fn is_special(&self, node: usize) -> bool {
        self.special_place(node).is_some()
    }

    /// Vectors all bonds of whose bulk lanes are there.
    pub(super) fn find_whole(&mut self) {
        let (n, layout) = (self.row_nodes(), &self.layout);
        let whole: Vec<bool> = (0..layout.rows() * layout.length)
            .into_par_iter()
            .map(|vector| {
                let (row, j) = (vector / layout.length, vector % layout.length);
                let bulk = |&lane: &usize| {
                    let e = lane * layout.length + j;
                    e < n && self.stencil[row * n + e] > 0 && !self.is_special(row * n + e)
                };
                let lanes = (0..layout.lanes).filter(bulk).fold(0, |bits, lane| bits | 1 << lane);
                let slot = (j + layout.reach[0]) * layout.lanes;
                lanes == 0
                    || (0..self.half.len()).all(|p| {
                        let [dx, dy, dz] = self.half.offset[p];
                        let behind = (slot as i64 - i64::from(dx) * layout.lanes as i64) as usize;
                        let others = self.word(layout.row_at(row, [-dy, -dz]), behind, p);
                        self.word(row, slot, p).bits() & others.bits() & lanes == lanes
                    })
            })
            .collect();
        self.whole = whole;
    }

    /// Number of unbroken bonds of an element of a row.
    pub(super) fn degree(&self, row: usize, element: usize) -> usize {
        (0..self.half.len())
            .map(|p| usize::from(self.own_bit(row, element, p)) + usize::from(self.opposite_bit(row, element, p)))
            .sum()
    }

    /// Bits of half bond p of the lanes at a slot's position of a row.
    #[inline]
    fn word(&self, row: usize, slot: usize, p: usize) -> T::Word {
        self.bits.slice()[(row * self.layout.positions() + slot / self.layout.lanes) * self.words + p]
    }

    /// Whether half bond p of the node at a slot of a row, or of the row of zeros, is unbroken.
    #[inline]
    pub(super) fn bit_at(&self, row: usize, slot: usize, p: usize) -> bool {
        self.word(row, slot, p).bits() >> (slot % self.layout.lanes) & 1 == 1
    }

    /// Whether half bond p of an element is unbroken.
    #[inline]
    pub(super) fn own_bit(&self, row: usize, element: usize, p: usize) -> bool {
        self.bit_at(row, self.layout.slot(element), p)
    }

    /// Whether the bond at −ξ of half bond p, a half bond of the node there, is unbroken.
    #[inline]
    pub(super) fn opposite_bit(&self, row: usize, element: usize, p: usize) -> bool {
        let [dx, dy, dz] = self.half.offset[p];
        let slot = self.layout.slot(element) as i64 - i64::from(dx) * self.layout.lanes as i64;
        self.bit_at(self.layout.row_at(row, [-dy, -dz]), slot as usize, p)
    }

    /// Half bonds p of nodes fail: they are cleared, and the nodal terms of both ends end.
    pub(super) fn fail_bonds(&mut self, failed: impl Iterator<Item = (usize, usize)> + Clone) {
        if self.has_nodal_term() {
            let n = self.row_nodes();
            for (node, p) in failed.clone() {
                self.torn[node] = true;
                if let Some(other) = self.node_at(node / n, node % n, self.half.offset[p]) {
                    self.torn[other] = true;
                }
            }
        }
        self.clear(failed);
    }

    /// Take half bonds p of nodes away.
    pub(super) fn clear(&mut self, broken: impl IntoIterator<Item = (usize, usize)>) {
        let (n, layout) = (self.row_nodes(), self.layout.clone());
        for (node, p) in broken {
            let (row, e) = (node / n, node % n);
            for &slot in layout.copies(e) {
                let (position, lane) = (slot as usize / layout.lanes, slot as usize % layout.lanes);
                let word = (row * layout.positions() + position) * self.words + p;
                self.bits.slice_mut()[word] &= !T::Word::bit(lane);
            }
            self.whole[row * layout.length + e % layout.length] = false;
            if let Some(other) = self.node_at(row, e, self.half.offset[p]) {
                self.whole[other / n * layout.length + other % n % layout.length] = false;
                if let Some(place) = self.special_place(other) {
                    self.surroundings.clear(place, p, false);
                }
            }
            if let Some(place) = self.special_place(node) {
                self.surroundings.clear(place, p, true);
            }
        }
    }
}

fn check(
    set: InstructionSet,
    body: &Body,
    neighbourhood: &Neighbourhood,
    stencil: &[u16],
    stencils: &[Stencil],
) -> Result<()> {
    if !set.available() {
        return Err(Error::input(format!("this machine has no {set:?}"), "use InstructionSet::best()"));
    }
    let (spacing, expected) = (body.grid.spacing, neighbourhood.spacing());
    if (spacing - expected).abs() > 1e-12 * expected {
        return Err(Error::input(
            format!("the grid's spacing is {spacing} m, the neighbourhood's {expected} m"),
            "build both with the same spacing",
        ));
    }
    if (neighbourhood.orientation() - Matrix3::identity()).norm() > 1e-12 {
        return Err(Error::input("the neighbourhood is turned against the grid", "turn the material instead"));
    }
    if stencil.len() != body.grid.len() || body.region.len() != body.grid.len() {
        return Err(Error::input(
            format!("{} stencils and {} regions for {} nodes", stencil.len(), body.region.len(), body.grid.len()),
            "give one per node of the grid",
        ));
    }
    let wrong = |&i: &usize| usize::from(stencil[i]) > stencils.len() || (stencil[i] > 0) != body.has(i);
    if let Some(i) = (0..stencil.len()).find(wrong) {
        return Err(Error::input(
            format!("node {i} of region {} has stencil {} of {}", body.region[i], stencil[i], stencils.len()),
            "give nodes of the body a stencil from 1 on, others 0",
        ));
    }
    let regions = usize::from(body.region.iter().copied().max().unwrap_or(0));
    if body.region.iter().any(|&r| r > 0 && usize::from(r) != regions) && regions > stencils.len() {
        return Err(Error::input(
            format!("{} stencils for {regions} regions", stencils.len()),
            "give first those of the regions' bulk, in their order",
        ));
    }
    let half = neighbourhood.bonds().len() / 2;
    if half > MOST_HALF_BONDS {
        return Err(Error::input(
            format!("{half} bonds per node, each counted once"),
            format!("use a horizon of at most {MOST_HALF_BONDS} such bonds (ratio 7)"),
        ));
    }
    stencils.iter().try_for_each(|s| s.check(neighbourhood.bonds().len()))
}
