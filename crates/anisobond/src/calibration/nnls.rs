//! Non-negative least squares in 15 or 21 dimensions (Lawson & Hanson 1974), with its optimality re-checked: the distance of
//! a target from the cone of the rays, and the direction that proves it.

use super::rays::{Coordinates, Rays, Square};

/// A ray enters when it leans on the residual by more than this (cosine, v and r at unit length).
const ENTERS: f64 = 1e-13;

/// A residual below this share of the target is rounding: the target is in the cone.
const IN_CONE: f64 = 1e-14;

/// The closest point of the cone { Σ x v : x ≥ 0 } to a target.
pub struct Closest<const D: usize> {
    /// Target minus that point, in the rays' span coordinates; zero when the target is in the cone. It satisfies v·r ≤ 0 for
    /// all rays and r·target = ‖r‖²: a Farkas certificate.
    pub residual: Coordinates<D>,
    /// The rays that make the point, with their x > 0.
    pub passive: Vec<(usize, f64)>,
}

/// Find the closest point.
pub fn closest<const D: usize>(rays: &Rays<D>, target: &Coordinates<D>) -> Closest<D> {
    let norm = target.norm();
    let mut passive: Vec<(usize, f64)> = Vec::new();
    let mut residual = *target;
    let mut leaning = rays.zeros();
    let mut refused: Vec<usize> = Vec::new();
    // Each ray enters a handful of times at most; the bound only guards against cycling on ties.
    for _ in 0..30 * D + rays.len() {
        if residual.norm() <= IN_CONE * norm {
            return Closest { residual: Coordinates::zeros(), passive };
        }
        let direction = residual.normalize();
        rays.forms(&direction, &mut leaning);
        let entering = (0..rays.len())
            .filter(|i| !refused.contains(i) && passive.iter().all(|(j, _)| j != i))
            .map(|i| (i, super::rays::at(&leaning, i)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((entering, lean)) = entering else { break };
        if lean <= ENTERS {
            break;
        }
        passive.push((entering, 0.0));
        match settle(rays, target, &mut passive) {
            Some(r) if r.norm() < residual.norm() => {
                residual = r;
                refused.clear();
            }
            // The ray brings nothing within rounding: set it aside until the residual changes.
            other => {
                refused.push(entering);
                if let Some(r) = other
                    && r.norm() <= residual.norm()
                {
                    residual = r;
                }
            }
        }
    }
    Closest { residual, passive }
}

/// Make the coefficients of the passive rays the least-squares ones, dropping rays that would turn negative on the way
/// (Lawson & Hanson's inner loop). Returns the residual, or `None` (passive set unchanged but for the last entry taken
/// back) when the newest ray depends on the others.
fn settle<const D: usize>(
    rays: &Rays<D>,
    target: &Coordinates<D>,
    passive: &mut Vec<(usize, f64)>,
) -> Option<Coordinates<D>> {
    let before = passive[..passive.len() - 1].to_vec();
    loop {
        let Some((solution, residual)) = least_squares(rays, target, passive) else {
            *passive = before;
            return None;
        };
        if solution.iter().all(|&x| x > 0.0) {
            for (entry, x) in passive.iter_mut().zip(solution) {
                entry.1 = x;
            }
            return Some(residual);
        }
        let newest = passive.len() - 1;
        if passive[newest].1 == 0.0 && solution[newest] <= 0.0 {
            *passive = before;
            return None;
        }
        // The largest step towards the solution that keeps every coefficient non-negative.
        let step = passive
            .iter()
            .zip(&solution)
            .filter(|&(_, &x)| x <= 0.0)
            .map(|(entry, x)| entry.1 / (entry.1 - x))
            .fold(1.0, f64::min);
        for (entry, x) in passive.iter_mut().zip(&solution) {
            entry.1 += step * (x - entry.1);
        }
        let blocking = passive
            .iter()
            .zip(&solution)
            .filter(|&(_, &x)| x <= 0.0)
            .map(|(entry, _)| entry.1)
            .fold(f64::INFINITY, f64::min);
        passive.retain(|entry| entry.1 > blocking);
        if passive.is_empty() {
            *passive = before;
            return None;
        }
    }
}

/// Coefficients and residual of the unconstrained least-squares problem on a few rays, by Gram-Schmidt carried out
/// twice; `None` when the rays depend on each other.
fn least_squares<const D: usize>(
    rays: &Rays<D>,
    target: &Coordinates<D>,
    passive: &[(usize, f64)],
) -> Option<(Vec<f64>, Coordinates<D>)> {
    let count = passive.len();
    if count > D {
        return None;
    }
    let mut q: Vec<Coordinates<D>> = Vec::with_capacity(count);
    let mut r = Square::<D>::zeros();
    for (column, &(ray, _)) in passive.iter().enumerate() {
        let mut v = Coordinates::from(*rays.row(ray));
        let length = v.norm();
        for _ in 0..2 {
            for (row, base) in q.iter().enumerate() {
                let share = base.dot(&v);
                r[(row, column)] += share;
                v -= share * base;
            }
        }
        let left = v.norm();
        if left <= 1e-11 * length {
            return None;
        }
        r[(column, column)] = left;
        q.push(v / left);
    }
    let mut residual = *target;
    let mut rhs = [0.0; D];
    for _ in 0..2 {
        for (row, base) in q.iter().enumerate() {
            let share = base.dot(&residual);
            rhs[row] += share;
            residual -= share * base;
        }
    }
    let mut solution = vec![0.0; count];
    for row in (0..count).rev() {
        let known: f64 = (row + 1..count).map(|column| r[(row, column)] * solution[column]).sum();
        solution[row] = (rhs[row] - known) / r[(row, row)];
    }
    Some((solution, residual))
}
