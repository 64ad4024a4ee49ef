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
pub use self::problem::{CellDrive, CellState, PackingEvidence, PackingProblem, Peak, ServoPlan};
use self::statics::External;
use super::problem::Schedule;
use super::simulation::{Ledger, StepEvidence};
use crate::operator::Network;
use crate::operator::particles::{Particles, Sums};
use crate::solver::SolverReport;
use crate::solver::particles::{Control, Servo, Verlet, Work, affine_stiffness, mean_stress, stable_step};
use crate::tensor::PAIRS;
use crate::{Error, Result};

/// How often spheres that have left are looked for in a run.
const LOOKS: u64 = 100;

/// A sphere that moves further than this part of the smallest radius in a step has been thrown out, not moved.
const FARTHEST: f64 = 0.5;

/// A free body's box: its bounds, enlarged on every side by this part of its diagonal.
const ROOM: f64 = 0.5;

/// A problem on a packing under way.
pub struct PackingSimulation {
    problem: PackingProblem,
    particles: Particles,
    loading: Loading,
    joined: Joined,
    stage: Stage,
    sums: Sums,
    step: u64,
    steps: u64,
    ledger: Ledger,
    /// Lost to viscous and local damping so far (J); friction is counted by the contacts.
    lost: f64,
    peak: Option<Peak>,
    /// The first sphere that left the body's box, and when.
    gone: Option<(usize, f64)>,
    bounds: [Vector3<f64>; 2],
    warnings: Vec<String>,
}

/// Motion or equilibrium.
enum Stage {
    Motion { verlet: Verlet, evidence: StepEvidence, servo: Option<Box<Servo>>, fastest: f64, last: Work },
    Equilibrium { external: External, last: Option<SolverReport> },
}

impl PackingSimulation {
    /// Bring a problem's spheres to their start.
    ///
    /// # Errors
    /// A model that is none; conditions that contradict each other, or are on spheres that do not exist; a step above the
    /// stable one; a servo of a body that is not periodic along all axes, or in equilibrium; bonds that break or finite
    /// kinematics in equilibrium.
    pub fn new(problem: PackingProblem) -> Result<Self> {
        let particles = Particles::new(problem.model.clone())?;
        let loading = Loading::new(&problem)?;
        let joined = Joined::new(&problem);
        let mut simulation = PackingSimulation {
            bounds: room(&problem),
            warnings: joined.warnings(&problem),
            stage: Stage::Equilibrium { external: External::default(), last: None },
            sums: Sums::default(),
            step: 0,
            steps: 1,
            ledger: Ledger::default(),
            lost: 0.0,
            peak: None,
            gone: None,
            joined,
            particles,
            loading,
            problem,
        };
        match simulation.problem.schedule {
            Schedule::Equilibrium { .. } => simulation.begin_equilibrium()?,
            Schedule::Motion { .. } => simulation.begin_motion()?,
        }
        Ok(simulation)
    }

    fn begin_motion(&mut self) -> Result<()> {
        let Schedule::Motion { duration, damping, from_equilibrium, .. } = self.problem.schedule else { return Ok(()) };
        let evidence = step_of(&self.problem, &self.particles)?;
        self.steps = ((duration / evidence.step).round() as u64).max(1);
        if from_equilibrium {
            let start = self.settled(0.0).map_err(|e| e.at("equilibrium at the start"))?;
            self.take(&start);
        }
        for (spheres, velocity) in &self.problem.initial_velocity {
            spheres.iter().for_each(|&s| self.particles.set_velocity(s as usize, velocity));
        }
        let servo = self.servo()?;
        self.sums = self.particles.evaluate(0.0)?;
        let verlet = Verlet { step: evidence.step, viscous: damping, local: self.problem.local_damping };
        let smallest = self.problem.model.packing.radii().iter().copied().fold(f64::INFINITY, f64::min);
        let fastest = FARTHEST * smallest / evidence.step;
        let acting = self.loading.acting(&self.particles, 0.0, evidence.step);
        let kicked = verlet.kick(&mut self.particles, &acting, 0.5 * evidence.step, fastest);
        let last = kicked.map_err(|r| self.exploded(r.sphere, r.speed, 0.0))?;
        self.ledger.broken_bonds = self.sums.broken.bonds as u64;
        self.ledger.fracture = self.sums.broken.energy;
        self.settle_ledger(&last);
        self.ledger.initial = self.ledger.kinetic + self.ledger.strain + self.ledger.fracture;
        self.stage = Stage::Motion { verlet, evidence, servo, fastest, last };
        Ok(())
    }

    /// The servo that drives the cell, if any.
    fn servo(&self) -> Result<Option<Box<Servo>>> {
        let Some(plan) = &self.problem.servo else { return Ok(None) };
        if !self.problem.is_periodic() {
            return Err(Error::input(
                "a servo drives the cell of a body that is periodic along all axes",
                "make the body periodic, or use conditions instead",
            ));
        }
        let model = &self.problem.model;
        let volume = self.particles.volume().unwrap_or(1.0);
        let nodes = model.packing.centres().to_vec();
        let network = Network { nodes, bonds: model.bonds.clone(), volume, nodal: None };
        let controls = [Control::Rate(0.0); 6];
        let stiffness = affine_stiffness(&network)?;
        Ok(Some(Box::new(Servo { controls, gain: plan.gain, fastest: plan.fastest, stiffness })))
    }

    /// Do one time step or one load step.
    ///
    /// # Errors
    /// A sphere that is thrown out; an equilibrium that is not found.
    pub fn advance(&mut self) -> Result<()> {
        if self.is_motion() { self.advance_motion() } else { self.advance_equilibrium() }
    }

    fn advance_motion(&mut self) -> Result<()> {
        let next = self.step + 1;
        let Stage::Motion { verlet, servo, fastest, last, .. } = &mut self.stage else { return Ok(()) };
        let (verlet, fastest) = (*verlet, *fastest);
        let (now, then) = (self.step as f64 * verlet.step, next as f64 * verlet.step);
        // What lay ahead of the last pass is now behind.
        self.ledger.external += last.external[1];
        self.lost += last.damping[1];
        let mut gradient = Matrix3::zeros();
        if let (Some(servo), Some(plan)) = (servo, &self.problem.servo) {
            servo.controls = plan.controls(now);
            let stress = mean_stress(&self.particles, &self.sums.virial).unwrap_or_else(Matrix3::zeros);
            gradient = servo.gradient(&stress, verlet.step)?;
        }
        verlet.drift(&mut self.particles);
        if self.problem.servo.is_some() {
            self.particles.deform(&gradient);
        }
        let virial = self.sums.virial;
        self.sums = self.particles.evaluate(verlet.step).map_err(|e| e.at(format!("t = {then:.4e} s")))?;
        let acting = self.loading.acting(&self.particles, then, verlet.step);
        let kicked = verlet.kick(&mut self.particles, &acting, verlet.step, fastest);
        let work = kicked.map_err(|r| self.exploded(r.sphere, r.speed, then))?;
        self.step = next;
        self.ledger.external += work.external[0] + 0.5 * (virial + self.sums.virial).component_mul(&gradient).sum();
        self.lost += work.damping[0];
        self.ledger.fracture += self.sums.broken.energy;
        self.ledger.broken_bonds += self.sums.broken.bonds as u64;
        self.settle_ledger(&work);
        if let Stage::Motion { last, .. } = &mut self.stage {
            *last = work;
        }
        self.note_peak();
        if self.gone.is_none() && (next.is_multiple_of((self.steps / LOOKS).max(1)) || next == self.steps) {
            self.look_for_gone();
        }
        Ok(())
    }

    /// Bring the ledger to the moment of the displacements.
    fn settle_ledger(&mut self, work: &Work) {
        self.ledger.kinetic = work.kinetic + work.rotational;
        self.ledger.strain = self.sums.bonds + self.sums.contacts;
        self.ledger.damping = self.lost + self.particles.friction_loss();
    }

    /// A sphere is faster than anything that a step can follow.
    fn exploded(&self, sphere: usize, speed: f64, time: f64) -> Error {
        let x = self.problem.position(sphere) + self.particles.displacement(sphere);
        Error::input(
            format!(
                "sphere {} at ({:.4e}, {:.4e}, {:.4e}) m has been thrown out at {speed:.3e} m/s at t = {time:.4e} s",
                sphere + 1,
                x.x,
                x.y,
                x.z
            ),
            "use a smaller time step (motion.safety), slower loads, or look at spheres that overlap without a bond",
        )
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

    /// Spheres of a free body that are far outside the box where it was.
    fn look_for_gone(&mut self) {
        let [low, high] = self.bounds;
        let outside = |x: &Vector3<f64>| (0..3).any(|a| !(low[a]..=high[a]).contains(&x[a]));
        let positions = self.particles.positions();
        let mut out = positions.iter().enumerate().filter(|(_, x)| outside(&(*x + self.problem.origin)));
        self.gone = out.next().map(|(sphere, _)| (sphere, self.time()));
    }

    /// Mean stress and strain of a body that is periodic along all axes; `None` of others.
    pub fn cell(&self) -> Option<CellState> {
        let (true, Some(f)) = (self.problem.is_periodic(), self.particles.deformation()) else { return None };
        let stress = mean_stress(&self.particles, &self.sums.virial)?;
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
        &self.particles
    }

    /// Steps done.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// Steps in all.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Whether the last step is done.
    pub fn finished(&self) -> bool {
        self.step >= self.steps
    }

    /// Time (s) in motion, load factor (–) in equilibrium.
    pub fn time(&self) -> f64 {
        match &self.stage {
            Stage::Motion { evidence, .. } => self.step as f64 * evidence.step,
            Stage::Equilibrium { .. } => self.step as f64 / self.steps as f64,
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
        &self.ledger
    }

    /// What a user should know of this run, before it.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// What a user should know of this run, after it.
    pub fn late_warnings(&self) -> Vec<String> {
        let left = self.gone.map(|(sphere, time)| {
            format!(
                "spheres have left the body's box; the first seen is sphere {} at t = {time:.4e} s. They are followed on",
                sphere + 1
            )
        });
        left.into_iter().chain(super::simulation::drift_warning(&self.ledger, self.is_motion())).collect()
    }

    /// The time step; `None` in equilibrium.
    pub fn step_evidence(&self) -> Option<StepEvidence> {
        match &self.stage {
            Stage::Motion { evidence, .. } => Some(*evidence),
            Stage::Equilibrium { .. } => None,
        }
    }

    /// How the last load step was solved; `None` in motion.
    pub fn static_evidence(&self) -> Option<SolverReport> {
        match &self.stage {
            Stage::Motion { .. } => None,
            Stage::Equilibrium { last, .. } => *last,
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

/// The largest stable step and the one used.
fn step_of(problem: &PackingProblem, particles: &Particles) -> Result<StepEvidence> {
    let Schedule::Motion { step, safety, force_step, .. } = problem.schedule else {
        return Err(Error::input("equilibrium has no time step", "give a duration"));
    };
    let stable = stable_step(particles)?;
    let step = step.unwrap_or(safety * stable);
    if step > stable && !force_step {
        return Err(Error::input(
            format!("the time step {step:.4e} s is above the stable one, {stable:.4e} s"),
            "leave the step out, give a smaller one, or set force_step = true",
        ));
    }
    Ok(StepEvidence { step, stable })
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
