//! Equilibrium of linear bonds on a grid by conjugate gradients.

use super::free_modes::FreeModes;
use super::supports::Supports;
use super::vectors::{Vectors, add_scaled, negate, norm};
use crate::operator::{GridOperator, VectorField};
use crate::solver::{LinearOperator, Look, Preconditioner, Progress, SolverReport, Stopping, System, TrueResidual};

/// Iterations without a new least residual after which a solve has stagnated.
const PATIENCE: usize = 500;

/// K of a body over the components that nothing holds: on prescribed components K u is zero.
#[derive(Clone, Copy)]
pub struct FreePart<'a> {
    /// The body's bonds.
    pub operator: &'a dyn GridOperator,
    /// What holds it.
    pub supports: &'a Supports,
}

impl LinearOperator<VectorField> for FreePart<'_> {
    fn apply(&self, u: &VectorField, f: &mut VectorField) {
        self.operator.forces(u, f);
        negate(f);
        self.supports.clear(f);
    }
}

/// A preconditioner whose steps have nothing of the free modes; its own applications are of the linear body.
pub(super) struct Projected<'a> {
    pub preconditioner: &'a dyn Preconditioner<VectorField>,
    pub body: FreePart<'a>,
    pub free: &'a FreeModes,
}

impl Preconditioner<VectorField> for Projected<'_> {
    fn apply(&self, _: &dyn LinearOperator<VectorField>, r: &VectorField, z: &mut VectorField) -> usize {
        let applications = self.preconditioner.apply(&self.body, r, z);
        self.free.project(z);
        applications
    }
}

/// Solve K u = f (N) for the free components of u (m), from the given u; prescribed components are imposed on it.
///
/// The residual is relative to ‖f − K u⁰‖ over the free components, u⁰ being zero but for what is prescribed. Loads
/// and steps are kept orthogonal to the free modes.
pub(super) fn solve(
    preconditioner: &Projected,
    load: &VectorField,
    u: &mut VectorField,
    seen: (&Stopping, Look),
) -> SolverReport {
    let &Projected { body, free, .. } = preconditioner;
    let FreePart { operator, supports } = body;
    let n = load.len();
    let mut r = VectorField::zeros(n);
    let scale = reference(body, load, free, &mut r);
    let mut report = SolverReport::begun(1);
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
    let space = Vectors(n);
    let mut rule = TrueResidual { space: &space, residual, progress: Progress::new(seen, scale, PATIENCE) };
    System { space: &space, operator: &body, preconditioner }.solve(&mut rule, u, &mut r, &mut report);
    report
}

/// ‖f − K u⁰‖ over free components; `r` is scratch.
pub(super) fn reference(body: FreePart, load: &VectorField, free: &FreeModes, r: &mut VectorField) -> f64 {
    let FreePart { operator, supports } = body;
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
