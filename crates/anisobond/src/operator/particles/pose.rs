//! Where a particle is, relative to where it was.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Displacement and rotation of a particle since the start: one cache line, which is all that a bond reads of its end.
///
/// Displacements rather than positions are stored so that small strains keep all their digits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Pose {
    /// Displacement u (m); the fourth number is unused.
    pub displacement: [f64; 4],
    /// Finite kinematics: unit quaternion (x, y, z, w). Linear kinematics: rotation vector θ (radians) and 1.
    pub turn: [f64; 4],
}

impl Pose {
    /// At the start.
    pub const START: Pose = Pose { displacement: [0.0; 4], turn: [0.0, 0.0, 0.0, 1.0] };

    /// Displacement (m).
    pub fn u(&self) -> Vector3<f64> {
        Vector3::new(self.displacement[0], self.displacement[1], self.displacement[2])
    }

    /// First three numbers of the turn: the rotation vector of linear kinematics.
    pub fn theta(&self) -> Vector3<f64> {
        Vector3::new(self.turn[0], self.turn[1], self.turn[2])
    }

    /// Rotation of finite kinematics.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        let [x, y, z, w] = self.turn;
        UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
    }

    /// Move by a displacement (m).
    pub fn shift(&mut self, by: &Vector3<f64>) {
        for i in 0..3 {
            self.displacement[i] += by[i];
        }
    }

    /// Turn by a rotation vector (radians) added to θ: linear kinematics.
    pub fn add_theta(&mut self, by: &Vector3<f64>) {
        for i in 0..3 {
            self.turn[i] += by[i];
        }
    }

    /// Turn by a finite rotation vector (radians), exactly: q ← exp(½ φ) q.
    #[inline]
    pub fn rotate(&mut self, by: &Vector3<f64>) {
        let q = increment(by) * self.rotation().into_inner();
        // Rounding only: |q|² stays 1 within it.
        let q = q * (1.5 - 0.5 * q.norm_squared());
        self.turn = [q.i, q.j, q.k, q.w];
    }
}

/// The quaternion of a rotation vector φ: (sin ½|φ| φ/|φ|, cos ½|φ|).
pub(super) fn increment(by: &Vector3<f64>) -> Quaternion<f64> {
    let square = 0.25 * by.norm_squared();
    // Series of sin(x)/x and cos(x) below x² = 10⁻³: the next term is below rounding.
    let (s, c) = if square < 1e-3 {
        let x = square;
        (
            1.0 + x * (-1.0 / 6.0 + x * (1.0 / 120.0 + x * (-1.0 / 5040.0 + x * (1.0 / 362_880.0)))),
            1.0 + x * (-0.5 + x * (1.0 / 24.0 + x * (-1.0 / 720.0 + x * (1.0 / 40_320.0)))),
        )
    } else {
        let x = square.sqrt();
        (x.sin() / x, x.cos())
    };
    Quaternion::from_parts(c, 0.5 * s * by)
}
