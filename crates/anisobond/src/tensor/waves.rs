//! Plane waves: Christoffel's tensor, speeds and polarisations, and their extremes over all directions.

use nalgebra::{Matrix3, Vector2, Vector3};
use serde::Serialize;

use super::directional::{Extreme, Extremes, inner, oriented, times, vector6};
use super::stiffness::Stiffness;
use super::turning::{Mandel, array_of, eigen3, frame_of, half_sphere, special_directions, starts_apart};
use crate::{Error, Result};

/// One of the three plane waves of a direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Wave {
    /// Phase speed (m/s).
    pub speed: f64,
    /// Unit direction of the displacement, its first component that is not zero positive.
    pub polarisation: [f64; 3],
}

/// Extremes over all directions of the three phase speeds (m/s).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WaveExtremes {
    /// The slowest of the three waves (a shear wave, usually).
    pub slow: Extremes,
    /// The wave between.
    pub intermediate: Extremes,
    /// The fastest of the three waves (a pressure wave, usually).
    pub fast: Extremes,
}

impl Stiffness {
    /// Christoffel's tensor Γ_ik = C_ijkl n_j n_l (Pa) of the unit direction n.
    pub fn christoffel(&self, n: &Vector3<f64>) -> Matrix3<f64> {
        Matrix3::from_fn(|i, k| {
            let mut sum = 0.0;
            for j in 0..3 {
                for l in 0..3 {
                    sum += self.component(i, j, k, l) * n[j] * n[l];
                }
            }
            sum
        })
    }

    /// The three plane waves along n (any length), slowest first: ρ c² u = Γ u, ρ the density (kg/m³).
    ///
    /// # Errors
    /// A density that is not positive, a direction that is zero, or a Γ that is not positive semidefinite.
    pub fn waves(&self, n: &Vector3<f64>, density: f64) -> Result<[Wave; 3]> {
        require_density(density)?;
        let n = n
            .try_normalize(0.0)
            .filter(|n| n.iter().all(|x| x.is_finite()))
            .ok_or_else(|| Error::input("the wave's direction is zero", "give a direction of any length but zero"))?;
        let (values, vectors) = eigen3(&self.christoffel(&n));
        if values[0].is_nan() || values[0] < -1e-13 * values[2].abs() {
            return Err(Error::input(
                format!("no wave travels along ({:.3} {:.3} {:.3}): ρc² would be {:e} Pa", n[0], n[1], n[2], values[0]),
                "give a stiffness that is positive definite",
            ));
        }
        Ok(std::array::from_fn(|k| Wave {
            speed: (values[k].max(0.0) / density).sqrt(),
            polarisation: oriented(&vectors.column(k).into_owned()),
        }))
    }

    /// The extremes over all directions of the slowest, the intermediate and the fastest wave, by a search over the
    /// half sphere and a simplex search from the best directions. The speeds are accurate to about 10⁻¹², also where
    /// two of them meet in a cone and have no gradient. Where moduli differ by a factor of thousands, two optima of
    /// nearly the same speed may be taken for each other (1 of 150 random orthotropic tensors, by 10⁻⁵).
    ///
    /// # Errors
    /// A density that is not positive, or a tensor that is not positive definite.
    pub fn wave_extremes(&self, density: f64) -> Result<WaveExtremes> {
        require_density(density)?;
        self.require_positive_definite()?;
        let c = array_of(self.mandel());
        let samples: Vec<(Vector3<f64>, [f64; 3])> =
            special_directions(self).into_iter().chain(half_sphere(DIRECTIONS)).map(|n| (n, moduli(&c, &n))).collect();
        let extreme = |branch: usize, sign: f64| {
            let values: Vec<(f64, Vector3<f64>)> = samples.iter().map(|(n, m)| (sign * m[branch], *n)).collect();
            // Special directions come first; a later one must be better by more than rounding.
            let starts = starts_apart(&values, NEAR_COSINE, STARTS);
            let value = |n: &Vector3<f64>| sign * moduli(&c, n)[branch];
            let mut found: Vec<(f64, Vector3<f64>)> =
                starts.iter().map(|&i| simplex_search(samples[i].0, &[0.04], 60, value)).collect();
            found.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut best = (f64::INFINITY, Vector3::x());
            for (_, start) in found.into_iter().take(POLISHED) {
                let (value, n) = simplex_search(start, &[0.02, 4e-3, 5e-4, 5e-5, 1e-6, 1e-8], 300, value);
                if value < best.0 - 1e-13 * value.abs() || !best.0.is_finite() {
                    best = (value, n);
                }
            }
            Extreme { value: (sign * best.0 / density).sqrt(), direction: oriented(&best.1), transverse: None }
        };
        let [slow, intermediate, fast] =
            [0, 1, 2].map(|branch| Extremes { min: extreme(branch, 1.0), max: extreme(branch, -1.0) });
        Ok(WaveExtremes { slow, intermediate, fast })
    }
}

/// ρc² of the three waves along the unit direction n, ascending (Pa): the eigenvalues of Γ_ik = w_i·C w_k with w_i the
/// symmetric part of e_i⊗n.
fn moduli(c: &Mandel, n: &Vector3<f64>) -> [f64; 3] {
    let w = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| vector6(&e, n));
    let cw = w.map(|w| times(c, &w));
    eigen3(&Matrix3::from_fn(|i, k| inner(&w[i], &cw[k]))).0.into()
}

/// Directions of the half sphere that are searched: 5° apart.
const DIRECTIONS: usize = 800;
/// Starts that are refined.
const STARTS: usize = 16;
/// Of the starts, after some steps, the best are refined to the end.
const POLISHED: usize = 3;
/// Starts are at least 10° apart.
const NEAR_COSINE: f64 = 0.985;

/// A local minimum on the sphere without derivatives, for extremes may lie where two speeds meet and have none: the
/// simplex method of Nelder & Mead (1965) in the plane tangent at the start, begun again with each
/// size (radians); at most so many steps each time.
fn simplex_search(
    start: Vector3<f64>,
    sizes: &[f64],
    steps: usize,
    f: impl Fn(&Vector3<f64>) -> f64,
) -> (f64, Vector3<f64>) {
    let mut best = (f(&start), start);
    for &size in sizes {
        let frame = frame_of(&best.1);
        let direction =
            |x: &Vector2<f64>| (frame.column(2) + x[0] * frame.column(0) + x[1] * frame.column(1)).normalize();
        let (value, x) = nelder_mead(size, steps, |x| f(&direction(x)));
        if value < best.0 {
            best = (value, direction(&x));
        }
    }
    best
}

/// Nelder & Mead's search from a triangle of given size about the origin.
fn nelder_mead(size: f64, steps: usize, f: impl Fn(&Vector2<f64>) -> f64) -> (f64, Vector2<f64>) {
    let at = |x: Vector2<f64>| (f(&x), x);
    let mut corners = [at(Vector2::zeros()), at(Vector2::new(size, 0.0)), at(Vector2::new(-0.5 * size, 0.866 * size))];
    for _ in 0..steps {
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [best, middle, worst] = corners;
        let spread = (worst.1 - best.1).norm().max((middle.1 - best.1).norm());
        if worst.0 - best.0 <= 1e-16 * best.0.abs() || spread < 1e-14 {
            break;
        }
        let centre = 0.5 * (best.1 + middle.1);
        let along = |t: f64| at(centre + t * (centre - worst.1));
        let reflected = along(1.0);
        if reflected.0 < best.0 {
            let expanded = along(2.0);
            corners[2] = if expanded.0 < reflected.0 { expanded } else { reflected };
            continue;
        }
        if reflected.0 < middle.0 {
            corners[2] = reflected;
            continue;
        }
        let contracted = if reflected.0 < worst.0 { along(0.5) } else { along(-0.5) };
        if contracted.0 < worst.0.min(reflected.0) {
            corners[2] = contracted;
        } else {
            corners[1] = at(0.5 * (best.1 + middle.1));
            corners[2] = at(0.5 * (best.1 + worst.1));
        }
    }
    corners.sort_by(|a, b| a.0.total_cmp(&b.0));
    corners[0]
}

fn require_density(density: f64) -> Result<()> {
    if density > 0.0 && density.is_finite() {
        return Ok(());
    }
    Err(Error::input(format!("the density is {density} kg/m³"), "give a positive number"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Material;

    /// Layered rock of S, C11 C33 C13 C12 = 130 55 28 40 MPa, C44 = ¼C11 + ¼C33 − ½C13.
    fn rock() -> Stiffness {
        let c44 = 0.25 * 130.0 + 0.25 * 55.0 - 0.5 * 28.0;
        #[rustfmt::skip]
        let c = nalgebra::Matrix6::new(
            130.0, 40.0, 28.0, 0.0, 0.0, 0.0,
            40.0, 130.0, 28.0, 0.0, 0.0, 0.0,
            28.0, 28.0, 55.0, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0, c44, 0.0, 0.0,
            0.0, 0.0, 0.0, 0.0, c44, 0.0,
            0.0, 0.0, 0.0, 0.0, 0.0, 45.0);
        Stiffness::from_voigt(&c).unwrap()
    }

    #[test]
    fn speeds_of_the_layered_rock() {
        let expected = [
            (Vector3::x(), [5.679, 6.708, 11.402]),
            (Vector3::z(), [5.679, 5.679, 7.416]),
            (Vector3::new(1.0, 0.0, 1.0), [5.186, 6.215, 9.892]),
        ];
        for (n, speeds) in expected {
            let waves = rock().waves(&n, 1.0).unwrap();
            for k in 0..3 {
                assert!((waves[k].speed - speeds[k]).abs() < 6e-4, "{n} {waves:?}");
            }
        }
        assert_eq!(rock().waves(&Vector3::x(), 1.0).unwrap()[2].polarisation.map(f64::abs), [1.0, 0.0, 0.0]);
    }

    /// Isotropic: c_s² = G/ρ twice and c_p² = (λ + 2G)/ρ in every direction.
    #[test]
    fn isotropic_speeds() {
        let e = Stiffness::isotropic(20e9, 30e9).wave_extremes(2700.0).unwrap();
        let (s, p) = ((30e9_f64 / 2700.0).sqrt(), (80e9_f64 / 2700.0).sqrt());
        for (branch, speed) in [(e.slow, s), (e.intermediate, s), (e.fast, p)] {
            assert!((branch.min.value / speed - 1.0).abs() < 1e-13 && (branch.max.value / speed - 1.0).abs() < 1e-13);
        }
    }

    /// Cubic with 2C44 > C11 − C12: fastest √((C11 + 2C12 + 4C44)/3ρ) along [111], slowest
    /// √((C11 − C12)/2ρ) along [110].
    #[test]
    fn cubic_extremes() {
        let c = Material::builtin("Spinel").unwrap().stiffness;
        let e = c.wave_extremes(3600.0).unwrap();
        let fast = ((252e9 + 2.0 * 145e9 + 4.0 * 142e9) / 3.0 / 3600.0_f64).sqrt();
        let slow = ((252e9 - 145e9) / 2.0 / 3600.0_f64).sqrt();
        assert!((e.fast.max.value / fast - 1.0).abs() < 1e-12 && (e.slow.min.value / slow - 1.0).abs() < 1e-12);
        assert!((e.slow.max.value / (142e9_f64 / 3600.0).sqrt() - 1.0).abs() < 1e-11, "{e:?}");
    }

    #[test]
    fn wrong_input_is_an_error() {
        let c = rock();
        assert!(c.waves(&Vector3::x(), 0.0).is_err() && c.waves(&Vector3::zeros(), 1.0).is_err());
        assert!(c.wave_extremes(f64::NAN).is_err());
        assert!(Stiffness::isotropic(-10.0, 1.0).waves(&Vector3::x(), 1.0).is_err());
    }
}
