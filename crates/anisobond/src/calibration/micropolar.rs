//! Normal and tangential bonds on a grid whose nodes rotate freely.
//!
//! C = Σ s (c_n N + c_t T) with s = ½ ω |ξ| ΔV, N = n⊗n⊗n⊗n and T the tangential projection. The problem is that of
//! central bonds in all 21 dimensions: minimise ½‖c_n‖² + ½‖c_t‖² subject to the sum and c_n, c_t ≥ 0. Its solution is
//! c_n = max(0, s N:Y), c_t = max(0, s T:Y) with one tensor Y of 21 numbers, the dual vector, and where none exists,
//! non-negative least squares gives the closest tensor and the certificate.
//!
//! What the sum promises is not yet what a grid of free nodes has: tangential bonds whose stiffness is not alike in all
//! directions turn the nodes ([`with_free_rotations`](super::with_free_rotations)).

use std::collections::HashMap;

use nalgebra::{Matrix3, Matrix3x6, Matrix6, SVector, Vector3};
use serde::Serialize;

use super::calibrator::{
    Calibrator, Cause, LowerBound, Outcome, least_norm_from, primitive_direction, push_below_bound,
};
use super::free_rotations::{relax, rotation, sum_for_free_rotations, turned};
use super::microplane::{normal_projection, tangential_projection};
use super::nearest_relaxed::nearest_relaxed;
use super::rays::{Coordinates, PerRay, Rays, at, set};
use super::{dual_newton, nnls};
use crate::Result;
use crate::lattice::Neighbourhood;
use crate::tensor::{Quartic, Stiffness, quartic_weights, tensor_of};

/// ‖Xc − C‖/‖C‖ up to which a target counts as reached; what is met in practice is a hundred times smaller.
const REACHED: f64 = 1e-12;

/// Newton steps after which non-negative least squares is asked whether a solution exists at all.
const USUAL_ITERATIONS: usize = 15;

/// Cosine within which a bond lies on the face of the cone that is orthogonal to a certificate.
const ON_FACE: f64 = 1e-9;

/// How far below zero a published certificate keeps its products with the bonds, so that it holds in any rounding.
const CERTIFICATE_MARGIN: f64 = 1e-14;

/// ‖T‖ of a unit vector: T has the Kelvin moduli ½, ½.
const TANGENTIAL_NORM: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Errors of candidates that differ by this share of them are the same.
const SAME: f64 = 1e-9;

/// A tangential micromodulus of this share of the largest normal one is zero: where normal bonds are enough, rounding
/// would leave tangential ones behind that hold rotations by next to nothing.
const TANGENTIAL_ROUNDING: f64 = 1e-12;

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

/// Evidence that a tensor is out of reach of normal and tangential bonds: of any, for [`Promise::Sum`]; for
/// [`Promise::FreeRotations`] of any as long as the nodes turn as they do with the bonds found, which is a local statement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MicropolarInfeasibility {
    /// What stands in the way.
    pub cause: Cause,
    /// Farkas certificate: a tensor Y (Kelvin-Mandel matrix, rows) with N:Y ≤ 0 and T:Y ≤ 0 for every bond while
    /// Y:C > 0. With free rotations T is what the nodes' rotation leaves of it, the bond's own strain energy, and where the
    /// bonds found come within rounding of the target Y says nothing.
    pub certificate: [[f64; 6]; 6],
    /// Largest N:Y or T:Y over the bonds (–), ≤ 0.
    pub largest_bond_product: f64,
    /// Y:C (Pa), > 0.
    pub target_product: f64,
    /// Distance of the target from the reachable tensors, relative to its norm; with free rotations from those reachable
    /// while the nodes turn so.
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
    /// What the sum over bonds was aimed at: the target, or the sum whose relaxed tensor is the target or, where there is
    /// none, the nearest found.
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
    /// The dual tensor Y (Kelvin-Mandel matrix, N/m¹⁰): c_n = max(0, s N:Y), c_t = max(0, s T:Y). Where a search found the
    /// nearest relaxed tensor, T is what the nodes' rotation leaves of it, and this holds to the accuracy of the search;
    /// where central bonds are the nearest, for c_n only.
    pub dual: Matrix6<f64>,
    /// `None` when c_n, c_t ≥ 0 reach the target; otherwise why not. The bonds then give the closest reachable tensor,
    /// with free rotations the nearest that was found.
    pub infeasibility: Option<MicropolarInfeasibility>,
    /// Newton steps taken (0: the pseudo-inverse was already optimal), those of a search for the nearest included.
    pub iterations: usize,
    /// ‖Xc − aim‖/‖aim‖, with the closest reachable tensor in place of the aim when infeasible.
    pub residual: f64,
    /// Whether the solver ended where it should: the residual is rounding (at most 10⁻¹²) and no bonds of smaller norm
    /// have the same sum. Where not, the bonds are what it came to.
    pub converged: bool,
}

impl MicropolarCalibration {
    /// Whether the bonds reach the target, to 10⁻¹² of the aim, with the least norm.
    pub fn feasible(&self) -> bool {
        self.infeasibility.is_none() && self.converged
    }

    /// What came of it.
    pub fn outcome(&self) -> Outcome {
        Outcome::of(self.feasible(), self.converged)
    }

    /// The promised tensor (Pa): [`Self::reached`] or [`Self::relaxed`].
    pub fn promised(&self) -> &Stiffness {
        match self.promise {
            Promise::Sum => &self.reached,
            Promise::FreeRotations => &self.relaxed,
        }
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
    /// to the target ([`sum_for_free_rotations`]); where no bonds ≥ 0 do, at the sum whose relaxed tensor is the nearest
    /// that a descent from the central bonds and from others finds, never farther from the target than central bonds.
    ///
    /// # Errors
    /// A tensor that is not positive definite.
    pub fn calibrate(&self, target: &Stiffness, promise: Promise) -> Result<MicropolarCalibration> {
        target.require_positive_definite()?;
        let scale = target.norm();
        let unit = Stiffness::from_mandel(target.mandel() / scale);
        let (aim, solution) = match promise {
            Promise::Sum => (unit, self.solve(&tensor_coordinates(unit.mandel()))),
            Promise::FreeRotations => self.solve_relaxed(&unit)?,
        };

        // Back to units: c = c̃ ‖C‖/s₁, Y = Ỹ ‖C‖/s₁².
        let c_unit = scale / self.share_unit;
        let (normal, tangential) = self.per_bond(&solution.c, c_unit);
        let reached = Stiffness::from_mandel(self.sum(&solution.c).mandel() * scale);
        let fabric = self.tangential_fabric(&tangential);
        let relaxed = relax(&reached, &fabric);
        let turn = match promise {
            Promise::Sum => Matrix3x6::zeros(),
            Promise::FreeRotations => rotation(&fabric),
        };
        Ok(MicropolarCalibration {
            target: *target,
            promise,
            aim: Stiffness::from_mandel(aim.mandel() * scale),
            relative_error: target.relative_error(&reached),
            reached,
            relaxed_error: target.relative_error(&relaxed),
            relaxed,
            cauchy_gap: target.cauchy_gap(),
            normal,
            tangential,
            dual: tensor_of_coordinates(&solution.dual) * (c_unit / self.share_unit),
            infeasibility: solution.away.map(|(cause, away)| self.evidence(cause, &away, target, &turn)),
            iterations: solution.iterations,
            residual: solution.residual,
            converged: solution.converged && solution.residual <= REACHED,
        })
    }

    /// The aim and its solution whose relaxed tensor is a unit target, or nearest to it.
    fn solve_relaxed(&self, target: &Stiffness) -> Result<(Stiffness, Solution)> {
        if let Some(aim) = sum_for_free_rotations(target) {
            let solution = self.solve(&tensor_coordinates(aim.mandel()));
            if solution.away.is_none() {
                return Ok((aim, solution));
            }
        }
        let central = self.solve_central(target)?;
        let search = self.search(target, &central.c);
        let found = [self.solve(&tensor_coordinates(target.mandel())), central, search];
        let errors = found.each_ref().map(|solution| (target.mandel() - self.relaxed(&solution.c).mandel()).norm());
        let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
        let steps = found.iter().map(|solution| solution.iterations).sum();
        // The simpler of equals.
        let [sum, central, search] = found;
        let mut solution = match errors.map(|error| error <= least * (1.0 + SAME)) {
            [true, ..] => sum,
            [_, true, _] => central,
            _ => search,
        };
        solution.iterations = steps;
        Ok((self.sum(&solution.c), solution))
    }

    /// The central bonds of a unit target; the tensor Y belongs to its quartic form.
    fn solve_central(&self, target: &Stiffness) -> Result<Solution> {
        let r = Calibrator::new(self.neighbourhood).calibrate(target, LowerBound::Value(0.0))?;
        let mut c = self.rays.zeros();
        for ((&d, s), bond) in self.direction_of_bond.iter().zip(&self.share).zip(&r.micromodulus) {
            set(&mut c, d as usize, bond * self.share_unit / s);
        }
        let form = Quartic::from(r.dual).component_div(&quartic_weights());
        let dual = tensor_coordinates(tensor_of(&form).mandel()) * self.share_unit.powi(2);
        let away = tensor_coordinates(&(target.mandel() - self.sum(&c).mandel()));
        Ok(Solution {
            c,
            dual,
            away: Some((self.cause(target), away)),
            iterations: r.iterations,
            residual: 0.0,
            converged: r.converged,
        })
    }

    /// What a search from the central bonds and from the sum closest to a unit target finds.
    fn search(&self, target: &Stiffness, central: &PerRay) -> Solution {
        let count = self.directions.len();
        let weight: Vec<f64> = (0..count).map(|i| at(self.rays.weight(), i)).collect();
        let central: Vec<f64> = (0..2 * count).map(|i| at(central, i)).collect();
        let found = nearest_relaxed(&self.directions, &weight, target, &central);
        let mut c = self.rays.zeros();
        found.c.iter().enumerate().for_each(|(i, &value)| set(&mut c, i, value));
        let c = self.without_rounding(c);
        // Where the target is within reach for nodes that turn so, what is missing is all there is to say.
        let missing = tensor_coordinates(&(target.mandel() - self.relaxed(&c).mandel()));
        let away = if found.away.norm() > SAME { found.away } else { missing };
        Solution {
            c,
            dual: found.dual,
            away: Some((self.cause(target), away)),
            iterations: found.steps,
            residual: 0.0,
            converged: true,
        }
    }

    /// Why a unit target that no sum reaches is out of reach.
    fn cause(&self, target: &Stiffness) -> Cause {
        let goal = tensor_coordinates(target.mandel());
        let outside = goal - self.rays.lift(&self.rays.project(&goal));
        if outside.norm() <= REACHED { Cause::Cone } else { Cause::RankAndCone }
    }

    /// Σ s (c_n N + c_t T), in the units of [`Self::solve`].
    fn sum(&self, c: &PerRay) -> Stiffness {
        Stiffness::from_mandel(tensor_of_coordinates(&self.rays.lift(&self.rays.tensor(c))))
    }

    /// The same with free node rotations.
    fn relaxed(&self, c: &PerRay) -> Stiffness {
        let (_, tangential) = self.per_bond(c, 1.0 / self.share_unit);
        relax(&self.sum(c), &self.tangential_fabric(&tangential))
    }

    /// The problem in units of ‖C‖ = 1 and largest share = 1.
    fn solve(&self, target: &Coordinates<21>) -> Solution {
        let rays = &self.rays;
        let inside = rays.project(target);
        let outside = target - rays.lift(&inside);
        let spanned = outside.norm() <= REACHED;
        let mut outcome = dual_newton::maximise(rays, &inside, 0.0, USUAL_ITERATIONS);
        let mut closest = Coordinates::zeros();
        let mut converged = true;
        if outcome.residual > REACHED {
            let judged = nnls::closest(rays, &inside);
            closest = judged.residual;
            if closest.norm() <= REACHED {
                (outcome, converged) = least_norm_from(rays, &inside, 0.0, &judged.passive);
            }
        }
        if outcome.residual <= REACHED || (spanned && closest.norm() <= REACHED) {
            return Solution {
                dual: rays.lift(&outcome.y),
                c: self.without_rounding(outcome.c),
                away: (!spanned).then_some((Cause::Rank, outside)),
                iterations: outcome.iterations,
                residual: outcome.residual,
                converged,
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
        let mut solution = Solution {
            c: rays.zeros(),
            dual: Coordinates::zeros(),
            away: None,
            iterations: 0,
            residual: 0.0,
            converged: true,
        };
        if !face.is_empty() {
            let on_face = rays.subset(&face);
            let rest = on_face.project(&rays.lift(goal));
            let mut restricted = dual_newton::maximise(&on_face, &rest, 0.0, USUAL_ITERATIONS);
            if restricted.residual > REACHED {
                let start = nnls::closest(&on_face, &rest).passive;
                (restricted, solution.converged) = least_norm_from(&on_face, &rest, 0.0, &start);
            }
            face.iter().enumerate().for_each(|(j, &i)| set(&mut solution.c, i, at(&restricted.c, j)));
            solution.iterations = restricted.iterations;
            solution.dual = push_below_bound(rays, &off_face, 0.0, &on_face.lift(&restricted.y), away);
        }
        solution.c = self.without_rounding(solution.c);
        solution.residual = (goal - rays.tensor(&solution.c)).norm();
        solution
    }

    /// c with tangential values that are rounding put to zero.
    fn without_rounding(&self, mut c: PerRay) -> PerRay {
        let count = self.directions.len();
        let rounding = TANGENTIAL_ROUNDING * (0..count).map(|i| at(&c, i)).fold(0.0, f64::max);
        (count..2 * count)
            .filter(|&i| at(&c, i) <= rounding)
            .collect::<Vec<_>>()
            .iter()
            .for_each(|&i| set(&mut c, i, 0.0));
        c
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

    /// The certificate, with every product below zero by more than rounding: the identity has N:1 = T:1 = 1, and less
    /// with a T whose nodes turn.
    fn evidence(
        &self,
        cause: Cause,
        away: &Coordinates<21>,
        target: &Stiffness,
        turn: &Matrix3x6<f64>,
    ) -> MicropolarInfeasibility {
        let tangential = |n: &Vector3<f64>| {
            let bond = Stiffness::from_mandel(tangential_projection(n));
            *turned(&bond, &(n * n.transpose()), turn).mandel()
        };
        let bonds: Vec<Matrix6<f64>> =
            self.directions.iter().flat_map(|n| [normal_projection(n), tangential(n)]).collect();
        let y = tensor_of_coordinates(&away.normalize());
        let above = bonds.iter().map(|bond| y.dot(bond) / bond.trace().max(1e-3)).fold(0.0, f64::max);
        let y = y - (above + CERTIFICATE_MARGIN) * Matrix6::identity();
        let defect = target.cauchy_defect();
        let trace = defect.trace();
        MicropolarInfeasibility {
            cause,
            certificate: std::array::from_fn(|a| std::array::from_fn(|b| y[(a, b)])),
            largest_bond_product: bonds.iter().map(|bond| y.dot(bond)).fold(f64::NEG_INFINITY, f64::max),
            target_product: y.dot(target.mandel()),
            distance: away.norm(),
            in_every_neighbourhood: turn.norm() == 0.0
                && defect.symmetric_eigenvalues().max() > 0.5 * trace + 1e-12 * target.norm(),
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
    /// Whether the norm is the least.
    converged: bool,
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
}
