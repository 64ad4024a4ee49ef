//! The same bonds one by one, slow and obvious: what the kernels must agree with.

use std::collections::HashSet;

use nalgebra::{Matrix3, Vector3};

use super::stencil::Stencil;
use crate::lattice::{Body, Neighbourhood};
use crate::operator::{Kinematics, VectorField};

/// A body's bonds, with the list of those that are broken.
#[derive(Clone, Debug)]
pub struct NaiveBonds<'a> {
    /// The body.
    pub body: &'a Body,
    /// Bonds of a node.
    pub neighbourhood: &'a Neighbourhood,
    /// Stencil of each node, from 1 on; 0 is none.
    pub stencil: &'a [u16],
    /// The stencils.
    pub stencils: &'a [Stencil],
    /// Broken bonds, as a node and a bond of the second half of the neighbourhood's order.
    pub broken: HashSet<(usize, usize)>,
}

/// What displacements of all nodes cause.
#[derive(Clone, Debug)]
pub struct NaiveResponse {
    /// Force on every node (N).
    pub forces: VectorField,
    /// Energy of every node (J), half of each bond's.
    pub energy: Vec<f64>,
    /// Virial stress of every node (Pa).
    pub stress: Vec<Matrix3<f64>>,
    /// Bonds above their critical stretch, each once.
    pub over: Vec<(usize, usize)>,
    /// Energy of those (J).
    pub energy_over: f64,
}

impl NaiveBonds<'_> {
    /// Unbroken bonds with both ends: node, bond of the second half, other node.
    pub fn bonds(&self) -> Vec<(usize, usize, usize)> {
        let list = self.neighbourhood.bonds();
        let mut found = Vec::new();
        for node in (0..self.stencil.len()).filter(|&i| self.stencil[i] > 0) {
            for (b, bond) in list.iter().enumerate().skip(list.len() / 2) {
                if let Some(other) = self.body.grid.neighbour(node, bond.offset).filter(|&j| self.stencil[j] > 0)
                    && !self.broken.contains(&(node, b))
                {
                    found.push((node, b, other));
                }
            }
        }
        found
    }

    /// Mean of what both ends say of a bond.
    fn mean(&self, of: fn(&Stencil) -> &[f64], node: usize, b: usize, other: usize) -> f64 {
        let at = |node: usize, b: usize| of(&self.stencils[usize::from(self.stencil[node]) - 1])[b];
        0.5 * (at(node, b) + at(other, self.neighbourhood.bonds().len() - 1 - b))
    }

    /// Forces, energies and stresses of displacements (m). With `breaking`, bonds above their critical stretch exert no
    /// force and hold no energy.
    pub fn response(&self, u: &VectorField, kinematics: Kinematics, breaking: bool) -> NaiveResponse {
        let n = u.len();
        let mut out = NaiveResponse {
            forces: VectorField::zeros(n),
            energy: vec![0.0; n],
            stress: vec![Matrix3::zeros(); n],
            over: vec![],
            energy_over: 0.0,
        };
        let volume = self.body.grid.spacing.powi(3);
        for (i, b, j) in self.bonds() {
            let xi = self.neighbourhood.bonds()[b].xi;
            let eta = u.at(j) - u.at(i);
            let k = self.mean(|s| &s.stiffness, i, b, j);
            let (elongation, to) = match kinematics {
                Kinematics::Linear => (xi.normalize().dot(&eta), xi),
                Kinematics::Finite => {
                    let elongation = eta.dot(&(2.0 * xi + eta)) / ((xi + eta).norm() + xi.norm());
                    (elongation, xi + eta)
                }
            };
            let energy = 0.5 * k * elongation * elongation;
            if breaking && elongation / xi.norm() > self.mean(|s| &s.critical, i, b, j) {
                out.over.push((i, b));
                out.energy_over += energy;
                continue;
            }
            let force = k * elongation * to.normalize();
            let add = |field: &mut VectorField, node: usize, f: Vector3<f64>| field.set(node, &(field.at(node) + f));
            add(&mut out.forces, i, force);
            add(&mut out.forces, j, -force);
            for node in [i, j] {
                out.energy[node] += 0.5 * energy;
                out.stress[node] += 0.5 * force * to.transpose() / volume;
            }
        }
        out
    }

    /// Share of a node's original bonds that are broken.
    pub fn damage(&self) -> Vec<f64> {
        let mut all = vec![0.0; self.stencil.len()];
        let mut left = all.clone();
        let whole = NaiveBonds { broken: HashSet::new(), ..self.clone() };
        for (count, bonds) in [(&mut all, whole.bonds()), (&mut left, self.bonds())] {
            for (i, _, j) in bonds {
                count[i] += 1.0;
                count[j] += 1.0;
            }
        }
        all.iter().zip(&left).map(|(all, left)| if *all > 0.0 { 1.0 - left / all } else { 0.0 }).collect()
    }
}
