//! The nodal term of least trace: a small semidefinite program, by a barrier method on its dual.
//!
//! maximise Σ d subject to Z = C − Σ d e⊗e ⪰ 0, d ≥ 0, with e = n⊗n in Kelvin-Mandel coordinates, so that
//! tr Z = tr C − Σ d (each n⊗n⊗n⊗n has trace 1). Its dual has 21 unknowns whatever the neighbourhood:
//! minimise Y:C subject to Y ⪰ 0 and e·Y·e ≥ 1 for every direction. On the central path of
//! Y:C − μ log det Y − μ Σ log(e·Y·e − 1) the primal solution is Z = μ Y⁻¹, d = μ/(e·Y·e − 1)
//! (Boyd & Vandenberghe 2004, sections 11.3 and 11.6).

use nalgebra::{Cholesky, Const, Matrix6, SMatrix, SVector, Vector6};

use crate::tensor::PAIRS;

/// What the trace of Z may still be above the least, relative to the trace of C.
const GAP: f64 = 1e-8;

/// Factor by which the barrier is lowered after each centring.
const LOWERED: f64 = 0.2;

/// μ below which rounding rules; about 10⁻¹¹ is enough.
const SMALLEST_MU: f64 = 1e-15;

/// Newton decrement (squared, in units of μ) below which the whole step is safe.
const QUADRATIC: f64 = 0.01;

/// Newton decrement (squared, in units of μ) at which a point counts as central.
const CENTRAL: f64 = 1e-4;

/// Newton steps of one centring at most; about five are used, at horizon 6 now and then a hundred.
const MOST_STEPS: usize = 500;

/// How much of the way to C the directions' sum keeps at most, against rounding.
const INSIDE: f64 = 1.0 - 1e-14;

/// Coordinates of a symmetric 6×6 matrix: the upper triangle, off-diagonals times √2.
type Upper = SVector<f64, 21>;

/// The solution with its evidence.
pub struct LeastTrace {
    /// d of every direction, ≥ 0 (units of C).
    pub weights: Vec<f64>,
    /// tr C − Y:C for a Y of the dual: no choice of d has a smaller tr Z (units of C).
    pub trace_bound: f64,
    /// Newton steps taken.
    pub steps: usize,
}

/// Solve for a positive definite C (Kelvin-Mandel, any unit) and directions e.
pub fn least_trace(c: &Matrix6<f64>, directions: &[Vector6<f64>]) -> LeastTrace {
    let scale = c.trace();
    let c = c / scale;
    let columns: Vec<Upper> = directions.iter().map(|e| upper(&(e * e.transpose()))).collect();
    let mut path = Path { c: upper(&c), columns: &columns, y: 2.0 * Matrix6::identity(), mu: 1.0 };
    let mut best = Certified { weights: vec![0.0; directions.len()], sum: 0.0, bound: 1.0 };
    let mut steps = 0;
    while best.bound - best.sum > GAP && path.mu > SMALLEST_MU {
        steps += path.centre();
        best.improve(path.certified(&c, directions));
        path.mu *= LOWERED;
    }
    LeastTrace {
        weights: best.weights.iter().map(|d| d * scale).collect(),
        trace_bound: (1.0 - best.bound) * scale,
        steps,
    }
}

/// A feasible point of the program and one of its dual; Σ d ≤ optimum ≤ bound whatever the accuracy of the path.
struct Certified {
    weights: Vec<f64>,
    /// Σ d.
    sum: f64,
    /// Y:C.
    bound: f64,
}

impl Certified {
    /// The better of each.
    fn improve(&mut self, other: Certified) {
        if other.sum > self.sum {
            (self.weights, self.sum) = (other.weights, other.sum);
        }
        self.bound = self.bound.min(other.bound);
    }
}

/// A point on (or near) the central path.
struct Path<'a> {
    c: Upper,
    columns: &'a [Upper],
    y: Matrix6<f64>,
    mu: f64,
}

impl Path<'_> {
    /// Newton's method to the central point of the current μ; returns the steps taken.
    fn centre(&mut self) -> usize {
        for step in 0..MOST_STEPS {
            let Some((direction, decrement)) = self.newton() else { return step };
            if decrement < CENTRAL || !self.search(&direction, decrement) {
                return step;
            }
        }
        MOST_STEPS
    }

    /// e·Y·e − 1 of every direction.
    fn slacks(&self, y: &Upper) -> impl Iterator<Item = f64> {
        self.columns.iter().map(move |column| column.dot(y) - 1.0)
    }

    /// The barrier's value over μ; `None` outside its domain.
    fn value(&self, y: &Matrix6<f64>) -> Option<f64> {
        let factor = y.cholesky()?;
        let log_det = 2.0 * (0..6).map(|k| factor.l_dirty()[(k, k)].ln()).sum::<f64>();
        let y = upper(y);
        let mut logs = 0.0;
        for slack in self.slacks(&y) {
            if slack <= 0.0 {
                return None;
            }
            logs += slack.ln();
        }
        Some(self.c.dot(&y) / self.mu - log_det - logs)
    }

    /// Newton's direction and squared decrement of the barrier over μ: gradient C/μ − Y⁻¹ − Σ e⊗e/slack, Hessian
    /// ΔY ↦ Y⁻¹ ΔY Y⁻¹ + Σ (e·ΔY·e) e⊗e/slack².
    fn newton(&self) -> Option<(Matrix6<f64>, f64)> {
        let inverse = self.y.cholesky()?.inverse();
        let mut gradient = self.c / self.mu - upper(&inverse);
        let mut hessian = congruence(&inverse);
        for (column, slack) in self.columns.iter().zip(self.slacks(&upper(&self.y))) {
            gradient -= column / slack;
            hessian.ger(1.0 / (slack * slack), column, column, 1.0);
        }
        let step: Upper = factor(hessian)?.solve(&-gradient);
        Some((matrix(&step), -gradient.dot(&step)))
    }

    /// Backtracking along a direction, or, where Newton converges quadratically and values are down to rounding, the
    /// whole step; false when rounding leaves nothing to gain.
    fn search(&mut self, direction: &Matrix6<f64>, decrement: f64) -> bool {
        let whole = self.y + direction;
        if decrement < QUADRATIC && self.value(&whole).is_some() {
            self.y = whole;
            return true;
        }
        let Some(before) = self.value(&self.y) else { return false };
        let mut t = 1.0;
        while t > 1e-10 {
            let moved = self.y + t * direction;
            if self.value(&moved).is_some_and(|after| after <= before - 0.1 * t * decrement) {
                self.y = moved;
                return true;
            }
            t *= 0.5;
        }
        false
    }

    /// d = μ/slack, with Newton's last direction ΔY as μ/slack − μ e·ΔY·e/slack² so that Z + Σ d e⊗e = C holds to rounding,
    /// shrunk until Z ⪰ 0 does; and Y:C of a Y grown until it is feasible.
    fn certified(&self, c: &Matrix6<f64>, directions: &[Vector6<f64>]) -> Certified {
        let y = upper(&self.y);
        let slacks: Vec<f64> = self.slacks(&y).collect();
        let change = upper(&self.newton().map_or_else(Matrix6::zeros, |(direction, _)| direction));
        let weight = |(column, slack): (&Upper, &f64)| (self.mu / slack * (1.0 - column.dot(&change) / slack)).max(0.0);
        let weights: Vec<f64> = self.columns.iter().zip(&slacks).map(weight).collect();
        let sum = directions.iter().zip(&weights).fold(Matrix6::zeros(), |sum, (e, &d)| sum + d * e * e.transpose());
        let shrink = (INSIDE / largest_relative(&sum, c)).min(1.0);
        let weights: Vec<f64> = weights.iter().map(|d| d * shrink).collect();
        let smallest = slacks.iter().copied().fold(f64::INFINITY, f64::min) + 1.0;
        Certified { sum: weights.iter().sum(), weights, bound: self.c.dot(&y) / smallest.min(1.0) }
    }
}

/// Cholesky factor of the Hessian, its diagonal raised by as little as rounding demands.
fn factor(hessian: SMatrix<f64, 21, 21>) -> Option<Cholesky<f64, Const<21>>> {
    [0.0, 1e-15, 1e-13, 1e-11].into_iter().find_map(|shift| {
        let mut raised = hessian;
        for k in 0..21 {
            raised[(k, k)] *= 1.0 + shift;
        }
        Cholesky::new(raised)
    })
}

/// Largest λ with b x = λ c x, c positive definite: b ⪯ λ c. Infinite if c is singular.
pub fn largest_relative(b: &Matrix6<f64>, c: &Matrix6<f64>) -> f64 {
    let Some(factor) = c.cholesky() else { return f64::INFINITY };
    let l = factor.l();
    let inverse = l.solve_lower_triangular(&Matrix6::identity());
    inverse.map_or(f64::INFINITY, |i| (i * b * i.transpose()).symmetric_eigenvalues().max())
}

/// Row and column of the 21 coordinates.
fn places() -> impl Iterator<Item = (usize, usize)> {
    (0..PAIRS.len()).flat_map(|a| (a..PAIRS.len()).map(move |b| (a, b)))
}

/// Coordinates of a symmetric matrix; their dot product is A:B.
fn upper(m: &Matrix6<f64>) -> Upper {
    let mut out = Upper::zeros();
    for (k, (a, b)) in places().enumerate() {
        out[k] = if a == b { m[(a, b)] } else { std::f64::consts::SQRT_2 * m[(a, b)] };
    }
    out
}

/// The matrix of given coordinates.
fn matrix(v: &Upper) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    for (k, (a, b)) in places().enumerate() {
        out[(a, b)] = if a == b { v[k] } else { std::f64::consts::FRAC_1_SQRT_2 * v[k] };
        out[(b, a)] = out[(a, b)];
    }
    out
}

/// ΔY ↦ W ΔY W on coordinates: (W_ac W_bd + W_ad W_bc) with the weights of both.
fn congruence(w: &Matrix6<f64>) -> SMatrix<f64, 21, 21> {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let mut out = SMatrix::zeros();
    for (p, (a, b)) in places().enumerate() {
        let f = if a == b { half } else { 1.0 };
        for (q, (c, d)) in places().enumerate() {
            let g = if c == d { half } else { 1.0 };
            out[(p, q)] = f * g * (w[(a, c)] * w[(b, d)] + w[(a, d)] * w[(b, c)]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn congruence_is_the_product() {
        let w = Matrix6::from_fn(|a, b| ((a * b + a + b) as f64).sin());
        let y = Matrix6::from_fn(|a, b| ((a + b) as f64).cos() + ((a * b) as f64).sin());
        let found = matrix(&(congruence(&w) * upper(&y)));
        assert!((found - w * y * w).norm() < 1e-13 * found.norm());
        assert!((matrix(&upper(&y)) - y).norm() < 1e-15);
    }

    /// One direction: as much of it as C carries, d = 1/(e·C⁻¹e).
    #[test]
    fn one_direction_by_hand() {
        let c = Matrix6::from_fn(|a, b| if a == b { 3.0 + a as f64 } else { 0.5 });
        let e = Vector6::new(0.36, 0.64, 0.0, 0.0, 0.0, 0.48 * 2f64.sqrt());
        let solution = least_trace(&c, &[e]);
        let expected = 1.0 / e.dot(&(c.try_inverse().unwrap() * e));
        assert!((solution.weights[0] / expected - 1.0).abs() < 1e-6, "{}", solution.weights[0]);
        assert!((solution.trace_bound - (c.trace() - expected)).abs() < 1e-6);
    }
}
