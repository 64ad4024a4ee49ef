//! What is read from spheres: probes and fields.

use nalgebra::{Matrix3, Vector3};

use super::PackingSimulation;
use crate::experiment::problem::{FieldName, Probe, Quantity};
use crate::operator::{Kinematics, StiffBond};
use crate::tensor::PAIRS;

/// What a bond carries: its energy (J), and F⊗l (J), F the force on its first end.
struct Carried {
    energy: f64,
    virial: Matrix3<f64>,
}

impl PackingSimulation {
    /// The columns of a probe.
    pub fn measure(&self, probe: &Probe) -> Vec<f64> {
        let count = probe.nodes.len().max(1) as f64;
        let nodes = || probe.nodes.iter().map(|&node| node as usize);
        let sum = |value: &dyn Fn(usize) -> Vector3<f64>| nodes().fold(Vector3::zeros(), |sum, node| sum + value(node));
        match probe.quantity {
            Quantity::Displacement => (sum(&|s| self.particles().displacement(s)) / count).iter().copied().collect(),
            Quantity::Velocity if !self.is_motion() => vec![0.0; 3],
            Quantity::Velocity => (sum(&|s| self.particles().velocity(s)) / count).iter().copied().collect(),
            Quantity::Reaction => (-sum(&|s| self.particles().force(s))).iter().copied().collect(),
            Quantity::Damage => {
                let damage = self.particles().damage();
                vec![nodes().map(|s| damage[s]).sum::<f64>() / count]
            }
        }
    }

    /// The largest damage of a sphere (–).
    pub fn largest_damage(&self) -> f64 {
        self.particles().damage().into_iter().fold(0.0, f64::max)
    }

    /// A field: numbers per sphere, and the numbers of all spheres one after another. Stress (Pa) and energy density
    /// (J/m³) are those of the bonds, half of each for either end, over the volume of rock that a sphere stands for.
    pub fn field(&self, name: FieldName) -> (usize, Vec<f32>) {
        let n = self.particles().len();
        match name {
            FieldName::Displacement => (3, vectors(&self.particles().displacements())),
            FieldName::Velocity if !self.is_motion() => (3, vec![0.0; 3 * n]),
            FieldName::Velocity => (3, vectors(&self.particles().velocities())),
            FieldName::Force => (3, vectors(&self.particles().forces())),
            FieldName::Damage => (1, self.particles().damage().into_iter().map(|d| d as f32).collect()),
            FieldName::Region => (1, self.problem.region.iter().map(|&r| f32::from(r) + 1.0).collect()),
            FieldName::Energy => {
                let mut energy = vec![0.0; n];
                self.each_bond(|end, carried| energy[end] += 0.5 * carried.energy / self.problem.volumes[end]);
                (1, energy.into_iter().map(|e| e as f32).collect())
            }
            FieldName::Stress => {
                let mut stress = vec![Matrix3::zeros(); n];
                self.each_bond(|end, carried| stress[end] += carried.virial * (0.5 / self.problem.volumes[end]));
                // VTK's order: xx yy zz xy yz xz.
                let places = [0, 1, 2, 5, 3, 4].map(|a| PAIRS[a]);
                let of = |s: &Matrix3<f64>| places.map(|(i, j)| (0.5 * (s[(i, j)] + s[(j, i)])) as f32);
                (6, stress.iter().flat_map(of).collect())
            }
        }
    }

    /// Every whole bond, once for either end.
    fn each_bond(&self, mut see: impl FnMut(usize, &Carried)) {
        let model = &self.problem.model;
        let (u, turns) = (self.particles().displacements(), self.particles().rotations());
        let strain = self.particles().deformation().map_or(Matrix3::zeros(), |f| f - Matrix3::identity());
        let centres = model.packing.centres();
        for (bond, _) in model.bonds.iter().zip(self.particles().whole()).filter(|(_, whole)| **whole) {
            let (a, b) = (bond.a as usize, bond.b as usize);
            // An image moves with the cell, too.
            let image = strain * (bond.branch - (centres[b] - centres[a]));
            let moved = u[b] + image - u[a];
            let carried = match model.kinematics {
                Kinematics::Linear => linear(bond, &moved, &(turns[a].scaled_axis() + turns[b].scaled_axis())),
                Kinematics::Finite => finite(bond, &moved, &(turns[a] * bond.branch + turns[b] * bond.branch)),
            };
            see(a, &carried);
            see(b, &carried);
        }
    }
}

/// Δ = moved − ½ (θ_a + θ_b)×L₀, F = k_n (Δ·n) n + k_t Δ_t (THEORY section 5).
fn linear(bond: &StiffBond, moved: &Vector3<f64>, turn: &Vector3<f64>) -> Carried {
    let n = bond.branch.normalize();
    let delta = moved - 0.5 * turn.cross(&bond.branch);
    let along = delta.dot(&n);
    let force = n * (bond.normal * along) + (delta - n * along) * bond.tangential;
    Carried { energy: 0.5 * force.dot(&delta), virial: force * bond.branch.transpose() }
}

/// U = ½ k_n (ℓ − ℓ₀)² + ½ k_t ℓ ℓ₀ |τ|², τ = m − (n·m) n, m = ½(R_a + R_b) L₀/ℓ₀, and its gradient, as the kernel has them.
fn finite(bond: &StiffBond, moved: &Vector3<f64>, carried_twice: &Vector3<f64>) -> Carried {
    let (rest, branch) = (bond.branch.norm(), bond.branch + moved);
    let (length, m) = (branch.norm(), carried_twice / (2.0 * rest));
    let n = branch / length;
    let along = n.dot(&m);
    let t = m - n * along;
    let (stretch, shear) = (length - rest, bond.tangential * rest);
    let force = n * (bond.normal * stretch + 0.5 * shear * t.norm_squared()) - t * (shear * along);
    let energy = 0.5 * bond.normal * stretch * stretch + 0.5 * shear * length * t.norm_squared();
    Carried { energy, virial: force * branch.transpose() }
}

fn vectors(field: &[Vector3<f64>]) -> Vec<f32> {
    field.iter().flat_map(|v| [v.x as f32, v.y as f32, v.z as f32]).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::operator::particles::naive::finite_energy;

    #[test]
    fn fields_are_those_of_the_kernel_s_energy() {
        let bond = StiffBond { a: 0, b: 1, branch: Vector3::new(0.7, -0.4, 1.1), normal: 3e5, tangential: 1e5 };
        let [a, b] = [[0.1, 0.2, -0.1], [-0.15, 0.1, 0.2]].map(|v| UnitQuaternion::from_scaled_axis(Vector3::from(v)));
        let moved = Vector3::new(0.05, 0.12, -0.08);
        let energy = |moved: &Vector3<f64>| finite_energy(&bond, [Vector3::zeros(), *moved], [a, b]);
        let ours = finite(&bond, &moved, &(a * bond.branch + b * bond.branch));
        assert!((ours.energy / energy(&moved) - 1.0).abs() < 1e-12);
        let (branch, h) = (bond.branch + moved, 1e-6);
        for axis in 0..3 {
            let e = Vector3::ith(axis, h);
            let slope = (energy(&(moved + e)) - energy(&(moved - e))) / (2.0 * h);
            // Of F⊗l, row by row.
            assert!((ours.virial[(axis, 2)] - slope * branch.z).abs() < 1e-6 * ours.virial.norm());
        }
    }
}
