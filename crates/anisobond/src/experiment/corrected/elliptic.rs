//! The four elliptic moduli, to meet C11, C33, C13 and C12 about the axis.

use nalgebra::{Rotation3, SMatrix, SVector, Vector3};

use super::report::CorrectedModuli;
use super::search::Form;
use crate::calibration::{EllipticFit, EllipticMicroplane, EllipticModuli, tensor_of_coordinates};
use crate::experiment::element_test::{Fields, sensitivity};
use crate::operator::Network;
use crate::tensor::{Stiffness, SymmetryClass};
use crate::{Error, Result};

/// Four elliptic moduli.
pub(super) struct Elliptic {
    axis: Vector3<f64>,
    prescribed: Stiffness,
    /// Its C11, C33, C13, C12 (Pa).
    target: SVector<f64, 4>,
    /// Least modulus (Pa).
    floor: f64,
    directions: Vec<Vector3<f64>>,
}

impl Elliptic {
    /// The form for a fit on bonds of given directions; `floor` is a share of the largest modulus.
    ///
    /// # Errors
    /// Constants that are zero or belong to no positive definite tensor.
    pub(super) fn new(fit: &EllipticFit, directions: Vec<Vector3<f64>>, floor: f64) -> Result<Self> {
        fit.prescribed.require_positive_definite()?;
        let axis = fit.microplane.axis;
        let target = constants_about(&fit.prescribed, &axis);
        if let Some(c) = target.iter().find(|c| c.abs() <= 1e-9 * target.amax()) {
            return Err(Error::input(
                format!("one of the constants C11, C33, C13, C12 is {c} Pa: its relative error means nothing"),
                "use the general form",
            ));
        }
        let floor = floor * fit.microplane.moduli.as_array().into_iter().fold(0.0, f64::max);
        Ok(Elliptic { axis, prescribed: fit.prescribed, target, floor, directions })
    }

    /// Moduli to begin with: those of the fit, above the floor.
    pub(super) fn start(&self, fit: &EllipticFit) -> SVector<f64, 4> {
        SVector::from(fit.microplane.moduli.as_array()).map(|e: f64| e.max(self.floor))
    }

    /// The moduli of given parameters.
    pub(super) fn moduli(&self, parameters: &SVector<f64, 4>) -> CorrectedModuli {
        let [en_a, en_b, et_a, et_b] = (*parameters).into();
        let moduli = EllipticModuli { en_a, en_b, et_a, et_b };
        CorrectedModuli::Elliptic(EllipticMicroplane { moduli, axis: self.axis })
    }

    /// w = |a×n|² of a bond.
    fn weight(&self, bond: usize) -> f64 {
        self.axis.cross(&self.directions[bond]).norm_squared()
    }
}

impl Form<4> for Elliptic {
    fn put(&self, unit: &Network, e: &SVector<f64, 4>, network: &mut Network) {
        for (i, bond) in network.bonds.iter_mut().enumerate() {
            let w = self.weight(i);
            bond.normal = unit.bonds[i].normal * (w * e[0] + (1.0 - w) * e[1]);
            bond.tangential = unit.bonds[i].tangential * (w * e[2] + (1.0 - w) * e[3]);
        }
    }

    fn target(&self) -> &Stiffness {
        &self.prescribed
    }

    fn error(&self, measured: &Stiffness) -> f64 {
        let constants = constants_about(measured, &self.axis);
        (0..4).map(|k| ((constants[k] - self.target[k]) / self.target[k]).abs()).fold(0.0, f64::max)
    }

    /// The measured constants are linear in the moduli while deformations are frozen: 𝒞 = J ℰ, J = ∂𝒞/∂ℰ.
    fn corrected(
        &self,
        unit: &Network,
        fields: &Fields,
        _parameters: &SVector<f64, 4>,
        aim: &Stiffness,
    ) -> SVector<f64, 4> {
        let tensors = sensitivity::<4>(unit, fields, |i| {
            let w = self.weight(i);
            let (kn, kt) = (unit.bonds[i].normal, unit.bonds[i].tangential);
            (SVector::from([w * kn, (1.0 - w) * kn, 0.0, 0.0]), SVector::from([0.0, 0.0, w * kt, (1.0 - w) * kt]))
        });
        let mut jacobian = SMatrix::<f64, 4, 4>::zeros();
        for k in 0..4 {
            let tensor = Stiffness::from_mandel(tensor_of_coordinates(&tensors.column(k).into()));
            jacobian.set_column(k, &constants_about(&tensor, &self.axis).component_div(&self.target));
        }
        least_squares_above(&jacobian, &constants_about(aim, &self.axis).component_div(&self.target), self.floor)
    }

    fn at_floor(&self, e: &SVector<f64, 4>) -> usize {
        e.iter().filter(|e| **e <= self.floor).count()
    }
}

/// Least squares J x = b with x ≥ floor: the best of the sixteen choices of what is held at the floor.
fn least_squares_above(j: &SMatrix<f64, 4, 4>, b: &SVector<f64, 4>, floor: f64) -> SVector<f64, 4> {
    let mut best = (f64::INFINITY, SVector::repeat(floor));
    for held in 0..16u32 {
        let mut system = *j;
        let mut right = *b;
        for k in (0..4).filter(|k| held >> k & 1 == 1) {
            right -= floor * j.column(k);
            system.column_mut(k).fill(0.0);
        }
        // Columns held are zero; the singular values' tolerance leaves their unknowns at zero.
        let svd = system.svd(true, true);
        let Ok(free) = svd.solve(&right, 1e-12 * svd.singular_values.max()) else { continue };
        let x = SVector::<f64, 4>::from_fn(|k, _| if held >> k & 1 == 1 { floor } else { free[k] });
        let residual = (j * x - b).norm();
        if x.iter().all(|x| *x >= floor) && residual < best.0 {
            best = (residual, x);
        }
    }
    best.1
}

/// C11, C33, C13, C12 (Pa) of the transversely isotropic projection about an axis (unit vector). Linear in C.
fn constants_about(c: &Stiffness, axis: &Vector3<f64>) -> SVector<f64, 4> {
    // An axis has no sign; the projection does not depend on the turn about it.
    let axis = if axis.z < 0.0 { -axis } else { *axis };
    let turn = Rotation3::rotation_between(&axis, &Vector3::z()).unwrap_or_else(Rotation3::identity);
    let v = SymmetryClass::TransverselyIsotropic.project(&c.rotated(turn.matrix())).voigt();
    SVector::from([v[(0, 0)], v[(2, 2)], v[(0, 2)], v[(0, 1)]])
}
