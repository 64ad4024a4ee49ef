//! Solids: what is inside, how far their surface is, and how they fill a grid.

mod boundary;
mod closed;
mod exposed;
mod fill;
mod grains;
mod mesh;
mod surface;
mod thin;

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

pub use boundary::{Surface, Window};
pub use exposed::exposed_spheres;
pub use fill::{MOST_BODY_NODES, grid_around, inside};
pub use grains::{Grains, grains, random_rotations};
pub use mesh::Mesh;
pub use surface::{Face, Patch, face_layer, surface_nodes, surface_patches};
pub use thin::{Labelled, Thin, filled};

/// A solid, in the grid's axes (m).
#[derive(Clone, Debug, PartialEq)]
pub enum Solid {
    /// min ≤ x ≤ max; components may be infinite.
    Box {
        /// Corner of the smallest coordinates.
        min: Vector3<f64>,
        /// Corner of the largest coordinates.
        max: Vector3<f64>,
    },
    /// A circular cylinder.
    Cylinder {
        /// Middle of its axis.
        centre: Vector3<f64>,
        /// Unit vector along its axis.
        axis: Vector3<f64>,
        /// Radius.
        radius: f64,
        /// Half its length; may be infinite.
        half_length: f64,
    },
    /// A ball.
    Sphere {
        /// Centre.
        centre: Vector3<f64>,
        /// Radius.
        radius: f64,
    },
    /// All points on the side of a plane to which its normal does not point.
    HalfSpace {
        /// A point of the plane.
        point: Vector3<f64>,
        /// Unit normal, out of the solid.
        normal: Vector3<f64>,
    },
    /// What is in any.
    Union(Vec<Solid>),
    /// What is in all.
    Intersection(Vec<Solid>),
    /// What is in the first and in none of the others.
    Difference(Box<Solid>, Vec<Solid>),
    /// A solid turned about the origin, then shifted.
    Moved {
        /// The solid before.
        solid: Box<Solid>,
        /// Rotation R (orthogonal).
        rotation: Matrix3<f64>,
        /// Shift t: x becomes R x + t.
        shift: Vector3<f64>,
    },
    /// The inside of a closed surface of triangles.
    Mesh(Arc<Mesh>),
}

impl Solid {
    /// Signed distance to the surface (m): negative inside. Exact for single solids; for a union exact outside, for an
    /// intersection or difference exact inside, and elsewhere a lower bound of its magnitude with the right sign.
    pub fn distance(&self, x: &Vector3<f64>) -> f64 {
        match self {
            Solid::Box { min, max } => {
                let beyond = Vector3::from_fn(|a, _| (min[a] - x[a]).max(x[a] - max[a]));
                let outside = beyond.map(|d| d.max(0.0)).norm();
                if outside > 0.0 { outside } else { beyond.max() }
            }
            Solid::Cylinder { centre, axis, radius, half_length } => {
                let along = (x - centre).dot(axis);
                let across = ((x - centre) - axis * along).norm() - radius;
                let beyond = along.abs() - half_length;
                if across > 0.0 && beyond > 0.0 { across.hypot(beyond) } else { across.max(beyond) }
            }
            Solid::Sphere { centre, radius } => (x - centre).norm() - radius,
            Solid::HalfSpace { point, normal } => normal.dot(&(x - point)),
            Solid::Union(parts) => parts.iter().map(|s| s.distance(x)).fold(f64::INFINITY, f64::min),
            Solid::Intersection(parts) => parts.iter().map(|s| s.distance(x)).fold(f64::NEG_INFINITY, f64::max),
            Solid::Difference(from, minus) => minus.iter().map(|s| -s.distance(x)).fold(from.distance(x), f64::max),
            Solid::Moved { solid, rotation, shift } => solid.distance(&rotation.tr_mul(&(x - shift))),
            Solid::Mesh(mesh) => mesh.distance(x),
        }
    }

    /// Whether a point is inside, or outside by no more than a tolerance (m).
    pub fn contains(&self, x: &Vector3<f64>, tolerance: f64) -> bool {
        self.distance(x) <= tolerance
    }

    /// Unit normal of the surface next to a point, outwards: the gradient of the signed distance by central differences
    /// over 2·`step` (m). Zero in the very middle of a solid.
    pub fn normal(&self, x: &Vector3<f64>, step: f64) -> Vector3<f64> {
        let slope = |a: usize| {
            let mut h = Vector3::zeros();
            h[a] = step;
            self.distance(&(x + h)) - self.distance(&(x - h))
        };
        // Infinite distances (an empty union) have no slope.
        let gradient = Vector3::from_fn(|a, _| Some(slope(a)).filter(|s| s.is_finite()).unwrap_or(0.0));
        gradient.try_normalize(0.0).unwrap_or_else(Vector3::zeros)
    }

    /// A box around the solid: its least and largest coordinates, which may be infinite. Of an empty one, min > max.
    pub fn bounds(&self) -> [Vector3<f64>; 2] {
        let infinite = Vector3::repeat(f64::INFINITY);
        match self {
            Solid::Box { min, max } => [*min, *max],
            Solid::Cylinder { centre, axis, radius, half_length } => {
                let reach = axis.map(|w| {
                    let across = radius * (1.0 - w * w).max(0.0).sqrt();
                    if w.abs() < 1e-12 { *radius } else { half_length * w.abs() + across }
                });
                [centre - reach, centre + reach]
            }
            Solid::Sphere { centre, radius } => [centre.add_scalar(-radius), centre.add_scalar(*radius)],
            Solid::HalfSpace { point, normal } => {
                let (mut low, mut high) = (-infinite, infinite);
                for a in 0..3 {
                    if normal[a] == 1.0 {
                        high[a] = point[a];
                    } else if normal[a] == -1.0 {
                        low[a] = point[a];
                    }
                }
                [low, high]
            }
            Solid::Union(parts) => parts
                .iter()
                .map(Solid::bounds)
                .fold([infinite, -infinite], |[low, high], [l, h]| [low.inf(&l), high.sup(&h)]),
            Solid::Intersection(parts) => parts
                .iter()
                .map(Solid::bounds)
                .fold([-infinite, infinite], |[low, high], [l, h]| [low.sup(&l), high.inf(&h)]),
            Solid::Difference(from, _) => from.bounds(),
            Solid::Moved { solid, rotation, shift } => {
                let [low, high] = solid.bounds();
                let reach = |a: usize, end: fn(f64, f64) -> f64| {
                    let term = |b: usize| {
                        let r = rotation[(a, b)];
                        // Rounding of a right angle must not make 0·∞.
                        if r.abs() < 1e-12 { 0.0 } else { end(r * low[b], r * high[b]) }
                    };
                    shift[a] + term(0) + term(1) + term(2)
                };
                [Vector3::from_fn(|a, _| reach(a, f64::min)), Vector3::from_fn(|a, _| reach(a, f64::max))]
            }
            Solid::Mesh(mesh) => mesh.bounds(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned() -> Matrix3<f64> {
        *nalgebra::Rotation3::from_euler_angles(0.3, -0.7, 1.1).matrix()
    }

    fn table() -> Vec<Solid> {
        let unit = Solid::Box { min: Vector3::new(-1.0, -0.5, -0.25), max: Vector3::new(1.0, 0.5, 0.25) };
        let rod = Solid::Cylinder {
            centre: Vector3::new(0.1, 0.0, 0.0),
            axis: Vector3::new(0.6, 0.0, 0.8),
            radius: 0.4,
            half_length: 0.7,
        };
        let ball = Solid::Sphere { centre: Vector3::new(0.2, 0.1, 0.0), radius: 0.5 };
        let half = Solid::HalfSpace { point: Vector3::zeros(), normal: Vector3::new(0.0, 0.6, 0.8) };
        vec![
            unit.clone(),
            rod.clone(),
            ball.clone(),
            Solid::Union(vec![unit.clone(), ball.clone()]),
            Solid::Intersection(vec![unit.clone(), ball.clone(), half]),
            Solid::Difference(Box::new(unit.clone()), vec![ball, rod]),
            Solid::Moved { solid: Box::new(unit), rotation: turned(), shift: Vector3::new(0.1, 0.2, 0.3) },
        ]
    }

    /// A signed distance never changes faster than the way, and what is inside is in the bounds.
    #[test]
    fn distances_are_lipschitz_and_bounds_hold() {
        for solid in table() {
            let [low, high] = solid.bounds();
            let mut points = Vec::new();
            for n in 0..2000 {
                let t = f64::from(n);
                points.push(Vector3::new((t * 0.7).sin(), (t * 1.3).sin(), (t * 2.9).sin()) * 1.5);
            }
            for pair in points.windows(2) {
                let change = (solid.distance(&pair[0]) - solid.distance(&pair[1])).abs();
                assert!(change <= (pair[0] - pair[1]).norm() + 1e-12, "{solid:?}");
                if solid.distance(&pair[0]) < 0.0 {
                    assert!((0..3).all(|a| low[a] <= pair[0][a] && pair[0][a] <= high[a]), "{solid:?}");
                }
            }
        }
    }

    #[test]
    fn bounds_of_cylinders() {
        let infinite =
            Solid::Cylinder { centre: Vector3::zeros(), axis: Vector3::z(), radius: 2.0, half_length: f64::INFINITY };
        let [low, high] = infinite.bounds();
        assert_eq!((low.x, high.y, high.z), (-2.0, 2.0, f64::INFINITY));
        let quarter = *nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2).matrix();
        let turned = Solid::Moved { solid: Box::new(infinite), rotation: quarter, shift: Vector3::zeros() };
        let [low, high] = turned.bounds();
        assert!((high.z - 2.0).abs() < 1e-9 && low.y == f64::NEG_INFINITY && high.x == 2.0);
    }

    #[test]
    fn normals_point_outwards() {
        let ball = Solid::Sphere { centre: Vector3::zeros(), radius: 1.0 };
        let hole = Solid::Difference(
            Box::new(Solid::Box { min: Vector3::repeat(-3.0), max: Vector3::repeat(3.0) }),
            vec![ball.clone()],
        );
        let x = Vector3::new(0.6, 0.0, 0.8);
        assert!((ball.normal(&x, 1e-4) - x).norm() < 1e-7);
        assert!((hole.normal(&x, 1e-4) + x).norm() < 1e-7);
    }
}
