//! Preconditioned conjugate gradients on a grid.

use serde::{Deserialize, Serialize};

use super::free_modes::FreeModes;
use super::preconditioner::Preconditioner;
use super::supports::Supports;
use super::vectors::{add_scaled, dot, norm, scale_add};
use crate::operator::{GridOperator, VectorField};
use crate::solver::{Look, Stopping};

/// Iterations without a new least residual after which a solve has stagnated.
const PATIENCE: usize = 500;

/// How an equilibrium solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Ending {
    /// The residual met the tolerance.
    Converged,
    /// The most iterations were done.
    MostIterations,
    /// A direction p with p·Kp ≤ 0: the body is unstable, or a mechanism.
    NegativeCurvature {
        /// p·Kp (J).
        curvature: f64,
    },
    /// A number that is none.
    NotFinite {
        /// The first node with such a residual.
        node: usize,
    },
    /// Many iterations without a smaller residual.
    Stagnated,
    /// Whoever saw the solve ended it.
    Stopped,
}

/// How a solve went.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridSolverReport {
    /// Iterations.
    pub iterations: usize,
    /// Applications of the operator, those of the preconditioner included.
    pub applications: usize,
    /// ‖f − K u‖ over the free components, computed anew at the end, relative to the load's.
    pub residual: f64,
    /// How it ended.
    pub ending: Ending,
}

impl GridSolverReport {
    /// Whether the residual met the tolerance.
    pub fn converged(&self) -> bool {
        self.ending == Ending::Converged
    }
}

/// Solve K u = f (N) for the free components of u (m), from the given u; prescribed components are imposed on it.
///
/// The residual is relative to ‖f − K u⁰‖ over the free components, u⁰ being zero but for what is prescribed. Loads
/// and steps are kept orthogonal to the free modes.
pub(super) fn conjugate_gradients(
    operator: &dyn GridOperator,
    load: &VectorField,
    supports: &Supports,
    free: &FreeModes,
    preconditioner: &dyn Preconditioner,
    u: &mut VectorField,
    (stopping, look): (&Stopping, Look),
) -> GridSolverReport {
    let n = load.len();
    let mut r = VectorField::zeros(n);
    let scale = reference(operator, load, supports, free, &mut r);
    let mut report = GridSolverReport { iterations: 0, applications: 1, residual: 0.0, ending: Ending::Converged };
    supports.impose(u);
    if scale == 0.0 {
        *u = VectorField::zeros(n);
        supports.impose(u);
        return report;
    }
    let residual = |u: &VectorField, r: &mut VectorField| {
        operator.forces(u, r);
        add_scaled(r, 1.0, load);
        supports.clear(r);
        free.project(r);
    };
    residual(u, &mut r);
    report.applications += 1;
    let (mut z, mut p, mut q) = (VectorField::zeros(n), VectorField::zeros(n), VectorField::zeros(n));
    let (mut rz_last, mut least, mut since) = (0.0, f64::INFINITY, 0);
    loop {
        report.residual = norm(&r) / scale;
        if let Some(ending) = ended(&r, report.residual, report.iterations, stopping) {
            // The residual of the recurrence drifts; only the true one counts.
            residual(u, &mut r);
            report.applications += 1;
            report.residual = norm(&r) / scale;
            report.ending = ending;
            if ending != Ending::Converged || report.residual <= stopping.tolerance || since > PATIENCE {
                return report;
            }
            rz_last = 0.0;
        }
        if report.residual < 0.999 * least {
            (least, since) = (report.residual, 0);
        } else {
            since += 1;
            if since > PATIENCE {
                report.ending = Ending::Stagnated;
                return report;
            }
        }
        if !look(report.iterations, report.residual) {
            report.ending = Ending::Stopped;
            return report;
        }
        report.applications += preconditioner.apply(operator, &r, &mut z);
        free.project(&mut z);
        let rz = dot(&r, &z);
        scale_add(&mut p, if rz_last > 0.0 { rz / rz_last } else { 0.0 }, &z);
        rz_last = rz;
        operator.forces(&p, &mut q);
        supports.clear(&mut q);
        report.applications += 1;
        let curvature = -dot(&p, &q);
        if curvature.is_finite() && curvature <= 0.0 {
            report.ending = Ending::NegativeCurvature { curvature };
            return report;
        }
        let alpha = rz / curvature;
        add_scaled(u, alpha, &p);
        add_scaled(&mut r, alpha, &q);
        report.iterations += 1;
    }
}

/// ‖f − K u⁰‖ over free components; `r` is scratch.
pub(super) fn reference(
    operator: &dyn GridOperator,
    load: &VectorField,
    supports: &Supports,
    free: &FreeModes,
    r: &mut VectorField,
) -> f64 {
    if supports.at_rest() {
        r.clone_from(load);
    } else {
        let mut lifted = VectorField::zeros(load.len());
        supports.impose(&mut lifted);
        operator.forces(&lifted, r);
        add_scaled(r, 1.0, load);
    }
    supports.clear(r);
    free.project(r);
    norm(r)
}

/// Why to stop, if so.
pub(super) fn ended(r: &VectorField, residual: f64, iterations: usize, stopping: &Stopping) -> Option<Ending> {
    if !residual.is_finite() {
        let bad = (0..r.len()).find(|n| !r.at(*n).iter().all(|x| x.is_finite())).unwrap_or(0);
        return Some(Ending::NotFinite { node: bad });
    }
    if residual <= stopping.tolerance {
        return Some(Ending::Converged);
    }
    (iterations >= stopping.most_iterations).then_some(Ending::MostIterations)
}
