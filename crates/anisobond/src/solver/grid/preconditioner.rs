//! Preconditioners: a node's own block for short waves, coarse grids of local elasticity for long ones.

use std::collections::{BTreeMap, HashMap};

use rayon::prelude::*;

use super::census::{Blocks, Census};
use super::coarsening::Coarsening;
use super::hexahedra::{Filling, Hexahedra, Part};
use super::multigrid::{Multigrid, Smoothing};
use super::pieces::Pieces;
use super::supports::Supports;
use super::symmetric3::{Symmetric3, pseudo_inverse};
use super::transfer::Transfer;
use super::vectors::{add_scaled, scale_add};
use super::waves::cheap_waves;
use crate::lattice::Body;
use crate::operator::{GridOperator, VectorField};
use crate::solver::{LinearOperator, Preconditioner};
use crate::tensor::Stiffness;

/// A prescribed component is a spring to ground on the coarse grids, so many times as stiff as the node's own block.
const SUPPORT: f64 = 4.0;

/// What a first coarse grid of twice the nodes must gain.
const PRICE: f64 = 3.0;

/// The inverse of every node's own 3×3 block.
pub struct NodeBlocks {
    kind: Vec<u32>,
    inverse: Vec<Symmetric3>,
    row: usize,
}

impl NodeBlocks {
    /// Of an operator, with prescribed components left out. Equal blocks are kept once.
    pub fn new(operator: &dyn GridOperator, supports: &Supports) -> Self {
        NodeBlocks::of(&Blocks::new(operator), operator.body().grid.nodes[0], supports)
    }

    /// The same of what is known of the nodes, in rows of a length.
    pub(super) fn of(blocks: &Blocks, row: usize, supports: &Supports) -> Self {
        let mut kind = blocks.kind.clone();
        let mut inverse: Vec<Symmetric3> = blocks.distinct.iter().map(|block| inverse_of(*block, 0)).collect();
        let mut known: HashMap<(u32, u8), u32> = HashMap::new();
        for (node, fixed) in fixed_bits(supports) {
            let free = blocks.kind[node as usize];
            kind[node as usize] = *known.entry((free, fixed)).or_insert_with(|| {
                inverse.push(inverse_of(blocks.distinct[free as usize], fixed));
                (inverse.len() - 1) as u32
            });
        }
        NodeBlocks { kind, inverse, row }
    }

    /// The inverse block of a node.
    pub fn block(&self, node: usize) -> &Symmetric3 {
        &self.inverse[self.kind[node] as usize]
    }

    /// z = D⁻¹ r.
    pub fn times(&self, r: &VectorField, z: &mut VectorField) {
        self.apply_rows(1.0, r, z, None);
    }

    /// z = s D⁻¹ r + P x of a coarse x, row by row.
    fn apply_rows(&self, s: f64, r: &VectorField, z: &mut VectorField, coarse: Option<(&Transfer, &[[f64; 3]])>) {
        let row = self.row;
        let [z1, z2, z3] = &mut z.components;
        let rows = z1.par_chunks_mut(row).zip(z2.par_chunks_mut(row)).zip(z3.par_chunks_mut(row));
        rows.enumerate().for_each(|(number, ((z1, z2), z3))| {
            let start = number * row;
            for i in 0..row {
                let n = start + i;
                let v = [r.components[0][n], r.components[1][n], r.components[2][n]];
                let [x, y, w] = self.block(n).times(&v);
                (z1[i], z2[i], z3[i]) = (s * x, s * y, s * w);
            }
            if let Some((transfer, values)) = coarse {
                let n2 = transfer.fine[1];
                transfer.row(values, number % n2, number / n2, |i, v| {
                    z1[i] += v[0];
                    z2[i] += v[1];
                    z3[i] += v[2];
                });
            }
        });
    }
}

impl Preconditioner<VectorField> for NodeBlocks {
    fn apply(&self, _: &dyn LinearOperator<VectorField>, r: &VectorField, z: &mut VectorField) -> usize {
        self.times(r, z);
        0
    }
}

/// The inverse of a block (11 22 33 23 13 12) whose prescribed components, a bit each, are left out.
fn inverse_of(block: [f64; 6], fixed: u8) -> Symmetric3 {
    let at = |i: usize, j: usize, value: f64| if (fixed >> i | fixed >> j) & 1 == 0 { value } else { 0.0 };
    let [a, b, c, d, e, f] = block;
    let (a, b, c, d, e, f) = (at(0, 0, a), at(1, 1, b), at(2, 2, c), at(1, 2, d), at(0, 2, e), at(0, 1, f));
    pseudo_inverse(&[[a, f, e], [f, b, d], [e, d, c]])
}

/// Nodes with prescribed components, with one bit per component that is.
fn fixed_bits(supports: &Supports) -> BTreeMap<u32, u8> {
    let mut bits = BTreeMap::new();
    for a in 0..3 {
        for node in supports.nodes(a) {
            *bits.entry(*node).or_default() |= 1 << a;
        }
    }
    bits
}

/// How the node blocks and the coarse grids are put together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scheme {
    /// M⁻¹ = w D⁻¹ + P A⁻¹ Pᵀ: no application of K.
    Additive {
        /// Weight w.
        weight: f64,
    },
    /// Node blocks, coarse grids, node blocks, each on what the one before left: two applications of K.
    Multiplicative {
        /// Weight w of the node blocks; below 2 over the largest eigenvalue of D⁻¹K.
        weight: f64,
    },
}

impl Default for Scheme {
    fn default() -> Self {
        Scheme::Additive { weight: 1.0 }
    }
}

/// Node blocks and coarse grids.
///
/// The coarse grids are elements of local elasticity at spacings 2Δ, 4Δ, … with the regions' bulk tensors, weighed by
/// the share of each region and by how whole its nodes' bonds are; elements parted by cracks or gaps are there once for every
/// piece. Short waves that cost little have coarse grids of their own.
pub struct TwoScale {
    supports: Supports,
    /// Nodes without material.
    empty: Vec<u32>,
    blocks: NodeBlocks,
    transfer: Transfer,
    multigrid: Multigrid,
    waves: Vec<Wave>,
    scheme: Scheme,
}

/// Waves that turn their sign from node to node along some axes and cost little.
struct Wave {
    signs: [bool; 3],
    multigrid: Multigrid,
}

impl TwoScale {
    /// For an operator and its supports.
    pub fn new(operator: &dyn GridOperator, supports: &Supports, scheme: Scheme, smoothing: Smoothing) -> Self {
        TwoScale::of(operator, &Census::new(operator), &Blocks::new(operator), supports, scheme, smoothing)
    }

    /// The same with what is known of the nodes.
    pub(super) fn of(
        operator: &dyn GridOperator,
        census: &Census,
        blocks: &Blocks,
        supports: &Supports,
        scheme: Scheme,
        smoothing: Smoothing,
    ) -> Self {
        let grid = &operator.body().grid;
        let wraps = std::array::from_fn(|a| grid.periodic[a] || grid.nodes[a] == 1);
        let regions = operator.body().region.iter().copied().max().unwrap_or(0);
        let tensors: Vec<Stiffness> = (0..regions).map(|r| operator.bulk_stiffness(r)).collect();
        let possible = std::array::from_fn(|a| grid.nodes[a] > if wraps[a] { 1 } else { 2 });
        let axes = Coarsening::new(&tensors, [1.0; 3], possible, PRICE).axes;
        let transfer = Transfer::new(grid.nodes, wraps, axes);
        let pieces = Pieces::new(&transfer, census.pieces(operator.body(), &transfer));
        let transfer = transfer.with(&pieces, &[]);
        let edges = std::array::from_fn(|a| grid.spacing * transfer.axes[a].factor as f64);
        let filled = filling(operator.body(), census, &transfer, pieces);
        let springs = springs(blocks, supports);
        let support = transfer.restrict(|n| springs.get(&(n as u32)).copied().unwrap_or_default());
        let support = support.into_iter().map(|s| s.map(|s| s.max(0.0))).collect();
        let waves = cheap_waves(operator, regions, axes)
            .into_iter()
            .map(|(signs, bulk)| {
                let spring = |node: usize| {
                    let held = springs.get(&(node as u32)).copied().unwrap_or_default();
                    match operator.body().region[node] {
                        0 => held,
                        region => {
                            let own = &bulk[usize::from(region) - 1].springs;
                            [0, 1, 2].map(|a| held[a] + census.wholeness[node] * own[(a, a)])
                        }
                    }
                };
                let tensors: Vec<Stiffness> = bulk.iter().map(|b| b.stiffness).collect();
                let support = transfer.restrict(spring).into_iter().map(|s| s.map(|s| s.max(0.0))).collect();
                let finest =
                    Hexahedra::new(transfer.coarse(), transfer.elements(), edges, filled.clone(), support, &tensors);
                Wave { signs, multigrid: Multigrid::new(finest, &tensors, smoothing) }
            })
            .collect();
        let finest = Hexahedra::new(transfer.coarse(), transfer.elements(), edges, filled, support, &tensors);
        let multigrid = Multigrid::new(finest, &tensors, smoothing);
        let blocks = NodeBlocks::of(blocks, grid.nodes[0], supports);
        let empty = (0..grid.len()).filter(|&node| !operator.body().has(node)).map(|node| node as u32).collect();
        TwoScale { supports: supports.clone(), empty, blocks, transfer, multigrid, waves, scheme }
    }

    /// A⁻¹ Pᵀ r.
    fn coarse(&self, r: &VectorField) -> Vec<[f64; 3]> {
        let [x, y, z] = &r.components;
        self.multigrid.solve(&self.transfer.restrict(|n| [x[n], y[n], z[n]]))
    }

    /// z += S P A⁻¹ Pᵀ S r for every cheap wave, S being its signs.
    fn add_waves(&self, r: &VectorField, z: &mut VectorField) {
        let [n1, n2, _] = self.transfer.fine;
        for wave in &self.waves {
            let sign = |node: usize| {
                let at = self.transfer.coordinates(node);
                if (0..3).filter(|a| wave.signs[*a] && at[*a] % 2 == 1).count() % 2 == 1 { -1.0 } else { 1.0 }
            };
            let [x, y, w] = &r.components;
            let coarse = wave.multigrid.solve(&self.transfer.restrict(|n| [x[n], y[n], w[n]].map(|v| sign(n) * v)));
            let [z1, z2, z3] = &mut z.components;
            let rows = z1.par_chunks_mut(n1).zip(z2.par_chunks_mut(n1)).zip(z3.par_chunks_mut(n1));
            rows.enumerate().for_each(|(number, ((z1, z2), z3))| {
                self.transfer.row(&coarse, number % n2, number / n2, |i, v| {
                    let s = sign(number * n1 + i);
                    z1[i] += s * v[0];
                    z2[i] += s * v[1];
                    z3[i] += s * v[2];
                });
            });
        }
    }

    /// Zero on prescribed components and empty nodes.
    fn clear(&self, z: &mut VectorField) {
        self.supports.clear(z);
        for z in &mut z.components {
            self.empty.iter().for_each(|&node| z[node as usize] = 0.0);
        }
    }
}

impl Preconditioner<VectorField> for TwoScale {
    fn apply(&self, operator: &dyn LinearOperator<VectorField>, r: &VectorField, z: &mut VectorField) -> usize {
        match self.scheme {
            Scheme::Additive { weight } => {
                let coarse = self.coarse(r);
                self.blocks.apply_rows(weight, r, z, Some((&self.transfer, &coarse)));
                self.add_waves(r, z);
                self.clear(z);
                0
            }
            Scheme::Multiplicative { weight } => {
                self.blocks.apply_rows(weight, r, z, None);
                let mut rest = VectorField::zeros(r.len());
                operator.apply(z, &mut rest);
                scale_add(&mut rest, -1.0, r);
                self.supports.clear(&mut rest);
                let coarse = self.coarse(&rest);
                let mut step = VectorField::zeros(r.len());
                self.blocks.apply_rows(0.0, r, &mut step, Some((&self.transfer, &coarse)));
                self.add_waves(&rest, &mut step);
                self.clear(&mut step);
                add_scaled(z, 1.0, &step);
                operator.apply(z, &mut rest);
                scale_add(&mut rest, -1.0, r);
                self.blocks.apply_rows(weight, &rest, &mut step, None);
                add_scaled(z, 1.0, &step);
                2
            }
        }
    }
}

/// What every element of spacing 2Δ holds: nodes are cells of volume Δ³, shared between the elements they touch.
fn filling(body: &Body, census: &Census, transfer: &Transfer, pieces: Pieces) -> Filling {
    let shares: [Vec<Vec<(usize, f64)>>; 3] = std::array::from_fn(|a| {
        let axis = &transfer.axes[a];
        let per_cell = |(e, share): (usize, f64)| (e, share / axis.cells(e, transfer.fine[a]));
        (0..transfer.fine[a]).map(|i| axis.shares_of_node(i).into_iter().map(per_cell).collect()).collect()
    });
    let mut filling = Filling::empty(transfer.elements().iter().product(), pieces.copies.clone());
    for (node, whole) in census.wholeness.iter().enumerate().filter(|w| *w.1 > 0.0) {
        let [i, j, k] = body.grid.coordinates(node);
        for &(ek, wk) in &shares[2][k] {
            for &(ej, wj) in &shares[1][j] {
                for &(ei, wi) in &shares[0][i] {
                    let part = Part { region: body.region[node] - 1, weight: whole * wi * wj * wk };
                    let element = transfer.element_index([ei, ej, ek]);
                    let usual = transfer.corners(element);
                    let own = pieces.holding(element, node as u32).map_or(usual.map(|c| c as u32), |p| p.corners);
                    filling.add(element, own, usual, part);
                }
            }
        }
    }
    filling
}

/// Springs to ground (N/m) of the nodes with prescribed components.
fn springs(blocks: &Blocks, supports: &Supports) -> HashMap<u32, [f64; 3]> {
    let mut springs: HashMap<u32, [f64; 3]> = HashMap::new();
    for a in 0..3 {
        for node in supports.nodes(a) {
            let block = blocks.of(*node as usize);
            springs.entry(*node).or_default()[a] = SUPPORT * block[(a, a)];
        }
    }
    springs
}
