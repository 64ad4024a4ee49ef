//! A problem on a packing run: spheres in motion step by step, or in equilibrium load step by load step.

mod cost;
mod fields;
mod loading;
mod loose;
mod problem;
mod saved;
mod statics;

use nalgebra::{Matrix3, Vector3};

use self::loading::Loading;
use self::loose::Joined;
pub use self::problem::{CellDrive, CellState, Leavers, PackingEvidence, PackingProblem, Peak, ServoPlan};
use self::statics::{Rest, settle_start};
use super::checked::Checked;
use super::outcome::{Outcome, StepLook};
use super::particles::{MotionPlan, ParticleMotion, checked_step};
use super::problem::Schedule;
use super::simulation::{Ledger, StaticEvidence, StepEvidence, steps_in};
use crate::operator::Network;
use crate::operator::particles::{Particles, Sums};
use crate::solver::particles::{Control, Servo, affine_stiffness, damped_step, mean_stress};
use crate::tensor::PAIRS;
use crate::{Error, Result};
pub use saved::PackingFacts;

/// How often spheres that have left are looked for in a run.
const LOOKS: u64 = 100;

/// A free body's box: its bounds, enlarged on every side by this part of its diagonal.
const ROOM: f64 = 0.5;

/// A problem on a packing under way.
pub struct PackingSimulation {
    problem: Checked<PackingProblem>,
    loading: Loading,
    joined: Joined,
    stage: Stage,
    peak: Option<Peak>,
    left: Option<Leavers>,
    bounds: [Vector3<f64>; 2],
    warnings: Vec<String>,
}

/// Motion or equilibrium.
enum Stage {
    Motion { motion: Box<ParticleMotion>, steps: u64 },
    Equilibrium(Box<Rest>),
}

impl PackingSimulation {
    /// Bring a problem's spheres to their start.
    ///
    /// # Errors
    /// What [`PackingProblem::checked`] refuses; a model that is none; conditions that contradict each other; a step above the
    /// stable one; a servo of a body that is not periodic along all axes, or in equilibrium; contacts, bonds that yield or finite
    /// kinematics in equilibrium.
    pub fn new(problem: PackingProblem) -> Result<Self> {
        PackingSimulation::new_seen(problem, &|_| true)
    }

    /// The same; the equilibrium that a motion starts from is seen while it is looked for.
    ///
    /// # Errors
    /// As [`PackingSimulation::new`], and [`Error::Interrupted`] where `look` ends it.
    pub fn new_seen(problem: PackingProblem, look: StepLook) -> Result<Self> {
        let problem = problem.checked()?;
        let loading = Loading::new(&problem)?;
        let joined = Joined::new(&problem);
        let stage = match problem.schedule {
            Schedule::Equilibrium { .. } => Stage::Equilibrium(Box::new(Rest::new(&problem)?)),
            Schedule::Motion { duration, .. } => {
                let motion = motion(&problem, &loading, &joined, look)?;
                let steps = steps_in(duration, motion.step())?;
                Stage::Motion { motion: Box::new(motion), steps }
            }
        };
        Ok(PackingSimulation {
            bounds: room(&problem),
            warnings: problem.warnings_of(&joined),
            stage,
            peak: None,
            left: None,
            joined,
            loading,
            problem,
        })
    }

    /// Do one time step or one load step.
    ///
    /// # Errors
    /// A sphere that is thrown out; an equilibrium that is not found.
    pub fn advance(&mut self) -> Result<()> {
        self.advance_seen(&|_| true)
    }

    /// The same; a load step is seen while it goes on.
    ///
    /// # Errors
    /// As [`PackingSimulation::advance`], and [`Error::Interrupted`] where `look` ends it; the state is then that before the step.
    pub fn advance_seen(&mut self, look: StepLook) -> Result<()> {
        let (problem, loading) = (&self.problem, &self.loading);
        match &mut self.stage {
            Stage::Equilibrium(rest) => rest.advance(problem, loading, &self.joined, look),
            Stage::Motion { motion, steps } => {
                let now = motion.time();
                if let (Some(servo), Some(plan)) = (motion.servo_mut(), &problem.servo) {
                    servo.controls = plan.controls(now);
                }
                motion.advance(|particles, t, step| loading.acting(particles, t, step))?;
                let (done, steps) = (motion.steps(), *steps);
                self.note_peak();
                if done.is_multiple_of((steps / LOOKS).max(1)) || done == steps {
                    self.look_for_leavers();
                }
                Ok(())
            }
        }
    }

    /// Note the largest differential stress of the component that is strained fastest.
    fn note_peak(&mut self) {
        let (Some(plan), Some(cell)) = (&self.problem.servo, self.cell()) else { return };
        let Some(axis) = plan.axial(self.time()) else { return };
        let stress = cell.stress[axis];
        let lateral = 0.5 * ((0..3).map(|a| cell.stress[a]).sum::<f64>() - stress);
        let differential = (stress - lateral).abs();
        if self.peak.is_none_or(|p| differential > p.differential) {
            self.peak = Some(Peak { axis, differential, stress, strain: cell.strain[axis], time: self.time() });
        }
    }

    /// Count the spheres of a free body that are far outside the box where it was.
    fn look_for_leavers(&mut self) {
        let [low, high] = self.bounds;
        let outside = |x: &Vector3<f64>| (0..3).any(|a| !(low[a]..=high[a]).contains(&x[a]));
        let places = self.particles().positions().into_iter().map(|x| x + self.problem.origin);
        let out: Vec<(usize, Vector3<f64>)> = places.enumerate().filter(|(_, x)| outside(x)).collect();
        let time = self.time();
        let seen = out.first().map(|&(sphere, x)| Leavers { number: 0, first: sphere + 1, place: x.into(), time });
        self.left = self.left.or(seen).map(|left| Leavers { number: out.len(), ..left });
    }

    /// Mean stress and strain of a body that is periodic along all axes; `None` of others.
    pub fn cell(&self) -> Option<CellState> {
        let (true, Some(f)) = (self.problem.is_periodic(), self.particles().deformation()) else { return None };
        let stress = mean_stress(self.particles(), &self.sums().virial)?;
        let symmetric = |m: &Matrix3<f64>, (i, j): (usize, usize)| 0.5 * (m[(i, j)] + m[(j, i)]);
        let strain = |(i, j): (usize, usize)| if i == j { f[(i, i)].ln() } else { symmetric(&f, (i, j)) };
        Some(CellState { stress: PAIRS.map(|p| symmetric(&stress, p)), strain: PAIRS.map(strain) })
    }

    /// The largest differential stress so far; `None` without a component that is strained.
    pub fn peak(&self) -> Option<Peak> {
        self.peak
    }

    /// The problem.
    pub fn problem(&self) -> &PackingProblem {
        &self.problem
    }

    /// The spheres as they are now.
    pub fn particles(&self) -> &Particles {
        match &self.stage {
            Stage::Motion { motion, .. } => motion.particles(),
            Stage::Equilibrium(rest) => &rest.particles,
        }
    }

    fn sums(&self) -> &Sums {
        match &self.stage {
            Stage::Motion { motion, .. } => motion.sums(),
            Stage::Equilibrium(rest) => &rest.sums,
        }
    }

    /// Steps done.
    pub fn step(&self) -> u64 {
        match &self.stage {
            Stage::Motion { motion, .. } => motion.steps(),
            Stage::Equilibrium(rest) => rest.step,
        }
    }

    /// Steps in all.
    pub fn steps(&self) -> u64 {
        match &self.stage {
            Stage::Motion { steps, .. } => *steps,
            Stage::Equilibrium(rest) => rest.steps,
        }
    }

    /// Whether the last step is done, or the body broke.
    pub fn finished(&self) -> bool {
        self.step() >= self.steps() || *self.outcome() != Outcome::Completed
    }

    /// How the run ended, or that nothing has ended it yet.
    pub fn outcome(&self) -> &Outcome {
        match &self.stage {
            Stage::Motion { .. } => &Outcome::Completed,
            Stage::Equilibrium(rest) => &rest.outcome,
        }
    }

    /// Go from the last equilibrium of a body that broke to its last state, for its fields. Energies stay those of the equilibrium.
    pub fn show_broken(&mut self) {
        if let Stage::Equilibrium(rest) = &mut self.stage {
            rest.show_broken();
        }
    }

    /// Time (s) in motion, load factor (–) in equilibrium; where the last state of a body that broke is
    /// [shown](PackingSimulation::show_broken), the load factor at which it broke.
    pub fn time(&self) -> f64 {
        match &self.stage {
            Stage::Motion { motion, .. } => motion.time(),
            Stage::Equilibrium(rest) => rest.load_factor(),
        }
    }

    /// Time (s), or load factor of the last equilibrium (–).
    pub fn reached(&self) -> f64 {
        match &self.stage {
            Stage::Motion { motion, .. } => motion.time(),
            Stage::Equilibrium(rest) => rest.step as f64 / rest.steps as f64,
        }
    }

    /// Whether the body moves.
    pub fn is_motion(&self) -> bool {
        matches!(self.stage, Stage::Motion { .. })
    }

    /// Bonds at the start.
    pub fn bonds(&self) -> u64 {
        self.problem.model.bonds.len() as u64
    }

    /// Energies.
    pub fn ledger(&self) -> &Ledger {
        match &self.stage {
            Stage::Motion { motion, .. } => motion.ledger(),
            Stage::Equilibrium(rest) => &rest.ledger,
        }
    }

    /// What a user should know of this run, before it.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// What a user should know of this run, after it.
    pub fn late_warnings(&self) -> Vec<String> {
        let left = self.left.map(|Leavers { number, first, place: [x, y, z], time }| {
            format!(
                "spheres have left the body's box; the first seen is sphere {first} at ({x:.4e}, {y:.4e}, {z:.4e}) m at \
                 t = {time:.4e} s, at the end there are {number}. They are followed on"
            )
        });
        let broke = self.outcome().words().map(|words| format!("the body {words}"));
        broke.into_iter().chain(left).chain(super::simulation::drift_warning(self.ledger(), self.is_motion())).collect()
    }

    /// Spheres that have left the body's box; `None` if none has.
    pub fn leavers(&self) -> Option<Leavers> {
        self.left
    }

    /// The time step; `None` in equilibrium.
    pub fn step_evidence(&self) -> Option<StepEvidence> {
        match &self.stage {
            Stage::Motion { motion, .. } => Some(StepEvidence { step: motion.step(), stable: motion.stable() }),
            Stage::Equilibrium(_) => None,
        }
    }

    /// How the last load step ended; `None` in motion.
    pub fn static_evidence(&self) -> Option<StaticEvidence> {
        match &self.stage {
            Stage::Motion { .. } => None,
            Stage::Equilibrium(rest) => rest.last,
        }
    }

    /// Spheres that no bond joins to any other.
    pub fn floaters(&self) -> &[u32] {
        &self.joined.floaters
    }
}

impl ServoPlan {
    /// What drives the cell at time t (s).
    fn controls(&self, t: f64) -> [Control; 6] {
        self.drives.map(|drive| match drive {
            CellDrive::Rate(rate) => Control::Rate(rate),
            CellDrive::Stress(stress) => Control::Stress(stress),
            CellDrive::StressThenRate { stress, until, .. } if t < until => Control::Stress(stress),
            CellDrive::StressThenRate { rate, .. } => Control::Rate(rate),
        })
    }

    /// The normal component that is strained fastest at time t (s); `None` if none is strained.
    pub fn axial(&self, t: f64) -> Option<usize> {
        let controls = self.controls(t);
        let rate = |a: usize| match controls[a] {
            Control::Rate(rate) => rate.abs(),
            Control::Stress(_) => 0.0,
        };
        (0..3).filter(|&a| rate(a) > 0.0).max_by(|&a, &b| rate(a).total_cmp(&rate(b)))
    }
}

/// The spheres of a problem, ready to move.
fn motion(problem: &PackingProblem, loading: &Loading, joined: &Joined, look: StepLook) -> Result<ParticleMotion> {
    let mut particles = Particles::new(problem.model.clone())?;
    if let Schedule::Motion { from_equilibrium: true, .. } = problem.schedule {
        settle_start(problem, loading, joined, &mut particles, look)?;
    }
    for (spheres, velocity) in &problem.initial_velocity {
        spheres.iter().for_each(|&s| particles.set_velocity(s as usize, velocity));
    }
    let plan = MotionPlan { servo: servo(problem)?, ..plan(problem)? };
    ParticleMotion::new(particles, &plan, |particles, t, step| loading.acting(particles, t, step))
}

/// How a problem's spheres are moved, without a servo.
fn plan(problem: &PackingProblem) -> Result<MotionPlan> {
    let Schedule::Motion { step, safety, force_step, damping, local_damping: local, .. } = problem.schedule else {
        return Err(Error::input("equilibrium has no time step", "give a duration"));
    };
    Ok(MotionPlan { step, safety, force_step, viscous: damping, local, servo: None, origin: problem.origin })
}

/// The servo that drives a problem's cell, if any.
fn servo(problem: &PackingProblem) -> Result<Option<Servo>> {
    let Some(plan) = &problem.servo else { return Ok(None) };
    let model = &problem.model;
    let (true, Some(edges)) = (problem.is_periodic(), model.packing.cell()) else {
        return Err(Error::input(
            "a servo drives the cell of a body that is periodic along all axes",
            "make the body periodic, or use conditions instead",
        ));
    };
    let nodes = model.packing.centres().to_vec();
    let network = Network { nodes, bonds: model.bonds.clone(), volume: edges.product(), nodal: None };
    let stiffness = affine_stiffness(&network)?;
    Ok(Some(Servo { controls: plan.controls(0.0), gain: plan.gain, fastest: plan.fastest, stiffness }))
}

/// The largest stable step and the one used.
fn step_of(problem: &PackingProblem, particles: &Particles) -> Result<StepEvidence> {
    let plan = plan(problem)?;
    let stable = damped_step(particles, plan.local)?;
    Ok(StepEvidence { step: checked_step(&plan, stable)?, stable })
}

/// The box of a body's start, with room around it; endless along periodic axes.
fn room(problem: &PackingProblem) -> [Vector3<f64>; 2] {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = -low;
    for sphere in 0..problem.model.packing.len() {
        let x = problem.position(sphere);
        (low, high) = (low.inf(&x), high.sup(&x));
    }
    let room = ROOM * (high - low).norm() + 2.0 * problem.mean_radius();
    for a in 0..3 {
        let more = if problem.periodic[a] { f64::INFINITY } else { room };
        (low[a], high[a]) = (low[a] - more, high[a] + more);
    }
    [low, high]
}
