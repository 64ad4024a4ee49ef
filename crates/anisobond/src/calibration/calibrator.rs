//! A neighbourhood prepared once, and the calibration of any number of tensors on it.

use std::collections::HashMap;
use std::sync::OnceLock;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::dual_newton::{self, DualOutcome};
use super::least_norm::least_norm;
use super::nnls;
use super::proximal_newton;
use super::rays::{Coordinates, PerRay, Rays, at, set};
use crate::lattice::Neighbourhood;
use crate::tensor::{
    MONOMIALS, Metric, Quartic, Stiffness, cauchy_coordinates, quartic_of, quartic_weights, tensor_of,
};
use crate::{Error, Result};

/// ‖Xc − S‖/‖S‖ up to which a target counts as reached; what is met in practice is a hundred times smaller.
const REACHED: f64 = 1e-12;

/// How far below zero a published certificate keeps its products with the bonds, so that it holds in any rounding.
const CERTIFICATE_MARGIN: f64 = 1e-14;

/// Newton steps after which non-negative least squares is asked whether a solution exists at all; a feasible target
/// rarely needs more.
const USUAL_ITERATIONS: usize = 12;

/// Newton steps granted to a target that is known to have a solution, before the bonds themselves are solved for.
const MOST_ITERATIONS: usize = 60;

/// Cuts of the linear program for the largest bound; about ten are used.
const MOST_CUTS: usize = 200;

/// Cosine within which a bond lies on the face of the cone that is orthogonal to a certificate.
const ON_FACE: f64 = 1e-9;

/// A bound on the micromoduli from below (P section 4.1.2: c ≥ l).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LowerBound {
    /// c ≥ l for every bond (N/m⁶); 0 is P's method.
    Value(f64),
    /// The largest l for which a solution exists.
    Largest,
}

/// Why no micromoduli c ≥ l reach the Cauchy part of the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// The neighbourhood's bonds span too few tensors: even bonds of either sign cannot express the target.
    Rank,
    /// The bonds span the target, but only with some micromoduli below the bound.
    Cone,
    /// Both.
    RankAndCone,
}

/// What came of a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// The bonds reach what was aimed at, with the least norm.
    Feasible,
    /// No bonds do; these are the nearest.
    Infeasible,
    /// The solver ended early: the bonds are what it came to.
    NotConverged,
}

impl Outcome {
    pub(super) fn of(feasible: bool, converged: bool) -> Self {
        match (converged, feasible) {
            (false, _) => Outcome::NotConverged,
            (true, true) => Outcome::Feasible,
            (true, false) => Outcome::Infeasible,
        }
    }

    /// feasible, infeasible or not converged.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Feasible => "feasible",
            Outcome::Infeasible => "infeasible",
            Outcome::NotConverged => "not converged",
        }
    }
}

/// Evidence that a target is out of reach.
#[derive(Clone, Debug)]
pub struct Infeasibility {
    /// What stands in the way.
    pub cause: Cause,
    /// Farkas certificate: the quartic form y(n) = Σ yₖ n₁ᵃ n₂ᵇ n₃ᶜ (15 coefficients in the order of
    /// [`crate::tensor::MONOMIALS`]) with y(nᵢ) ≤ 0 for every bond, hence y·Xᵢ = sᵢ y(nᵢ) ≤ 0, while y·(S − X l) > 0.
    pub certificate: [f64; 15],
    /// Largest y(nᵢ) over the bonds (–), ≤ 0.
    pub largest_bond_product: f64,
    /// y·(S − X l) (Pa), > 0.
    pub target_product: f64,
    /// Distance of the aim from the reachable tensors, relative to its norm; both in the metric of the calibration.
    pub distance: f64,
    /// True when no neighbourhood can reach the target with c ≥ 0: its Cauchy part has a negative Kelvin modulus
    /// (Hilbert 1888). Otherwise a larger horizon can.
    pub in_every_neighbourhood: bool,
}

/// The bonds of a material on a neighbourhood, with the evidence of how good they are.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The wanted tensor.
    pub target: Stiffness,
    /// The tensor of the calibrated bonds, Σ c s n⊗n⊗n⊗n (P eq 29).
    pub reached: Stiffness,
    /// ‖target − reached‖/‖target‖.
    pub relative_error: f64,
    /// ‖target − S‖/‖target‖ with S the Cauchy part: the least error of central bonds on any neighbourhood.
    pub cauchy_gap: f64,
    /// In which sense the bonds come close to a target out of reach.
    pub metric: Metric,
    /// Micromodulus c of every bond, in the neighbourhood's order (N/m⁶).
    pub micromodulus: Vec<f64>,
    /// The lower bound l that was in force (N/m⁶).
    pub lower_bound: f64,
    /// Coefficients of the quartic form p in the order of [`crate::tensor::MONOMIALS`] (N/m¹⁰):
    /// cᵢ = max(l, sᵢ p(nᵢ)) with sᵢ = ½ ωᵢ |ξᵢ| ΔV.
    pub dual: [f64; 15],
    /// `None` when c ≥ l reaches the aim; otherwise why not, with a certificate. The bonds then give the
    /// closest reachable tensor.
    pub infeasibility: Option<Infeasibility>,
    /// Newton steps taken (0: the pseudo-inverse was already optimal).
    pub iterations: usize,
    /// ‖Xc − S‖/‖S‖, with the closest reachable tensor in place of S when infeasible.
    pub residual: f64,
    /// Whether the solver ended where it should: the residual is rounding (at most 10⁻¹²) and no bonds of smaller norm
    /// have the same tensor. Where not, the bonds are what it came to.
    pub converged: bool,
}

impl Calibration {
    /// What the bonds are to reach: the Cauchy part S, or S* that is closest in the sense of energy.
    pub fn aim(&self) -> Stiffness {
        // The target was checked; there is such a tensor.
        self.target.cauchy_part_in(self.metric).unwrap_or_else(|| self.target.cauchy_part())
    }

    /// Whether the bonds reach their aim, to 10⁻¹², with the least norm.
    pub fn feasible(&self) -> bool {
        self.infeasibility.is_none() && self.converged
    }

    /// What came of it.
    pub fn outcome(&self) -> Outcome {
        Outcome::of(self.feasible(), self.converged)
    }

    /// Whether the bonds reach the target itself, to a relative error.
    pub fn exact(&self, tolerance: f64) -> bool {
        self.relative_error <= tolerance
    }
}

/// A neighbourhood prepared for calibration: its bonds collapsed onto rays, once for all materials.
pub struct Calibrator<'a> {
    pub(super) neighbourhood: &'a Neighbourhood,
    /// n⊗n⊗n⊗n of every distinct ± direction of the bonds.
    pub(super) quartics: Vec<Quartic>,
    /// Ray of every bond among the directions.
    pub(super) direction_of_bond: Vec<u32>,
    /// s of every bond in units of `share_unit`.
    pub(super) share: Vec<f64>,
    /// Largest s (m⁴).
    pub(super) share_unit: f64,
    /// One ray per distinct direction (bound 0: bonds of one direction share one coefficient).
    by_direction: Rays<15>,
    /// One ray per distinct direction and share (bound above 0), with the ray of every bond; made when first needed.
    by_share: OnceLock<(Rays<15>, Vec<u32>)>,
    /// The form that is 1 on every direction.
    pub(super) one: Quartic,
}

impl<'a> Calibrator<'a> {
    /// Prepare a neighbourhood.
    pub fn new(neighbourhood: &'a Neighbourhood) -> Self {
        let bonds = neighbourhood.bonds();
        let mut index: HashMap<[i32; 3], u32> = HashMap::new();
        let mut quartics = Vec::new();
        let direction_of_bond: Vec<u32> = bonds
            .iter()
            .map(|bond| {
                let primitive = primitive_direction(bond.offset);
                *index.entry(primitive).or_insert_with(|| {
                    let n = neighbourhood.orientation() * Vector3::from(primitive.map(f64::from));
                    quartics.push(quartic_of(&n.normalize()));
                    quartics.len() as u32 - 1
                })
            })
            .collect();
        let share: Vec<f64> = bonds.iter().map(|bond| neighbourhood.stiffness_share(bond)).collect();
        let share_unit = share.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let share: Vec<f64> = share.iter().map(|s| s / share_unit).collect();
        Calibrator::seen(neighbourhood, quartics, direction_of_bond, (share, share_unit), one_everywhere())
    }

    /// Bonds whose directions have given coordinates; `one` is the form that is 1 on every direction.
    pub(super) fn seen(
        neighbourhood: &'a Neighbourhood,
        quartics: Vec<Quartic>,
        direction_of_bond: Vec<u32>,
        (share, share_unit): (Vec<f64>, f64),
        one: Quartic,
    ) -> Self {
        let mut weight = vec![0.0; quartics.len()];
        for (&ray, s) in direction_of_bond.iter().zip(&share) {
            weight[ray as usize] += s * s;
        }
        let by_direction = Rays::new(&quartics, &vec![1.0; weight.len()], &weight);
        let by_share = OnceLock::new();
        Calibrator { neighbourhood, quartics, direction_of_bond, share, share_unit, by_direction, by_share, one }
    }

    /// The neighbourhood.
    pub fn neighbourhood(&self) -> &'a Neighbourhood {
        self.neighbourhood
    }

    /// Number of distinct ± directions of the bonds.
    pub fn directions(&self) -> usize {
        self.quartics.len()
    }

    /// Dimension of the tensors that bonds of either sign can reach (15 when nothing is missing).
    pub fn rank(&self) -> usize {
        self.by_direction.rank()
    }

    /// Calibrate: minimise ½‖c‖² subject to Xc = S, c ≥ l, S the Cauchy part of the target; if no such c exists, the
    /// same for the closest reachable tensor (P eqs 36-43).
    ///
    /// # Errors
    /// A tensor that is not positive definite, or a lower bound that is negative or not finite.
    pub fn calibrate(&self, target: &Stiffness, bound: LowerBound) -> Result<Calibration> {
        self.calibrate_in(target, bound, Metric::Norm)
    }

    /// As [`Calibrator::calibrate`], close to the target in a sense. In that of energy the aim is S* of
    /// [`Stiffness::cauchy_part_in_energy`] in place of S, and where no c ≥ l reaches it, the reachable tensor X c of least
    /// ‖C^(−½)(X c − C)C^(−½)‖; then the least norm as before. A target that satisfies Cauchy's relations has the same bonds in
    /// both.
    ///
    /// # Errors
    /// As [`Calibrator::calibrate`].
    pub fn calibrate_in(&self, target: &Stiffness, bound: LowerBound, metric: Metric) -> Result<Calibration> {
        target.require_positive_definite()?;
        let aim = target.cauchy_part_in(metric).ok_or_else(|| {
            Error::input("the stiffness has no Cholesky factor in floating point", "check its components and units")
        })?;
        let cauchy = cauchy_coordinates(&aim);
        let scale = cauchy.norm();
        let solution = match bound {
            LowerBound::Value(l) if l.is_finite() && l >= 0.0 => {
                self.solve(&(cauchy / scale), l * self.share_unit / scale)
            }
            LowerBound::Value(l) => {
                return Err(Error::input(
                    format!("the lower bound is {l} N/m⁶"),
                    "give a number ≥ 0, or `max` for the largest feasible one",
                ));
            }
            LowerBound::Largest => self.solve_at_largest_bound(&(cauchy / scale)),
        };
        let solution = match (metric, &solution.certificate) {
            (Metric::Energy, Some(_)) => self.solve_in_energy(target, &(cauchy / scale), solution.bound)?,
            _ => solution,
        };
        let bound = solution.bound;

        // Back to units: c = c̃ ‖S‖/s₁, p = p̃ ‖S‖/s₁².
        let c_unit = scale / self.share_unit;
        let weights = quartic_weights();
        let dual = solution.dual.component_mul(&weights) * (c_unit / self.share_unit);
        let reached = tensor_of(&(self.tensor(&solution.c) * scale));
        let infeasibility = solution.certificate.map(|(cause, y)| {
            let y_max = self.quartics.iter().map(|v| v.dot(&y)).fold(f64::NEG_INFINITY, f64::max);
            let shifted = cauchy - self.tensor(&vec![bound; self.share.len()]) * scale;
            Infeasibility {
                cause,
                certificate: y.component_mul(&weights).into(),
                largest_bond_product: y_max,
                target_product: y.dot(&shifted),
                distance: solution.distance,
                in_every_neighbourhood: bound == 0.0 && tensor_of(&cauchy).eigen().0[0] < -1e-12 * scale,
            }
        });
        Ok(Calibration {
            metric,
            target: *target,
            relative_error: target.relative_error(&reached),
            reached,
            cauchy_gap: target.cauchy_gap(),
            micromodulus: solution.c.iter().map(|c| c * c_unit).collect(),
            lower_bound: bound * c_unit,
            dual: dual.into(),
            infeasibility,
            iterations: solution.iterations,
            residual: solution.residual,
            converged: solution.converged && solution.residual <= REACHED,
        })
    }

    /// The problem in units of ‖S‖ = 1 and largest share = 1.
    pub(super) fn solve(&self, cauchy: &Quartic, bound: f64) -> Solution {
        let (rays, ray_of_bond) = self.rays(bound);
        let inside = rays.project(cauchy);
        let outside = cauchy - rays.lift(&inside);
        let spanned = outside.norm() <= REACHED;
        let mut outcome = dual_newton::maximise(rays, &inside, bound, USUAL_ITERATIONS);
        let mut closest = Quartic::zeros();
        let mut converged = true;
        if outcome.residual > REACHED {
            let judged = nnls::closest(rays, &(inside - rays.tensor(&rays.filled(bound))));
            closest = judged.residual;
            if closest.norm() <= REACHED {
                (outcome, converged) = least_norm_from(rays, &inside, bound, &judged.passive);
            }
        }
        // A target that is in the cone has a solution; should none have been found all the same, the residual says so.
        if outcome.residual <= REACHED || (spanned && closest.norm() <= REACHED) {
            return Solution {
                bound,
                c: self.per_bond(&outcome.c, ray_of_bond, bound),
                dual: rays.lift(&outcome.y),
                certificate: (!spanned).then(|| (Cause::Rank, self.tidy(&outside))),
                distance: if spanned { 0.0 } else { outside.norm() },
                iterations: outcome.iterations,
                residual: outcome.residual,
                converged,
            };
        }

        // Out of reach: the closest point of the cone behind the bound, then the least norm on the face it lies on.
        let away = outside + rays.lift(&closest);
        let mut solution = self.solve_on_face(rays, ray_of_bond, &(inside - closest), bound, &away.normalize());
        solution.certificate = Some((if spanned { Cause::Cone } else { Cause::RankAndCone }, self.tidy(&away)));
        solution.distance = away.norm();
        solution.iterations += outcome.iterations;
        solution
    }

    /// Least norm for a goal (span coordinates) on the cone's border: every bond that `away`, a unit vector with
    /// v·away ≤ 0 for all rays, leaves below zero stays at the bound; the others are solved for.
    fn solve_on_face(
        &self,
        rays: &Rays<15>,
        ray_of_bond: &[u32],
        goal: &Quartic,
        bound: f64,
        away: &Quartic,
    ) -> Solution {
        let leaning = rays.project(away);
        let (face, off_face): (Vec<usize>, Vec<usize>) =
            (0..rays.len()).partition(|&i| rays.quartic(i).dot(&leaning) >= -ON_FACE);
        let mut c = rays.filled(bound);
        let mut dual = Quartic::zeros();
        let (mut iterations, mut converged) = (0, true);
        if !face.is_empty() {
            let mut fixed = rays.zeros();
            off_face.iter().for_each(|&i| set(&mut fixed, i, bound));
            let on_face = rays.subset(&face);
            let rest = on_face.project(&rays.lift(&(goal - rays.tensor(&fixed))));
            let mut restricted = dual_newton::maximise(&on_face, &rest, bound, USUAL_ITERATIONS);
            if restricted.residual > REACHED {
                let start = nnls::closest(&on_face, &(rest - on_face.tensor(&on_face.filled(bound)))).passive;
                (restricted, converged) = least_norm_from(&on_face, &rest, bound, &start);
            }
            face.iter().enumerate().for_each(|(j, &i)| set(&mut c, i, at(&restricted.c, j)));
            iterations = restricted.iterations;
            dual = push_below_bound(rays, &off_face, bound, &on_face.lift(&restricted.y), away);
        }
        Solution {
            bound,
            residual: (goal - rays.tensor(&c)).norm(),
            c: self.per_bond(&c, ray_of_bond, bound),
            dual,
            certificate: None,
            distance: 0.0,
            iterations,
            converged,
        }
    }

    /// The problem at the largest t such that Xc = S, c ≥ t has a solution.
    ///
    /// The linear program max t s.t. X d + t X1 = S, d ≥ 0 by its own cuts: where t is too large, the residual r of the
    /// closest point to S − t X1 proves t ≤ r·S / r·X1; take that t and repeat. Each t is an upper bound and the cone
    /// has finitely many faces, so a few rounds end at the optimum. There the last r still supports the cone, so only
    /// bonds orthogonal to it can lie above the bound.
    fn solve_at_largest_bound(&self, cauchy: &Quartic) -> Solution {
        let (rays, ray_of_bond) = self.rays(1.0);
        let target = rays.project(cauchy);
        let ones = rays.tensor(&rays.filled(1.0));
        let mut support = -rays.project(&self.one);
        let mut bound = support.dot(&target) / support.dot(&ones);
        for _ in 0..MOST_CUTS {
            let r = nnls::closest(rays, &(target - bound * ones)).residual;
            let slope = r.dot(&ones);
            if slope >= 0.0 {
                break;
            }
            let next = r.dot(&target) / slope;
            if next.partial_cmp(&bound) != Some(std::cmp::Ordering::Less) {
                break;
            }
            (bound, support) = (next, r);
        }
        if bound <= 0.0 || (cauchy - rays.lift(&target)).norm() > REACHED {
            // Not even c ≥ 0 reaches S: the plain problem says why.
            return self.solve(cauchy, 0.0);
        }
        self.solve_on_face(rays, ray_of_bond, &target, bound, &rays.lift(&support).normalize())
    }

    /// The rays to solve on, and the ray of every bond.
    fn rays(&self, bound: f64) -> (&Rays<15>, &[u32]) {
        if bound == 0.0 {
            return (&self.by_direction, &self.direction_of_bond);
        }
        let (rays, ray_of_bond) = self.by_share.get_or_init(|| {
            let mut index: HashMap<(u32, u64), u32> = HashMap::new();
            let (mut quartics, mut share, mut count) = (Vec::new(), Vec::new(), Vec::new());
            let ray_of_bond = self
                .direction_of_bond
                .iter()
                .zip(&self.share)
                .map(|(&direction, &s)| {
                    let ray = *index.entry((direction, s.to_bits())).or_insert_with(|| {
                        quartics.push(self.quartics[direction as usize]);
                        share.push(s);
                        count.push(0.0);
                        count.len() as u32 - 1
                    });
                    count[ray as usize] += 1.0;
                    ray
                })
                .collect();
            (Rays::new(&quartics, &share, &count), ray_of_bond)
        });
        (rays, ray_of_bond)
    }

    /// c of every bond from c of every ray: bonds of a ray share c/s.
    fn per_bond(&self, c: &PerRay, ray_of_bond: &[u32], bound: f64) -> Vec<f64> {
        let bonds = ray_of_bond.iter().zip(&self.share);
        bonds.map(|(&ray, s)| if bound == 0.0 { s * at(c, ray as usize) } else { at(c, ray as usize) }).collect()
    }

    /// Σ s c n⊗n⊗n⊗n, bond by bond.
    fn tensor(&self, c: &[f64]) -> Quartic {
        let mut per_direction = vec![0.0; self.quartics.len()];
        for ((&direction, s), c) in self.direction_of_bond.iter().zip(&self.share).zip(c) {
            per_direction[direction as usize] += s * c;
        }
        self.quartics.iter().zip(per_direction).fold(Quartic::zeros(), |sum, (v, a)| sum + a * v)
    }

    /// A certificate whose every product with a bond is below zero by more than rounding.
    fn tidy(&self, y: &Quartic) -> Quartic {
        let y = y.normalize();
        let largest = self.quartics.iter().map(|v| v.dot(&y)).fold(0.0, f64::max);
        y - (largest + CERTIFICATE_MARGIN) * self.one
    }
}

/// What [`Calibrator::solve`] returns, in its units.
pub(super) struct Solution {
    /// The lower bound in force.
    pub bound: f64,
    pub c: Vec<f64>,
    pub dual: Quartic,
    pub certificate: Option<(Cause, Quartic)>,
    pub distance: f64,
    pub iterations: usize,
    pub residual: f64,
    /// Whether the norm is the least.
    pub converged: bool,
}

/// The least norm for a target that is known to have a solution, given by its coefficients on some rays: by Newton's
/// method on the dual, where that has no end, by proximal points of the dual, and where rounding keeps these from the tensor,
/// by descent on the bonds. Whether it is the least.
pub(super) fn least_norm_from<const D: usize>(
    rays: &Rays<D>,
    target: &Coordinates<D>,
    bound: f64,
    start: &[(usize, f64)],
) -> (DualOutcome<D>, bool) {
    let newton = dual_newton::maximise(rays, target, bound, MOST_ITERATIONS);
    if newton.residual <= REACHED {
        return (newton, true);
    }
    let mut proximal = proximal_newton::maximise(rays, target, bound);
    proximal.iterations += newton.iterations;
    if proximal.residual <= REACHED {
        return (proximal, true);
    }
    let found = least_norm(rays, target, bound, start);
    let iterations = proximal.iterations + found.iterations;
    (DualOutcome { y: found.y, c: found.c, iterations, residual: found.residual }, found.least)
}

/// The quartic form |n|⁴ = 1.
fn one_everywhere() -> Quartic {
    let squares = Quartic::from_fn(|k, _| match MONOMIALS[k].iter().max() {
        Some(4) => 1.0,
        Some(2) if k < 6 => 2.0,
        _ => 0.0,
    });
    squares.component_div(&quartic_weights())
}

/// Add as much of a certificate (zero on the face, negative off it) to a dual vector as keeps every bond off the face
/// at the bound, so that c = max(l, s p) holds for all bonds.
pub(super) fn push_below_bound<const D: usize>(
    rays: &Rays<D>,
    off_face: &[usize],
    bound: f64,
    dual: &Coordinates<D>,
    away: &Coordinates<D>,
) -> Coordinates<D> {
    let (p, q) = (rays.project(dual), rays.project(away));
    let push = off_face
        .iter()
        .map(|&i| {
            let (v, s) = (rays.quartic(i), at(rays.share(), i));
            (s * v.dot(&p) - bound) / (-s * v.dot(&q))
        })
        .fold(0.0, f64::max);
    dual + push * away
}

/// The primitive integer vector along an offset, one of the two signs.
pub(super) fn primitive_direction(offset: [i32; 3]) -> [i32; 3] {
    let divisor = offset.iter().fold(0, |a, &b| gcd(a, b.abs()));
    let sign = offset.iter().rev().find(|&&x| x != 0).map_or(1, |x| x.signum());
    offset.map(|x| sign * x / divisor)
}

/// Greatest common divisor of two numbers ≥ 0, not both 0.
fn gcd(a: i32, b: i32) -> i32 {
    if b == 0 { a } else { gcd(b, a % b) }
}
