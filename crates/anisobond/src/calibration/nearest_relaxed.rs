//! The normal and tangential bonds ≥ 0 whose relaxed tensor is nearest to a target that none of them relaxes to.
//!
//! With the nodes' rotation Θ per unit strain held, the relaxed tensor is linear in the bonds: a tangential bond adds its
//! own strain energy T_Θ, the derivative of C_eff. A step of Gauss and Newton is thus a non-negative least-squares
//! problem over the rays N and T_Θ, and its solution a direction of descent.
//!
//! What is made small is ‖C* − C_eff‖² + α‖c‖². Without the second term there may be no least: tangential bonds in one
//! direction alone are let go by the rotation, whatever their stiffness, and it is by ever stiffer ones that the error can
//! shrink on. With it a step's bonds are c = max(0, s v·Y)/α for one tensor Y, found by Newton's method in 21 dimensions.
//! The error is not convex in the bonds: the result is a local one, the better of those from two starts.

use nalgebra::{Matrix3, Matrix3x6, Vector3};

use super::free_rotations::{relax, rotation, turned};
use super::microplane::{normal_projection, tangential_projection};
use super::rays::{Coordinates, Rays, Square, add_outer};
use super::{nnls, tensor_coordinates};
use crate::tensor::Stiffness;

/// α‖c‖² of the central bonds, as a share of their squared error.
const PENALTY: f64 = 1e-2;

/// Steps from one start.
const MOST_STEPS: usize = 60;

/// Relative decrease of the objective below which a descent has ended.
const SETTLED: f64 = 1e-9;

/// Halvings of a step that does not go down.
const MOST_HALVINGS: usize = 20;

/// Newton steps of a least-squares problem; a dozen are used.
const MOST_NEWTON_STEPS: usize = 100;

/// A Newton step shortened to this is rounding.
const SHORTEST_STEP: f64 = 1e-9;

/// The nearest bonds that were found.
pub(super) struct NearestRelaxed {
    /// c/s of the normal bonds of every direction, then of the tangential ones.
    pub c: Vec<f64>,
    /// ‖C* − C_eff‖.
    pub error: f64,
    /// The tensor Y of c = s max(0, v·Y), v = N or T_Θ, to the accuracy of the search.
    pub dual: Coordinates<21>,
    /// Target minus the closest tensor that bonds ≥ 0 reach while the nodes turn as those found.
    pub away: Coordinates<21>,
    /// Gauss-Newton steps of all starts.
    pub steps: usize,
}

/// Search for a unit target (‖C*‖ = 1) on the bonds' directions, each of weight Σ s²; from the central bonds, given by
/// their c/s, and from the sum that is closest to the target.
pub(super) fn nearest_relaxed(
    directions: &[Vector3<f64>],
    weight: &[f64],
    target: &Stiffness,
    central: &[f64],
) -> NearestRelaxed {
    let mut search = Search { directions, weight, target: *target, penalty: 0.0 };
    search.penalty = PENALTY * search.error(central).powi(2) / search.norm_squared(central);
    let still = Matrix3x6::zeros();
    let sum = search.closest(&still, &Coordinates::zeros()).0;
    let mut best = search.descend(central.to_vec(), &still);
    let turn = rotation(&search.sum(&sum).1);
    let other = search.descend(sum, &turn);
    let steps = best.steps + other.steps;
    if other.error < best.error {
        best = other;
    }
    best.steps = steps;
    best
}

struct Search<'a> {
    directions: &'a [Vector3<f64>],
    weight: &'a [f64],
    target: Stiffness,
    /// α.
    penalty: f64,
}

impl Search<'_> {
    /// Downhill from some bonds, the first step with a given rotation of the nodes, every other with their own.
    fn descend(&self, start: Vec<f64>, rotation_of_start: &Matrix3x6<f64>) -> NearestRelaxed {
        let mut c = start;
        let mut objective = self.objective(&c);
        let mut turn = *rotation_of_start;
        let mut dual = Coordinates::zeros();
        let mut steps = 0;
        while steps < MOST_STEPS {
            let (there, y) = self.closest(&turn, &dual);
            dual = y;
            steps += 1;
            let Some((lower, value)) = self.lower(&c, objective, &there) else { break };
            let settled = objective - value <= SETTLED * objective;
            (c, objective) = (lower, value);
            turn = rotation(&self.sum(&c).1);
            if settled {
                break;
            }
        }
        let ones = vec![1.0; 2 * self.directions.len()];
        let rays = Rays::new(&self.rays(&turn), &ones, &ones);
        let goal = self.goal();
        let inside = rays.project(&goal);
        let away = goal - rays.lift(&(inside - nnls::closest(&rays, &inside).residual));
        NearestRelaxed { error: self.error(&c), c, dual: dual / self.penalty, away, steps }
    }

    /// The longest halved step towards other bonds that lowers the objective.
    fn lower(&self, here: &[f64], objective: f64, there: &[f64]) -> Option<(Vec<f64>, f64)> {
        let mut t = 1.0;
        for _ in 0..MOST_HALVINGS {
            let between: Vec<f64> = here.iter().zip(there).map(|(a, b)| (1.0 - t) * a + t * b).collect();
            let value = self.objective(&between);
            if value < objective {
                return Some((between, value));
            }
            t *= 0.5;
        }
        None
    }

    fn objective(&self, c: &[f64]) -> f64 {
        self.error(c).powi(2) + self.penalty * self.norm_squared(c)
    }

    /// ‖C* − C_eff‖.
    fn error(&self, c: &[f64]) -> f64 {
        let (sum, fabric) = self.sum(c);
        (self.target.mandel() - relax(&sum, &fabric).mandel()).norm()
    }

    /// ‖c_n‖² + ‖c_t‖² over all bonds.
    fn norm_squared(&self, c: &[f64]) -> f64 {
        self.weight.iter().chain(self.weight).zip(c).map(|(w, c)| w * c * c).sum()
    }

    /// Σ s (c_n N + c_t T) and its tangential fabric Σ s c_t n⊗n.
    fn sum(&self, c: &[f64]) -> (Stiffness, Matrix3<f64>) {
        let (normal, tangential) = c.split_at(self.directions.len());
        let mut sum = *self.target.mandel() * 0.0;
        let mut fabric = Matrix3::zeros();
        for (((n, w), cn), ct) in self.directions.iter().zip(self.weight).zip(normal).zip(tangential) {
            if *cn > 0.0 {
                sum += *w * *cn * normal_projection(n);
            }
            if *ct > 0.0 {
                sum += *w * *ct * tangential_projection(n);
                fabric += *w * *ct * n * n.transpose();
            }
        }
        (Stiffness::from_mandel(sum), fabric)
    }

    fn goal(&self) -> Coordinates<21> {
        tensor_coordinates(self.target.mandel())
    }

    /// N of every direction, then T when the nodes turn by a given rotation.
    fn rays(&self, rotation: &Matrix3x6<f64>) -> Vec<Coordinates<21>> {
        let normal = self.directions.iter().map(|n| tensor_coordinates(&normal_projection(n)));
        let tangential = self.directions.iter().map(|n| {
            let bond = Stiffness::from_mandel(tangential_projection(n));
            tensor_coordinates(turned(&bond, &(n * n.transpose()), rotation).mandel())
        });
        normal.chain(tangential).collect()
    }

    /// The c ≥ 0 of least ‖C* − Σ w c v‖² + α‖c‖² while the nodes turn by a given rotation, with its residual Y, from a
    /// guess of it: c = max(0, v·Y)/α, and Y is the zero of the monotone C* − Y − Σ w c v.
    fn closest(&self, rotation: &Matrix3x6<f64>, guess: &Coordinates<21>) -> (Vec<f64>, Coordinates<21>) {
        let rays = self.rays(rotation);
        let goal = self.goal();
        let weights = || self.weight.iter().chain(self.weight);
        let values =
            |y: &Coordinates<21>| -> Vec<f64> { rays.iter().map(|v| v.dot(y).max(0.0) / self.penalty).collect() };
        // The dual objective, to be made large, and its gradient.
        let dual = |y: &Coordinates<21>, c: &[f64]| {
            let mut gradient = goal - y;
            let mut value = goal.dot(y) - 0.5 * y.norm_squared();
            for ((v, w), c) in rays.iter().zip(weights()).zip(c).filter(|(_, c)| **c > 0.0) {
                gradient -= *w * *c * v;
                value -= 0.5 * self.penalty * w * c * c;
            }
            (value, gradient)
        };
        let mut y = *guess;
        let mut c = values(&y);
        let (mut value, mut gradient) = dual(&y, &c);
        for _ in 0..MOST_NEWTON_STEPS {
            let mut hessian = Square::<21>::identity();
            // At y = 0 every bond counts, as in the pseudo-inverse.
            for (v, w) in rays.iter().zip(weights()).filter(|(v, _)| v.dot(&y) >= 0.0) {
                add_outer(&mut hessian, &(*v).into(), w / self.penalty);
            }
            let Some(factor) = hessian.cholesky() else { break };
            let direction = factor.solve(&gradient);
            let slope = gradient.dot(&direction);
            let mut step = 1.0;
            let next = loop {
                let moved = y + step * direction;
                let c = values(&moved);
                let (value_there, gradient) = dual(&moved, &c);
                if value_there >= value + 1e-4 * step * slope {
                    break Some((moved, c, value_there, gradient));
                }
                step *= 0.5;
                if step < SHORTEST_STEP {
                    break None;
                }
            };
            let Some(next) = next else { break };
            (y, c, value, gradient) = next;
            if gradient.norm() <= 1e-12 {
                break;
            }
        }
        (c, y)
    }
}
