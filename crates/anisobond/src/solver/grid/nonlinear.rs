//! Equilibrium of forces that are not linear in the displacements, by preconditioned non-linear conjugate gradients.

use super::conjugate_gradients::{Ending, GridSolverReport};
use super::free_modes::FreeModes;
use super::preconditioner::Preconditioner;
use super::vectors::{add_scaled, dot, scale_add};
use super::watch::ResidualWatch;
use crate::operator::{GridOperator, VectorField};
use crate::solver::{Look, Stopping};

/// Iterations without a new least residual after which a solve has stagnated.
const PATIENCE: usize = 300;

/// Secant steps per direction.
const SECANTS: usize = 4;

/// A direction is searched until the residual along it has fallen to this share.
const SEARCHED: f64 = 0.1;

/// Find u with residual(u) = 0, from the given u; the preconditioner is that of the linearised body.
///
/// Directions by Polak and Ribière, restarted where they do not descend; steps by the secant of the residual along the
/// direction, so that no tangent is needed.
pub(super) fn nonlinear_gradients(
    operator: &dyn GridOperator,
    residual: impl Fn(&VectorField, &mut VectorField),
    preconditioner: &dyn Preconditioner,
    free: &FreeModes,
    scale: f64,
    u: &mut VectorField,
    (stopping, look): (&Stopping, Look),
) -> GridSolverReport {
    let n = u.len();
    let mut r = VectorField::zeros(n);
    let (mut z, mut z_last, mut p) = (VectorField::zeros(n), VectorField::zeros(n), VectorField::zeros(n));
    let mut report = GridSolverReport { iterations: 0, applications: 1, residual: 0.0, ending: Ending::Converged };
    let balance = |u: &VectorField, r: &mut VectorField| {
        residual(u, r);
        free.project(r);
    };
    balance(u, &mut r);
    let mut watch = ResidualWatch::new(stopping, look, scale, PATIENCE);
    let mut rz_last = 0.0;
    loop {
        if watch.ends(&r, &mut report) {
            return report;
        }
        std::mem::swap(&mut z, &mut z_last);
        report.applications += preconditioner.apply(operator, &r, &mut z);
        free.project(&mut z);
        let rz = dot(&r, &z);
        let beta = if rz_last > 0.0 { ((rz - dot(&r, &z_last)) / rz_last).max(0.0) } else { 0.0 };
        scale_add(&mut p, beta, &z);
        let mut slope = dot(&r, &p);
        if slope <= 0.0 {
            p.clone_from(&z);
            slope = rz;
        }
        rz_last = rz;
        let (first, mut step) = (slope, 1.0);
        for _ in 0..SECANTS {
            add_scaled(u, step, &p);
            balance(u, &mut r);
            report.applications += 1;
            let next = dot(&r, &p);
            if next.abs() <= SEARCHED * first || !next.is_finite() {
                break;
            }
            // The secant through the last two points; where the curvature is not positive, a step as long again.
            let fall = slope - next;
            step = if fall > 0.0 { step * next / fall } else { step.abs() };
            slope = next;
        }
        report.iterations += 1;
    }
}
