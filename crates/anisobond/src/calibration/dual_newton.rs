//! The least-norm solution by a semismooth Newton method on the dual.
//!
//! minimise Σ w c²/2 subject to Σ w s c v = S, c ≥ l has the concave, piecewise quadratic dual
//! g(y) = S·y − Σ w h(s v·y), h(t) = t²/2 for t ≥ l, l t − l²/2 below, with gradient S − Σ w s c v at
//! c = max(l, s v·y) and generalised Hessian −Σ_{s v·y > l} w s² v vᵀ.

use super::rays::{Coordinates, PerRay, Rays, Square, add_outer, at, factor, set};

/// How a dual ascent ended.
pub struct DualOutcome<const D: usize> {
    /// Dual vector, in the rays' span coordinates.
    pub y: Coordinates<D>,
    /// c of every ray.
    pub c: PerRay,
    /// Newton steps taken; 0 when the pseudo-inverse was already optimal.
    pub iterations: usize,
    /// ‖S − Σ w s c v‖ / ‖S‖ within the span.
    pub residual: f64,
}

/// A relative residual that ends the ascent: below it only rounding is left.
const CONVERGED: f64 = 2e-15;

/// A relative residual at which what is left is the rounding of v·y for a large y.
const ROUNDING: f64 = 1e-12;

/// A dual step longer than this many Newton steps has no end: the dual is unbounded, the target out of reach.
const UNBOUNDED: f64 = 1e8;

/// Maximise the dual for a target in span coordinates and a lower bound l in at most so many steps; the caller judges
/// the residual.
pub fn maximise<const D: usize>(
    rays: &Rays<D>,
    target: &Coordinates<D>,
    lower_bound: f64,
    most_iterations: usize,
) -> DualOutcome<D> {
    let norm = target.norm();
    let mut y = rays.pseudo_inverse(target);
    let mut p = rays.zeros();
    let mut q = rays.zeros();
    let mut c = rays.zeros();
    rays.forms(&y, &mut p);
    values(rays, &p, lower_bound, &mut c);
    let mut gradient = target - rays.tensor(&c);
    let mut hessian = Hessian::new(rays);
    let mut best = (gradient.norm(), y, c.clone());
    let mut stalled = 0;
    let mut iterations = 0;
    while gradient.norm() > CONVERGED * norm && iterations < most_iterations && stalled < 3 {
        hessian.follow(rays, &p, lower_bound);
        let direction = hessian.solve(&gradient);
        rays.forms(&direction, &mut q);
        let Some(step) = line_search(rays, target.dot(&direction), &p, &q, lower_bound) else { break };
        y += step * direction;
        rays.forms(&y, &mut p);
        values(rays, &p, lower_bound, &mut c);
        gradient = target - rays.tensor(&c);
        iterations += 1;
        // At the level of rounding the gradient wanders; keep the best and stop soon.
        if gradient.norm() < best.0 {
            stalled = 0;
            best = (gradient.norm(), y, c.clone());
        } else if best.0 < ROUNDING * norm {
            stalled += 1;
        }
    }
    let (_, mut y, mut c) = best;
    polish(rays, target, lower_bound, &mut y, &mut c);
    let residual = (target - rays.tensor(&c)).norm() / norm;
    DualOutcome { y, c, iterations, residual }
}

/// c = max(l, s p).
fn values<const D: usize>(rays: &Rays<D>, p: &PerRay, lower_bound: f64, c: &mut PerRay) {
    for ((c, p), s) in c.iter_mut().zip(p).zip(rays.share()) {
        for lane in 0..c.len() {
            c[lane] = lower_bound.max(s[lane] * p[lane]);
        }
    }
}

/// Remove the residual that rounding of v·y leaves when y is large: the same Newton correction, applied to c itself on
/// the rays above the bound, as long as it leaves the others below it.
fn polish<const D: usize>(
    rays: &Rays<D>,
    target: &Coordinates<D>,
    lower_bound: f64,
    y: &mut Coordinates<D>,
    c: &mut PerRay,
) {
    let norm = target.norm();
    let mut before = (target - rays.tensor(c)).norm();
    if before <= CONVERGED * norm || before > ROUNDING * norm {
        return;
    }
    let mut active = Square::zeros();
    for i in 0..rays.len() {
        if at(c, i) > lower_bound {
            add_outer(&mut active, rays.row(i), at(rays.weight(), i) * at(rays.share(), i).powi(2));
        }
    }
    let active = factor(&active, rays.rank());
    let largest = c.iter().flatten().copied().fold(lower_bound, f64::max);
    let (mut p, mut q) = (rays.zeros(), rays.zeros());
    for _ in 0..3 {
        let direction = active.solve(&(target - rays.tensor(c)));
        rays.forms(y, &mut p);
        rays.forms(&direction, &mut q);
        let mut moved = c.clone();
        for i in 0..rays.len() {
            let (s, now) = (at(rays.share(), i), at(c, i));
            if now > lower_bound {
                set(&mut moved, i, lower_bound.max(now + s * at(&q, i)));
            } else if s * (at(&p, i) + at(&q, i)) > lower_bound + 1e-10 * largest {
                return;
            }
        }
        let after = (target - rays.tensor(&moved)).norm();
        if after >= before {
            return;
        }
        before = after;
        *c = moved;
        *y += direction;
    }
}

/// Σ w s² v vᵀ over the rays above the bound, kept up to date as rays change sides.
struct Hessian<const D: usize> {
    matrix: Square<D>,
    above: Vec<bool>,
    rank: usize,
}

impl<const D: usize> Hessian<D> {
    fn new(rays: &Rays<D>) -> Self {
        Hessian { matrix: *rays.gram(), above: vec![true; rays.len()], rank: rays.rank() }
    }

    fn follow(&mut self, rays: &Rays<D>, p: &PerRay, lower_bound: f64) {
        for (i, above) in self.above.iter_mut().enumerate() {
            let s = at(rays.share(), i);
            let now = s * at(p, i) > lower_bound;
            if now != *above {
                *above = now;
                let sign = if now { 1.0 } else { -1.0 };
                add_outer(&mut self.matrix, rays.row(i), sign * at(rays.weight(), i) * s * s);
            }
        }
    }

    fn solve(&self, gradient: &Coordinates<D>) -> Coordinates<D> {
        factor(&self.matrix, self.rank).solve(gradient)
    }
}

/// The step that maximises the dual along a direction: the root of its decreasing, piecewise linear slope
/// S·d − Σ w s q max(l, s (p + t q)). The full Newton step is taken when it is good enough; `None` when the slope stays
/// positive for ever, so that no primal solution exists.
fn line_search<const D: usize>(
    rays: &Rays<D>,
    target_slope: f64,
    p: &PerRay,
    q: &PerRay,
    lower_bound: f64,
) -> Option<f64> {
    let slope = |t: f64| -> f64 {
        let mut sum = [0.0; 8];
        for (((p, q), s), w) in p.iter().zip(q).zip(rays.share()).zip(rays.weight()) {
            for lane in 0..p.len() {
                let c = lower_bound.max(s[lane] * (p[lane] + t * q[lane]));
                sum[lane] += w[lane] * s[lane] * q[lane] * c;
            }
        }
        target_slope - sum.iter().sum::<f64>()
    };
    let start = slope(0.0);
    let full = slope(1.0);
    if full.abs() <= 0.3 * start || start <= 0.0 {
        return Some(1.0);
    }
    let (mut low, mut high) = ((0.0, start), (1.0, full));
    while high.1 > 0.0 {
        if high.0 > UNBOUNDED {
            return None;
        }
        low = high;
        high = (4.0 * high.0, slope(4.0 * high.0));
    }
    // Regula falsi with the Illinois rule.
    let (mut f_low, mut f_high) = (low.1, high.1);
    let mut last_side = 0;
    for _ in 0..40 {
        let t = (low.0 * f_high - high.0 * f_low) / (f_high - f_low);
        let f = slope(t);
        if f.abs() <= 1e-3 * start {
            return Some(t);
        }
        if f > 0.0 {
            low = (t, f);
            f_low = f;
            if last_side == 1 {
                f_high *= 0.5;
            }
            last_side = 1;
        } else {
            high = (t, f);
            f_high = f;
            if last_side == -1 {
                f_low *= 0.5;
            }
            last_side = -1;
        }
    }
    Some(if low.0 > 0.0 { low.0 } else { high.0 })
}
