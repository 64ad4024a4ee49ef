//! Equilibrium of a body of spheres under loads that grow, bonds failing on the way.

use std::cell::{Cell, RefCell};

use nalgebra::Vector3;

use super::loading::Loading;
use super::loose::Joined;
use super::problem::PackingProblem;
use crate::experiment::outcome::{Break, Collapse, Outcome, StepLook, WithinStep};
use crate::experiment::problem::Schedule;
use crate::experiment::simulation::{Ledger, SETTLED, StaticEvidence};
use crate::operator::Kinematics;
use crate::operator::particles::{Particles, Sums};
use crate::solver::particles::{PointLoad, Resting, SpheresAtRest};
use crate::solver::{Settled, SettlingEnd, Stopping, settle};
use crate::{Error, ErrorKind, Result};

/// Most iterations of a solve.
const MOST_ITERATIONS: usize = 100_000;

/// Relative residual of the equilibrium that a motion starts from.
const START_TOLERANCE: f64 = 1e-8;

/// Force and moment that loads and supports put on each sphere, and where they have brought it.
pub(super) struct External {
    pub force: Vec<[Vector3<f64>; 2]>,
    pub displacement: Vec<Vector3<f64>>,
    pub rotation: Vec<Vector3<f64>>,
}

/// A body on its way through its load steps.
pub(super) struct Rest {
    pub particles: Particles,
    pub sums: Sums,
    pub ledger: Ledger,
    pub external: External,
    pub last: Option<StaticEvidence>,
    pub outcome: Outcome,
    /// The last state of a body that broke, which is no equilibrium.
    broken: Option<(Particles, Sums)>,
    /// Load steps done, and in all.
    pub step: u64,
    pub steps: u64,
}

/// Energies (J) that a load step moves.
#[derive(Clone, Copy, Default)]
struct Account {
    external: f64,
    /// Spent by bonds that failed.
    fracture: f64,
    /// Set free where bonds failed and the body came to a new equilibrium under loads and supports at rest.
    released: f64,
    /// Energy of the bonds.
    strain: f64,
    broken: u64,
    changed: usize,
}

impl Rest {
    /// # Errors
    /// What equilibrium of packings cannot do.
    pub(super) fn new(problem: &PackingProblem) -> Result<Self> {
        let Schedule::Equilibrium { steps, relaxation, .. } = problem.schedule else {
            return Err(Error::input("motion has no load steps", "leave the duration out"));
        };
        let wrong = |problem: &str, remedy: &str| Err(Error::input(problem, remedy));
        if relaxation {
            return wrong("packings are not relaxed in equilibrium", "leave relaxation out, or use damped motion");
        }
        if problem.servo.is_some() {
            return wrong("a servo drives a cell in motion", "give a duration instead of load steps");
        }
        if problem.model.contact.is_some() {
            return wrong(
                "contacts need motion, but the body is to be in equilibrium",
                "leave contact out, or give a duration with damping instead of load steps",
            );
        }
        if problem.model.law.yields() {
            return wrong(
                "bonds of a packing that yield need motion, but the body is to be in equilibrium",
                "use softening, or give a duration with damping instead of load steps",
            );
        }
        if problem.model.kinematics == Kinematics::Finite {
            return wrong("equilibrium of packings is that of small displacements", "use linear kinematics, or motion");
        }
        let particles = Particles::new(problem.model.clone())?;
        let (n, zero) = (particles.len(), Vector3::zeros());
        Ok(Rest {
            particles,
            sums: Sums::default(),
            ledger: Ledger::default(),
            external: External { force: vec![[zero; 2]; n], displacement: vec![zero; n], rotation: vec![zero; n] },
            last: None,
            outcome: Outcome::Completed,
            broken: None,
            step: 0,
            steps: steps as u64,
        })
    }

    /// The next load step: to its equilibrium, or to where the body breaks.
    ///
    /// # Errors
    /// An equilibrium that is not found of a body of which no bond has failed; interruption, with nothing done.
    pub(super) fn advance(
        &mut self,
        problem: &PackingProblem,
        loading: &Loading,
        joined: &Joined,
        look: StepLook,
    ) -> Result<()> {
        let reached = self.step as f64 / self.steps as f64;
        let factor = (self.step + 1) as f64 / self.steps as f64;
        let place = format!("load step {} of {}", self.step + 1, self.steps);
        let can_fail = problem.model.strength.is_some();
        let whole = can_fail.then(|| self.particles.clone());
        let from = SpheresAtRest::placed(self.external.displacement.clone(), self.external.rotation.clone());
        let (external, loads) = (&self.external, loading.loads(factor));
        let account = Cell::new(Account { strain: self.ledger.strain, ..Account::default() });
        let within = Cell::new(WithinStep::default());
        let (why, sums, mut first) = (RefCell::new(None), Cell::new(self.sums), true);
        let solve = |particles: &Particles, from: &SpheresAtRest| {
            let seen = |iterations, residual| look(&WithinStep { iterations, residual, ..within.get() });
            let start = can_fail.then_some(from);
            match at_rest(problem, loading, joined, (particles, start), factor, &seen) {
                Ok(rest) => {
                    let mut now = account.get();
                    let work = if first { work(external, &rest, &loads) } else { work_at_rest(from, &rest, &loads) };
                    now.external += work;
                    // Between equilibria of which bonds fail nothing moves but what they let go.
                    now.released += if first { 0.0 } else { work - (rest.energy - now.strain) };
                    now.strain = rest.energy;
                    account.set(now);
                    first = false;
                    let report = rest.report;
                    Ok(Some((rest, report)))
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => Err(e),
                Err(e) => {
                    *why.borrow_mut() = Some(e);
                    Ok(None)
                }
            }
        };
        let fail = |particles: &mut Particles, from: &SpheresAtRest, rest: &SpheresAtRest| {
            for sphere in 0..particles.len() {
                particles.move_by(sphere, &(rest.displacement[sphere] - from.displacement[sphere]));
                particles.turn_by(sphere, &(rest.rotation[sphere] - from.rotation[sphere]));
            }
            let found = particles.evaluate_at_rest(SETTLED)?;
            sums.set(found);
            let mut now = account.get();
            now.fracture += found.broken.energy;
            now.broken += found.broken.bonds as u64;
            now.changed += found.broken.changed;
            if found.broken.changed > 0 {
                now.strain = found.bonds;
            }
            account.set(now);
            let equilibria = within.get().equilibria + 1;
            within.set(WithinStep { equilibria, broken: now.broken, ..WithinStep::default() });
            Ok(found.broken.changed)
        };
        let back = |particles: &mut Particles| whole.iter().for_each(|whole| particles.clone_from(whole));
        let (rest, settled) = match settle(&mut self.particles, from, solve, fail) {
            Ok(settled) => settled,
            Err(e) => {
                back(&mut self.particles);
                return Err(e.at(place));
            }
        };
        let account = account.get();
        let failed = account.changed > 0 || self.ledger.fracture > 0.0;
        let Settled { equilibria, report, ended, .. } = settled;
        let (how, what) = match (ended, why.into_inner(), report) {
            (SettlingEnd::AtRest, _, Some(report)) => {
                self.last = Some(StaticEvidence { equilibria, broken: account.broken, report });
                let force = acting(&rest, &loads);
                self.external = External { force, displacement: rest.displacement, rotation: rest.rotation };
                self.sums = sums.get();
                self.step += 1;
                self.ledger.strain = account.strain;
                self.ledger.external += account.external;
                self.ledger.fracture += account.fracture;
                self.ledger.damping += account.released;
                self.ledger.broken_bonds += account.broken;
                return Ok(());
            }
            (SettlingEnd::StillFailing, ..) => (Collapse::KeepsBreaking, String::new()),
            (_, Some(e), _) if !failed => {
                back(&mut self.particles);
                return Err(e.at(place));
            }
            (_, Some(Error::Failure { kind: ErrorKind::Mechanism, problem, .. }), _) => (Collapse::Apart, problem),
            (_, e, _) => (Collapse::Unsolved, e.map_or(String::new(), |e| e.to_string())),
        };
        let broken_bonds = account.broken;
        let end = Break { load_factor: reached, not_reached: factor, how, what, equilibria, broken_bonds };
        self.outcome = if how == Collapse::Unsolved { Outcome::NotConverged(end) } else { Outcome::Broke(end) };
        self.broken = Some((self.particles.clone(), sums.get()));
        back(&mut self.particles);
        Ok(())
    }

    /// As [`super::PackingSimulation::time`].
    pub(super) fn load_factor(&self) -> f64 {
        match &self.outcome {
            Outcome::Broke(b) | Outcome::NotConverged(b) if self.broken.is_none() => b.not_reached,
            _ => self.step as f64 / self.steps as f64,
        }
    }

    /// As [`super::PackingSimulation::show_broken`].
    pub(super) fn show_broken(&mut self) {
        if let Some(state) = self.broken.take() {
            (self.particles, self.sums) = state;
        }
    }
}

/// Bring spheres to the equilibrium that a motion starts from.
///
/// # Errors
/// As [`at_rest`]; bonds that fail there.
pub(super) fn settle_start(
    problem: &PackingProblem,
    loading: &Loading,
    joined: &Joined,
    particles: &mut Particles,
    look: StepLook,
) -> Result<()> {
    let seen = |iterations, residual| look(&WithinStep { iterations, residual, ..WithinStep::default() });
    let start = at_rest(problem, loading, joined, (particles, None), 0.0, &seen);
    let start = start.map_err(|e| e.at("equilibrium at the start"))?;
    for (sphere, (u, theta)) in start.displacement.iter().zip(&start.rotation).enumerate() {
        particles.move_by(sphere, u);
        particles.turn_by(sphere, theta);
    }
    if problem.model.strength.is_none() {
        return Ok(());
    }
    match particles.clone().evaluate_at_rest(0.0)?.broken.changed {
        0 => Ok(()),
        failed => Err(Error::input(
            format!("the body breaks in its equilibrium at the start: {failed} bonds are beyond their strength"),
            "use smaller loads at time 0, or leave from_equilibrium out and let them grow",
        )),
    }
}

/// Equilibrium of the bonds that there are at a load factor, or at a time (s); of spheres that are somewhere already, from there.
///
/// # Errors
/// As [`Resting::equilibrium`]; a load on a sphere that has lost all of its bonds.
fn at_rest(
    problem: &PackingProblem,
    loading: &Loading,
    joined: &Joined,
    (particles, from): (&Particles, Option<&SpheresAtRest>),
    at: f64,
    seen: &dyn Fn(usize, f64) -> bool,
) -> Result<SpheresAtRest> {
    let tolerance = match problem.schedule {
        Schedule::Equilibrium { tolerance, .. } => tolerance,
        Schedule::Motion { .. } => START_TOLERANCE,
    };
    let loads = loading.loads(at);
    let bonds = particles.stiff_bonds();
    let lost = lost_spheres(problem, joined, &bonds);
    let mut supports = loading.supports(at, &joined.floaters, from);
    if let Some(load) = loads.iter().find(|l| l.force != Vector3::zeros() && lost.contains(&l.sphere)) {
        let held = supports.iter().find(|s| s.sphere == load.sphere);
        let free = |i: usize| load.force[i] != 0.0 && held.is_none_or(|s| s.value[i].is_none());
        if (0..3).any(free) {
            return Err(Error::mechanism(
                format!("no bond joins sphere {} to others any more, and it is loaded", load.sphere + 1),
                "use smaller loads, or follow the body in motion",
            ));
        }
    }
    if !lost.is_empty() {
        supports = loading.supports(at, &[&joined.floaters[..], &lost].concat(), from);
    }
    let stopping = Stopping { tolerance, most_iterations: MOST_ITERATIONS };
    let centres = problem.model.packing.centres();
    Resting { centres, bonds, supports: &supports, loads: &loads, from }.equilibrium(&stopping, seen)
}

/// Spheres that had bonds at the start and have none among these, ascending.
fn lost_spheres(problem: &PackingProblem, joined: &Joined, bonds: &[crate::operator::StiffBond]) -> Vec<u32> {
    if bonds.len() == problem.model.bonds.len() {
        return Vec::new();
    }
    let mut joins = vec![false; problem.model.packing.len()];
    bonds.iter().for_each(|b| [b.a, b.b].iter().for_each(|&end| joins[end as usize] = true));
    joined.floaters.iter().for_each(|&s| joins[s as usize] = true);
    (0..joins.len() as u32).filter(|&s| !joins[s as usize]).collect()
}

/// Force (N) and moment (N·m) that supports and loads put on each of the spheres that have come to rest.
fn acting(rest: &SpheresAtRest, loads: &[PointLoad]) -> Vec<[Vector3<f64>; 2]> {
    let mut force = rest.reaction.clone();
    for load in loads {
        force[load.sphere as usize][0] += load.force;
        force[load.sphere as usize][1] += load.moment;
    }
    force
}

/// Work of mean forces on the way from one equilibrium of linear bonds to the next (J).
fn work(before: &External, rest: &SpheresAtRest, loads: &[PointLoad]) -> f64 {
    let force = acting(rest, loads);
    let of = |sphere: usize| {
        let u = rest.displacement[sphere] - before.displacement[sphere];
        let theta = rest.rotation[sphere] - before.rotation[sphere];
        let [f, m] = [0, 1].map(|k| 0.5 * (force[sphere][k] + before.force[sphere][k]));
        f.dot(&u) + m.dot(&theta)
    };
    (0..force.len()).map(of).sum()
}

/// Work of loads that rest (J); supports rest, too.
fn work_at_rest(from: &SpheresAtRest, rest: &SpheresAtRest, loads: &[PointLoad]) -> f64 {
    let of = |load: &PointLoad| {
        let sphere = load.sphere as usize;
        load.force.dot(&(rest.displacement[sphere] - from.displacement[sphere]))
            + load.moment.dot(&(rest.rotation[sphere] - from.rotation[sphere]))
    };
    loads.iter().map(of).sum()
}
