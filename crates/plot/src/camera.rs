//! Where a picture is seen from.

use nalgebra::{Unit, Vector3};

use super::scene::View;

/// Direction from the scene to the eye when nothing is cut.
const WHOLE: Vector3<f64> = Vector3::new(0.75, -1.3, 0.8);
/// Angle between a cut's normal and the direction to the eye (radians): oblique enough to show the body behind the cut.
const OBLIQUE: f64 = 0.55;

/// An orthographic camera: three orthonormal vectors.
pub(super) struct Camera {
    right: Vector3<f64>,
    up: Vector3<f64>,
    to_eye: Vector3<f64>,
}

impl Camera {
    /// The camera of a view, z upwards where possible.
    pub(super) fn of(view: &View) -> Self {
        let whole = WHOLE.normalize();
        let to_eye = match (view.to_eye, view.normal) {
            (Some(to_eye), _) => to_eye,
            (None, None) => whole,
            (None, Some(n)) => {
                // Tilted from the normal towards the eye of the whole view.
                let aside = [whole, Vector3::z()]
                    .into_iter()
                    .find_map(|direction| Unit::try_new(direction - n * direction.dot(&n), 1e-6))
                    .unwrap_or_else(Vector3::x_axis);
                (n * OBLIQUE.cos() + aside.into_inner() * OBLIQUE.sin()).normalize()
            }
        };
        let vertical = if to_eye.z.abs() < 0.99 { Vector3::z() } else { Vector3::y() };
        let right = vertical.cross(&to_eye).normalize();
        Camera { right, up: to_eye.cross(&right), to_eye }
    }

    /// Position in the picture plane, to the right and upwards.
    pub(super) fn project(&self, point: &Vector3<f64>) -> [f64; 2] {
        [self.right.dot(point), self.up.dot(point)]
    }

    /// How near to the eye.
    pub(super) fn nearness(&self, point: &Vector3<f64>) -> f64 {
        self.to_eye.dot(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cut_faces_an_upright_camera() {
        let normals = [(0., -1., 0.), (0., 0., 1.), (1., 0., 0.), (0., 0., -1.), (0.75, -1.3, 0.8), (-0.75, 1.3, -0.8)];
        for (x, y, z) in normals {
            let view = View::cut(Vector3::new(x, y, z)).unwrap();
            let camera = Camera::of(&view);
            assert!((camera.nearness(&view.normal.unwrap()) - OBLIQUE.cos()).abs() < 1e-9);
            assert!(camera.project(&Vector3::z())[1] >= 0.0);
            assert!((camera.right.cross(&camera.up) - camera.to_eye).norm() < 1e-12);
        }
        assert!(View::cut(Vector3::zeros()).is_err() && View::cut(Vector3::new(f64::NAN, 0.0, 1.0)).is_err());
    }
}
