//! A flat crack in an infinite anisotropic medium under uniform load.

use nalgebra::{Matrix3, Vector3};

use super::barnett_lothe::BarnettLothe;
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// A crack |x₁| ≤ a, x₂ = 0, endless along x₃, its faces free of traction, under σ·e₂ = t far away (Stroh 1958; Ting 1996, section 11.1).
#[derive(Clone, Debug)]
pub struct CentreCrack {
    half_length: f64,
    traction: Vector3<f64>,
    /// L⁻¹ of Barnett & Lothe (1/Pa).
    compliance: Matrix3<f64>,
}

impl CentreCrack {
    /// A crack of half length a (m) under a far traction σ·e₂ = t (Pa).
    ///
    /// # Errors
    /// A length that is not positive, a traction that is not finite, a tensor that is not positive definite.
    pub fn new(stiffness: &Stiffness, half_length: f64, traction: &Vector3<f64>) -> Result<Self> {
        stiffness.require_positive_definite()?;
        let sound = half_length.is_finite() && half_length > 0.0 && traction.iter().all(|x| x.is_finite());
        let compliance = BarnettLothe::new(stiffness, 0.0).and_then(|b| b.l.try_inverse());
        match compliance.filter(|_| sound) {
            Some(compliance) => Ok(CentreCrack { half_length, traction: *traction, compliance }),
            None => Err(Error::input(
                format!("the crack has half length {half_length} m and traction {:?} Pa", traction.as_slice()),
                "give a positive length and finite tractions",
            )),
        }
    }

    /// Opening u(x₁, 0⁺) − u(x₁, 0⁻) = 2 √(a² − x₁²) L⁻¹ t (m); zero beyond the tips.
    pub fn opening(&self, x: f64) -> Vector3<f64> {
        2.0 * (self.half_length.powi(2) - x * x).max(0.0).sqrt() * (self.compliance * self.traction)
    }

    /// Stress intensities √(πa) t (Pa√m), in the order of the axes: modes II, I, III.
    pub fn stress_intensity(&self) -> Vector3<f64> {
        (std::f64::consts::PI * self.half_length).sqrt() * self.traction
    }

    /// Energy ½ K·L⁻¹·K released per area of crack at each tip (J/m²).
    pub fn energy_release_rate(&self) -> f64 {
        let k = self.stress_intensity();
        0.5 * k.dot(&(self.compliance * k))
    }
}
