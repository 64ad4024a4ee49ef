//! A problem run: motion step by step, or equilibrium load step by load step, bonds breaking on the way.

mod assemble;
mod cost;
mod crack;
mod crack_path;
#[cfg(test)]
mod crack_tests;
mod crack_tips;
mod grid_state;
mod ledger;
mod load_step;
mod loading;
mod measure;
mod motion;
mod overlap;
mod reactions;
mod resolution;
mod saved;
mod stability;
mod statics;
mod time_step;
mod unrolled;

pub use self::assemble::{InterfaceEvidence, InterfaceFracture, RegionEvidence};
pub use self::cost::RunCost;
use self::crack::CrackFront;
pub use self::crack::diffuse_warning;
pub use self::crack_path::{CrackPath, CrackPoint};
pub use self::crack_tips::{CrackTip, TipPoint};
pub use self::grid_state::GridFacts;
pub use self::ledger::Ledger;
use self::load_step::BrokenState;
use self::loading::Loading;
use self::motion::{Motion, Pass};
pub use self::overlap::{Between, Overlap};
use self::reactions::Reactions;
pub use self::saved::SavedState;
pub(super) use self::statics::SETTLED;
pub use self::statics::StaticEvidence;
use self::statics::{Moment, Statics};
pub use self::time_step::StepEvidence;
pub(super) use self::time_step::steps_in;
use self::time_step::time_step;
use super::checked::Checked;
use super::outcome::{Outcome, StepLook};
use super::problem::{Problem, Schedule};
use crate::operator::grid::{FailingBonds, Padded};
use crate::operator::{Kinematics, VectorField};
use crate::solver::Stopping;
use crate::solver::grid::Method;
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// Most iterations of a solve for equilibrium.
const MOST_ITERATIONS: usize = 5000;

/// Relative residual of the equilibrium that a motion starts from.
const START_TOLERANCE: f64 = 1e-8;

/// Drift of the energy relative to the largest energy above which a run is warned of.
const DRIFT: f64 = 0.02;

/// Energy of a motion relative to what was put in, above which it explodes: at 0.99 of the stable step a single wave's kinetic
/// and strain energies swing to 50 times their sum.
const EXPLODED: f64 = 1e4;

/// How often a motion's cracks are looked at, while they grow.
const LOOKS: u64 = 100;

/// A problem under way.
pub struct Simulation {
    problem: Checked<Problem>,
    regions: Vec<RegionEvidence>,
    interfaces: Vec<InterfaceEvidence>,
    /// The stiffness (Pa) that the bonds of each region reach.
    reached: Vec<Stiffness>,
    bonds: FailingBonds,
    bond_count: u64,
    loading: Loading,
    u: Padded<f64>,
    stage: Stage,
    step: u64,
    steps: u64,
    ledger: Ledger,
    /// Forces of the present state on the nodes of reaction probes.
    reactions: Reactions,
    /// The largest strain of a node at which the step was looked at.
    looked_at: f64,
    crack: CrackFront,
    outcome: Outcome,
    overlap: Option<Overlap>,
    /// Whether the body is in parts from the start.
    apart: bool,
    broken: Option<BrokenState>,
    warnings: Vec<String>,
}

/// Motion or equilibrium.
enum Stage {
    Motion { motion: Motion, evidence: StepEvidence, last: Pass },
    Equilibrium { statics: Statics, last: Option<StaticEvidence> },
}

impl Simulation {
    /// Calibrate the bonds of a problem's body, cut its cracks, and bring it to its start.
    ///
    /// # Errors
    /// What [`Problem::checked`] refuses; a material that cannot be calibrated; conditions that contradict each other; a step
    /// above the stable one; a start from an equilibrium that is none.
    pub fn new(problem: Problem) -> Result<Self> {
        Simulation::new_seen(problem, &|_| true)
    }

    /// The same; the equilibrium that a motion starts from is seen while it is looked for.
    ///
    /// # Errors
    /// As [`Simulation::new`], and [`Error::Interrupted`] where `look` ends it.
    pub fn new_seen(problem: Problem, look: StepLook) -> Result<Self> {
        let problem = problem.checked()?;
        let (bonds, regions, reached) = assemble::bonds(&problem)?;
        let loading = Loading::new(&problem)?;
        let parts = resolution::parts(&bonds);
        let mut simulation = Simulation {
            apart: !parts.is_empty(),
            warnings: [assemble::warnings(&regions), problem.coarse(), parts].concat(),
            bond_count: bonds.grid().unbroken() as u64,
            u: bonds.grid().padded(),
            crack: CrackFront::new(&problem, &bonds),
            interfaces: assemble::interfaces(&problem, &bonds),
            stage: Stage::Equilibrium { statics: statics_of(&problem.schedule), last: None },
            step: 0,
            steps: 1,
            ledger: Ledger::default(),
            outcome: Outcome::Completed,
            overlap: None,
            broken: None,
            reactions: Reactions::new(&problem),
            looked_at: 0.0,
            problem,
            regions,
            reached,
            bonds,
            loading,
        };
        simulation.begin(look)?;
        Ok(simulation)
    }

    /// The state at the start.
    fn begin(&mut self, look: StepLook) -> Result<()> {
        match self.problem.schedule {
            Schedule::Equilibrium { steps, .. } => {
                self.steps = steps as u64;
                Statics::require_balanced(&self.problem, &self.loading, &self.bonds, steps)
            }
            Schedule::Motion { duration, from_equilibrium, .. } => {
                let evidence = time_step(&self.problem, self.bonds.grid())?;
                self.steps = evidence.steps_in(duration)?;
                if from_equilibrium {
                    self.start_from_equilibrium(look)?;
                }
                let velocity = self.initial_velocity();
                let damping = damping_of(&self.problem.schedule);
                let mut motion = Motion::new(&self.problem, velocity, evidence.step, damping);
                let at = (0.0, 0.5 * evidence.step);
                let reactions = &mut self.reactions;
                let first = motion.kick(&self.problem, &self.loading, &mut self.bonds, &self.u, at, true, reactions)?;
                // Nothing lies behind the first pass.
                let last = Pass { external: 0.0, damping: 0.0, ..first };
                self.stage = Stage::Motion { motion, evidence, last };
                self.settle_ledger(true)?;
                self.ledger.initial = self.ledger.kinetic + self.ledger.strain + self.ledger.fracture;
                self.check_step()
            }
        }
    }

    fn start_from_equilibrium(&mut self, look: StepLook) -> Result<()> {
        let statics = statics_of(&self.problem.schedule);
        let start = VectorField::zeros(self.problem.body.grid.len());
        let at_start = Moment { before: None, at: 0.0, lost: false };
        let settled = statics
            .settle(&self.problem, &self.loading, &mut self.bonds, start, at_start, look)
            .map_err(|e| e.at("equilibrium at the start"))?;
        if settled.broke.is_some() {
            return Err(Error::input(
                format!("the body breaks in its equilibrium at the start: {} bonds", settled.failure.broken),
                "use smaller loads at time 0, or leave from_equilibrium out and let them grow",
            ));
        }
        self.u.set(&settled.displacement);
        self.ledger.broken_bonds += settled.failure.broken as u64;
        Ok(())
    }

    fn initial_velocity(&self) -> VectorField {
        let mut velocity = VectorField::zeros(self.problem.body.grid.len());
        for (nodes, value) in &self.problem.initial_velocity {
            nodes.iter().for_each(|&node| velocity.set(node as usize, value));
        }
        velocity
    }

    /// Do one time step or one load step.
    ///
    /// # Errors
    /// Numbers that are none; an equilibrium that is not found. That a body breaks is an [outcome](Simulation::outcome).
    pub fn advance(&mut self) -> Result<()> {
        self.advance_seen(&|_| true)
    }

    /// The same; a load step is seen while it goes on.
    ///
    /// # Errors
    /// As [`Simulation::advance`], and [`Error::Interrupted`] where `look` ends it; the state is then that before the step.
    pub fn advance_seen(&mut self, look: StepLook) -> Result<()> {
        if self.is_motion() { self.advance_motion() } else { self.advance_equilibrium(look) }
    }

    fn advance_motion(&mut self) -> Result<()> {
        let next = self.step + 1;
        let every = self.problem.output.probe_every.max(1) as u64;
        let measured = next.is_multiple_of(every) || next == self.steps;
        if let Stage::Motion { motion, evidence, last } = &mut self.stage {
            // What lay ahead of the last pass is now behind.
            self.ledger.external += last.external_ahead;
            self.ledger.damping += last.damping_ahead;
            self.ledger.fracture += last.failure.ahead;
            motion.drift(&mut self.u);
            let at = (next as f64 * evidence.step, evidence.step);
            let reactions = &mut self.reactions;
            *last = motion.kick(&self.problem, &self.loading, &mut self.bonds, &self.u, at, measured, reactions)?;
        }
        self.step = next;
        self.settle_ledger(measured)?;
        self.check_numbers()?;
        self.check_step()?;
        if next.is_multiple_of((self.steps / LOOKS).max(1)) || next == self.steps {
            self.crack.look(&self.bonds, self.time(), self.ledger.fracture);
            self.look_for_overlap();
        }
        Ok(())
    }

    /// Note how far parts lie in each other now.
    fn look_for_overlap(&mut self) {
        let cracked = !self.problem.cracks.is_empty() || self.ledger.broken_bonds > 0;
        // What hangs together as at the start is nowhere in itself, unless it folds.
        if !self.apart && !cracked {
            return;
        }
        let now = (self.time(), self.is_motion(), cracked);
        self.overlap = overlap::look(&self.problem, &self.bonds, &self.u, now, self.overlap.take());
    }

    /// Bring the ledger to the moment of the displacements.
    fn settle_ledger(&mut self, measured: bool) -> Result<()> {
        let Stage::Motion { last, .. } = &self.stage else { return Ok(()) };
        self.ledger.kinetic = last.kinetic;
        self.ledger.external += last.external;
        self.ledger.damping += last.damping;
        self.ledger.fracture += last.failure.energy;
        self.ledger.broken_bonds += last.failure.broken as u64;
        if measured {
            self.ledger.strain = match self.problem.kinematics {
                Kinematics::Linear => last.strain,
                Kinematics::Finite => self.bonds.energy(&self.u, Kinematics::Finite)?,
            };
        }
        Ok(())
    }

    /// Names the first node whose numbers are none, or the fastest where the body has far more energy than was put in.
    fn check_numbers(&self) -> Result<()> {
        let Stage::Motion { motion, .. } = &self.stage else { return Ok(()) };
        let Ledger { kinetic, strain, external, initial, .. } = self.ledger;
        let held = kinetic.abs().max(strain.abs());
        let finite = kinetic.is_finite() && strain.is_finite();
        if finite && held <= EXPLODED * (initial + external).max(0.0) {
            return Ok(());
        }
        let fastness = |node: &usize| motion.velocity.at(*node).amax();
        let nodes = 0..motion.velocity.len();
        let bad = nodes.clone().find(|node| !motion.velocity.at(*node).iter().all(|v| v.is_finite()));
        let bad = bad.or_else(|| nodes.max_by(|a, b| fastness(a).total_cmp(&fastness(b))));
        let place = bad.map(|node| self.problem.body.grid.position(node));
        let place = place.map_or(String::new(), |p| format!(" at ({:.4e}, {:.4e}, {:.4e}) m", p.x, p.y, p.z));
        let (what, remedy) = match finite {
            true => ("explodes", "use a smaller time step"),
            false => ("is no longer a number", "use a smaller time step, and look at the loads"),
        };
        Err(Error::diverged(format!("the motion {what}{place} at t = {:.4e} s", self.time()), remedy))
    }

    /// Whether the last step is done, or the body broke.
    pub fn finished(&self) -> bool {
        self.step >= self.steps || self.outcome != Outcome::Completed
    }

    /// Steps done.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// Steps in all.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Time (s) in motion, load factor (–) in equilibrium; where the last state of a body that broke is
    /// [shown](Simulation::show_broken), the load factor at which it broke.
    pub fn time(&self) -> f64 {
        match (&self.stage, &self.outcome) {
            (Stage::Motion { evidence, .. }, _) => self.step as f64 * evidence.step,
            (_, Outcome::Broke(b) | Outcome::NotConverged(b)) if self.broken.is_none() => b.not_reached,
            _ => self.load_factor(),
        }
    }

    /// Time (s), or load factor of the last equilibrium (–).
    pub fn reached(&self) -> f64 {
        if self.is_motion() { self.time() } else { self.load_factor() }
    }

    /// Whether the body moves.
    pub fn is_motion(&self) -> bool {
        matches!(self.stage, Stage::Motion { .. })
    }

    /// The problem.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The bonds, as they are now.
    pub fn bond_state(&self) -> &FailingBonds {
        &self.bonds
    }

    /// Bonds at the start, each pair once, pre-cracks cut.
    pub fn bonds(&self) -> u64 {
        self.bond_count
    }

    /// Energies.
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// What the bonds of every region reach.
    pub fn regions(&self) -> &[RegionEvidence] {
        &self.regions
    }

    /// What the bonds between regions are, by pairs of regions.
    pub fn interfaces(&self) -> &[InterfaceEvidence] {
        &self.interfaces
    }

    /// What a user should know of this run.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The deepest that parts of the body have gone through each other; `None` where none was seen.
    pub fn overlap(&self) -> Option<&Overlap> {
        self.overlap.as_ref()
    }

    /// What a user should know of this run, after it.
    pub fn late_warnings(&self) -> Vec<String> {
        let broke = self.outcome.words().map(|words| format!("the body {words}"));
        let spacing = self.problem.body.grid.spacing;
        let overlap = self.overlap.as_ref().map(|o| o.warning(spacing, self.is_motion()));
        broke.into_iter().chain(overlap).chain(drift_warning(&self.ledger, self.is_motion())).collect()
    }

    /// Share of the energy spent by failing bonds (–) that lies beyond the reach of every crack; `None` where nothing has failed.
    pub fn diffuse_damage(&self) -> Option<f64> {
        self.crack.away_from_cracks(&self.problem.body.grid, &self.problem.neighbourhood, &self.bonds)
    }

    /// The time step; `None` in equilibrium.
    pub fn step_evidence(&self) -> Option<StepEvidence> {
        match &self.stage {
            Stage::Motion { evidence, .. } => Some(*evidence),
            Stage::Equilibrium { .. } => None,
        }
    }

    /// How the last load step ended; `None` in motion.
    pub fn static_evidence(&self) -> Option<StaticEvidence> {
        match &self.stage {
            Stage::Motion { .. } => None,
            Stage::Equilibrium { last, .. } => *last,
        }
    }

    /// The cracks that have grown, the longest first.
    pub fn cracks(&self) -> Vec<CrackPath> {
        self.crack.paths(&self.problem.body.grid, self.is_motion())
    }
}

/// A warning where the energy of a motion does not balance.
pub(super) fn drift_warning(ledger: &Ledger, motion: bool) -> Option<String> {
    let drift = ledger.relative_drift();
    let remedy = if motion { "a smaller time step" } else { "more load steps or a closer tolerance" };
    (drift > DRIFT)
        .then(|| format!("the energy has drifted by {:.1} % of its largest part; use {remedy}", 100.0 * drift))
}

/// How equilibrium is found under a schedule.
fn statics_of(schedule: &Schedule) -> Statics {
    match *schedule {
        Schedule::Equilibrium { tolerance, relaxation, .. } => Statics {
            stopping: Stopping {
                tolerance,
                most_iterations: if relaxation { 200 * MOST_ITERATIONS } else { MOST_ITERATIONS },
            },
            method: if relaxation { Method::Relaxation } else { Method::default() },
        },
        Schedule::Motion { .. } => Statics {
            stopping: Stopping { tolerance: START_TOLERANCE, most_iterations: MOST_ITERATIONS },
            method: Method::default(),
        },
    }
}

/// Viscous (1/s) and local damping (–).
fn damping_of(schedule: &Schedule) -> [f64; 2] {
    match *schedule {
        Schedule::Motion { damping, local_damping, .. } => [damping, local_damping],
        Schedule::Equilibrium { .. } => [0.0; 2],
    }
}
