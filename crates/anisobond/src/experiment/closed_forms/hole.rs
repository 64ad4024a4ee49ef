//! A pressurised circular hole in an anisotropic medium.

use nalgebra::{Complex, Matrix3, Vector3};

use super::stroh::Stroh;
use crate::tensor::{PAIRS, Stiffness};
use crate::{Error, Result};

/// √−1.
const I: Complex<f64> = Complex::new(0.0, 1.0);

/// An infinitely long circular hole along x₃ under internal pressure, in an infinite medium of any stiffness that is
/// free of stress far away, in generalised plane strain: ε₃₃ = 0, u₃(x₁, x₂) free (Lekhnitskii 1963; Amadei & Savage; by
/// Stroh's formalism, Ting 1996, section 10.1).
///
/// With ζ_α outside the unit circle, x₁ + p_α x₂ = ½a((1 − i p_α) ζ_α + (1 + i p_α)/ζ_α), the functions are
/// f_α = q_α/ζ_α and the traction p e_r on the edge gives B q = ½ a p (i, −1, 0).
#[derive(Clone, Debug)]
pub struct PressurisedHole {
    stiffness: Stiffness,
    radius: f64,
    /// Solutions whose weighted sum is the answer, each with its q (m).
    parts: Vec<(f64, Stroh, Vector3<Complex<f64>>)>,
}

impl PressurisedHole {
    /// The hole of a radius (m), under a pressure (Pa).
    ///
    /// # Errors
    /// A radius that is not positive, a pressure that is not finite, a tensor that is not positive definite.
    pub fn new(stiffness: &Stiffness, radius: f64, pressure: f64) -> Result<Self> {
        stiffness.require_positive_definite()?;
        if !(radius.is_finite() && radius > 0.0 && pressure.is_finite()) {
            return Err(Error::input(
                format!("the hole has radius {radius} m and pressure {pressure} Pa"),
                "give a positive radius and a finite pressure",
            ));
        }
        let singular = || Error::input("the stiffness is too close to singular", "give a tensor with larger moduli");
        let load = Vector3::new(I, Complex::new(-1.0, 0.0), Complex::new(0.0, 0.0))
            * Complex::new(0.5 * radius * pressure, 0.0);
        let mut parts = Vec::new();
        for (weight, stroh) in Stroh::weighted(stiffness).ok_or_else(singular)? {
            let q = stroh.b.lu().solve(&load).ok_or_else(singular)?;
            parts.push((weight, stroh, q));
        }
        Ok(PressurisedHole { stiffness: *stiffness, radius, parts })
    }

    /// ζ_α of a point on or outside the edge.
    fn zeta(&self, p: Complex<f64>, x: [f64; 2]) -> Complex<f64> {
        let z = p * x[1] + x[0];
        let root = (z * z - (p * p + 1.0) * self.radius.powi(2)).sqrt();
        // The larger of the two, without cancellation.
        let sum = if (z.conj() * root).re >= 0.0 { z + root } else { z - root };
        sum / ((-I * p + 1.0) * self.radius)
    }

    /// Displacement (m) at (x₁, x₂) (m) on or outside the edge.
    pub fn displacement(&self, x: [f64; 2]) -> Vector3<f64> {
        self.parts.iter().fold(Vector3::zeros(), |sum, (weight, stroh, q)| {
            let f = Vector3::from_fn(|k, _| q[k] / self.zeta(stroh.roots[k], x));
            sum + 2.0 * *weight * (stroh.a * f).map(|u| u.re)
        })
    }

    /// u_i,j (–) at (x₁, x₂) (m) on or outside the edge; the third column is zero.
    pub fn gradient(&self, x: [f64; 2]) -> Matrix3<f64> {
        self.parts.iter().fold(Matrix3::zeros(), |sum, (weight, stroh, q)| {
            let slope = Vector3::from_fn(|k, _| {
                let p = stroh.roots[k];
                let inverse = self.zeta(p, x).inv();
                let square = inverse * inverse;
                let ip = I * p;
                let dz = ((-ip + 1.0) - (ip + 1.0) * square) * (0.5 * self.radius);
                -q[k] * square / dz
            });
            let along_2 = Vector3::from_fn(|k, _| slope[k] * stroh.roots[k]);
            let column = |f: &Vector3<Complex<f64>>| 2.0 * *weight * (stroh.a * f).map(|u| u.re);
            sum + Matrix3::from_columns(&[column(&slope), column(&along_2), Vector3::zeros()])
        })
    }

    /// Stress C:ε (Pa) at (x₁, x₂) (m) on or outside the edge.
    pub fn stress(&self, x: [f64; 2]) -> Matrix3<f64> {
        let gradient = self.gradient(x);
        let mut stress = Matrix3::zeros();
        for (i, j) in PAIRS {
            let mut sum = 0.0;
            for k in 0..3 {
                for l in 0..3 {
                    sum += self.stiffness.component(i, j, k, l) * gradient[(k, l)];
                }
            }
            stress[(i, j)] = sum;
            stress[(j, i)] = sum;
        }
        stress
    }

    /// Hoop stress σ_θθ (Pa) at the edge, at the angle θ (radians) from x₁.
    pub fn hoop_stress(&self, theta: f64) -> f64 {
        let (sin, cos) = theta.sin_cos();
        let around = Vector3::new(-sin, cos, 0.0);
        around.dot(&(self.stress([self.radius * cos, self.radius * sin]) * around))
    }
}
