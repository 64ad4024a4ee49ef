//! Equilibrium under loads that grow, bonds failing on the way.

use std::cell::Cell;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::loading::Loading;
use crate::experiment::outcome::{Collapse, StepLook, WithinStep};
use crate::experiment::problem::Problem;
use crate::operator::grid::{FailingBonds, Failure};
use crate::operator::{Kinematics, VectorField};
use crate::solver::grid::{Equilibrium, FreeModes, Method, Prepared, Supports};
use crate::solver::{Ending, Settled, SettlingEnd, SolverReport, Stopping, settle};
use crate::{Error, Result};

/// Iterations relative to those of the first solve with a preconditioner, above which it is set up anew.
const POOR: f64 = 1.5;

/// Bonds are followed until no secant, relative to the undamaged one, would fall by more, and no permanent elongation, relative to
/// that of the onset, would change by more.
pub(in crate::experiment) const SETTLED: f64 = 1e-4;

/// A body whose loads do so many times the work of the last equilibrium, and have not come to rest, carries them no more.
const YIELDS: f64 = 100.0;

/// How a load step ended.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct StaticEvidence {
    /// Equilibria solved until no bond failed.
    pub equilibria: usize,
    /// Bonds broken in the step.
    pub broken: u64,
    /// The last solve.
    pub report: SolverReport,
}

/// When equilibrium is to be found: times, or load factors.
#[derive(Clone, Copy)]
pub(super) struct Moment {
    /// That of the equilibrium before; `None` where nothing has loaded the body yet.
    pub(super) before: Option<f64>,
    pub(super) at: f64,
    /// Whether bonds failed before.
    pub(super) lost: bool,
}

/// What one load step came to.
pub(super) struct Step {
    /// Of the last solve.
    pub(super) displacement: VectorField,
    /// Forces of the bonds there (N).
    pub(super) forces: VectorField,
    /// The equilibrium; `None` where the body broke.
    pub(super) evidence: Option<StaticEvidence>,
    pub(super) failure: Failure,
    pub(super) account: Account,
    /// How the body broke, what moves, and after how many equilibria.
    pub(super) broke: Option<(Collapse, String, usize)>,
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
    /// fails or the body, which has `lost` bonds before, carries no more.
    ///
    /// # Errors
    /// Loads on a body that nothing holds and that no bond has failed of; a solve that does not converge; interruption. Bonds that
    /// failed until then are left broken.
    pub(super) fn settle(
        &self,
        problem: &Problem,
        loading: &Loading,
        bonds: &mut FailingBonds,
        start: VectorField,
        Moment { before, at, lost }: Moment,
        look: StepLook,
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
        // What the loads do at an equilibrium, and what moves where nothing holds it.
        let (mut work, mut unheld) = (work_of(&loads.before, &start), None);
        let within = Cell::new(WithinStep::default());
        let mut forces = VectorField::default();
        let solve = |bonds: &FailingBonds, from: &VectorField| {
            let ready = prepared.get_or_insert_with(|| Arc::new(Prepared::new(bonds, &supports, self.method)));
            let seen = |iterations, residual| look(&WithinStep { iterations, residual, ..within.get() });
            let equilibrium = Equilibrium::prepared(bonds, &supports, ready.clone()).seen_by(&seen);
            if let Err(why) = equilibrium.free_modes().require_balanced(bonds, &loads.now) {
                unheld = Some(why);
                return Ok(None);
            }
            let solved = |equilibrium: &Equilibrium| match problem.kinematics {
                _ if bonds.yields() => {
                    let forces = |u: &VectorField, f: &mut VectorField| bonds.coming_forces(u, problem.kinematics, f);
                    equilibrium.solve_nonlinear(&forces, &loads.now, from.clone(), &self.stopping)
                }
                Kinematics::Linear => equilibrium.solve(&loads.now, from.clone(), &self.stopping),
                Kinematics::Finite => {
                    let forces = |u: &VectorField, f: &mut VectorField| bonds.forces_of(u, Kinematics::Finite, f);
                    equilibrium.solve_nonlinear(&forces, &loads.now, from.clone(), &self.stopping)
                }
            };
            let (mut u, mut report) = solved(&equilibrium)?;
            if !report.converged() && report.ending != Ending::Stopped && within.get().broken > 0 {
                // What was set up before bonds broke may not suit what is left.
                let anew = Arc::new(Prepared::new(bonds, &supports, self.method));
                (u, report) = solved(&Equilibrium::prepared(bonds, &supports, anew.clone()).seen_by(&seen))?;
                prepared = Some(anew);
            }
            if !report.converged() {
                return Ok(Some((u, report)));
            }
            let first = usual == 0;
            forces = account.add(bonds, problem.kinematics, &loads, [from, &u], first);
            work = work.max(work_of(&loads.now, &u));
            // From now on loads rest.
            if first {
                loads.before.clone_from(&loads.now);
                usual = report.iterations.max(1);
            } else if report.iterations as f64 > POOR * usual as f64 {
                prepared = None;
            }
            Ok(Some((u, report)))
        };
        let fail = |bonds: &mut FailingBonds, from: &VectorField, u: &VectorField| {
            let now = bonds.fail(u, from, problem.kinematics, SETTLED);
            failure += now;
            let WithinStep { equilibria, broken, .. } = within.get();
            let next = (equilibria + 1, broken + now.broken as u64);
            within.set(WithinStep { equilibria: next.0, broken: next.1, ..WithinStep::default() });
            Ok(now.changed)
        };
        let (displacement, settled) = settle(bonds, start, solve, fail)?;
        let failed = lost || failure.changed > 0;
        let broke = |how, what| Ok(Some((how, what, settled.equilibria)));
        let broke = match settled {
            Settled { ended: SettlingEnd::AtRest, .. } => Ok(None),
            Settled { ended: SettlingEnd::StillFailing, .. } => broke(Collapse::KeepsBreaking, String::new()),
            Settled { report: Some(report), .. } if report.ending == Ending::Stopped => {
                Err(Error::Interrupted { message: "equilibrium was not found yet".into() })
            }
            Settled { ended: SettlingEnd::Unheld, .. } => match unheld {
                Some(Error::Failure { problem, .. }) if failed => {
                    let what = problem.split_once(": ").map_or(problem.as_str(), |(_, modes)| modes);
                    broke(Collapse::Apart, what.to_string())
                }
                why => Err(why.unwrap_or_else(|| not_found(&settled))),
            },
            Settled { ended: SettlingEnd::NotConverged, .. } => {
                let yields = work > 0.0 && work_of(&loads.now, &displacement) > YIELDS * work;
                match (failed && yields, failure.changed > 0) {
                    (true, _) => broke(Collapse::Yields, String::new()),
                    (false, true) => broke(Collapse::Unsolved, not_found(&settled).to_string()),
                    (false, false) => Err(not_found(&settled)),
                }
            }
        }?;
        let Settled { equilibria, report, .. } = settled;
        let evidence = match (&broke, report) {
            (None, Some(report)) => Some(StaticEvidence { equilibria, broken: failure.broken as u64, report }),
            _ => None,
        };
        Ok(Step { displacement, forces, evidence, failure, account, broke })
    }
}

/// f·u (J).
fn work_of(load: &VectorField, u: &VectorField) -> f64 {
    (0..u.len()).map(|node| load.at(node).dot(&u.at(node))).sum()
}

/// The error of a solve that has not converged.
fn not_found(settled: &Settled) -> Error {
    let ended = settled.report.map_or_else(String::new, |r| {
        let how = match r.ending {
            Ending::NegativeCurvature { .. } => "a motion of the body has no positive energy".into(),
            Ending::NotFinite { .. } => "a number is none".into(),
            _ => format!("the residual is {:.1e}", r.residual),
        };
        format!(" after {} iterations: {how}", r.iterations)
    });
    let broken = match settled.broken {
        0 => String::new(),
        n => format!(", {n} bonds of this load step having failed in {} equilibria", settled.equilibria),
    };
    Error::not_converged(
        format!("the solver did not find equilibrium{ended}{broken}"),
        "use more load steps or a looser tolerance, or follow the body in motion",
    )
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
        let [mut f, mut g] = [from, to].map(|u| VectorField::zeros(u.len()));
        bonds.forces_of(from, kinematics, &mut f);
        bonds.coming_forces(to, kinematics, &mut g);
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
