//! How each bond deforms in an element test, and what its stiffness is worth to the whole.

use nalgebra::{Matrix3x6, Matrix6, RowVector6, SMatrix, SVector, Vector3, Vector6};

use super::static_test::Fields;
use crate::calibration::{strain_dot, tensor_coordinates, tensor_of_coordinates};
use crate::operator::{Network, StiffBond};
use crate::tensor::mandel_weight;

/// The relaxed deformation of one bond under the six unit strains (Kelvin-Mandel, one column each), node displacements
/// and rotations included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BondDeformation {
    /// n·Δ (m) per unit strain.
    pub normal: RowVector6<f64>,
    /// Δ − (n·Δ) n (m) per unit strain.
    pub tangential: Matrix3x6<f64>,
}

impl BondDeformation {
    /// V ∂C/∂k_n = (n·Δ)⊗(n·Δ) (m²) as a Kelvin-Mandel matrix: the bond's own relaxed energy. The energy is stationary
    /// in displacements and rotations, so that their change counts for nothing and no adjoint is solved.
    pub fn of_normal(&self) -> Matrix6<f64> {
        self.normal.transpose() * self.normal
    }

    /// V ∂C/∂k_t = Δ_tᵀ Δ_t (m²) as a Kelvin-Mandel matrix.
    pub fn of_tangential(&self) -> Matrix6<f64> {
        self.tangential.transpose() * self.tangential
    }
}

/// The relaxed deformations of all bonds of a network, in its order, from the fields of its element test:
/// Δ = u_B − u_A + E·L − ½(θ_A + θ_B)×L.
pub fn bond_deformations<'a>(network: &'a Network, fields: &'a Fields) -> impl Iterator<Item = BondDeformation> + 'a {
    network.bonds.iter().map(|bond| deformation(bond, fields))
}

fn deformation(bond: &StiffBond, fields: &Fields) -> BondDeformation {
    let (a, b) = (bond.a as usize, bond.b as usize);
    let n = bond.branch.normalize();
    let mut delta = Matrix3x6::zeros();
    for case in 0..6 {
        let (u, theta) = (&fields.displacement[case], &fields.rotation[case]);
        let turn = 0.5 * (theta[a] + theta[b]);
        // Fields are those of engineering strain 1 in shear; a unit Kelvin-Mandel shear is √2 of it.
        let relaxed = mandel_weight(case) * (u[b] - u[a] - turn.cross(&bond.branch));
        delta.set_column(case, &(relaxed + strain_dot(&unit_strain(case), &bond.branch)));
    }
    let normal = n.transpose() * delta;
    BondDeformation { normal, tangential: delta - n * normal }
}

/// ∂C/∂p (Pa per unit of p) for parameters on which the stiffnesses of bonds depend linearly, as 21 orthonormal
/// coordinates per parameter: Σ (∂k_n/∂p) ∂C/∂k_n + (∂k_t/∂p) ∂C/∂k_t.
///
/// `of_bond` gives (∂k_n/∂p, ∂k_t/∂p) of a bond by its number.
pub(crate) fn sensitivity<const P: usize>(
    network: &Network,
    fields: &Fields,
    mut of_bond: impl FnMut(usize) -> (SVector<f64, P>, SVector<f64, P>),
) -> SMatrix<f64, 21, P> {
    let mut sum = SMatrix::zeros();
    for (bond, deformation) in bond_deformations(network, fields).enumerate() {
        let (normal, tangential) = of_bond(bond);
        sum += tensor_coordinates(&deformation.of_normal()) * normal.transpose();
        sum += tensor_coordinates(&deformation.of_tangential()) * tangential.transpose();
    }
    sum / network.volume
}

/// The relaxed average strains of a network's nodes under the six unit strains (Kelvin-Mandel, one column each), in its
/// order; nothing without a nodal term.
pub fn nodal_strains(network: &Network, fields: &Fields) -> Vec<Matrix6<f64>> {
    let Some(term) = &network.nodal else { return Vec::new() };
    let mut strains = vec![Matrix6::zeros(); network.nodes.len()];
    for case in 0..6 {
        // As above: fields are those of engineering strain 1 in shear.
        let moved: Vec<Vector3<f64>> = fields.displacement[case].iter().map(|u| mandel_weight(case) * u).collect();
        for (node, e) in term.average_strains(&network.bonds, &moved, &unit_strain(case)).iter().enumerate() {
            strains[node].set_column(case, e);
        }
    }
    strains
}

/// ∂C/∂Z (–) as coordinates by coordinates: of a change δZ, δC = (1/V) Σ V_i ε̄_iᵀ δZ ε̄_i with the relaxed average strains.
pub(crate) fn nodal_sensitivity(network: &Network, fields: &Fields) -> SMatrix<f64, 21, 21> {
    let volumes = network.nodal.as_ref().map_or(&[][..], |term| &term.volumes);
    let strains = nodal_strains(network, fields);
    let mut jacobian = SMatrix::<f64, 21, 21>::zeros();
    for k in 0..21 {
        let unit = tensor_of_coordinates(&SVector::from_fn(|i, _| f64::from(i == k)));
        let sum =
            strains.iter().zip(volumes).fold(Matrix6::zeros(), |sum, (e, v)| sum + *v * (e.transpose() * unit * e));
        jacobian.set_column(k, &(tensor_coordinates(&sum) / network.volume));
    }
    jacobian
}

/// The unit strain of a case in Kelvin-Mandel coordinates.
fn unit_strain(case: usize) -> Vector6<f64> {
    Vector6::from_fn(|a, _| f64::from(a == case))
}
