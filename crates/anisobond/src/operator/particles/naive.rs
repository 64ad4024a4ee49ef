//! The energy of one bond written down as its formula: slow, obvious, the oracle of the kernel.

use nalgebra::{UnitQuaternion, Vector3};

use crate::operator::StiffBond;

/// Energy (J) of a bond with finite kinematics whose ends have displacements (m) and rotations since rest:
/// U = ½ k_n (ℓ − ℓ₀)² + ½ k_t (ℓ/ℓ₀) |(I − n⊗n) ½(R_a + R_b) L₀|².
pub fn finite_energy(bond: &StiffBond, displacement: [Vector3<f64>; 2], rotation: [UnitQuaternion<f64>; 2]) -> f64 {
    let rest = bond.branch;
    let branch = rest + displacement[1] - displacement[0];
    let n = branch.normalize();
    let carried = 0.5 * (rotation[0] * rest + rotation[1] * rest);
    let across = carried - n * n.dot(&carried);
    let stretch = branch.norm() - rest.norm();
    let lengthening = branch.norm() / rest.norm();
    0.5 * bond.normal * stretch * stretch + 0.5 * bond.tangential * lengthening * across.norm_squared()
}

/// Energy (J) of a bond with linear kinematics, rotations as vectors (radians) (THEORY section 5):
/// U = ½ k_n (Δ·n)² + ½ k_t |Δ_t|², Δ = u_b − u_a − ½ (θ_a + θ_b)×L₀.
pub fn linear_energy(bond: &StiffBond, displacement: [Vector3<f64>; 2], rotation: [Vector3<f64>; 2]) -> f64 {
    let rest = bond.branch;
    let delta = displacement[1] - displacement[0] - 0.5 * (rotation[0] + rotation[1]).cross(&rest);
    let n = rest.normalize();
    let along = delta.dot(&n);
    let across = delta - n * along;
    0.5 * bond.normal * along * along + 0.5 * bond.tangential * across.norm_squared()
}
