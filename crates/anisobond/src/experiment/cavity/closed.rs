//! The hole's closed form in the coordinates of a body.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::experiment::closed_forms::PressurisedHole;
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// A pressurised hole of any axis through the origin, in an infinite body at rest far away: generalised plane strain,
/// ε along the axis zero, displacement along the axis free ([`PressurisedHole`]).
#[derive(Clone, Debug)]
pub struct Cavity {
    hole: PressurisedHole,
    /// Rows: two directions across the hole, then its axis.
    frame: Matrix3<f64>,
    radius: f64,
}

/// The motion of a hole's wall. On the wall the closed form is linear in the unit normal n: u = W n (f = q/ζ with
/// ζ = e^{iθ}); so three numbers along either direction across the hole say all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallMotion {
    /// W (m), of the body's axes; W times the hole's axis is zero.
    pub matrix: Matrix3<f64>,
}

impl Cavity {
    /// A hole of a radius (m) along an axis (any length but zero) under a pressure (Pa), in a stiffness (Pa).
    ///
    /// # Errors
    /// An axis without direction; what [`PressurisedHole::new`] refuses.
    pub fn new(stiffness: &Stiffness, axis: &Vector3<f64>, radius: f64, pressure: f64) -> Result<Self> {
        let axis = axis
            .try_normalize(0.0)
            .filter(|n| n.iter().all(|x| x.is_finite()))
            .ok_or_else(|| Error::input("the hole's axis has no direction", "give a vector that is not zero"))?;
        // The next two axes in their cyclic order where the axis is one of the body's own.
        let helper = Vector3::from_fn(|i, _| if i == (axis.iamax() + 1) % 3 { 1.0 } else { 0.0 });
        let first = (helper - axis * axis.dot(&helper)).normalize();
        let frame = Matrix3::from_rows(&[first.transpose(), axis.cross(&first).transpose(), axis.transpose()]);
        let hole = PressurisedHole::new(&stiffness.rotated(&frame), radius, pressure)?;
        Ok(Cavity { hole, frame, radius })
    }

    /// Radius of the hole (m).
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Unit vector along the hole.
    pub fn axis(&self) -> Vector3<f64> {
        self.frame.row(2).transpose()
    }

    /// Two unit vectors across the hole.
    pub fn across(&self) -> [Vector3<f64>; 2] {
        [0, 1].map(|k| self.frame.row(k).transpose())
    }

    /// Distance from the axis (m), and the unit vector away from it.
    pub fn polar(&self, x: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let away = x - self.axis() * self.axis().dot(x);
        let r = away.norm();
        (r, if r > 0.0 { away / r } else { self.frame.row(0).transpose() })
    }

    /// Displacement (m) at a place (m); within the hole that of the wall.
    pub fn displacement(&self, x: &Vector3<f64>) -> Vector3<f64> {
        let (r, n) = self.polar(x);
        let place = self.frame * n * r.max(self.radius);
        self.frame.tr_mul(&self.hole.displacement([place.x, place.y]))
    }

    /// Hoop stress (Pa) on the wall where the vector away from the axis points.
    pub fn hoop_stress(&self, away: &Vector3<f64>) -> f64 {
        let n = self.frame * self.polar(away).1;
        self.hole.hoop_stress(n.y.atan2(n.x))
    }

    /// The wall's motion.
    pub fn wall(&self) -> WallMotion {
        let along = |k: usize| {
            let n: Vector3<f64> = self.frame.row(k).transpose();
            self.displacement(&(n * self.radius)) * n.transpose()
        };
        WallMotion { matrix: along(0) + along(1) }
    }

    /// The matrix W of least squares, u ≈ W n, over displacements (m) at places (m); `None` of fewer than two directions.
    pub fn fitted(&self, places: &[Vector3<f64>], displacements: &[Vector3<f64>]) -> Option<WallMotion> {
        let mut normal = Matrix2::zeros();
        let mut right = nalgebra::Matrix3x2::zeros();
        for (x, u) in places.iter().zip(displacements) {
            let n = self.frame * self.polar(x).1;
            let n = Vector2::new(n.x, n.y);
            normal += n * n.transpose();
            right += u * n.transpose();
        }
        let across = self.frame.fixed_rows::<2>(0).into_owned();
        Some(WallMotion { matrix: right * normal.try_inverse()? * across })
    }
}

impl WallMotion {
    /// Displacement (m) of the wall at the unit normal n of the hole's surface, pointing away from the axis.
    pub fn at(&self, n: &Vector3<f64>) -> Vector3<f64> {
        self.matrix * n
    }

    /// Radial displacement at n (m).
    pub fn radial(&self, n: &Vector3<f64>) -> f64 {
        n.dot(&self.at(n))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// S's rock: C11 C33 C13 C12 C44 (MPa) about an axis in the plane of y and z, β from z (strike 270°).
    pub(in crate::experiment::cavity) fn rock(dip_degrees: f64) -> Stiffness {
        let (c11, c33, c13, c12, c44) = (130e6, 55e6, 28e6, 40e6, 32.25e6);
        let mut c = nalgebra::Matrix6::zeros();
        for (i, j, value) in [
            (0, 0, c11),
            (1, 1, c11),
            (2, 2, c33),
            (0, 1, c12),
            (0, 2, c13),
            (1, 2, c13),
            (3, 3, c44),
            (4, 4, c44),
            (5, 5, 0.5 * (c11 - c12)),
        ] {
            c[(i, j)] = value;
            c[(j, i)] = value;
        }
        let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), -dip_degrees.to_radians());
        Stiffness::from_voigt(&c).unwrap().rotated(turn.matrix())
    }

    /// THEORY section 9: the axis of anisotropy in the section.
    #[test]
    fn the_wall_in_the_section() {
        let cavity = Cavity::new(&rock(0.0), &Vector3::y(), 2.0, 1e6).unwrap();
        let wall = cavity.wall();
        let [x, z] = [Vector3::x(), Vector3::z()].map(|n| wall.radial(&n) / 2.0);
        assert!((x - 0.011644).abs() < 5e-7 && (z - 0.022676).abs() < 5e-7, "{x} {z}");
        assert!((z / x - 1.9475).abs() < 5e-5);
        assert!((wall.matrix * Vector3::y()).norm() < 1e-15);
        assert!(wall.matrix.row(1).norm() < 1e-12);
    }

    /// u = W n all around the wall, also where the axis of anisotropy leaves the section.
    #[test]
    fn the_wall_is_linear_in_its_normal() {
        for axis in [Vector3::y(), Vector3::z(), Vector3::new(0.3, 0.5, -0.8)] {
            let cavity = Cavity::new(&rock(25.0), &axis, 0.7, 2e6).unwrap();
            let wall = cavity.wall();
            for k in 0..24 {
                let angle = f64::from(k) * 0.27;
                let across: Vector3<f64> =
                    cavity.frame.row(0).transpose() * angle.cos() + cavity.frame.row(1).transpose() * angle.sin();
                let u = cavity.displacement(&(across * 0.7));
                assert!((u - wall.at(&across)).norm() < 1e-10 * u.norm(), "{axis:?} {k}");
            }
        }
    }

    /// The displacements solve the problem, seen without its own formulas: stresses by central differences of the
    /// displacements and Hooke's law are in equilibrium in the body, and on the wall they are the pressure.
    #[test]
    fn displacements_are_in_equilibrium_and_carry_the_pressure() {
        let (stiffness, p, a) = (rock(25.0), 1.5e6, 0.7);
        let cavity = Cavity::new(&stiffness, &Vector3::y(), a, p).unwrap();
        let h = 1e-4 * a;
        let stress = |x: &Vector3<f64>| {
            let slope = |j: usize| {
                let mut e = Vector3::zeros();
                e[j] = h;
                (cavity.displacement(&(x + e)) - cavity.displacement(&(x - e))) / (2.0 * h)
            };
            let gradient = Matrix3::from_columns(&[slope(0), slope(1), slope(2)]);
            Matrix3::from_fn(|i, j| {
                let terms = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
                terms.map(|(k, l)| stiffness.component(i, j, k, l) * gradient[(k, l)]).sum::<f64>()
            })
        };
        for k in 0..12 {
            let angle = 0.1 + f64::from(k) * 0.53;
            let n = Vector3::new(angle.cos(), 0.0, angle.sin());
            let traction = stress(&(n * a * 1.0005)) * n;
            assert!((traction + n * p).norm() < 5e-3 * p, "{angle}: {traction:?}");
            let x = n * a * (1.2 + 0.1 * f64::from(k));
            let wide = 30.0 * h;
            let divergence: Vector3<f64> = (0..3)
                .map(|j| {
                    let mut e = Vector3::zeros();
                    e[j] = wide;
                    (stress(&(x + e)) - stress(&(x - e))).column(j) / (2.0 * wide)
                })
                .sum();
            assert!(divergence.norm() < 2e-4 * p / a, "{angle}: {divergence:?}");
        }
    }

    /// A fit to the wall's own displacements is the wall's motion.
    #[test]
    fn fits_are_exact_on_the_wall() {
        let cavity = Cavity::new(&rock(25.0), &Vector3::y(), 0.7, 2e6).unwrap();
        let places: Vec<Vector3<f64>> =
            (0..50).map(|k| Vector3::new(f64::from(k).cos(), 0.2 * f64::from(k), f64::from(k).sin()) * 0.7).collect();
        let u: Vec<Vector3<f64>> = places.iter().map(|x| cavity.displacement(&(cavity.polar(x).1 * 0.7))).collect();
        let fitted = cavity.fitted(&places, &u).unwrap();
        assert!((fitted.matrix - cavity.wall().matrix).norm() < 1e-12 * fitted.matrix.norm());
        assert!(cavity.fitted(&places[..1], &u).is_none());
        assert!(Cavity::new(&rock(25.0), &Vector3::zeros(), 0.7, 2e6).is_err());
    }
}
