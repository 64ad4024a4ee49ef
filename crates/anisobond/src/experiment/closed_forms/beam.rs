//! A cantilever as a plane elastic body.

use crate::tensor::Stiffness;
use crate::{Error, Result};

/// A cantilever 0 ≤ x₁ ≤ L, |x₂| ≤ c, sheared by a force P per width along x₂ at its free end x₁ = L, in plane strain or
/// plane stress: σ₁₁ = −P (L − x₁) x₂/I, σ₁₂ = P (c² − x₂²)/2I, I = 2c³/3, exact away from the ends' details
/// (Timoshenko & Goodier, section 21, for orthotropic media by Lekhnitskii 1968). At the origin u = 0 and u₁,₂ = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cantilever {
    /// Length L (m).
    pub length: f64,
    /// Half the height, c (m).
    pub half_height: f64,
    /// Force per width P (N/m).
    pub force: f64,
    /// Plane compliances a₁₁ a₁₂ a₆₆ (1/Pa): ε₁₁ = a₁₁ σ₁₁ + a₁₂ σ₂₂, 2ε₁₂ = a₆₆ σ₁₂.
    pub compliance: [f64; 3],
}

impl Cantilever {
    /// A cantilever of a tensor that is orthotropic in the plane x₁x₂; `plane_strain`: ε₃₃ = 0, otherwise σ₃₃ = 0.
    ///
    /// # Errors
    /// Lengths that are not positive, a force that is not finite, a tensor that is not positive definite or that couples
    /// shear in the plane with stretch.
    pub fn new(c: &Stiffness, length: f64, half_height: f64, force: f64, plane_strain: bool) -> Result<Self> {
        c.require_positive_definite()?;
        if !(length.is_finite() && length > 0.0 && half_height.is_finite() && half_height > 0.0 && force.is_finite()) {
            return Err(Error::input(
                format!("the cantilever has length {length} m, half height {half_height} m and force {force} N/m"),
                "give positive lengths and a finite force",
            ));
        }
        let singular = || Error::input("the stiffness cannot be inverted", "give a positive definite tensor");
        let s = c.compliance_voigt().ok_or_else(singular)?;
        let reduced = |i: usize, j: usize| {
            if plane_strain { s[(i, j)] - s[(i, 2)] * s[(j, 2)] / s[(2, 2)] } else { s[(i, j)] }
        };
        let scale = s[(0, 0)].abs().max(s[(5, 5)].abs());
        let coupled = |i: usize, j: usize| s[(i, j)].abs() > 1e-9 * scale;
        if (0..3).any(|i| (3..6).any(|j| coupled(i, j))) || coupled(3, 5) || coupled(4, 5) {
            return Err(Error::input(
                "the tensor couples stretch along the beam with shear",
                "turn it so that x₁ and x₂ are axes of orthotropy",
            ));
        }
        Ok(Cantilever { length, half_height, force, compliance: [reduced(0, 0), reduced(0, 1), reduced(5, 5)] })
    }

    /// P/I (Pa/m²).
    fn curvature_unit(&self) -> f64 {
        1.5 * self.force / self.half_height.powi(3)
    }

    /// u₁, u₂ (m) at (x₁, x₂) (m).
    pub fn displacement(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([a11, a12, a66], l, c) = (self.compliance, self.length, self.half_height);
        let k = self.curvature_unit();
        let shear = 0.5 * a66 * c * c;
        let u = a11 * (0.5 * x * x - l * x) * y + 0.5 * (a66 * (c * c * y - y.powi(3) / 3.0) - a12 * y.powi(3) / 3.0)
            - shear * y;
        let v = 0.5 * a12 * (x - l) * y * y + a11 * (0.5 * l * x * x - x.powi(3) / 6.0) + shear * x;
        [k * u, k * v]
    }

    /// σ₁₁, σ₁₂ (Pa) at (x₁, x₂) (m); σ₂₂ = 0.
    pub fn stress(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let k = self.curvature_unit();
        [k * (x - self.length) * y, 0.5 * k * (self.half_height.powi(2) - y * y)]
    }

    /// Deflection P L³ a₁₁/3I + P c² a₆₆ L/2I (m) of the free end's middle.
    pub fn tip_deflection(&self) -> f64 {
        self.displacement([self.length, 0.0])[1]
    }
}
