//! The Barnett-Lothe tensors: what Stroh's formalism gives without its roots.

use nalgebra::{Complex, Matrix3, Matrix6};

use super::stroh::fundamental;
use crate::tensor::Stiffness;

/// Most steps of the sign iteration; about ten are used far from the limiting speed.
const MOST_STEPS: usize = 100;

/// S, H and L of a tensor, for fields that do not change along x₃ and run along x₁ with a speed (0: at rest).
///
/// They are the blocks of the matrix [S H; −L Sᵀ] that has Stroh's eigenvectors with the eigenvalue +i for roots above
/// the real axis and −i below (Ting 1996, ch. 6). That matrix is a sign function of N, found by Newton's iteration
/// X ← (X − X⁻¹)/2: no roots, so equal ones need no care.
#[derive(Clone, Copy, Debug)]
pub struct BarnettLothe {
    /// S (–).
    pub s: Matrix3<f64>,
    /// H (1/Pa), symmetric, positive definite at rest.
    pub h: Matrix3<f64>,
    /// L (Pa), symmetric, positive definite at rest.
    pub l: Matrix3<f64>,
}

impl BarnettLothe {
    /// For ρv² = `inertia` (Pa) below the limiting speed; `None` at or above it.
    pub fn new(c: &Stiffness, inertia: f64) -> Option<Self> {
        let unit = c.norm();
        let mut x: Matrix6<f64> = fundamental(c, unit, inertia)?;
        let (mut steps, mut before) = (0, f64::INFINITY);
        loop {
            let next = 0.5 * (x - x.try_inverse()?);
            let change = (next - x).norm() / next.norm();
            x = next;
            steps += 1;
            // Quadratic convergence ends where rounding begins.
            if change < 1e-13 || (change < 1e-5 && change >= before) {
                break;
            }
            if steps == MOST_STEPS || change.is_nan() {
                return None;
            }
            before = change;
        }
        let block = |i, j| x.fixed_view::<3, 3>(i, j).into_owned();
        Some(BarnettLothe { s: block(0, 0), h: block(0, 3) / unit, l: -block(3, 0) * unit })
    }

    /// The surface impedance H⁻¹ + i H⁻¹S (Pa) of the half-space x₂ > 0: Hermitian, positive definite below the Rayleigh
    /// speed (Barnett & Lothe 1985).
    pub fn impedance(&self) -> Option<Matrix3<Complex<f64>>> {
        let inverse = self.h.try_inverse()?;
        let imaginary = inverse * self.s;
        Some(Matrix3::from_fn(|i, j| {
            Complex::new(0.5 * (inverse[(i, j)] + inverse[(j, i)]), 0.5 * (imaginary[(i, j)] - imaginary[(j, i)]))
        }))
    }
}
