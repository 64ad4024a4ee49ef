//! Equilibrium of forces that are not linear in the displacements: Newton's method, its steps by preconditioned conjugate
//! gradients.

use super::linear::Projected;
use super::tangent::{Inner, Tangent};
use super::vectors::{Vectors, add_scaled, dot, norm};
use crate::operator::VectorField;
use crate::solver::{Look, Progress, SolverReport, Stopping, System};

/// Newton steps without a new least residual after which a solve has stagnated.
const PATIENCE: usize = 30;

/// Secant steps along a direction.
const SECANTS: usize = 6;

/// A step is long enough where the residual along it has fallen to this share.
const SEARCHED: f64 = 0.5;

/// The residual of a Newton step's linear system, relative: at most and at least (Eisenstat and Walker 1996, choice 2, with
/// γ = 0.9 and exponent 2).
const INNER: [f64; 2] = [0.1, 1e-3];

/// Find u with residual(u) = 0, from the given u; the preconditioner is that of the linearised body.
///
/// The tangent acts on a direction as the difference of residuals along it does, so it is that of the forces whatever they
/// are. Steps are as long as the secant of the residual along them says, the whole step first; where the tangent is not
/// positive along a direction, as beyond a bifurcation, the step is what was found before.
pub(super) fn newton(
    residual: impl Fn(&VectorField, &mut VectorField),
    preconditioner: &Projected,
    scale: f64,
    u: &mut VectorField,
    (stopping, look): (&Stopping, Look),
) -> SolverReport {
    let n = u.len();
    let mut r = VectorField::zeros(n);
    let mut report = SolverReport::begun(1);
    let balance = |u: &VectorField, r: &mut VectorField| {
        residual(u, r);
        preconditioner.free.project(r);
    };
    let space = Vectors(n);
    let spacing = preconditioner.body.operator.body().grid.spacing;
    balance(u, &mut r);
    let mut progress = Progress::new((stopping, look), scale, PATIENCE);
    let mut last = f64::INFINITY;
    while !progress.ends(&space, &r, &mut report) {
        let size = norm(&r);
        let falls = 0.9 * (size / last).powi(2);
        // No closer than the tolerance asks for.
        let enough = 0.5 * stopping.tolerance * scale / size;
        let inner = falls.max(enough).clamp(INNER[1], INNER[0]);
        last = size;
        let mut p = VectorField::zeros(n);
        let tangent = Tangent::new(&balance, u, &r, spacing);
        let mut rule = Inner { look, enough: inner * size, done: 0 };
        let mut rest = r.clone();
        System { space: &space, operator: &tangent, preconditioner }.solve(&mut rule, &mut p, &mut rest, &mut report);
        // A direction along which the tangent is not positive is an iteration, too.
        report.iterations += usize::from(report.negative_curvature());
        let (mut slope, mut step) = (dot(&r, &p), 1.0);
        let first = slope;
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
    }
    report
}
