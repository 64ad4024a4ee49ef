//! Equilibrium of forces that are not linear in the displacements: Newton's method, its steps by preconditioned conjugate
//! gradients.

use super::conjugate_gradients::{Ending, GridSolverReport};
use super::free_modes::FreeModes;
use super::preconditioner::Preconditioner;
use super::vectors::{add_scaled, dot, norm, scale_add};
use super::watch::ResidualWatch;
use crate::operator::{GridOperator, VectorField};
use crate::solver::{Look, Stopping};

/// Newton steps without a new least residual after which a solve has stagnated.
const PATIENCE: usize = 30;

/// Secant steps along a direction.
const SECANTS: usize = 6;

/// A step is long enough where the residual along it has fallen to this share.
const SEARCHED: f64 = 0.5;

/// The residual of a Newton step's linear system, relative: at most and at least (Eisenstat and Walker 1996, choice 2, with
/// γ = 0.9 and exponent 2).
const INNER: [f64; 2] = [0.1, 1e-3];

/// Iterations of a Newton step at most.
const MOST_INNER: usize = 300;

/// The largest displacement of the difference that stands for a derivative, relative to the grid's spacing. What is neglected
/// is of that order, far below [`INNER`]; rounding is some 10⁻⁹ of it.
const DIFFERENCE: f64 = 1e-6;

/// Find u with residual(u) = 0, from the given u; the preconditioner is that of the linearised body.
///
/// The tangent acts on a direction as the difference of residuals along it does, so it is that of the forces whatever they
/// are. Steps are as long as the secant of the residual along them says, the whole step first; where the tangent is not
/// positive along a direction, as beyond a bifurcation, the step is what was found before.
pub(super) fn newton(
    operator: &dyn GridOperator,
    residual: impl Fn(&VectorField, &mut VectorField),
    preconditioner: &dyn Preconditioner,
    free: &FreeModes,
    scale: f64,
    u: &mut VectorField,
    (stopping, look): (&Stopping, Look),
) -> GridSolverReport {
    let n = u.len();
    let (mut r, mut p) = (VectorField::zeros(n), VectorField::zeros(n));
    let mut report = GridSolverReport { iterations: 0, applications: 1, residual: 0.0, ending: Ending::Converged };
    let balance = |u: &VectorField, r: &mut VectorField| {
        residual(u, r);
        free.project(r);
    };
    let body = Body { operator, preconditioner, free, balance: &balance, look };
    balance(u, &mut r);
    let mut watch = ResidualWatch::new(stopping, look, scale, PATIENCE);
    let mut last = f64::INFINITY;
    while !watch.ends(&r, &mut report) {
        let size = norm(&r);
        let falls = 0.9 * (size / last).powi(2);
        // No closer than the tolerance asks for.
        let enough = 0.5 * stopping.tolerance * scale / size;
        let inner = falls.max(enough).clamp(INNER[1], INNER[0]);
        last = size;
        body.step(u, &r, inner, &mut p, &mut report);
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

/// What Newton steps are of.
struct Body<'a, B> {
    operator: &'a dyn GridOperator,
    preconditioner: &'a dyn Preconditioner,
    free: &'a FreeModes,
    balance: &'a B,
    look: Look<'a>,
}

impl<B: Fn(&VectorField, &mut VectorField)> Body<'_, B> {
    /// A step p with ‖r − K p‖ ≤ `inner` ‖r‖, K the tangent at u, where the residual is r; or a shorter one that descends.
    fn step(&self, u: &VectorField, r: &VectorField, inner: f64, p: &mut VectorField, report: &mut GridSolverReport) {
        let n = u.len();
        let (mut rest, mut moved) = (r.clone(), u.clone());
        let (mut z, mut d, mut q) = (VectorField::zeros(n), VectorField::zeros(n), VectorField::zeros(n));
        *p = VectorField::zeros(n);
        let enough = inner * norm(r);
        let mut rz_last = 0.0;
        for iteration in 0..MOST_INNER {
            if !(self.look)(report.iterations, report.residual) {
                return;
            }
            report.applications += self.preconditioner.apply(self.operator, &rest, &mut z);
            self.free.project(&mut z);
            let rz = dot(&rest, &z);
            scale_add(&mut d, if rz_last > 0.0 { rz / rz_last } else { 0.0 }, &z);
            rz_last = rz;
            let largest = d.components.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
            let length = DIFFERENCE * self.operator.body().grid.spacing / largest;
            moved.clone_from(u);
            add_scaled(&mut moved, length, &d);
            (self.balance)(&moved, &mut q);
            report.applications += 1;
            report.iterations += 1;
            // q = K d.
            for (q, r) in q.components.iter_mut().zip(&r.components) {
                q.iter_mut().zip(r).for_each(|(q, r)| *q = (r - *q) / length);
            }
            let curvature = dot(&d, &q);
            if curvature.is_nan() || curvature <= 0.0 {
                if iteration == 0 {
                    p.clone_from(&d);
                }
                return;
            }
            add_scaled(p, rz / curvature, &d);
            add_scaled(&mut rest, -rz / curvature, &q);
            if norm(&rest) <= enough {
                return;
            }
        }
    }
}
