//! The least-norm solution by an active-set method on the bonds themselves.
//!
//! minimise Σ w c²/2 subject to Σ w s c v = S, c ≥ l, from any c that satisfies both: with the rays at the bound held,
//! the least norm is the projection of z = √w c on the row space of √w s v; go there, or up to the first ray that would
//! pass the bound, and hold that one too. Once there, z = √w s v·y for some y, and a ray with s v·y > l that is held is let
//! go (Nocedal & Wright 2006, section 16.5; a convex quadratic program). The tensor stays S to rounding however nearly the
//! free rays depend on each other, where Newton's method on the dual loses digits with the square of their condition.

use nalgebra::{DMatrix, DVector};

use super::rays::{Coordinates, PerRay, Rays, at, set};

/// A pivot below this part of the largest is rounding: the rays left depend on those before.
const DEPENDENT: f64 = 1e-14;

/// How much s v·y must be above the bound, relative to the largest c, for a held ray to be let go.
const RELEASED: f64 = 1e-11;

/// The same for a ray that was refused, up to which the norm still counts as the least.
const LEAST: f64 = 1e-6;

/// Rounds per ray at most; about two are used.
const MOST_ROUNDS: usize = 6;

/// How the descent ended.
pub struct LeastNorm<const D: usize> {
    /// c of every ray.
    pub c: PerRay,
    /// Dual vector, in the rays' span coordinates.
    pub y: Coordinates<D>,
    /// Projections carried out.
    pub iterations: usize,
    /// ‖S − Σ w s c v‖/‖S‖.
    pub residual: f64,
    /// Whether no held ray would lower the norm.
    pub least: bool,
}

/// Descend to the least norm from c = l + x/(w s), x the coefficients of a non-negative solution of S − Σ w s l v.
pub fn least_norm<const D: usize>(
    rays: &Rays<D>,
    target: &Coordinates<D>,
    lower_bound: f64,
    start: &[(usize, f64)],
) -> LeastNorm<D> {
    let mut descent = Descent::new(rays, lower_bound, start);
    let mut y = Coordinates::zeros();
    let (mut iterations, mut least) = (0, false);
    // What is let go together; one at a time when that brought nothing.
    let (mut share, mut before) = (0.5, f64::INFINITY);
    let mut refused = vec![false; rays.len()];
    while iterations < MOST_ROUNDS * rays.len() + 100 {
        iterations += 1;
        let free = FreeRays::new(&descent);
        match descent.project(&free) {
            Step::Blocked { moved } => {
                if moved {
                    refused.fill(false);
                }
            }
            Step::There => {
                free.correct(&mut descent, target);
                y = free.dual(&descent);
                let norm = descent.z.norm_squared();
                if norm >= before * (1.0 - 1e-14) {
                    share = 1.0;
                }
                before = norm;
                if !descent.release(&y, share, &mut refused) {
                    least = descent.is_least(&y);
                    break;
                }
            }
        }
    }
    let mut c = rays.zeros();
    (0..rays.len()).for_each(|i| set(&mut c, i, descent.z[i] / descent.root[i]));
    let residual = (target - rays.tensor(&c)).norm() / target.norm();
    LeastNorm { c, y, iterations, residual, least }
}

struct Descent<'a, const D: usize> {
    rays: &'a Rays<D>,
    /// √w of every ray, √w c and √w l.
    root: Vec<f64>,
    z: DVector<f64>,
    lowest: Vec<f64>,
    free: Vec<usize>,
}

enum Step {
    There,
    Blocked { moved: bool },
}

impl<'a, const D: usize> Descent<'a, D> {
    fn new(rays: &'a Rays<D>, lower_bound: f64, start: &[(usize, f64)]) -> Self {
        let root: Vec<f64> = (0..rays.len()).map(|i| at(rays.weight(), i).sqrt()).collect();
        let lowest: Vec<f64> = root.iter().map(|w| w * lower_bound).collect();
        let mut z = DVector::from_vec(lowest.clone());
        for &(i, x) in start {
            z[i] += x / (root[i] * at(rays.share(), i));
        }
        let free = start.iter().map(|entry| entry.0).collect();
        Descent { rays, root, z, lowest, free }
    }

    /// √w s v of a ray.
    fn column(&self, ray: usize) -> Coordinates<D> {
        self.rays.quartic(ray) * (self.root[ray] * at(self.rays.share(), ray))
    }

    /// Σ z √w s v.
    fn tensor(&self, z: &DVector<f64>) -> Coordinates<D> {
        let rays = (0..z.len()).filter(|&i| z[i] != 0.0);
        rays.fold(Coordinates::zeros(), |sum, i| sum + z[i] * self.column(i))
    }

    /// To the least norm on the free rays, or up to where the first of them meets the bound.
    fn project(&mut self, free: &FreeRays<D>) -> Step {
        let here = DVector::from_iterator(self.free.len(), self.free.iter().map(|&i| self.z[i]));
        let there = free.projected(&here);
        let (mut step, mut blocking) = (1.0, None);
        for (k, &i) in self.free.iter().enumerate() {
            if there[k] < self.lowest[i] {
                let until = ((here[k] - self.lowest[i]) / (here[k] - there[k])).max(0.0);
                if until < step {
                    (step, blocking) = (until, Some(k));
                }
            }
        }
        for (k, &i) in self.free.iter().enumerate() {
            self.z[i] = here[k] + step * (there[k] - here[k]);
        }
        let Some(k) = blocking else { return Step::There };
        let held = self.free.swap_remove(k);
        self.z[held] = self.lowest[held];
        Step::Blocked { moved: step > 1e-12 }
    }

    /// Whether no held ray, of the refused ones neither, would lower the norm.
    fn is_least(&self, y: &Coordinates<D>) -> bool {
        let largest = (0..self.z.len()).map(|i| self.z[i] / self.root[i]).fold(0.0, f64::max);
        let most = LEAST * largest + 4.0 * f64::EPSILON * y.norm();
        let held = (0..self.z.len()).filter(|i| !self.free.contains(i));
        held.map(|i| at(self.rays.share(), i) * self.rays.quartic(i).dot(y) - self.lowest[i] / self.root[i])
            .all(|above| above <= most)
    }

    /// Let go of held rays whose s v·y is above the bound, those within a share of the highest; false if there is none.
    /// What is let go and held again without a step in between is refused.
    fn release(&mut self, y: &Coordinates<D>, share: f64, refused: &mut [bool]) -> bool {
        let largest = (0..self.z.len()).map(|i| self.z[i] / self.root[i]).fold(0.0, f64::max);
        let mut held = vec![true; self.z.len()];
        self.free.iter().for_each(|&i| held[i] = false);
        let above = |i: usize| at(self.rays.share(), i) * self.rays.quartic(i).dot(y) - self.lowest[i] / self.root[i];
        // A large y makes products with rounding of its own size.
        let least = RELEASED * largest + 4.0 * f64::EPSILON * y.norm();
        let candidates: Vec<(usize, f64)> = (0..self.z.len())
            .filter(|&i| held[i] && !refused[i])
            .map(|i| (i, above(i)))
            .filter(|(_, value)| *value > least)
            .collect();
        let highest = candidates.iter().map(|entry| entry.1).fold(0.0, f64::max);
        let chosen: Vec<usize> =
            candidates.iter().filter(|(_, value)| *value >= share * highest).map(|entry| entry.0).collect();
        chosen.iter().for_each(|&i| refused[i] = true);
        self.free.extend(&chosen);
        !chosen.is_empty()
    }
}

/// The free rays' matrix (one row √w s v each) by Householder's method with pivoting, rays that depend on others within
/// rounding left out of its range.
struct FreeRays<const D: usize> {
    q: DMatrix<f64>,
    r: DMatrix<f64>,
    /// The coordinate that every kept column was.
    pivots: Vec<usize>,
}

impl<const D: usize> FreeRays<D> {
    fn new(descent: &Descent<D>) -> Self {
        let rank = descent.rays.rank();
        let columns: Vec<Coordinates<D>> = descent.free.iter().map(|&i| descent.column(i)).collect();
        let matrix = DMatrix::from_fn(columns.len(), rank, |i, k| columns[i][k]);
        let qr = matrix.col_piv_qr();
        let (q, r) = (qr.q(), qr.r());
        let mut order = DMatrix::from_fn(1, rank, |_, k| k as f64);
        qr.p().permute_columns(&mut order);
        let largest = if r.is_empty() { 0.0 } else { r[(0, 0)].abs() };
        let kept = (0..r.nrows()).take_while(|&k| r[(k, k)].abs() > DEPENDENT * largest).count();
        let pivots = (0..kept).map(|k| order[(0, k)] as usize).collect();
        FreeRays { q: q.columns(0, kept).into_owned(), r: r.view((0, 0), (kept, kept)).into_owned(), pivots }
    }

    /// The part in the row space, by projecting what is left once more.
    fn projected(&self, z: &DVector<f64>) -> DVector<f64> {
        let once = &self.q * self.q.tr_mul(z);
        let rest = z - &once;
        once + &self.q * self.q.tr_mul(&rest)
    }

    /// Take up what rounding has left of the target, where no ray passes the bound by it.
    fn correct(&self, descent: &mut Descent<D>, target: &Coordinates<D>) {
        for _ in 0..2 {
            let missing = target - descent.tensor(&descent.z);
            let right = DVector::from_iterator(self.pivots.len(), self.pivots.iter().map(|&k| missing[k]));
            let Some(change) = self.r.tr_solve_upper_triangular(&right) else { return };
            let change = &self.q * change;
            let mut moved = descent.z.clone();
            for (k, &i) in descent.free.iter().enumerate() {
                moved[i] = (moved[i] + change[k]).max(descent.lowest[i]);
            }
            if (target - descent.tensor(&moved)).norm() >= missing.norm() {
                return;
            }
            descent.z = moved;
        }
    }

    /// y of z = √w s v·y.
    fn dual(&self, descent: &Descent<D>) -> Coordinates<D> {
        let z = DVector::from_iterator(descent.free.len(), descent.free.iter().map(|&i| descent.z[i]));
        let mut y = Coordinates::zeros();
        if let Some(solution) = self.r.solve_upper_triangular(&self.q.tr_mul(&z)) {
            self.pivots.iter().zip(solution.iter()).for_each(|(&k, value)| y[k] = *value);
        }
        y
    }
}
