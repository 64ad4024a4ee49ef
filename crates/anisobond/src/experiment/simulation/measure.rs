//! What is read from a run: probes and fields.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::{Simulation, Stage};
use crate::experiment::field::{FieldName, Quantity, mean_components, principal, symmetric, von_mises};
use crate::experiment::problem::Probe;
use crate::operator::{LocalGradient, LocalState, VectorField};

impl Simulation {
    /// Forces of the bonds on all nodes (N).
    pub fn forces(&self) -> VectorField {
        let mut f = VectorField::zeros(self.problem.body.grid.len());
        self.bonds.forces_of(&self.u.get(), self.problem.kinematics, &mut f);
        f
    }

    /// Displacements (m).
    pub fn displacement(&self) -> VectorField {
        self.u.get()
    }

    /// Velocities (m/s), half a step ahead of the displacements; zero in equilibrium.
    pub fn velocity(&self) -> VectorField {
        match &self.stage {
            Stage::Motion { motion, .. } => motion.velocity.clone(),
            Stage::Equilibrium { .. } => VectorField::zeros(self.problem.body.grid.len()),
        }
    }

    /// The columns of a probe. Reactions are those of the forces that the last step has found: in motion the forces that act in
    /// it, without the bonds that break there, and with the nodal terms that end there.
    pub fn measure(&self, probe: &Probe) -> Vec<f64> {
        let count = probe.nodes.len().max(1) as f64;
        let nodes = || probe.nodes.iter().map(|&node| node as usize);
        let sum = |value: &dyn Fn(usize) -> Vector3<f64>| nodes().fold(Vector3::zeros(), |sum, node| sum + value(node));
        match probe.quantity {
            Quantity::Displacement => (sum(&|node| Vector3::from(self.u.at(node))) / count).iter().copied().collect(),
            Quantity::Velocity => match &self.stage {
                Stage::Motion { motion, .. } => {
                    (sum(&|node| motion.velocity.at(node)) / count).iter().copied().collect()
                }
                Stage::Equilibrium { .. } => vec![0.0; 3],
            },
            Quantity::Reaction => {
                // Forces of the last step; all are found anew only for other nodes than the problem's probes, or after a restart.
                let known = nodes().all(|node| self.reactions.at(node).is_some());
                let anew = (!known).then(|| self.forces());
                let force =
                    |node| anew.as_ref().map_or_else(|| self.reactions.at(node).unwrap_or_default(), |f| f.at(node));
                (-sum(&force)).iter().copied().collect()
            }
            Quantity::Damage => {
                let damage = self.bonds.damage();
                vec![nodes().map(|node| damage[node]).sum::<f64>() / count]
            }
            Quantity::Strain => self.mean_state(&probe.nodes, |state| state.strain),
            Quantity::Stress => self.mean_state(&probe.nodes, |state| state.stress),
        }
    }

    /// Numbers of the strain and stress at every node; zeros where there is none.
    fn local_states<const N: usize>(&self, numbers: impl Fn(&LocalState) -> [f32; N] + Sync) -> Vec<f32> {
        let gradients = self.bonds.grid().gradients(&self.u);
        let of = |(node, gradient): (usize, &LocalGradient)| {
            self.local_state(node, gradient).map_or([0.0; N], |state| numbers(&state))
        };
        gradients.par_iter().enumerate().flat_map_iter(of).collect()
    }

    /// Strain and stress at a node, of the tensor that the bonds of its region reach.
    fn local_state(&self, node: usize, gradient: &LocalGradient) -> Option<LocalState> {
        let region = usize::from(self.problem.body.region[node]).checked_sub(1)?;
        Some(gradient.state(&self.reached[region], self.problem.kinematics))
    }

    /// The mean of strains or stresses over nodes, components 11 22 33 23 13 12.
    fn mean_state(&self, nodes: &[u32], tensor: impl Fn(&LocalState) -> Matrix3<f64>) -> Vec<f64> {
        let nodes = || nodes.iter().map(|&node| node as usize);
        let gradients = self.bonds.grid().gradients_of(&self.u, nodes());
        let states = nodes().zip(&gradients).filter_map(|(node, gradient)| self.local_state(node, gradient));
        mean_components(states.map(|state| tensor(&state)))
    }

    /// The largest damage of a node (–).
    pub fn largest_damage(&self) -> f64 {
        self.bonds.damage().into_iter().fold(0.0, f64::max)
    }

    /// A field: numbers per node, and the numbers of all nodes one after another.
    pub fn field(&self, name: FieldName) -> (usize, Vec<f32>) {
        match name {
            FieldName::Displacement => (3, vectors(&self.displacement())),
            FieldName::Velocity => (3, vectors(&self.velocity())),
            FieldName::Force => (3, vectors(&self.forces())),
            FieldName::Damage => (1, self.bonds.damage().into_iter().map(|d| d as f32).collect()),
            FieldName::Energy => {
                let volume = self.problem.body.grid.spacing.powi(3);
                let states = self.bonds.node_states(&self.u, self.problem.kinematics);
                (1, states.iter().map(|s| (s.energy / volume) as f32).collect())
            }
            FieldName::Virial => {
                let states = self.bonds.node_states(&self.u, self.problem.kinematics);
                (6, states.iter().flat_map(|s| symmetric(&s.stress)).collect())
            }
            FieldName::Strain => (6, self.local_states(|s| symmetric(&s.strain))),
            FieldName::Stress => (6, self.local_states(|s| symmetric(&s.stress))),
            FieldName::VonMises => (1, self.local_states(|s| [von_mises(&s.stress)])),
            FieldName::PrincipalStress => (3, self.local_states(|s| principal(&s.stress))),
            FieldName::Stretch => {
                let stretches = self.bonds.largest_stretches(&self.u, self.problem.kinematics);
                (1, stretches.into_iter().map(|s| s as f32).collect())
            }
            FieldName::PlasticStretch => (1, self.bonds.plastic_stretch().into_iter().map(|s| s as f32).collect()),
            FieldName::Region => (1, self.problem.body.region.iter().map(|&r| f32::from(r)).collect()),
        }
    }
}

/// A field of vectors, node by node.
fn vectors(field: &VectorField) -> Vec<f32> {
    let [x, y, z] = &field.components;
    x.iter().zip(y).zip(z).flat_map(|((x, y), z)| [*x as f32, *y as f32, *z as f32]).collect()
}
