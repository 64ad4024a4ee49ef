//! The least-norm solution by proximal points of the dual, for targets next to the border of what the rays reach.
//!
//! There only a few rays are above the bound, Newton's matrix is nearly singular and steps have no end. So the dual g of
//! [`dual_newton`](super::dual_newton) is maximised less ½ δ |y − y₀|², which holds y where it was; then from there with a smaller δ.
//! The sequence tends to a maximum of g itself (Rockafellar, SIAM J. Control Optim. 14, 1976), in the end faster than linearly.
//! c = max(l, s v·y) throughout, so once the tensor is reached the norm is the least.

use super::dual_newton::DualOutcome;
use super::rays::{Coordinates, PerRay, Rays, Square, add_outer, at, factor, set};

/// δ to begin with as a share of Σ w s² |v|², how much smaller it is each time, and how often.
const HELD: f64 = 1e-3;
const LOOSENED: f64 = 0.1;
const MOST_HELD: usize = 14;

/// Newton steps with one δ at most.
const MOST_STEPS: usize = 60;

/// Shortest part of a step that is tried.
const SHORTEST: f64 = 1e-6;

/// A gradient of so much of 1 + |y| is rounding.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// A relative residual that ends the search.
const CONVERGED: f64 = 1e-14;

/// Maximise the dual for a target in span coordinates and a lower bound l; the caller judges the residual.
pub fn maximise<const D: usize>(rays: &Rays<D>, target: &Coordinates<D>, lower_bound: f64) -> DualOutcome<D> {
    let norm = target.norm();
    let mut held = HELD * rays.gram().trace();
    let mut y = Coordinates::zeros();
    let mut iterations = 0;
    let mut best: Option<(f64, Coordinates<D>, PerRay)> = None;
    for _ in 0..MOST_HELD {
        iterations += ascend(rays, target, lower_bound, held, &mut y);
        let here = Sum::new(rays, &y, lower_bound);
        let residual = (target - here.tensor).norm() / norm;
        if best.as_ref().is_none_or(|before| residual < before.0) {
            best = Some((residual, y, here.c));
        }
        if residual <= CONVERGED {
            break;
        }
        held *= LOOSENED;
    }
    let (residual, y, c) = best.unwrap_or_else(|| (f64::INFINITY, y, rays.filled(lower_bound)));
    DualOutcome { y, c, iterations, residual }
}

/// Newton's method with y held where it is; the steps taken.
fn ascend<const D: usize>(
    rays: &Rays<D>,
    target: &Coordinates<D>,
    lower_bound: f64,
    held: f64,
    y: &mut Coordinates<D>,
) -> usize {
    let centre = *y;
    let mut here = Sum::new(rays, y, lower_bound);
    for steps in 0..MOST_STEPS {
        let gradient = target - here.tensor - held * (*y - centre);
        if gradient.norm() <= ROUNDING * (target.norm() + y.norm()) {
            return steps;
        }
        let step = factor(&(here.hessian(rays) + held * Square::identity()), D).solve(&gradient);
        // Halved until what is maximised still rises at its end, or falls less than half as fast as it rose.
        let rise = gradient.dot(&step);
        let mut length = 1.0;
        loop {
            let there = *y + length * step;
            here = Sum::new(rays, &there, lower_bound);
            let ahead = target - here.tensor - held * (there - centre);
            if ahead.dot(&step) >= -0.5 * rise || length <= SHORTEST {
                *y = there;
                break;
            }
            length *= 0.5;
        }
    }
    MOST_STEPS
}

/// c = max(l, s v·y) and Σ w s c v at a y.
struct Sum<const D: usize> {
    c: PerRay,
    tensor: Coordinates<D>,
    above: Vec<usize>,
}

impl<const D: usize> Sum<D> {
    fn new(rays: &Rays<D>, y: &Coordinates<D>, lower_bound: f64) -> Self {
        let (mut c, mut above) = (rays.zeros(), Vec::new());
        rays.forms(y, &mut c);
        for i in 0..rays.len() {
            let value = at(rays.share(), i) * at(&c, i);
            if value > lower_bound {
                above.push(i);
            }
            set(&mut c, i, value.max(lower_bound));
        }
        Sum { tensor: rays.tensor(&c), c, above }
    }

    /// Σ w s² v vᵀ over the rays above the bound.
    fn hessian(&self, rays: &Rays<D>) -> Square<D> {
        self.above.iter().fold(Square::zeros(), |mut sum, &i| {
            add_outer(&mut sum, rays.row(i), at(rays.weight(), i) * at(rays.share(), i).powi(2));
            sum
        })
    }
}
