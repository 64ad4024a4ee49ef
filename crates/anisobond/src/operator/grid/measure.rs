//! What is asked of a state beside its forces: energy, stress, damage; and cuts.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::build::GridBonds;
use super::layout::NONE;
use super::padded::Padded;
use super::real::Real;
use crate::Result;
use crate::operator::Kinematics;

/// The state of a node; a bond's energy and stress are shared equally by its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeState {
    /// Strain energy (J).
    pub energy: f64,
    /// Virial stress ½ Σ f⊗(ξ or ξ+η) / ΔV of its bonds, and Z:ε̄ or F̄ (Z:E) F̄ᵀ of the nodal term (Pa). With finite
    /// kinematics it is the Kirchhoff stress τ = J σ: present forces and lengths per volume before the deformation.
    pub stress: Matrix3<f64>,
}

impl<T: Real> GridBonds<T> {
    /// Energy and stress of every node; zero where there is none.
    pub fn node_states(&self, u: &Padded<T>, kinematics: Kinematics) -> Vec<NodeState> {
        (0..self.stencil.len())
            .into_par_iter()
            .with_min_len(64)
            .map(|node| self.node_state(u, kinematics, node))
            .collect()
    }

    /// Strain energy (J), summed by rows in their order.
    ///
    /// # Errors
    /// Displacements of other bonds.
    pub fn energy(&self, u: &Padded<T>, kinematics: Kinematics) -> Result<f64> {
        self.refuse_others(u)?;
        let bonds = self.bonds_energy(u, kinematics);
        if !self.has_nodal_term() {
            return Ok(bonds);
        }
        let n = self.row_nodes();
        let rows: Vec<f64> = (0..self.layout.rows())
            .into_par_iter()
            .map(|row| (row * n..(row + 1) * n).map(|node| self.nodal_state(u, kinematics, node).0).sum())
            .collect();
        Ok(bonds + rows.iter().sum::<f64>())
    }

    /// Share of each node's original bonds that are broken or cut (–); zero where there is no node.
    pub fn damage(&self) -> Vec<f64> {
        let (n, layout) = (self.row_nodes(), &*self.layout);
        let of_row = |row: usize| {
            let whole = &self.whole[row * layout.length..(row + 1) * layout.length];
            let rows = self.rows_around(row);
            (0..n).map(move |e| {
                let node = row * n + e;
                match self.stencil[node] == 0 || whole[e % layout.length] && !self.is_special(node) {
                    true => 0.0,
                    false => self.damage_of(row, e, &rows),
                }
            })
        };
        (0..layout.rows()).into_par_iter().with_min_len(8).flat_map_iter(of_row).collect()
    }

    /// Rows at the offsets `HalfBonds::rows` from a row, and opposite.
    fn rows_around(&self, row: usize) -> Vec<[usize; 2]> {
        let around = |&[dy, dz]: &[i32; 2]| [[dy, dz], [-dy, -dz]].map(|offset| self.layout.row_at(row, offset));
        self.half.rows.iter().map(around).collect()
    }

    fn damage_of(&self, row: usize, element: usize, rows: &[[usize; 2]]) -> f64 {
        let (n, layout) = (self.row_nodes(), &*self.layout);
        let slot = layout.slot(element) as i64;
        let exists = |to: usize, slot: i64| {
            let e = layout.element[slot as usize];
            to < layout.rows() && e != NONE && self.stencil[to * n + e as usize] > 0
        };
        let (mut original, mut left) = (0, 0);
        for p in 0..self.half.len() {
            let [plus, minus] = rows[self.half.row_of[p]];
            let along = i64::from(self.half.offset[p][0]) * layout.lanes as i64;
            original += usize::from(exists(plus, slot + along)) + usize::from(exists(minus, slot - along));
            left += usize::from(self.bit_at(row, slot as usize, p));
            left += usize::from(self.bit_at(minus, (slot - along) as usize, p));
        }
        if original == 0 { 0.0 } else { 1.0 - left as f64 / original as f64 }
    }

    /// Cut every bond for which `cuts(p, q)` holds of its ends (m), from one end on; a bond through a periodic face ends
    /// beyond it. Returns the number of bonds cut.
    pub fn cut(&mut self, cuts: impl Fn(&Vector3<f64>, &Vector3<f64>) -> bool + Sync) -> usize {
        let n = self.row_nodes();
        let bonds = &*self;
        let cut_of = |node: usize| {
            let p = bonds.body.grid.position(node);
            let passes = |h: &usize| bonds.own_bit(node / n, node % n, *h) && cuts(&p, &(p + bonds.half.xi[*h]));
            (0..bonds.half.len()).filter(passes).map(|h| (node, h)).collect::<Vec<_>>()
        };
        let cut: Vec<(usize, usize)> =
            (0..bonds.stencil.len()).into_par_iter().with_min_len(64).flat_map_iter(cut_of).collect();
        self.clear(cut.iter().copied());
        cut.len()
    }

    /// Energy (J) of half bond p of a node.
    pub(super) fn bond_energy(&self, u: &Padded<T>, kinematics: Kinematics, node: usize, p: usize) -> f64 {
        let n = self.row_nodes();
        let found = self.bond_of(u, node / n, node % n, p, true);
        found.map_or(0.0, |found| {
            let (elongation, _) = elongation(kinematics, &self.half.xi[p], &Vector3::from(found.eta.map(T::f64)));
            0.5 * found.k.f64() * elongation * elongation
        })
    }

    fn node_state(&self, u: &Padded<T>, kinematics: Kinematics, node: usize) -> NodeState {
        let mut state = NodeState { energy: 0.0, stress: Matrix3::zeros() };
        let (row, e) = (node / self.row_nodes(), node % self.row_nodes());
        for p in 0..self.half.len() {
            for ahead in [true, false] {
                if let Some(found) = self.bond_of(u, row, e, p, ahead) {
                    let eta = Vector3::from(found.eta.map(T::f64));
                    let (elongation, to) = elongation(kinematics, &self.half.xi[p], &eta);
                    let k = found.k.f64();
                    state.energy += 0.25 * k * elongation * elongation;
                    state.stress += 0.5 * k * elongation / to.norm() * to * to.transpose();
                }
            }
        }
        state.stress /= self.body.grid.spacing.powi(3);
        let (energy, stress) = self.nodal_state(u, kinematics, node);
        state.energy += energy;
        state.stress += stress;
        state
    }
}

/// A bond's elongation (m) and the vector along which it pulls (m): linear n·η and ξ, finite |ξ+η| − |ξ| and ξ+η.
pub(super) fn elongation(kinematics: Kinematics, xi: &Vector3<f64>, eta: &Vector3<f64>) -> (f64, Vector3<f64>) {
    match kinematics {
        Kinematics::Linear => (xi.dot(eta) / xi.norm(), *xi),
        Kinematics::Finite => {
            let to = xi + eta;
            // (|ξ+η|² − |ξ|²)/(|ξ+η| + |ξ|), in which nothing cancels.
            (eta.dot(&(to + xi)) / (to.norm() + xi.norm()), to)
        }
    }
}
