//! Constants of the bonds of nodes between stencils: mean values of what both ends say, by half bond, in vectors.
//!
//! They depend on nothing but the stencils around a node, so that nodes of a flat interface or surface share them: each
//! node keeps 4 bytes that say which they are, and one bit per bond.

use std::collections::HashMap;

use rayon::prelude::*;

use super::aligned::Aligned;
use super::build::GridBonds;
use super::law::mean;
use super::real::Real;
use super::stencil::{HalfBonds, MOST_LANES};

/// Nodes whose surroundings are found at once.
const TOGETHER: usize = 4096;

/// The surroundings of special nodes, by their place in `GridBonds::special`.
#[derive(Debug)]
pub struct Surroundings<T: Real> {
    /// Number of the surroundings of each.
    of: Vec<u32>,
    /// Which of its bonds are unbroken: bits of half bonds at +ξ, then of those at −ξ.
    unbroken: Vec<u16>,
    /// By surroundings: stencil of the node, then those at +ξ, then at −ξ, by half bond; 0 is no node.
    stencils: Vec<u16>,
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
        Surroundings { of: vec![], unbroken: vec![], stencils: vec![], stiffness, critical, half: 0, padded: 0 }
    }

    /// Of the special nodes of these bonds, as far as they are unbroken.
    pub fn new(bonds: &GridBonds<T>) -> Self {
        let half = bonds.half.len();
        let padded = half.next_multiple_of(MOST_LANES);
        let (mut of, mut stencils, mut unbroken) = (Vec::new(), Vec::new(), Vec::new());
        let mut numbers: HashMap<Vec<u16>, u32> = HashMap::new();
        for nodes in bonds.special.chunks(TOGETHER) {
            let found: Vec<_> = nodes.par_iter().map(|&node| bonds.surrounding_of(node as usize, padded)).collect();
            for (around, bits) in found {
                unbroken.extend(bits);
                let next = numbers.len() as u32;
                of.push(*numbers.entry(around).or_insert_with_key(|around| {
                    stencils.extend_from_slice(around);
                    next
                }));
            }
        }
        let numbers = 2 * padded * numbers.len();
        let (stiffness, critical) = (Aligned::zeros(numbers), Aligned::zeros(numbers));
        let mut made = Surroundings { of, unbroken, stencils, stiffness, critical, half, padded };
        made.set(&bonds.half, &bonds.stiffness, &bonds.critical);
        made
    }

    /// Take over k (N/m) and s_c (–) by stencil and bond.
    pub fn set(&mut self, half: &HalfBonds<T>, stiffness: &[T], critical: &[T]) {
        if self.of.is_empty() {
            return;
        }
        for (to, values) in [(&mut self.stiffness, stiffness), (&mut self.critical, critical)] {
            let around = self.stencils.chunks_exact(1 + 2 * self.half);
            for (to, around) in to.slice_mut().chunks_exact_mut(2 * self.padded).zip(around) {
                let (own, others) = (usize::from(around[0]), &around[1..]);
                for (i, &other) in others.iter().enumerate().filter(|(_, other)| **other > 0) {
                    let (p, ahead) = (i % self.half, i < self.half);
                    let (first, second) = if ahead { (own, usize::from(other)) } else { (usize::from(other), own) };
                    let b = half.full[p];
                    let place = if ahead { p } else { self.padded + p };
                    let of = |stencil: usize, bond: usize| values[(stencil - 1) * half.bonds + bond];
                    to[place] = mean(of(first, b), of(second, half.opposite(b)));
                }
            }
        }
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
        4 * self.of.len()
            + 2 * (self.unbroken.len() + self.stencils.len())
            + self.stiffness.bytes()
            + self.critical.bytes()
    }
}

impl<T: Real> GridBonds<T> {
    /// Stencils around a node, and bits of its unbroken bonds.
    fn surrounding_of(&self, node: usize, padded: usize) -> (Vec<u16>, Vec<u16>) {
        let (row, e) = (node / self.row_nodes(), node % self.row_nodes());
        let mut around = vec![self.stencil[node]];
        let mut bits = vec![0; 2 * padded / MOST_LANES];
        for ahead in [true, false] {
            let word = if ahead { 0 } else { padded / MOST_LANES };
            for (p, &offset) in self.half.offset.iter().enumerate() {
                let to = if ahead { offset } else { offset.map(|x| -x) };
                around.push(self.node_at(row, e, to).map_or(0, |other| self.stencil[other]));
                let unbroken = if ahead { self.own_bit(row, e, p) } else { self.opposite_bit(row, e, p) };
                bits[word + p / MOST_LANES] |= u16::from(unbroken) << (p % MOST_LANES);
            }
        }
        (around, bits)
    }

    /// Place of a node in the list of special ones.
    pub(super) fn special_place(&self, node: usize) -> Option<usize> {
        let row = node / self.row_nodes();
        let from = self.special_from[row] as usize;
        let of_row = &self.special[from..self.special_from[row + 1] as usize];
        of_row.binary_search(&(node as u32)).ok().map(|place| from + place)
    }
}
