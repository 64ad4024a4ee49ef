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

/// Bring a body through load factors 1/n, 2/n, … 1. At each, solve for equilibrium, break what is overstretched, and
/// solve again until nothing breaks. `solve(body, factor, start)` gives u (m); `observe(body, step, u)` sees every
/// finished step and ends the loading early by returning `false`.
///
/// Returns the last displacements and all steps. A solve that does not converge ends the loading, with the step as its
/// evidence: nothing is broken by displacements that are no equilibrium.
///
/// # Errors
/// No steps, or what `solve` reports: a part broken loose under load, for one.
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
        let (mut equilibria, mut broken) = (0, 0);
        let report = loop {
            let (next, report) = solve(body, factor, u).map_err(|e| e.at(format!("load step {number} of {steps}")))?;
            u = next;
            equilibria += 1;
            let breaking = if report.converged() { body.break_overstretched(&u) } else { 0 };
            broken += breaking;
            if breaking == 0 {
                break report;
            }
        };
        let step = LoadStep { factor, equilibria, broken, report };
        done.push(step);
        if !observe(body, &step, &u) || !report.converged() {
            break;
        }
    }
    Ok((u, done))
}
