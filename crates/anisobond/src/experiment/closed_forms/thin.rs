//! Long waves in bars and plates.

use nalgebra::{Matrix3, Vector3};

use super::rayleigh::frame;
use super::stroh::fundamental;
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// Speed √(E/ρ) (m/s) of long waves in a thin bar along an axis (any length), E = 1/(n n : C⁻¹ : n n).
///
/// # Errors
/// A zero axis, a density that is not positive, a tensor that is not positive definite.
pub fn bar_wave(stiffness: &Stiffness, density: f64, axis: &Vector3<f64>) -> Result<f64> {
    stiffness.require_positive_definite()?;
    let n = axis.try_normalize(0.0).filter(|n| n.iter().all(|x| x.is_finite()) && density > 0.0);
    let (Some(n), Some(compliance)) = (n, stiffness.compliance()) else {
        return Err(Error::input(
            format!("the bar has the axis {:?} and the density {density} kg/m³", axis.as_slice()),
            "give an axis that is not zero and a positive density",
        ));
    };
    let root = std::f64::consts::SQRT_2;
    let nn =
        nalgebra::Vector6::new(n.x * n.x, n.y * n.y, n.z * n.z, root * n.y * n.z, root * n.x * n.z, root * n.x * n.y);
    Ok((1.0 / (density * nn.dot(&(compliance * nn)))).sqrt())
}

/// Speeds (m/s), slower first, of the two long waves along `along` in a thin plate of normal `normal` that stretch it:
/// ρv² are the eigenvalues of Q − R T⁻¹ Rᵀ, the stiffness at zero traction on the faces. The third eigenvalue, 0, is
/// bending.
///
/// # Errors
/// Directions that are zero or not orthogonal, a density that is not positive, a tensor that is not positive definite.
pub fn plate_waves(
    stiffness: &Stiffness,
    density: f64,
    along: &Vector3<f64>,
    normal: &Vector3<f64>,
) -> Result<[f64; 2]> {
    stiffness.require_positive_definite()?;
    let turned = stiffness.rotated(&frame(along, normal)?);
    let n = fundamental(&turned, 1.0, 0.0).filter(|_| density > 0.0).ok_or_else(|| {
        Error::input(format!("the density of the plate is {density} kg/m³"), "give a positive number")
    })?;
    let reduced: Matrix3<f64> = -n.fixed_view::<3, 3>(3, 0).into_owned();
    let mut values: Vec<f64> = reduced.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    Ok([values[1], values[2]].map(|x| (x / density).sqrt()))
}
