//! Displacements in the kernels' memory.

use std::sync::Arc;

use rayon::prelude::*;

use super::aligned::Aligned;
use super::layout::Layout;
use super::real::Real;
use crate::operator::VectorField;

/// Displacements (m) of a body's nodes, in the layout of its kernels; made by [`super::GridBonds::padded`].
///
/// Each row holds its three components one after another, with copies of elements beyond the ends of lanes; a row of
/// zeros behind all others stands for rows outside the grid.
#[derive(Clone, Debug)]
pub struct Padded<T: Real> {
    pub(super) layout: Arc<Layout>,
    pub(super) values: Aligned<T>,
}

impl<T: Real> Padded<T> {
    /// Zero displacements.
    pub(super) fn zeros(layout: &Arc<Layout>) -> Self {
        Padded { layout: layout.clone(), values: Aligned::zeros((layout.rows() + 1) * 3 * layout.slots) }
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.values.bytes()
    }

    /// Visit every row of n₁ nodes in parallel: its number j + n₂k, its displacements in natural order, which may be
    /// changed, and the row's part of three arrays of one value per node. Returns what the visits return, by row.
    pub fn update<V: Sync, R: Send>(
        &mut self,
        with: [&[V]; 3],
        visit: impl Fn(usize, [&mut [T]; 3], [&[V]; 3]) -> R + Sync,
    ) -> Vec<R> {
        let layout = &*self.layout;
        let n = layout.nodes[0];
        let stored = &mut self.values.slice_mut()[..layout.rows() * 3 * layout.slots];
        stored
            .par_chunks_mut(3 * layout.slots)
            .enumerate()
            .with_min_len(8)
            .map_init(
                || [vec![T::default(); n], vec![T::default(); n], vec![T::default(); n]],
                |natural, (row, stored)| {
                    let inner = layout.reach[0] * layout.lanes..(layout.reach[0] + layout.length) * layout.lanes;
                    for (natural, stored) in natural.iter_mut().zip(stored.chunks_exact(layout.slots)) {
                        layout.collect(&stored[inner.clone()], natural);
                    }
                    let [x, y, z] = natural;
                    let result = visit(row, [&mut *x, &mut *y, &mut *z], with.map(|v| &v[row * n..(row + 1) * n]));
                    for (natural, stored) in natural.iter().zip(stored.chunks_exact_mut(layout.slots)) {
                        layout.spread(natural, stored);
                    }
                    result
                },
            )
            .collect()
    }

    /// u += Δt v with velocities (m/s) in natural order and Δt in s.
    pub fn drift(&mut self, velocity: [&[T]; 3], step: T) {
        let layout = &*self.layout;
        let n = layout.nodes[0];
        let stored = &mut self.values.slice_mut()[..layout.rows() * 3 * layout.slots];
        stored.par_chunks_mut(layout.slots).enumerate().with_min_len(24).for_each(|(part, stored)| {
            let (row, axis) = (part / 3, part % 3);
            let velocity = &velocity[axis][row * n..(row + 1) * n];
            for (lane, velocity) in velocity.chunks(layout.length).enumerate() {
                let own = stored[layout.reach[0] * layout.lanes + lane..].iter_mut().step_by(layout.lanes);
                for (u, &v) in own.zip(velocity) {
                    *u += step * v;
                }
            }
            layout.refresh(stored);
        });
    }

    /// Take over displacements in natural order (m).
    pub fn set(&mut self, u: &VectorField) {
        let [x, y, z] = &u.components;
        self.update([x, y, z], |_, to, from| {
            for (to, from) in to.into_iter().zip(from) {
                for (to, &from) in to.iter_mut().zip(from) {
                    *to = T::of(from);
                }
            }
        });
    }

    /// The displacements in natural order (m).
    pub fn get(&self) -> VectorField {
        let layout = &*self.layout;
        let n = layout.nodes[0];
        let mut u = VectorField::zeros(layout.rows() * n);
        for (axis, component) in u.components.iter_mut().enumerate() {
            component.par_chunks_mut(n).enumerate().for_each(|(row, natural)| {
                let stored = &self.values.slice()[(3 * row + axis) * layout.slots..][..layout.slots];
                for (e, to) in natural.iter_mut().enumerate() {
                    *to = stored[layout.slot(e)].f64();
                }
            });
        }
        u
    }

    /// The displacement of a node (m), rounded as it is stored.
    pub fn at(&self, node: usize) -> [T; 3] {
        let n = self.layout.nodes[0];
        let slot = self.layout.slot(node % n);
        [0, 1, 2].map(|axis| self.values.slice()[(3 * (node / n) + axis) * self.layout.slots + slot])
    }
}
