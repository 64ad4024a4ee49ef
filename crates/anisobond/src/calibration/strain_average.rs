//! A node's average strain over its bonds: the least-squares gradient of correspondence peridynamics.

use nalgebra::{Matrix3, Vector3};

use crate::lattice::Neighbourhood;
use crate::{Error, Result};

/// Smallest eigenvalue of the shape tensor, relative to the largest, from which bonds count as filling space.
const FLAT: f64 = 1e-9;

/// The displacement gradient that fits the bonds of a node best: with η the relative displacement of a bond ξ,
/// minimise Σ ω |η − G ξ|², so G = (Σ ω η⊗ξ) K⁻¹ with the shape tensor K = Σ ω ξ⊗ξ, and ε̄ = sym G
/// (Silling et al. 2007, eqs 12-14 and 36). The weights are the influence ω; an affine field gives its own strain exactly.
#[derive(Clone, Debug)]
pub struct StrainAverage {
    /// ω K⁻¹ξ of every bond (1/m), in the neighbourhood's order.
    gradients: Vec<Vector3<f64>>,
}

impl StrainAverage {
    /// Prepare a neighbourhood.
    ///
    /// # Errors
    /// Bonds that all lie in a plane or on a line: they see no strain across it.
    pub fn new(neighbourhood: &Neighbourhood) -> Result<Self> {
        let bonds = neighbourhood.bonds();
        let shape = bonds.iter().fold(Matrix3::zeros(), |k, b| k + b.influence * b.xi * b.xi.transpose());
        let moduli = shape.symmetric_eigenvalues();
        let inverse = shape.try_inverse().filter(|_| moduli.min() > FLAT * moduli.max()).ok_or_else(|| {
            Error::input(
                "the bonds of the neighbourhood lie in a plane: a node's average strain is not defined",
                "use a neighbourhood that reaches at least one spacing along every axis",
            )
        })?;
        Ok(StrainAverage { gradients: bonds.iter().map(|b| b.influence * (inverse * b.xi)).collect() })
    }

    /// ω K⁻¹ξ of every bond (1/m), in the neighbourhood's order: G = Σ η ⊗ (ω K⁻¹ξ).
    pub fn gradients(&self) -> &[Vector3<f64>] {
        &self.gradients
    }

    /// G = Σ η⊗(ω K⁻¹ξ) (–) of the bonds' relative displacements η (m), in the neighbourhood's order.
    pub fn gradient(&self, eta: impl IntoIterator<Item = Vector3<f64>>) -> Matrix3<f64> {
        self.gradients.iter().zip(eta).fold(Matrix3::zeros(), |sum, (b, eta)| sum + eta * b.transpose())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::{Influence, Shape};

    #[test]
    fn an_affine_field_is_averaged_exactly() {
        let turn = *nalgebra::Rotation3::from_euler_angles(0.3, -0.4, 1.0).matrix();
        let gradient = Matrix3::from_fn(|i, j| (3 * i + j) as f64 * 0.1 - 0.3);
        for influence in [Influence::Constant, Influence::Inverse, Influence::Hat] {
            let grid = Neighbourhood::sphere(3.0, 0.02, influence).unwrap().rotated(&turn).unwrap();
            let average = StrainAverage::new(&grid).unwrap();
            let found = average.gradient(grid.bonds().iter().map(|b| gradient * b.xi));
            assert!((found - gradient).norm() < 1e-14, "{found}");
        }
    }

    #[test]
    fn flat_neighbourhoods_are_refused() {
        let flat = Neighbourhood::new(Shape::Cuboid { semi_axes: [2.0, 2.0, 0.5] }, 2.0, 1.0, Influence::Constant);
        let message = StrainAverage::new(&flat.unwrap()).unwrap_err().to_string();
        assert!(message.contains("plane"), "{message}");
    }
}
