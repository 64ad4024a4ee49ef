//! Equilibrium under loads that grow, bonds breaking on the way.

use std::sync::Arc;

use serde::Serialize;

use super::loading::Loading;
use crate::experiment::problem::Problem;
use crate::operator::grid::{Broken, GridBonds};
use crate::operator::{Kinematics, VectorField};
use crate::solver::Stopping;
use crate::solver::grid::{Equilibrium, GridSolverReport, Method, Prepared, Supports};
use crate::{Error, Result};

/// Equilibria of one load step at most; a body that still breaks then comes apart.
const MOST_EQUILIBRIA: usize = 10_000;

/// Iterations relative to those of the first solve with a preconditioner, above which it is set up anew.
const POOR: f64 = 1.5;

/// How a load step ended.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct StaticEvidence {
    /// Equilibria solved until no bond broke.
    pub equilibria: usize,
    /// Bonds broken in the step.
    pub broken: u64,
    /// The last solve.
    pub report: GridSolverReport,
}

/// What one load step came to.
pub(super) struct Step {
    pub(super) displacement: VectorField,
    pub(super) evidence: StaticEvidence,
    pub(super) broken: Broken,
}

/// How equilibrium is found.
pub(super) struct Statics {
    pub(super) stopping: Stopping,
    pub(super) method: Method,
}

impl Statics {
    /// Equilibrium at a moment (time or load factor), from a start; what is overstretched breaks, and equilibrium is
    /// found again, until nothing breaks.
    ///
    /// # Errors
    /// Loads on a body that nothing holds; a solve that does not converge.
    pub(super) fn settle(
        &self,
        problem: &Problem,
        loading: &Loading,
        bonds: &mut GridBonds<f64>,
        start: VectorField,
        at: f64,
    ) -> Result<Step> {
        let factors = loading.at(at);
        let nodes = problem.body.grid.len();
        let load = loading.force_field(nodes, &factors);
        let supports = Supports::new(&problem.body, loading.displacements(&factors))?;
        let (mut u, mut broken, mut equilibria) = (start, Broken::default(), 0);
        // Set up anew for every load step, so that a run that is gone on with does the same, and where the bonds that broke
        // since have made it poor.
        let mut prepared = Arc::new(Prepared::new(&*bonds, &supports, self.method));
        let mut first = None;
        loop {
            let report = {
                let equilibrium = Equilibrium::prepared(&*bonds, &supports, prepared.clone());
                let (next, report) = match problem.kinematics {
                    Kinematics::Linear => equilibrium.solve(&load, u, &self.stopping)?,
                    Kinematics::Finite => {
                        let forces = |u: &VectorField, f: &mut VectorField| bonds.finite_forces(u, f);
                        equilibrium.solve_nonlinear(&forces, &load, u, &self.stopping)?
                    }
                };
                u = next;
                report
            };
            equilibria += 1;
            if !report.converged() {
                return Err(Error::input(
                    format!("equilibrium was not found: {:?} after {} iterations", report.ending, report.iterations),
                    "use more load steps, a looser tolerance, or more supports",
                ));
            }
            let now = bonds.break_overstretched(&u, problem.kinematics);
            let usual = *first.get_or_insert(report.iterations);
            if now.count > 0 && report.iterations as f64 > POOR * usual as f64 {
                prepared = Arc::new(Prepared::new(&*bonds, &supports, self.method));
                first = None;
            }
            broken = Broken { count: broken.count + now.count, energy: broken.energy + now.energy };
            if now.count == 0 {
                let evidence = StaticEvidence { equilibria, broken: broken.count as u64, report };
                return Ok(Step { displacement: u, evidence, broken });
            }
            if equilibria == MOST_EQUILIBRIA {
                return Err(Error::input(
                    format!("bonds still break after {MOST_EQUILIBRIA} equilibria of one load step"),
                    "the body comes apart: follow it in motion instead",
                ));
            }
        }
    }
}
