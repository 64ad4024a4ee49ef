//! Least-squares gradients of displacement ([`crate::operator::GradientFit`]) at the nodes of a grid.
//!
//! A node's neighbours are the other ends of its unbroken bonds in its own region: faces of a crack are told apart, and the
//! strain on one side of an interface is that side's. Where those do not fill space (a layer of one node between others),
//! neighbours in other regions count, too.

use std::cell::RefCell;
use std::collections::HashMap;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::build::GridBonds;
use super::failing::FailingBonds;
use super::measure::elongation;
use super::padded::Padded;
use super::real::Real;
use crate::operator::Kinematics;
use crate::operator::local_strain::{GradientFit, LocalGradient};

impl<T: Real> GridBonds<T> {
    /// The gradient of displacement at every node; of places without a node that of a node on its own.
    pub fn gradients(&self, u: &Padded<T>) -> Vec<LocalGradient> {
        let nodes = 0..self.stencil.len();
        let standing: Vec<f64> = nodes.clone().into_par_iter().with_min_len(64).map(|n| self.standing(n)).collect();
        nodes.into_par_iter().with_min_len(64).map(|node| self.gradient_at(u, node, &|n| standing[n])).collect()
    }

    /// The gradient of displacement at some nodes.
    pub fn gradients_of(&self, u: &Padded<T>, nodes: impl Iterator<Item = usize>) -> Vec<LocalGradient> {
        let known = RefCell::new(HashMap::new());
        let standing = |n: usize| *known.borrow_mut().entry(n).or_insert_with(|| self.standing(n));
        nodes.map(|node| self.gradient_at(u, node, &standing)).collect()
    }

    /// The largest stretch of a node's unbroken bonds (–); −∞ without bonds.
    fn largest_stretch(&self, u: &Padded<T>, kinematics: Kinematics, node: usize) -> f64 {
        let mut largest = f64::NEG_INFINITY;
        if self.stencil[node] > 0 {
            let here = self.place_of(u, node);
            self.for_neighbours(node, |xi, other| {
                largest = largest.max(elongation(kinematics, xi, &(self.place_of(u, other) - here)).0 / xi.norm());
            });
        }
        largest
    }

    /// Weight of a node in fits: one, and its unbroken bonds within its region.
    fn standing(&self, node: usize) -> f64 {
        let mut count = 1.0;
        if self.stencil[node] > 0 {
            self.for_neighbours(node, |_, other| count += f64::from(u8::from(self.same_region(node, other))));
        }
        count
    }

    fn same_region(&self, node: usize, other: usize) -> bool {
        self.body.region[node] == self.body.region[other]
    }

    fn place_of(&self, u: &Padded<T>, node: usize) -> Vector3<f64> {
        Vector3::from(u.at(node).map(T::f64))
    }

    fn gradient_at(&self, u: &Padded<T>, node: usize, standing: &dyn Fn(usize) -> f64) -> LocalGradient {
        if self.stencil[node] == 0 {
            return GradientFit::default().gradient();
        }
        // All bonds of a node that has all are symmetric about it.
        let whole = self.standing(node) > self.half.bonds as f64;
        let weight = |n: usize| if whole { 1.0 } else { standing(n) };
        let fit = |across: bool| {
            let here = self.place_of(u, node);
            let mut fit = GradientFit::default();
            fit.add(weight(node), &Vector3::zeros(), &Vector3::zeros());
            self.for_neighbours(node, |xi, other| {
                if across || self.same_region(node, other) {
                    fit.add(weight(other), xi, &(self.place_of(u, other) - here));
                }
            });
            fit.gradient()
        };
        let own = fit(false);
        if own.is_whole() { own } else { fit(true) }
    }

    /// Visit the unbroken bonds of a node: ξ (m) as seen from it, and the other end.
    fn for_neighbours(&self, node: usize, mut visit: impl FnMut(&Vector3<f64>, usize)) {
        let (row, e) = (node / self.row_nodes(), node % self.row_nodes());
        for (p, &offset) in self.half.offset.iter().enumerate() {
            if self.own_bit(row, e, p)
                && let Some(other) = self.node_at(row, e, offset)
            {
                visit(&self.half.xi[p], other);
            }
            if self.opposite_bit(row, e, p)
                && let Some(other) = self.node_at(row, e, offset.map(|x| -x))
            {
                visit(&-self.half.xi[p], other);
            }
        }
    }
}

impl FailingBonds {
    /// The largest stretch (–) of each node's bonds that are unbroken, softening ones among them: elongation over length. Zero
    /// without bonds.
    pub fn largest_stretches(&self, u: &Padded<f64>, kinematics: Kinematics) -> Vec<f64> {
        let grid = self.grid();
        let nodes = (0..grid.stencil.len()).into_par_iter().with_min_len(64);
        let mut largest: Vec<f64> = nodes.map(|node| grid.largest_stretch(u, kinematics, node)).collect();
        for bond in self.list() {
            let xi = &grid.half.xi[usize::from(bond.half)];
            let eta = grid.place_of(u, bond.other as usize) - grid.place_of(u, bond.node as usize);
            let stretch = elongation(kinematics, xi, &eta).0 / xi.norm();
            for node in [bond.node, bond.other] {
                largest[node as usize] = largest[node as usize].max(stretch);
            }
        }
        largest.into_iter().map(|s| if s.is_finite() { s } else { 0.0 }).collect()
    }
}
