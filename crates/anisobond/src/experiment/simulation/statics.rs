//! Equilibrium under loads that grow, bonds failing on the way.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::loading::Loading;
use crate::experiment::problem::Problem;
use crate::operator::grid::{FailingBonds, Failure};
use crate::operator::{Kinematics, VectorField};
use crate::solver::Stopping;
use crate::solver::grid::{Equilibrium, FreeModes, GridSolverReport, Method, Prepared, Settled, Supports, settle};
use crate::{Error, Result};

/// Iterations relative to those of the first solve with a preconditioner, above which it is set up anew.
const POOR: f64 = 1.5;

/// Softening bonds are followed until no secant, relative to the undamaged one, would fall by more.
const SETTLED: f64 = 1e-4;

/// How a load step ended.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct StaticEvidence {
    /// Equilibria solved until no bond failed.
    pub equilibria: usize,
    /// Bonds broken in the step.
    pub broken: u64,
    /// The last solve.
    pub report: GridSolverReport,
}

/// What one load step came to.
pub(super) struct Step {
    pub(super) displacement: VectorField,
    /// Forces of the bonds there (N).
    pub(super) forces: VectorField,
    pub(super) evidence: StaticEvidence,
    pub(super) failure: Failure,
    pub(super) account: Account,
}

/// Energies (J) that a load step moved.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Account {
    /// Work of loads and supports.
    pub(super) external: f64,
    /// Set free where bonds failed and the body came to a new equilibrium under loads and supports at rest. In motion it would
    /// go into waves.
    pub(super) released: f64,
}

/// How equilibrium is found.
pub(super) struct Statics {
    pub(super) stopping: Stopping,
    pub(super) method: Method,
}

/// Loads (N) and prescribed displacements at a moment.
struct Loads {
    before: VectorField,
    now: VectorField,
    held: Vec<(u32, [Option<f64>; 3])>,
}

impl Statics {
    /// Refuses loads of load steps that do work on motions that nothing holds, before anything is solved.
    ///
    /// # Errors
    /// Names the part of the body, its free motions and the remedy.
    pub(super) fn require_balanced(
        problem: &Problem,
        loading: &Loading,
        bonds: &FailingBonds,
        steps: usize,
    ) -> Result<()> {
        let factors = |step: usize| loading.at(step as f64 / steps as f64);
        let free = FreeModes::new(bonds, &Supports::new(&problem.body, loading.displacements(&factors(steps)))?);
        if free.none() {
            return Ok(());
        }
        let nodes = problem.body.grid.len();
        (1..=steps).try_for_each(|step| free.require_balanced(bonds, &loading.force_field(nodes, &factors(step))))
    }

    /// Equilibrium at a moment (time or load factor), from a start, which is the equilibrium at the moment `before` or, if that
    /// is `None`, a body that nothing has loaded yet; what is overstretched fails, and equilibrium is found again, until nothing
    /// fails.
    ///
    /// # Errors
    /// Loads on a body that nothing holds; a solve that does not converge.
    pub(super) fn settle(
        &self,
        problem: &Problem,
        loading: &Loading,
        bonds: &mut FailingBonds,
        start: VectorField,
        (before, at): (Option<f64>, f64),
    ) -> Result<Step> {
        let nodes = problem.body.grid.len();
        let factors = loading.at(at);
        let load_before =
            before.map_or(VectorField::zeros(nodes), |before| loading.force_field(nodes, &loading.at(before)));
        let mut loads = Loads {
            before: load_before,
            now: loading.force_field(nodes, &factors),
            held: loading.displacements(&factors),
        };
        let supports = Supports::new(&problem.body, loads.held.clone())?;
        // Set up anew for every load step, so that a run that is gone on with does the same, and where the bonds that broke
        // since have made it poor.
        let mut prepared = None;
        let mut usual = 0;
        let (mut account, mut failure) = (Account::default(), Failure::default());
        let mut forces = VectorField::default();
        let solve = |bonds: &FailingBonds, start: VectorField| {
            let ready = prepared.get_or_insert_with(|| Arc::new(Prepared::new(bonds, &supports, self.method)));
            let equilibrium = Equilibrium::prepared(bonds, &supports, ready.clone());
            let from = start.clone();
            let (u, report) = match problem.kinematics {
                Kinematics::Linear => equilibrium.solve(&loads.now, start, &self.stopping)?,
                Kinematics::Finite => {
                    let forces = |u: &VectorField, f: &mut VectorField| bonds.forces_of(u, Kinematics::Finite, f);
                    equilibrium.solve_nonlinear(&forces, &loads.now, start, &self.stopping)?
                }
            };
            if !report.converged() {
                return Err(Error::input(
                    format!("equilibrium was not found: {:?} after {} iterations", report.ending, report.iterations),
                    "use more load steps, a looser tolerance, or more supports",
                ));
            }
            let first = usual == 0;
            forces = account.add(bonds, problem.kinematics, &loads, [&from, &u], first);
            // From now on loads rest.
            if first {
                loads.before.clone_from(&loads.now);
                usual = report.iterations.max(1);
            } else if report.iterations as f64 > POOR * usual as f64 {
                prepared = None;
            }
            Ok((u, report))
        };
        let fail = |bonds: &mut FailingBonds, u: &VectorField| {
            let now = bonds.fail(u, problem.kinematics, SETTLED);
            failure += now;
            now.changed
        };
        let (displacement, Settled { equilibria, report, .. }) = settle(bonds, start, solve, fail)?;
        let evidence = StaticEvidence { equilibria, broken: failure.broken as u64, report };
        Ok(Step { displacement, forces, evidence, failure, account })
    }
}

impl Account {
    /// Energies on the way from one state to another between which no bond fails: mean forces times the way, exact for linear
    /// bonds. In the first of a load step loads and supports move, and bonds hold what they do; later they rest. Returns the
    /// bonds' forces (N) in the second state.
    fn add(
        &mut self,
        bonds: &FailingBonds,
        kinematics: Kinematics,
        loads: &Loads,
        [from, to]: [&VectorField; 2],
        first: bool,
    ) -> VectorField {
        let forces_at = |u: &VectorField| {
            let mut f = VectorField::zeros(u.len());
            bonds.forces_of(u, kinematics, &mut f);
            f
        };
        let (f, g) = (forces_at(from), forces_at(to));
        let way = |node: usize| to.at(node) - from.at(node);
        let load = |node: usize| 0.5 * (loads.before.at(node) + loads.now.at(node));
        let balance = |node: usize| load(node) + 0.5 * (f.at(node) + g.at(node));
        let mut unbalanced: f64 = (0..to.len()).map(|node| balance(node).dot(&way(node))).sum();
        self.external += (0..to.len()).map(|node| load(node).dot(&way(node))).sum::<f64>();
        for (node, value) in &loads.held {
            let node = *node as usize;
            for axis in (0..3).filter(|&a| value[a].is_some()) {
                // The support's force is what bonds and loads lack.
                let work = balance(node)[axis] * way(node)[axis];
                self.external -= work;
                unbalanced -= work;
            }
        }
        if !first {
            self.released += unbalanced;
        }
        g
    }
}
