//! Quadrature on the unit sphere.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use serde::Serialize;

/// A named rule for the mean over all directions; exact for polynomials of n up to its degree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SphereRule {
    /// 14 points, degree 5 (Lebedev 1976).
    Lebedev14,
    /// 26 points, degree 7.
    Lebedev26,
    /// 50 points, degree 11.
    Lebedev50,
    /// Gauss-Legendre in cos θ times equal steps in φ: any degree, about (degree + 1)²/2 points.
    GaussProduct {
        /// Degree integrated exactly.
        degree: usize,
    },
}

impl SphereRule {
    /// Largest degree of a polynomial of n that is integrated exactly.
    pub fn degree(self) -> usize {
        match self {
            SphereRule::Lebedev14 => 5,
            SphereRule::Lebedev26 => 7,
            SphereRule::Lebedev50 => 11,
            SphereRule::GaussProduct { degree } => degree,
        }
    }

    /// Directions and weights; the weights add to 1.
    pub fn points(self) -> Vec<(Vector3<f64>, f64)> {
        let (axis, edge, corner) = ([1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0]);
        match self {
            SphereRule::Lebedev14 => orbits(&[(axis, 1.0 / 15.0), (corner, 3.0 / 40.0)]),
            SphereRule::Lebedev26 => orbits(&[(axis, 1.0 / 21.0), (edge, 4.0 / 105.0), (corner, 9.0 / 280.0)]),
            SphereRule::Lebedev50 => orbits(&[
                (axis, 4.0 / 315.0),
                (edge, 64.0 / 2835.0),
                (corner, 27.0 / 1280.0),
                ([1.0, 1.0, 3.0], 14641.0 / 725_760.0),
            ]),
            SphereRule::GaussProduct { degree } => gauss_product(degree),
        }
    }
}

/// All distinct points that permutations and signs make of each vector, normalised, each with the orbit's weight.
fn orbits(generators: &[([f64; 3], f64)]) -> Vec<(Vector3<f64>, f64)> {
    let mut points: Vec<(Vector3<f64>, f64)> = Vec::new();
    for &([x, y, z], weight) in generators {
        let first = points.len();
        for [a, b, c] in [[x, y, z], [y, z, x], [z, x, y], [y, x, z], [x, z, y], [z, y, x]] {
            for signs in 0..8 {
                let sign = |bit: i32| if signs >> bit & 1 == 0 { 1.0 } else { -1.0 };
                let n = Vector3::new(sign(0) * a, sign(1) * b, sign(2) * c).normalize();
                if points[first..].iter().all(|(p, _)| (p - n).norm() > 1e-9) {
                    points.push((n, weight));
                }
            }
        }
    }
    points
}

/// ∫ f dΩ/4π = ½ Σ_i w_i (1/m) Σ_j f(θ_i, φ_j) with Gauss-Legendre nodes cos θ_i and m > degree equal steps in φ.
fn gauss_product(degree: usize) -> Vec<(Vector3<f64>, f64)> {
    let azimuths = degree + 1;
    let mut points = Vec::new();
    for (z, w) in gauss_legendre(degree / 2 + 1) {
        let s = (1.0 - z * z).sqrt();
        for j in 0..azimuths {
            let phi = TAU * (j as f64 + 0.5) / azimuths as f64;
            points.push((Vector3::new(s * phi.cos(), s * phi.sin(), z), 0.5 * w / azimuths as f64));
        }
    }
    points
}

/// Nodes and weights of the n-point Gauss-Legendre rule on [−1, 1]: Newton's method on P_n, whose value and slope
/// follow from the three-term recurrence.
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let legendre = |x: f64| {
        let (mut before, mut p) = (1.0, x);
        for k in 2..=n {
            let k = k as f64;
            (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
        }
        (p, n as f64 * (x * p - before) / (x * x - 1.0))
    };
    (0..n)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            for _ in 0..20 {
                let (p, slope) = legendre(x);
                x -= p / slope;
            }
            let (_, slope) = legendre(x);
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ⟨x^a y^b z^c⟩ = (a−1)!! (b−1)!! (c−1)!! / (a+b+c+1)!! for even exponents, 0 otherwise.
    fn mean(a: usize, b: usize, c: usize) -> f64 {
        if a % 2 + b % 2 + c % 2 > 0 {
            return 0.0;
        }
        let double = |n: usize| (1..=n).rev().step_by(2).map(|k| k as f64).product::<f64>();
        let odd = |n: usize| if n == 0 { 1.0 } else { double(n - 1) };
        odd(a) * odd(b) * odd(c) / double(a + b + c + 1)
    }

    #[test]
    fn every_monomial_up_to_the_degree_is_exact_and_one_beyond_is_not() {
        let mut rules = vec![SphereRule::Lebedev14, SphereRule::Lebedev26, SphereRule::Lebedev50];
        rules.extend((0..=15).map(|degree| SphereRule::GaussProduct { degree }));
        for rule in rules {
            let points = rule.points();
            let error = |degree: usize| {
                let mut worst = 0.0f64;
                for a in 0..=degree {
                    for b in 0..=degree - a {
                        let c = degree - a - b;
                        let sum: f64 = points
                            .iter()
                            .map(|(n, w)| w * n.x.powi(a as i32) * n.y.powi(b as i32) * n.z.powi(c as i32))
                            .sum();
                        worst = worst.max((sum - mean(a, b, c)).abs());
                    }
                }
                worst
            };
            for degree in 0..=rule.degree() {
                assert!(error(degree) < 1e-14, "{rule:?} {degree} {}", error(degree));
            }
            let beyond = rule.degree() + 1;
            assert!(error(beyond + beyond % 2) > 1e-6, "{rule:?}");
        }
        assert_eq!(SphereRule::Lebedev50.points().len(), 50);
        assert_eq!(SphereRule::Lebedev26.points().len(), 26);
    }
}
