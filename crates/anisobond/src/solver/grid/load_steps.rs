//! Loads that grow step by step while bonds break.

use serde::Serialize;

use super::conjugate_gradients::GridSolverReport;
use crate::operator::{GridOperator, VectorField};
use crate::{Error, Result};

/// A body whose bonds break.
pub trait Breaking: GridOperator {
    /// Break every bond that a displacement u (m) stretches too far; how many bonds broke.
    fn break_overstretched(&mut self, u: &VectorField) -> usize;
}

/// One load step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoadStep {
    /// Load factor, 0 … 1.
    pub factor: f64,
    /// Equilibria that were solved until no bond broke.
    pub equilibria: usize,
    /// Bonds broken in the step.
    pub broken: usize,
    /// The last solve.
    pub report: GridSolverReport,
}

/// Equilibria of one load step at most; a body that still breaks then comes apart.
const MOST_EQUILIBRIA: usize = 10_000;

/// How a body came to rest under its loads, or did not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Settled {
    /// Equilibria that were solved until nothing failed.
    pub equilibria: usize,
    /// Bonds that failed.
    pub broken: usize,
    /// The last solve; `None` where there was none.
    pub report: Option<GridSolverReport>,
    /// Why it ended.
    pub ended: SettlingEnd,
}

/// Why a body's settling ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum SettlingEnd {
    /// Nothing fails any more.
    AtRest,
    /// The last solve did not converge.
    NotConverged,
    /// The loads move something that nothing holds.
    Unheld,
    /// Bonds still failed after the most equilibria that are looked for.
    StillFailing,
}

/// Equilibrium of a body whose bonds fail: `solve(body, start)` gives u (m), or `None` where the loads move something that nothing
/// holds; `fail(body, u)` lets fail what u stretches too far and returns how many bonds that is; both again until nothing fails.
/// A solve that does not converge ends it, with the report as its evidence: nothing fails by displacements that are no
/// equilibrium. Returned are the last displacements, and how it ended.
///
/// # Errors
/// What `solve` reports.
pub fn settle<B>(
    body: &mut B,
    start: VectorField,
    mut solve: impl FnMut(&B, &VectorField) -> Result<Option<(VectorField, GridSolverReport)>>,
    mut fail: impl FnMut(&mut B, &VectorField) -> usize,
) -> Result<(VectorField, Settled)> {
    let mut u = start;
    let mut settled = Settled { equilibria: 0, broken: 0, report: None, ended: SettlingEnd::StillFailing };
    while settled.equilibria < MOST_EQUILIBRIA {
        let Some((next, report)) = solve(body, &u)? else {
            return Ok((u, Settled { ended: SettlingEnd::Unheld, ..settled }));
        };
        u = next;
        settled.equilibria += 1;
        settled.report = Some(report);
        if !report.converged() {
            return Ok((u, Settled { ended: SettlingEnd::NotConverged, ..settled }));
        }
        let failed = fail(body, &u);
        settled.broken += failed;
        if failed == 0 {
            return Ok((u, Settled { ended: SettlingEnd::AtRest, ..settled }));
        }
    }
    Ok((u, settled))
}

/// Bring a body through load factors 1/n, 2/n, … 1, each [settled](settle). `solve(body, factor, start)` gives u (m); `observe(body, step, u)` sees every
/// finished step and ends the loading early by returning `false`.
///
/// Returns the last displacements and all steps. A solve that does not converge ends the loading, with the step as its
/// evidence: nothing is broken by displacements that are no equilibrium.
///
/// # Errors
/// No steps; bonds that break without end; what `solve` reports: a part broken loose under load, for one.
pub fn load_steps<B: Breaking>(
    body: &mut B,
    steps: usize,
    mut solve: impl FnMut(&B, f64, VectorField) -> Result<(VectorField, GridSolverReport)>,
    mut observe: impl FnMut(&B, &LoadStep, &VectorField) -> bool,
) -> Result<(VectorField, Vec<LoadStep>)> {
    if steps == 0 {
        return Err(Error::input("equilibrium in 0 load steps", "give at least 1 step"));
    }
    let mut u = VectorField::zeros(body.body().grid.len());
    let mut done = Vec::new();
    for number in 1..=steps {
        let factor = number as f64 / steps as f64;
        let place = |e: Error| e.at(format!("load step {number} of {steps}"));
        let solve = |body: &B, start: &VectorField| solve(body, factor, start.clone()).map(Some);
        let (next, settled) = settle(body, u, solve, |body, u| body.break_overstretched(u)).map_err(place)?;
        u = next;
        let Settled { equilibria, broken, report: Some(report), ended } = settled else { break };
        if ended == SettlingEnd::StillFailing {
            return Err(place(Error::not_converged(
                format!("bonds still break after {MOST_EQUILIBRIA} equilibria of one load step"),
                "the body comes apart: follow it in motion instead",
            )));
        }
        let step = LoadStep { factor, equilibria, broken, report };
        done.push(step);
        if !observe(body, &step, &u) || !report.converged() {
            break;
        }
    }
    Ok((u, done))
}
