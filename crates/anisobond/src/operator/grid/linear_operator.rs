//! Bonds as the operator that solvers of equilibrium see.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::build::GridBonds;
use super::padded::Padded;
use super::real::Real;
use super::stencil::outer;
use super::sweep::Law;
use crate::lattice::Body;
use crate::operator::{GridOperator, Kinematics, VectorField};
use crate::tensor::Stiffness;

impl<T: Real> GridOperator for GridBonds<T> {
    fn body(&self) -> &Body {
        &self.body
    }

    fn forces(&self, u: &VectorField, f: &mut VectorField) {
        // Kept between calls, because its memory is as large as the field's; a second caller at once makes its own.
        let kept = self.scratch.lock().ok().and_then(|mut scratch| scratch.take());
        let mut padded: Padded<T> = kept.unwrap_or_else(|| self.padded());
        padded.set(u);
        let law = Law { kinematics: Kinematics::Linear, breaking: false };
        let [x, y, z] = &mut f.components;
        self.pass(&padded, law, [x, y, z], |_, from, to| {
            for (to, from) in to.into_iter().zip(from) {
                for (to, &from) in to.iter_mut().zip(from) {
                    *to = from.f64();
                }
            }
        });
        if let Ok(mut scratch) = self.scratch.lock() {
            *scratch = Some(padded);
        }
    }

    fn diagonal_block(&self, node: usize) -> Matrix3<f64> {
        // The same bits for all nodes in the bulk of a stencil, whichever is first.
        match self.bulk_block.get(usize::from(self.stencil[node]).wrapping_sub(1)) {
            Some(block) if self.block_is_bulk(node) => *block.get_or_init(|| self.block_of(node)),
            _ => self.block_of(node),
        }
    }

    fn half_bonds(&self, node: usize, visit: &mut dyn FnMut(usize)) {
        let (row, e) = (node / self.row_nodes(), node % self.row_nodes());
        let place = self.special_place(node);
        for p in (0..self.half.len()).filter(|&p| self.own_bit(row, e, p)) {
            if self.constants_at(node, place, p, true)[0].f64() != 0.0
                && let Some(other) = self.node_at(row, e, self.half.offset[p])
            {
                visit(other);
            }
        }
    }

    fn bonds_along(&self, offset: [i32; 3], visit: &(dyn Fn(usize, usize) + Sync)) {
        let Some(p) = self.half.offset.iter().position(|o| *o == offset) else { return };
        let n = self.row_nodes();
        (0..self.stencil.len()).into_par_iter().with_min_len(4096).filter(|&node| self.stencil[node] > 0).for_each(
            |node| {
                if self.own_bit(node / n, node % n, p)
                    && self.constants_of(node, p, true)[0].f64() != 0.0
                    && let Some(other) = self.node_at(node / n, node % n, offset)
                {
                    visit(node, other);
                }
            },
        );
    }

    fn bulk_stiffness(&self, region: u16) -> Stiffness {
        let xi: Vec<_> = self.neighbourhood.bonds().iter().map(|b| b.xi).collect();
        self.stencils[self.most_common(region)].bulk(&xi, self.body.grid.spacing.powi(3))
    }

    fn bulk_bonds(&self, region: u16) -> Vec<([i32; 3], f64)> {
        let stiffness = &self.stencils[self.most_common(region)].stiffness;
        self.neighbourhood.bonds().iter().map(|b| b.offset).zip(stiffness.iter().copied()).collect()
    }

    fn wholeness(&self, node: usize) -> f64 {
        let s = self.stencil[node];
        if s == 0 {
            return 0.0;
        }
        if self.is_bulk(node) {
            return 1.0;
        }
        let all: f64 = self.stencils[usize::from(s) - 1].stiffness.iter().map(|k| k.abs()).sum();
        let mut here = 0.0;
        self.for_bonds(node, |_, k, _| here += k.abs());
        if all > 0.0 { (here / all).min(1.0) } else { 0.0 }
    }
}

impl<T: Real> GridBonds<T> {
    /// The stencil of most nodes of a region.
    fn most_common(&self, region: u16) -> usize {
        let mut count = vec![0usize; self.stencils.len()];
        for (&s, _) in self.stencil.iter().zip(&self.body.region).filter(|(s, r)| **s > 0 && **r == region + 1) {
            count[usize::from(s) - 1] += 1;
        }
        (0..count.len()).max_by_key(|&s| count[s]).unwrap_or(0)
    }

    /// Whether all bonds of a node are there and lead to nodes of its own stencil.
    pub(super) fn is_bulk(&self, node: usize) -> bool {
        let (row, e) = (node / self.row_nodes(), node % self.row_nodes());
        let whole = || self.whole[row * self.layout.length + e % self.layout.length];
        self.stencil[node] > 0 && !self.is_special(node) && (whole() || self.degree(row, e) == self.half.bonds)
    }

    /// Whether a node's diagonal block is that of its stencil's bulk; nodal terms take part in their neighbours' blocks.
    fn block_is_bulk(&self, node: usize) -> bool {
        let mut bulk = self.is_bulk(node);
        if bulk && self.has_nodal_term() {
            self.for_ends(node, |_, _, other| bulk = bulk && self.is_bulk(other));
        }
        bulk
    }

    /// A node's diagonal block, bond by bond.
    fn block_of(&self, node: usize) -> Matrix3<f64> {
        let mut block = self.nodal_block(node);
        self.for_bonds(node, |xi, k, own| {
            // A bond to the node's own image never stretches.
            if !own {
                block += k * outer(&xi.normalize());
            }
        });
        block
    }

    /// Visit the unbroken bonds of a node: ξ (m, to the other end or from it), k (N/m), whether the other end is the
    /// node itself.
    pub(super) fn for_bonds(&self, node: usize, mut visit: impl FnMut(&nalgebra::Vector3<f64>, f64, bool)) {
        let place = self.special_place(node);
        self.for_ends(node, |p, ahead, other| {
            visit(&self.half.xi[p], self.constants_at(node, place, p, ahead)[0].f64(), other == node);
        });
    }
}
