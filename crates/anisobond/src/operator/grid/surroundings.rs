//! Constants of the bonds of nodes between stencils, by half bond, in vectors: mean values of what both ends say, and where
//! regions meet those of their layers ([`super::interface`]).
//!
//! Nodes of a flat interface or surface share them: each node keeps 4 bytes that say which they are, and one bit per bond.

use std::collections::HashMap;

use rayon::prelude::*;
use twox_hash::XxHash3_128;

use super::aligned::Aligned;
use super::build::GridBonds;
use super::interface::{Interfaces, KnownLayers};
use super::law::mean;
use super::real::Real;
use super::stencil::MOST_LANES;

/// Nodes whose surroundings are found at once.
const TOGETHER: usize = 4096;

/// The surroundings of special nodes, by their place in `GridBonds::special`.
#[derive(Debug)]
pub struct Surroundings<T: Real> {
    /// Number of the surroundings of each.
    of: Vec<u32>,
    /// Which of its bonds are unbroken: bits of half bonds at +ξ, then of those at −ξ.
    unbroken: Vec<u16>,
    /// k (N/m) and s_c (–) by surroundings, of half bonds at +ξ, then of those at −ξ, each in whole vectors.
    stiffness: Aligned<T>,
    critical: Aligned<T>,
    /// Half bonds, and so many in whole vectors.
    half: usize,
    padded: usize,
}

/// What a special node's bonds are.
pub struct Surrounding<'a, T> {
    /// k (N/m), of half bonds at +ξ, then of those at −ξ, each in whole vectors.
    pub stiffness: &'a [T],
    /// s_c (–), likewise.
    pub critical: &'a [T],
    /// Bits of unbroken half bonds, likewise.
    pub unbroken: &'a [u16],
}

impl<T: Real> Surroundings<T> {
    /// Bits of unbroken bonds of all nodes, to be put back later.
    pub(super) fn unbroken(&self) -> &[u16] {
        &self.unbroken
    }

    /// Bonds as unbroken as they were.
    pub(super) fn set_unbroken(&mut self, unbroken: &[u16]) {
        self.unbroken.copy_from_slice(unbroken);
    }

    /// Of no node.
    pub fn none() -> Self {
        let (stiffness, critical) = (Aligned::zeros(0), Aligned::zeros(0));
        Surroundings { of: vec![], unbroken: vec![], stiffness, critical, half: 0, padded: 0 }
    }

    /// Of the special nodes of these bonds, as far as they are unbroken.
    pub fn new(bonds: &GridBonds<T>) -> Self {
        let half = bonds.half.len();
        let padded = half.next_multiple_of(MOST_LANES);
        let interfaces = Interfaces::of(bonds);
        let (mut of, mut unbroken) = (Vec::new(), Vec::new());
        let [mut stiffness, mut critical] = [Vec::new(), Vec::new()];
        let mut numbers: HashMap<u128, u32> = HashMap::new();
        for nodes in bonds.special.chunks(TOGETHER) {
            let find = |known: &mut KnownLayers, &node: &u32| {
                let node = node as usize;
                let of_layers = interfaces.as_ref().map(|i| bonds.constants_around(node, padded, Some(i), known));
                let hash = of_layers.as_ref().map_or_else(|| hash_of_stencils(&bonds.stencils_around(node)), hash);
                (node, hash, of_layers, bonds.unbroken_around(node, padded))
            };
            let found: Vec<_> = nodes.par_iter().map_init(KnownLayers::new, find).collect();
            for (node, hash, of_layers, bits) in found {
                unbroken.extend(bits);
                let next = numbers.len() as u32;
                of.push(*numbers.entry(hash).or_insert_with(|| {
                    let constants = of_layers
                        .unwrap_or_else(|| bonds.constants_around(node, padded, None, &mut KnownLayers::new()));
                    stiffness.extend_from_slice(&constants[0]);
                    critical.extend_from_slice(&constants[1]);
                    next
                }));
            }
        }
        let aligned = |values: Vec<T>| {
            let mut aligned = Aligned::zeros(values.len());
            aligned.slice_mut().copy_from_slice(&values);
            aligned
        };
        Surroundings { of, unbroken, stiffness: aligned(stiffness), critical: aligned(critical), half, padded }
    }

    /// Change every critical stretch (–).
    pub fn change_critical(&mut self, to: impl Fn(T) -> T) {
        self.critical.slice_mut().iter_mut().for_each(|s| *s = to(*s));
    }

    /// k (N/m) and s_c (–) of half bond p, or of the bond at its −ξ, of the special node at a place.
    pub fn constants(&self, place: usize, p: usize, ahead: bool) -> [T; 2] {
        let at = self.of[place] as usize * 2 * self.padded + if ahead { p } else { self.padded + p };
        [self.stiffness.slice()[at], self.critical.slice()[at]]
    }

    /// Those of the special node at a place.
    #[inline(always)]
    pub fn at(&self, place: usize) -> Surrounding<'_, T> {
        let words = 2 * self.padded / MOST_LANES;
        let numbers = self.of[place] as usize * 2 * self.padded..(self.of[place] as usize + 1) * 2 * self.padded;
        Surrounding {
            stiffness: &self.stiffness.slice()[numbers.clone()],
            critical: &self.critical.slice()[numbers],
            unbroken: &self.unbroken[place * words..(place + 1) * words],
        }
    }

    /// Break half bond p, or the bond at its −ξ, of the special node at a place.
    pub fn clear(&mut self, place: usize, p: usize, ahead: bool) {
        let words = self.padded / MOST_LANES;
        let word = place * 2 * words + if ahead { 0 } else { words } + p / MOST_LANES;
        self.unbroken[word] &= !(1 << (p % MOST_LANES));
    }

    /// Whether the special node at a place has all its bonds.
    pub fn is_whole(&self, place: usize) -> bool {
        let words = 2 * self.padded / MOST_LANES;
        let unbroken = &self.unbroken[place * words..(place + 1) * words];
        unbroken.iter().map(|w| w.count_ones() as usize).sum::<usize>() == 2 * self.half
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        4 * self.of.len() + 2 * self.unbroken.len() + self.stiffness.bytes() + self.critical.bytes()
    }
}

impl<T: Real> GridBonds<T> {
    /// k (N/m) and s_c (–) of the bonds of a node, of half bonds at +ξ, then of those at −ξ, each in whole vectors.
    fn constants_around(
        &self,
        node: usize,
        padded: usize,
        interfaces: Option<&Interfaces<T>>,
        known: &mut KnownLayers,
    ) -> [Vec<T>; 2] {
        let (row, e, bonds) = (node / self.row_nodes(), node % self.row_nodes(), self.half.bonds);
        let [mut stiffness, mut critical] = [vec![T::default(); 2 * padded], vec![T::default(); 2 * padded]];
        for ahead in [true, false] {
            for (p, &offset) in self.half.offset.iter().enumerate() {
                let to = if ahead { offset } else { offset.map(|x| -x) };
                let Some(other) = self.node_at(row, e, to) else { continue };
                let (first, second) = if ahead { (node, other) } else { (other, node) };
                let place = if ahead { p } else { padded + p };
                let between = interfaces.and_then(|i| i.constants(first, p, second, known));
                [stiffness[place], critical[place]] = between.map(|c| c.map(T::of)).unwrap_or_else(|| {
                    let b = self.half.full[p];
                    [&self.stiffness, &self.critical].map(|values| {
                        let at = |node: usize, b: usize| values[(usize::from(self.stencil[node]) - 1) * bonds + b];
                        mean(at(first, b), at(second, self.half.opposite(b)))
                    })
                });
            }
        }
        [stiffness, critical]
    }

    /// Stencil of a node and of the other ends of its bonds, 0 where there is none: without interfaces they say what its
    /// bonds' constants are.
    fn stencils_around(&self, node: usize) -> Vec<u16> {
        let (row, e) = (node / self.row_nodes(), node % self.row_nodes());
        let of = |other: Option<usize>| other.map_or(0, |other| self.stencil[other]);
        let ends = self.half.offset.iter().flat_map(|&to| [to, to.map(|x| -x)]);
        std::iter::once(self.stencil[node]).chain(ends.map(|to| of(self.node_at(row, e, to)))).collect()
    }

    /// Bits of a node's unbroken bonds.
    fn unbroken_around(&self, node: usize, padded: usize) -> Vec<u16> {
        let (row, e) = (node / self.row_nodes(), node % self.row_nodes());
        let mut bits = vec![0; 2 * padded / MOST_LANES];
        for ahead in [true, false] {
            let word = if ahead { 0 } else { padded / MOST_LANES };
            for p in 0..self.half.len() {
                let unbroken = if ahead { self.own_bit(row, e, p) } else { self.opposite_bit(row, e, p) };
                bits[word + p / MOST_LANES] |= u16::from(unbroken) << (p % MOST_LANES);
            }
        }
        bits
    }

    /// k (N/m) and s_c (–) of half bond p of a node, or of the bond at its −ξ, as both of its ends know it.
    pub(super) fn constants_of(&self, node: usize, p: usize, ahead: bool) -> [T; 2] {
        self.constants_at(node, self.special_place(node), p, ahead)
    }

    /// The same of a node whose place in the list of special ones is known.
    pub(super) fn constants_at(&self, node: usize, place: Option<usize>, p: usize, ahead: bool) -> [T; 2] {
        if let Some(place) = place {
            return self.surroundings.constants(place, p, ahead);
        }
        let (b, from) = (self.half.full[p], (usize::from(self.stencil[node]) - 1) * self.half.bonds);
        [&self.stiffness, &self.critical].map(|values| mean(values[from + b], values[from + self.half.opposite(b)]))
    }

    /// Place of a node in the list of special ones.
    pub(super) fn special_place(&self, node: usize) -> Option<usize> {
        let row = node / self.row_nodes();
        let from = self.special_from[row] as usize;
        let of_row = &self.special[from..self.special_from[row + 1] as usize];
        of_row.binary_search(&(node as u32)).ok().map(|place| from + place)
    }
}

/// A number for the stencils around a node, by which equal ones are found.
fn hash_of_stencils(stencils: &[u16]) -> u128 {
    let bytes: Vec<u8> = stencils.iter().flat_map(|s| s.to_le_bytes()).collect();
    XxHash3_128::oneshot(&bytes)
}

/// A number for the constants of a node's bonds, by which equal ones are found.
fn hash<T: Real>([stiffness, critical]: &[Vec<T>; 2]) -> u128 {
    let numbers = stiffness.iter().chain(critical);
    let bytes: Vec<u8> = numbers.flat_map(|x| x.f64().to_bits().to_le_bytes()).collect();
    XxHash3_128::oneshot(&bytes)
}
