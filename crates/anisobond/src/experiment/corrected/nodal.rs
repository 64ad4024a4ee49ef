//! The nodal term Z beside bonds that stay, to meet all components.
//!
//! The energy is linear in Z: V ∂C/∂Z is Σ V_i ε̄_i⊗ε̄_i of the relaxed average strains, and C = bonds' part + (∂C/∂Z) Z
//! while deformations are frozen.

use nalgebra::{Matrix6, SMatrix, SVector};

use super::general::Coordinates;
use super::search::Form;
use crate::calibration::{tensor_coordinates, tensor_of_coordinates};
use crate::experiment::element_test::{Fields, bond_deformations, nodal_sensitivity};
use crate::operator::Network;
use crate::tensor::Stiffness;

/// Bonds of a share of their stiffness, and Z.
pub(super) struct Nodal {
    /// What of the bonds' stiffness is kept (–).
    pub(super) share: f64,
    pub(super) target: Stiffness,
}

impl Nodal {
    /// Z that the sum over bonds at uniform strain leaves: Voigt's hypothesis.
    pub(super) fn of_sum(&self, unit: &Network) -> Coordinates {
        let still = super::search::no_fields(unit.nodes.len());
        tensor_coordinates(&(self.target.mandel() - self.bonds_part(unit, &still)))
    }

    /// (share/V) Σ (k_n ∂C/∂k_n + k_t ∂C/∂k_t) V.
    fn bonds_part(&self, unit: &Network, fields: &Fields) -> Matrix6<f64> {
        let mut sum = Matrix6::zeros();
        for (bond, d) in unit.bonds.iter().zip(bond_deformations(unit, fields)) {
            sum += bond.normal * d.of_normal() + bond.tangential * d.of_tangential();
        }
        sum * (self.share / unit.volume)
    }
}

impl Form<21> for Nodal {
    fn put(&self, unit: &Network, z: &SVector<f64, 21>, network: &mut Network) {
        for (bond, unit) in network.bonds.iter_mut().zip(&unit.bonds) {
            bond.normal = self.share * unit.normal;
            bond.tangential = self.share * unit.tangential;
        }
        if let Some(term) = &mut network.nodal {
            term.stiffness = Stiffness::from_mandel(tensor_of_coordinates(z));
        }
    }

    fn target(&self) -> &Stiffness {
        &self.target
    }

    fn error(&self, measured: &Stiffness) -> f64 {
        self.target.relative_error(measured)
    }

    /// Z with bonds' part + (∂C/∂Z) Z = C.
    fn corrected(&self, unit: &Network, fields: &Fields, z: &Coordinates, aim: &Stiffness) -> Coordinates {
        let jacobian: SMatrix<f64, 21, 21> = nodal_sensitivity(unit, fields);
        let right = tensor_coordinates(&(aim.mandel() - self.bonds_part(unit, fields)));
        jacobian.lu().solve(&right).unwrap_or(*z)
    }

    fn at_floor(&self, _z: &Coordinates) -> usize {
        0
    }
}
