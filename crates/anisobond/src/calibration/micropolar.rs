//! Normal and tangential bonds on a grid whose nodes rotate freely.
//!
//! C = Σ s (c_n N + c_t T) with s = ½ ω |ξ| ΔV, N = n⊗n⊗n⊗n and T the tangential projection. The problem is that of
//! central bonds in all 21 dimensions: minimise ½‖c_n‖² + ½‖c_t‖² subject to the sum and c_n, c_t ≥ 0. Its solution is
//! c_n = max(0, s N:Y), c_t = max(0, s T:Y) with one tensor Y of 21 numbers, the dual vector, and where none exists,
//! non-negative least squares gives the closest tensor and the certificate.
//!
//! What the sum promises is not yet what a grid of free nodes has: tangential bonds whose stiffness is not alike in all
//! directions turn the nodes ([`with_free_rotations`]).

use std::collections::HashMap;

use nalgebra::{Matrix3, Matrix3x6, Matrix6, SVector, Vector3};
use serde::Serialize;

use super::calibrator::{Cause, primitive_direction, push_below_bound};
use super::microplane::{normal_projection, tangential_projection};
use super::rays::{Coordinates, PerRay, Rays, at, set};
use super::{dual_newton, nnls};
use crate::Result;
use crate::lattice::Neighbourhood;
use crate::tensor::{PAIRS, Stiffness, mandel_weight};

/// ‖Xc − C‖/‖C‖ up to which a target counts as reached; what is met in practice is a hundred times smaller.
const REACHED: f64 = 1e-12;

/// Newton steps after which non-negative least squares is asked whether a solution exists at all.
const USUAL_ITERATIONS: usize = 15;

/// Newton steps granted to a target that is known to have a solution.
const MOST_ITERATIONS: usize = 200;

/// Cosine within which a bond lies on the face of the cone that is orthogonal to a certificate.
const ON_FACE: f64 = 1e-9;

/// How far below zero a published certificate keeps its products with the bonds, so that it holds in any rounding.
const CERTIFICATE_MARGIN: f64 = 1e-14;

/// ‖T‖ of a unit vector: T has the Kelvin moduli ½, ½.
const TANGENTIAL_NORM: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Largest negative eigenvalue of the tangential fabric that is rounding, relative to its trace.
const FABRIC_ROUNDING: f64 = 1e-12;

/// Fixed-point steps towards a sum whose relaxed tensor is the target; a dozen are used.
const MOST_RELAXATIONS: usize = 500;

/// The 21 coordinates of a tensor's Kelvin-Mandel matrix in an orthonormal basis: the upper triangle row by row,
/// off-diagonal entries times √2, so that the dot product is that of the tensors.
pub(crate) fn tensor_coordinates(mandel: &Matrix6<f64>) -> SVector<f64, 21> {
    let mut next = 0..21;
    let mut out = SVector::zeros();
    for a in 0..6 {
        for (b, k) in (a..6).zip(&mut next) {
            out[k] = mandel[(a, b)] * if a == b { 1.0 } else { std::f64::consts::SQRT_2 };
        }
    }
    out
}

/// The Kelvin-Mandel matrix of 21 coordinates.
pub(crate) fn tensor_of_coordinates(coordinates: &SVector<f64, 21>) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    let mut k = 0;
    for a in 0..6 {
        for b in a..6 {
            out[(a, b)] = coordinates[k] / if a == b { 1.0 } else { std::f64::consts::SQRT_2 };
            out[(b, a)] = out[(a, b)];
            k += 1;
        }
    }
    out
}

/// Which of a grid's two tensors a calibration promises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Promise {
    /// The sum over bonds at uniform strain without node rotation.
    #[default]
    Sum,
    /// The tensor that an element test with free rotations measures.
    FreeRotations,
}

impl Promise {
    /// sum or free-rotations.
    pub fn name(self) -> &'static str {
        match self {
            Promise::Sum => "sum",
            Promise::FreeRotations => "free-rotations",
        }
    }
}

/// Evidence that a tensor is out of reach of normal and tangential bonds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MicropolarInfeasibility {
    /// What stands in the way.
    pub cause: Cause,
    /// Farkas certificate: a tensor Y (Kelvin-Mandel matrix, rows) with N:Y ≤ 0 and T:Y ≤ 0 for every bond while
    /// Y:C > 0.
    pub certificate: [[f64; 6]; 6],
    /// Largest N:Y or T:Y over the bonds (–), ≤ 0.
    pub largest_bond_product: f64,
    /// Y:C (Pa), > 0.
    pub target_product: f64,
    /// Distance of the aim from the reachable tensors, relative to its norm.
    pub distance: f64,
    /// True when no neighbourhood can reach it: tangential bonds would have to be negative, for an eigenvalue of the
    /// Cauchy defect is above half of its trace. False says nothing.
    pub in_every_neighbourhood: bool,
}

/// The normal and tangential bonds of a material on a neighbourhood, with the evidence of how good they are.
#[derive(Clone, Debug)]
pub struct MicropolarCalibration {
    /// The wanted tensor.
    pub target: Stiffness,
    /// Which tensor was brought onto the target.
    pub promise: Promise,
    /// What the sum over bonds was aimed at: the target, or the sum whose relaxed tensor is the target.
    pub aim: Stiffness,
    /// The sum over bonds Σ s (c_n N + c_t T) (Pa).
    pub reached: Stiffness,
    /// ‖target − reached‖/‖target‖.
    pub relative_error: f64,
    /// What an element test of the perfect grid measures, node rotations free (Pa).
    pub relaxed: Stiffness,
    /// ‖target − relaxed‖/‖target‖.
    pub relaxed_error: f64,
    /// ‖target − S‖/‖target‖: the least error of central bonds alone.
    pub cauchy_gap: f64,
    /// c_n of every bond, in the neighbourhood's order (N/m⁶).
    pub normal: Vec<f64>,
    /// c_t of every bond (N/m⁶).
    pub tangential: Vec<f64>,
    /// The dual tensor Y (Kelvin-Mandel matrix, N/m¹⁰): c_n = max(0, s N:Y), c_t = max(0, s T:Y).
    pub dual: Matrix6<f64>,
    /// `None` when c_n, c_t ≥ 0 reach the aim; otherwise why not. The bonds then give the closest reachable tensor.
    pub infeasibility: Option<MicropolarInfeasibility>,
    /// Newton steps taken (0: the pseudo-inverse was already optimal).
    pub iterations: usize,
    /// ‖Xc − aim‖/‖aim‖, with the closest reachable tensor in place of the aim when infeasible.
    pub residual: f64,
}

impl MicropolarCalibration {
    /// Whether the sum over bonds reaches the aim.
    pub fn feasible(&self) -> bool {
        self.infeasibility.is_none()
    }

    /// The error of the promised tensor: [`Self::relative_error`] or [`Self::relaxed_error`].
    pub fn promised_error(&self) -> f64 {
        match self.promise {
            Promise::Sum => self.relative_error,
            Promise::FreeRotations => self.relaxed_error,
        }
    }
}

/// A neighbourhood prepared for normal and tangential bonds, once for all materials.
pub struct MicropolarCalibrator<'a> {
    neighbourhood: &'a Neighbourhood,
    /// Every distinct ± direction of the bonds.
    directions: Vec<Vector3<f64>>,
    direction_of_bond: Vec<u32>,
    /// s of every bond in units of `share_unit`.
    share: Vec<f64>,
    /// Largest s (m⁴).
    share_unit: f64,
    /// N of every direction, then T/‖T‖ of every direction.
    rays: Rays<21>,
}

impl<'a> MicropolarCalibrator<'a> {
    /// Prepare a neighbourhood.
    pub fn new(neighbourhood: &'a Neighbourhood) -> Self {
        let mut index: HashMap<[i32; 3], u32> = HashMap::new();
        let mut directions = Vec::new();
        let direction_of_bond: Vec<u32> = neighbourhood
            .bonds()
            .iter()
            .map(|bond| {
                let primitive = primitive_direction(bond.offset);
                *index.entry(primitive).or_insert_with(|| {
                    let n = neighbourhood.orientation() * Vector3::from(primitive.map(f64::from));
                    directions.push(n.normalize());
                    directions.len() as u32 - 1
                })
            })
            .collect();
        let share: Vec<f64> = neighbourhood.bonds().iter().map(|bond| neighbourhood.stiffness_share(bond)).collect();
        let share_unit = share.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let share: Vec<f64> = share.iter().map(|s| s / share_unit).collect();
        let rays = rays_of(&directions, &direction_of_bond, &share);
        MicropolarCalibrator { neighbourhood, directions, direction_of_bond, share, share_unit, rays }
    }

    /// The neighbourhood.
    pub fn neighbourhood(&self) -> &'a Neighbourhood {
        self.neighbourhood
    }

    /// Number of distinct ± directions of the bonds.
    pub fn directions(&self) -> usize {
        self.directions.len()
    }

    /// Dimension of the tensors that bonds of either sign can reach (21 when nothing is missing).
    pub fn rank(&self) -> usize {
        self.rays.rank()
    }

    /// Calibrate: minimise ½‖c_n‖² + ½‖c_t‖² subject to Σ s (c_n N + c_t T) = C, c_n, c_t ≥ 0; if no such c exists, the
    /// same for the closest reachable tensor. With [`Promise::FreeRotations`] the sum is aimed at the tensor that relaxes
    /// to the target ([`sum_for_free_rotations`]), or at the target itself where there is none.
    ///
    /// # Errors
    /// A tensor that is not positive definite.
    pub fn calibrate(&self, target: &Stiffness, promise: Promise) -> Result<MicropolarCalibration> {
        target.require_positive_definite()?;
        let aim = match promise {
            Promise::Sum => *target,
            Promise::FreeRotations => sum_for_free_rotations(target).unwrap_or(*target),
        };
        let scale = aim.norm();
        let solution = self.solve(&(tensor_coordinates(aim.mandel()) / scale));

        // Back to units: c = c̃ ‖C‖/s₁, Y = Ỹ ‖C‖/s₁².
        let c_unit = scale / self.share_unit;
        let (normal, tangential) = self.per_bond(&solution.c, c_unit);
        let reached =
            Stiffness::from_mandel(tensor_of_coordinates(&self.rays.lift(&self.rays.tensor(&solution.c))) * scale);
        let relaxed = relax(&reached, &self.tangential_fabric(&tangential));
        Ok(MicropolarCalibration {
            target: *target,
            promise,
            aim,
            relative_error: target.relative_error(&reached),
            reached,
            relaxed_error: target.relative_error(&relaxed),
            relaxed,
            cauchy_gap: target.cauchy_gap(),
            normal,
            tangential,
            dual: tensor_of_coordinates(&solution.dual) * (c_unit / self.share_unit),
            infeasibility: solution.away.map(|(cause, away)| self.evidence(cause, &away, &aim)),
            iterations: solution.iterations,
            residual: solution.residual,
        })
    }

    /// The problem in units of ‖C‖ = 1 and largest share = 1.
    fn solve(&self, target: &Coordinates<21>) -> Solution {
        let rays = &self.rays;
        let inside = rays.project(target);
        let outside = target - rays.lift(&inside);
        let spanned = outside.norm() <= REACHED;
        let mut outcome = dual_newton::maximise(rays, &inside, 0.0, USUAL_ITERATIONS);
        let mut closest = Coordinates::zeros();
        if outcome.residual > REACHED {
            closest = nnls::closest(rays, &inside);
            if closest.norm() <= REACHED {
                outcome = dual_newton::maximise(rays, &inside, 0.0, MOST_ITERATIONS);
            }
        }
        if outcome.residual <= REACHED || (spanned && closest.norm() <= REACHED) {
            return Solution {
                dual: rays.lift(&outcome.y),
                c: outcome.c,
                away: (!spanned).then_some((Cause::Rank, outside)),
                iterations: outcome.iterations,
                residual: outcome.residual,
            };
        }
        let away = outside + rays.lift(&closest);
        let mut solution = self.solve_on_face(&(inside - closest), &away.normalize());
        solution.away = Some((if spanned { Cause::Cone } else { Cause::RankAndCone }, away));
        solution.iterations += outcome.iterations;
        solution
    }

    /// Least norm for a goal (span coordinates) on the cone's border: every ray that `away` leaves below zero is zero.
    fn solve_on_face(&self, goal: &Coordinates<21>, away: &Coordinates<21>) -> Solution {
        let rays = &self.rays;
        let leaning = rays.project(away);
        let (face, off_face): (Vec<usize>, Vec<usize>) =
            (0..rays.len()).partition(|&i| rays.quartic(i).dot(&leaning) >= -ON_FACE);
        let mut solution =
            Solution { c: rays.zeros(), dual: Coordinates::zeros(), away: None, iterations: 0, residual: 0.0 };
        if !face.is_empty() {
            let on_face = rays.subset(&face);
            let restricted = dual_newton::maximise(&on_face, &on_face.project(&rays.lift(goal)), 0.0, MOST_ITERATIONS);
            face.iter().enumerate().for_each(|(j, &i)| set(&mut solution.c, i, at(&restricted.c, j)));
            solution.iterations = restricted.iterations;
            solution.dual = push_below_bound(rays, &off_face, 0.0, &on_face.lift(&restricted.y), away);
        }
        solution.residual = (goal - rays.tensor(&solution.c)).norm();
        solution
    }

    /// c_n and c_t of every bond: bonds of one direction share c/s.
    fn per_bond(&self, c: &PerRay, unit: f64) -> (Vec<f64>, Vec<f64>) {
        let bonds = || self.direction_of_bond.iter().map(|&d| d as usize).zip(&self.share);
        let count = self.directions.len();
        (
            bonds().map(|(d, s)| unit * s * at(c, d)).collect(),
            bonds().map(|(d, s)| unit * s * at(c, count + d)).collect(),
        )
    }

    /// M = Σ s c_t n⊗n (Pa).
    fn tangential_fabric(&self, tangential: &[f64]) -> Matrix3<f64> {
        let bonds = self.direction_of_bond.iter().zip(&self.share).zip(tangential);
        bonds.fold(Matrix3::zeros(), |sum, ((&d, s), c)| {
            let n = &self.directions[d as usize];
            sum + s * self.share_unit * c * n * n.transpose()
        })
    }

    /// The certificate, with every product below zero by more than rounding: the identity has N:1 = T:1 = 1.
    fn evidence(&self, cause: Cause, away: &Coordinates<21>, aim: &Stiffness) -> MicropolarInfeasibility {
        let largest = |y: &Matrix6<f64>| {
            let products = self.directions.iter().map(|n| {
                let (normal, tangential) = (normal_projection(n), tangential_projection(n));
                y.dot(&normal).max(y.dot(&tangential))
            });
            products.fold(f64::NEG_INFINITY, f64::max)
        };
        let y = tensor_of_coordinates(&away.normalize());
        let y = y - (largest(&y).max(0.0) + CERTIFICATE_MARGIN) * Matrix6::identity();
        let defect = aim.cauchy_defect();
        let trace = defect.trace();
        MicropolarInfeasibility {
            cause,
            certificate: std::array::from_fn(|a| std::array::from_fn(|b| y[(a, b)])),
            largest_bond_product: largest(&y),
            target_product: y.dot(aim.mandel()),
            distance: away.norm(),
            in_every_neighbourhood: defect.symmetric_eigenvalues().max() > 0.5 * trace + 1e-12 * aim.norm(),
        }
    }
}

/// What [`MicropolarCalibrator::solve`] returns, in its units.
struct Solution {
    c: PerRay,
    dual: Coordinates<21>,
    /// Cause and target minus the closest reachable tensor.
    away: Option<(Cause, Coordinates<21>)>,
    iterations: usize,
    residual: f64,
}

/// Rays N and T/‖T‖ of all directions; the bonds of a direction weigh Σ s².
fn rays_of(directions: &[Vector3<f64>], direction_of_bond: &[u32], share: &[f64]) -> Rays<21> {
    let normal = directions.iter().map(|n| tensor_coordinates(&normal_projection(n)));
    let tangential = directions.iter().map(|n| tensor_coordinates(&tangential_projection(n)) / TANGENTIAL_NORM);
    let columns: Vec<Coordinates<21>> = normal.chain(tangential).collect();
    let count = directions.len();
    let mut weight = vec![0.0; 2 * count];
    for (&d, s) in direction_of_bond.iter().zip(share) {
        weight[d as usize] += s * s;
        weight[count + d as usize] += s * s;
    }
    let mut norms = vec![1.0; count];
    norms.resize(2 * count, TANGENTIAL_NORM);
    Rays::new(&columns, &norms, &weight)
}

/// M = Σ s c_t n⊗n (Pa) of a sum over bonds, read from its Cauchy defect: a tangential bond has the defect
/// ¼ s c_t (1 − n⊗n), hence 4D = tr(M) 1 − M and M = 2 tr(D) 1 − 4D.
fn fabric_of_defect(sum: &Stiffness) -> Matrix3<f64> {
    let defect = sum.cauchy_defect();
    Matrix3::identity() * (2.0 * defect.trace()) - 4.0 * defect
}

/// C_eff = C − Bᵀ D_r⁻¹ B: the rotation θ that all nodes share has the energy density ½ θ·D_r θ + θ·B E with
/// D_r = tr(M) 1 − M and B E = −Σ s c_t n×(E n) = −ε:(M E), M = Σ s c_t n⊗n.
fn relax(sum: &Stiffness, fabric: &Matrix3<f64>) -> Stiffness {
    let coupling = Matrix3x6::from_fn(|i, a| {
        let (p, q) = PAIRS[a];
        let mut strain = Matrix3::zeros();
        strain[(p, q)] = mandel_weight(a) / if p == q { 1.0 } else { 2.0 };
        strain[(q, p)] = strain[(p, q)];
        let product = fabric * strain;
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        product[(k, j)] - product[(j, k)]
    });
    let resistance = Matrix3::identity() * fabric.trace() - fabric;
    let eigen = resistance.symmetric_eigen();
    let floor = FABRIC_ROUNDING * fabric.trace();
    let mut softer = *sum.mandel();
    for (value, axis) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        // An axis about which nothing resists has nothing that turns it either.
        if *value > floor {
            let row = coupling.tr_mul(&axis);
            softer -= row * row.transpose() / *value;
        }
    }
    Stiffness::from_mandel(softer)
}

/// The tensor that a perfect grid of one kind of node has when its nodes rotate freely, from its sum over normal and
/// tangential bonds, C_eff = C − Bᵀ D_r⁻¹ B. It depends on the sum alone: normal bonds resist no rotation, and
/// what the tangential ones do shows in the Cauchy defect. `None` for a tensor that is no such sum because an eigenvalue
/// of its defect is above half of the trace (or the trace is negative).
pub fn with_free_rotations(sum: &Stiffness) -> Option<Stiffness> {
    let fabric = fabric_of_defect(sum);
    let allowed = -FABRIC_ROUNDING * sum.norm();
    (fabric.symmetric_eigenvalues().min() >= allowed).then(|| relax(sum, &fabric))
}

/// The sum over bonds whose tensor with free rotations is a given one, by the fixed point C ← C + (C* − relaxed(C));
/// `None` where there is none within reach of normal and tangential bonds.
pub fn sum_for_free_rotations(measured: &Stiffness) -> Option<Stiffness> {
    let mut sum = *measured;
    for _ in 0..MOST_RELAXATIONS {
        let missing = measured.mandel() - with_free_rotations(&sum)?.mandel();
        sum = Stiffness::from_mandel(sum.mandel() + missing);
        if missing.norm() <= 1e-15 * measured.norm() {
            return Some(sum);
        }
    }
    let missing = (measured.mandel() - with_free_rotations(&sum)?.mandel()).norm();
    (missing <= 1e-12 * measured.norm()).then_some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_orthonormal() {
        let (n, m) = (Vector3::new(0.3, -0.5, 0.2).normalize(), Vector3::new(-1.0, 0.4, 0.7).normalize());
        let (a, b) = (tangential_projection(&n), tangential_projection(&m));
        assert!((tensor_coordinates(&a).dot(&tensor_coordinates(&b)) - a.dot(&b)).abs() < 1e-15);
        assert!((tensor_of_coordinates(&tensor_coordinates(&a)) - a).norm() < 1e-15);
        assert!((a.norm() - TANGENTIAL_NORM).abs() < 1e-15);
    }

    /// The defect of one tangential bond gives back its fabric.
    #[test]
    fn fabric_is_in_the_defect() {
        let n = Vector3::new(0.3, -0.5, 0.2).normalize();
        let sum = Stiffness::from_mandel(3.0 * tangential_projection(&n) + 7.0 * normal_projection(&n));
        assert!((fabric_of_defect(&sum) - 3.0 * n * n.transpose()).norm() < 1e-14);
    }
}
