//! The Rayleigh wave of any half-space: the speed that cracks do not exceed.

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::barnett_lothe::BarnettLothe;
use super::stroh::plane_blocks;
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// Angles at which the limiting speed is looked for before it is refined.
const ANGLES: usize = 720;

/// Part of the limiting speed up to which a Rayleigh wave is looked for.
const BELOW_LIMIT: f64 = 1.0 - 1e-9;

/// The surface wave of a half-space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayleighWave {
    /// Its speed (m/s); `None` where the half-space has none slower than `limiting` (exceptional directions).
    pub speed: Option<f64>,
    /// The limiting speed (m/s): the slowest at which a plane wave of the bulk keeps pace with the surface.
    pub limiting: f64,
}

/// The Rayleigh wave that runs along `along` on a free surface of normal `normal` (orthogonal vectors of any length): the
/// speed at which the surface impedance loses its definiteness (Barnett & Lothe 1985). A crack in the plane of that
/// normal, running that way, stays below it.
///
/// # Errors
/// Directions that are zero or not orthogonal to 10⁻⁹, a density that is not positive, a tensor not positive definite.
pub fn rayleigh_wave(
    stiffness: &Stiffness,
    density: f64,
    along: &Vector3<f64>,
    normal: &Vector3<f64>,
) -> Result<RayleighWave> {
    stiffness.require_positive_definite()?;
    if !(density.is_finite() && density > 0.0) {
        return Err(Error::input(format!("the density is {density} kg/m³"), "give a positive number"));
    }
    let turned = stiffness.rotated(&frame(along, normal)?);
    let limit = limiting_inertia(&turned);
    let least = |inertia: f64| -> Option<f64> {
        let z = BarnettLothe::new(&turned, inertia)?.impedance()?;
        // A Hermitian matrix as a real one of twice the size, with each eigenvalue twice.
        let real = Matrix6::from_fn(|i, j| {
            let x = z[(i % 3, j % 3)];
            match (i < 3, j < 3) {
                (true, false) => -x.im,
                (false, true) => x.im,
                _ => x.re,
            }
        });
        Some(real.symmetric_eigenvalues().min())
    };
    let limiting = (limit / density).sqrt();
    // Where even the sign iteration fails the speed is as good as the limiting one.
    if !least(limit * BELOW_LIMIT).is_some_and(|x| x < 0.0) {
        return Ok(RayleighWave { speed: None, limiting });
    }
    let (mut low, mut high) = (0.0, limit * BELOW_LIMIT);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if least(middle).is_some_and(|x| x < 0.0) { high = middle } else { low = middle }
    }
    Ok(RayleighWave { speed: Some((low / density).sqrt()), limiting })
}

/// The rotation that turns `along` to x₁ and `normal` to x₂.
pub(super) fn frame(along: &Vector3<f64>, normal: &Vector3<f64>) -> Result<Matrix3<f64>> {
    let unit = |v: &Vector3<f64>| v.try_normalize(0.0).filter(|n| n.iter().all(|x| x.is_finite()));
    match (unit(along), unit(normal)) {
        (Some(m), Some(n)) if m.dot(&n).abs() < 1e-9 => Ok(Matrix3::from_columns(&[m, n, m.cross(&n)]).transpose()),
        _ => Err(Error::input(
            format!(
                "the directions {:?} and {:?} do not span a plane at right angles",
                along.as_slice(),
                normal.as_slice()
            ),
            "give two vectors at right angles, of any length but zero",
        )),
    }
}

/// The smallest ρv² (Pa) at which a real root appears: min over p of the least eigenvalue of Q + p (R + Rᵀ) + p² T, with
/// p = tan θ.
fn limiting_inertia(c: &Stiffness) -> f64 {
    let [q, r, t] = plane_blocks(c);
    let value = |theta: f64| {
        let p = theta.tan();
        (q + (r + r.transpose()) * p + t * (p * p)).symmetric_eigenvalues().min()
    };
    let step = std::f64::consts::PI / ANGLES as f64;
    let angle = |k: usize| -std::f64::consts::FRAC_PI_2 + (k as f64 + 0.5) * step;
    let best = (0..ANGLES).map(angle).min_by(|x, y| value(*x).total_cmp(&value(*y))).unwrap_or(0.0);
    // Golden section about the best angle.
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = (best - step, best + step);
    for _ in 0..60 {
        let width = ratio * (high - low);
        if value(high - width) < value(low + width) { high = low + width } else { low = high - width }
    }
    value(0.5 * (low + high)).min(value(best))
}
