//! What is read from a run: probes and fields.

use nalgebra::Vector3;

use super::{Simulation, Stage};
use crate::experiment::problem::{FieldName, Probe, Quantity};
use crate::operator::VectorField;

impl Quantity {
    /// Endings of the names of its columns.
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Quantity::Displacement => &["ux_m", "uy_m", "uz_m"],
            Quantity::Velocity => &["vx_m_s", "vy_m_s", "vz_m_s"],
            Quantity::Reaction => &["Fx_N", "Fy_N", "Fz_N"],
            Quantity::Damage => &["damage"],
        }
    }
}

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
        }
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
            FieldName::Stress => {
                let states = self.bonds.node_states(&self.u, self.problem.kinematics);
                let places = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];
                (6, states.iter().flat_map(|s| places.map(|p| s.stress[p] as f32)).collect())
            }
            FieldName::Region => (1, self.problem.body.region.iter().map(|&r| f32::from(r)).collect()),
        }
    }
}

/// A field of vectors, node by node.
fn vectors(field: &VectorField) -> Vec<f32> {
    let [x, y, z] = &field.components;
    x.iter().zip(y).zip(z).flat_map(|((x, y), z)| [*x as f32, *y as f32, *z as f32]).collect()
}
