//! A fracture energy by the normal of the crack, through a few given values.

use nalgebra::{DMatrix, DVector, Vector3};

use super::SphereRule;
use crate::{Error, Result};

/// A fracture energy by normal, through given values: G(n) = G₀ + √F(n), where F is the even form of the lowest degree (2, 4 or
/// 6) that passes through (G − G₀)², of the least variance over all directions, and G₀ the least of the values.
///
/// One value: the same for every plane. Of degree 2, √(n·A·n) is the support function of an ellipsoid, which is convex whatever
/// its axes, so bonds in dense directions reach it: G₀ is had by bonds as strong as those of an isotropic material of that energy,
/// and the rest by stronger bonds along the planes of least energy. No contrast asks for weaker ones. G₀ is 0 where no F ≥ 0 of
/// that degree passes through the values otherwise.
#[derive(Clone, Debug)]
pub struct EnergyByNormal {
    degree: usize,
    base: f64,
    coefficients: DVector<f64>,
}

impl EnergyByNormal {
    /// Through pairs of a normal (any length, either sign) and an energy (J/m²).
    ///
    /// # Errors
    /// No pairs, zero normals, energies that are not positive, contradicting values, or values between which the form
    /// is not positive.
    pub fn through(values: &[(Vector3<f64>, f64)]) -> Result<Self> {
        let mut points = Vec::new();
        for (normal, energy) in values {
            let n = normal.try_normalize(0.0).filter(|n| n.iter().all(|x| x.is_finite()));
            match n {
                Some(n) if energy.is_finite() && *energy > 0.0 => points.push((n, *energy)),
                _ => {
                    return Err(Error::input(
                        format!("fracture energy {energy} J/m² for the normal {:?}", normal.as_slice()),
                        "give normals that are not zero and positive energies",
                    ));
                }
            }
        }
        let Some(least) = points.iter().map(|(_, g)| *g).reduce(f64::min) else {
            return Err(Error::input("no fracture energy is given", "give at least one normal and its energy"));
        };
        let mut vanishing = None;
        for (degree, base) in [2, 4, 6].into_iter().flat_map(|degree| [(degree, least), (degree, 0.0)]) {
            let Some(form) = EnergyByNormal::of_degree(degree, base, &points) else { continue };
            match form.vanishes() {
                None => return Ok(form),
                Some(n) => vanishing = vanishing.or(Some(n)),
            }
        }
        match vanishing {
            Some(n) => Err(Error::input(
                format!(
                    "between the given values the fracture energy would vanish near the normal ({:.3} {:.3} {:.3})",
                    n.x, n.y, n.z
                ),
                "give its value there too, or smaller contrasts",
            )),
            None => Err(Error::input(
                "no smooth fracture energy passes through the given values",
                "give one energy per normal (n and −n are one plane) and at most about 20 normals",
            )),
        }
    }

    /// The form of a degree through points (n, G); `None` if there is none.
    fn of_degree(degree: usize, base: f64, points: &[(Vector3<f64>, f64)]) -> Option<Self> {
        let squares: Vec<(Vector3<f64>, f64)> = points.iter().map(|(n, g)| (*n, (g - base).powi(2))).collect();
        let largest = squares.iter().map(|(_, g)| *g).fold(0.0, f64::max);
        if largest == 0.0 {
            let coefficients = DVector::zeros(monomials(degree, &Vector3::x()).len());
            return Some(EnergyByNormal { degree, base, coefficients });
        }
        let coefficients = least_variance(degree, &squares, largest)?;
        let form = EnergyByNormal { degree, base, coefficients };
        squares.iter().all(|(n, g)| (form.square(n) - g).abs() <= 1e-9 * largest).then_some(form)
    }

    /// A normal whose F is negative, or 0 without a base.
    fn vanishes(&self) -> Option<Vector3<f64>> {
        let normals = SphereRule::GaussProduct { degree: 40 }.points();
        let values = || normals.iter().map(|(n, _)| (*n, self.square(n)));
        let scale = values().map(|(_, f)| f.abs()).fold(0.0, f64::max);
        let (n, smallest) = values().min_by(|x, y| x.1.total_cmp(&y.1))?;
        let positive = if self.base > 0.0 { smallest >= -1e-9 * scale } else { smallest > 0.0 };
        (!positive).then_some(n)
    }

    /// F = (G − G₀)² (J²/m⁴) for a unit normal.
    fn square(&self, n: &Vector3<f64>) -> f64 {
        self.coefficients.dot(&monomials(self.degree, n))
    }

    /// G (J/m²) for a unit normal.
    pub fn at(&self, n: &Vector3<f64>) -> f64 {
        self.base + self.square(n).max(0.0).sqrt()
    }

    /// Degree of F in n: 2, 4 or 6.
    pub fn degree(&self) -> usize {
        self.degree
    }
}

/// All n₁ᵃ n₂ᵇ n₃ᶜ with a + b + c = degree.
fn monomials(degree: usize, n: &Vector3<f64>) -> DVector<f64> {
    let exponents = (0..=degree).flat_map(|a| (0..=degree - a).map(move |b| (a, b)));
    let all: Vec<f64> =
        exponents.map(|(a, b)| n.x.powi(a as i32) * n.y.powi(b as i32) * n.z.powi((degree - a - b) as i32)).collect();
    DVector::from_vec(all)
}

/// Coefficients of the form of least variance through the points (n, g): minimise ½ cᵀVc subject to Φc = g.
fn least_variance(degree: usize, points: &[(Vector3<f64>, f64)], unit: f64) -> Option<DVector<f64>> {
    let size = monomials(degree, &Vector3::x()).len();
    let (mut second, mut first) = (DMatrix::zeros(size, size), DVector::zeros(size));
    for (n, w) in (SphereRule::GaussProduct { degree: 2 * degree }).points() {
        let f = monomials(degree, &n);
        second += w * &f * f.transpose();
        first += w * f;
    }
    let variance = second - &first * first.transpose();
    let rows = points.len();
    let mut system = DMatrix::zeros(size + rows, size + rows);
    system.view_mut((0, 0), (size, size)).copy_from(&variance);
    let mut right = DVector::zeros(size + rows);
    for (i, (n, g)) in points.iter().enumerate() {
        let f = monomials(degree, n);
        system.view_mut((size + i, 0), (1, size)).copy_from(&f.transpose());
        system.view_mut((0, size + i), (size, 1)).copy_from(&f);
        right[size + i] = g / unit;
    }
    // Repeated normals make it singular: the pseudo-inverse, judged by the values it gives.
    let solution = system.svd(true, true).solve(&right, 1e-12).ok()?;
    Some(solution.rows(0, size).into_owned() * unit)
}
