//! Tractions and pressures as forces on nodes, with the resultant and the moment that they have on the true surface.

use nalgebra::{Matrix3, Vector3};

use anisobond::experiment::{Condition, History};
use anisobond::lattice::solid::Surface;

/// Eigenvalues of the second moment of areas below this part of the largest are none: there is no arm about that axis.
const NO_ARM: f64 = 1e-6;

/// Resultants and moments below this part of their size are rounding.
const ROUNDING: f64 = 1e-12;

/// What acts on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Traction {
    /// Force per area (Pa).
    Vector(Vector3<f64>),
    /// Pressure (Pa), positive into the body.
    Pressure(f64),
}

/// The condition of a traction on a surface whose patches are carried by nodes at places (m), the body periodic along some axes.
///
/// A node gets t A of each of its patches. As it is not where the patch is, moments are off by the way between them. So
/// every patch gets A (τ + ω × (x − x̄)) more, τ and ω such that the sum of forces and their moment are ∫ t dA and ∫ x × t dA;
/// about axes that a periodic body cannot turn about there is no moment to balance.
pub(super) fn condition(
    surface: &Surface,
    place: impl Fn(u32) -> Vector3<f64>,
    periodic: [bool; 3],
    traction: Traction,
    history: History,
) -> Condition {
    let patches = &surface.patches;
    let (resultant, moment) = match traction {
        Traction::Vector(t) => (t * surface.area(), surface.moment.cross(&t)),
        Traction::Pressure(p) => (surface.normal * -p, surface.turning * -p),
    };
    let mut force: Vec<Vector3<f64>> = match traction {
        Traction::Vector(t) => patches.iter().map(|patch| t * patch.area).collect(),
        Traction::Pressure(p) => patches.iter().map(|patch| patch.normal * (-p * patch.area)).collect(),
    };
    let places: Vec<Vector3<f64>> = patches.iter().map(|patch| place(patch.node)).collect();
    let area = surface.area();
    let middle = patches.iter().zip(&places).map(|(p, x)| x * p.area).sum::<Vector3<f64>>() / area;
    let missing = resultant - force.iter().sum::<Vector3<f64>>();
    let turns = [0, 1, 2].map(|a: usize| !periodic[(a + 1) % 3] && !periodic[(a + 2) % 3]);
    let own: Vector3<f64> = places.iter().zip(&force).map(|(x, f)| (x - middle).cross(f)).sum();
    let mut twist = moment - middle.cross(&resultant) - own;
    let mut second = Matrix3::zeros();
    for (patch, x) in patches.iter().zip(&places) {
        let r = x - middle;
        second += (Matrix3::identity() * r.norm_squared() - r * r.transpose()) * patch.area;
    }
    for a in (0..3).filter(|&a| !turns[a]) {
        twist[a] = 0.0;
        second.fill_row(a, 0.0);
        second.fill_column(a, 0.0);
    }
    // What is rounding stays as it is.
    let total: f64 = force.iter().map(Vector3::norm).sum();
    let arm = (second.trace() / area).sqrt();
    let told = |v: Vector3<f64>, scale: f64| if v.norm() > ROUNDING * scale { v } else { Vector3::zeros() };
    let (missing, twist) = (told(missing, total), told(twist, total * (arm + middle.norm())));
    let (shift, spin) = (missing / area, solved(&second, &twist));
    for ((f, x), patch) in force.iter_mut().zip(&places).zip(patches) {
        *f += (shift + spin.cross(&(x - middle))) * patch.area;
    }
    Condition::Force { nodes: patches.iter().map(|p| p.node).collect(), force, history }
}

/// J⁻¹ m, without what J has no arm for.
fn solved(second: &Matrix3<f64>, twist: &Vector3<f64>) -> Vector3<f64> {
    let eigen = second.symmetric_eigen();
    let largest = eigen.eigenvalues.amax();
    let mut answer = Vector3::zeros();
    for (value, axis) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > NO_ARM * largest {
            answer += axis * (axis.dot(twist) / value);
        }
    }
    answer
}
