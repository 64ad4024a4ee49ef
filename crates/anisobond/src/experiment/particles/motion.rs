//! Spheres in motion under conditions, one step at a time, with the ledger of their energies.

use nalgebra::Matrix3;

use super::conditions::ParticleCondition;
use super::ledger::ParticleLedger;
use crate::operator::particles::{Particles, Sums};
use crate::solver::particles::{Acting, Runaway, Servo, Verlet, Work, mean_stress, stable_step};
use crate::{Error, Result};

/// How spheres are moved in time.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionPlan {
    /// Time step (s); `None`: the stable one times the safety factor.
    pub step: Option<f64>,
    /// Part of the stable step that is used, and above which a given step is refused.
    pub safety: f64,
    /// Run although the step is above the stable one.
    pub force_step: bool,
    /// Viscous damping α (1/s).
    pub viscous: f64,
    /// Local damping λ (–), 0 ≤ λ < 1 (Cundall).
    pub local: f64,
    /// Speed (m/s) beyond which the motion counts as exploded; `None`: the smallest radius per step.
    pub fastest: Option<f64>,
    /// What drives the periodic cell; `None`: it stays.
    pub servo: Option<Servo>,
    /// Box (its least and largest corner, m) that spheres may not leave; `None`: they may go anywhere.
    pub bounds: Option<[nalgebra::Vector3<f64>; 2]>,
}

impl Default for MotionPlan {
    fn default() -> Self {
        MotionPlan {
            step: None,
            safety: 0.8,
            force_step: false,
            viscous: 0.0,
            local: 0.0,
            fastest: None,
            servo: None,
            bounds: None,
        }
    }
}

/// Spheres on their way.
#[derive(Clone, Debug)]
pub struct ParticleMotion {
    particles: Particles,
    conditions: Vec<ParticleCondition>,
    verlet: Verlet,
    fastest: f64,
    servo: Option<Servo>,
    bounds: Option<[nalgebra::Vector3<f64>; 2]>,
    stable: f64,
    steps: u64,
    ledger: ParticleLedger,
    sums: Sums,
    /// Work and losses of the half step ahead, due when it is done.
    ahead: [f64; 2],
    /// Gradient of the cell over the last step.
    gradient: Matrix3<f64>,
}

impl ParticleMotion {
    /// Spheres ready to move, their forces evaluated.
    ///
    /// # Errors
    /// Conditions on spheres that do not exist; a step that is not positive, or above the stable one without
    /// `force_step`; damping out of range; a servo without a cell; a body without bonds to tell a step from.
    pub fn new(mut particles: Particles, conditions: Vec<ParticleCondition>, plan: &MotionPlan) -> Result<Self> {
        conditions.iter().try_for_each(|c| c.check(particles.len()))?;
        if plan.servo.is_some() && particles.cell().is_none() {
            return Err(Error::input("a servo drives a periodic cell, and there is none", "give the packing a cell"));
        }
        let damping = plan.viscous.is_finite() && plan.viscous >= 0.0 && (0.0..1.0).contains(&plan.local);
        if !damping {
            return Err(Error::input(
                format!("viscous damping {} 1/s, local damping {}", plan.viscous, plan.local),
                "give a viscous damping of at least 0 and a local one of at least 0 and below 1",
            ));
        }
        let stable = stable_step(&particles)?;
        let step = checked_step(plan, stable)?;
        let least = (0..particles.len()).map(|i| particles.sphere(i).0).fold(f64::INFINITY, f64::min);
        let sums = particles.evaluate(0.0)?;
        Ok(ParticleMotion {
            particles,
            conditions,
            verlet: Verlet { step, viscous: plan.viscous, local: plan.local },
            fastest: plan.fastest.unwrap_or(least / step),
            servo: plan.servo.clone(),
            bounds: plan.bounds,
            stable,
            steps: 0,
            ledger: ParticleLedger::default(),
            sums,
            ahead: [0.0; 2],
            gradient: Matrix3::zeros(),
        })
    }

    /// One step: kick, drift, forces. The ledger is that of the moment before the step.
    ///
    /// # Errors
    /// A sphere that is too fast or has no speed, one that has left its bounds, a cell that has collapsed: named with
    /// its place, the step and a remedy.
    pub fn advance(&mut self) -> Result<()> {
        let (t, step) = (self.time(), self.verlet.step);
        let mut acting = Acting::default();
        self.conditions.iter().for_each(|c| c.act(&self.particles, t, step, &mut acting));
        let first = self.steps == 0;
        let span = if first { 0.5 * step } else { step };
        let work = self
            .verlet
            .kick(&mut self.particles, &acting, span, self.fastest)
            .map_err(|runaway| self.exploded(&runaway))?;
        self.account(&work, first);
        self.drive_cell()?;
        self.verlet.drift(&mut self.particles);
        self.steps += 1;
        self.sums = self.particles.evaluate(self.verlet.step).map_err(|e| e.at(self.moment()))?;
        self.check_bounds()
    }

    /// The ledger at the moment of the kick: what is stored then, and what the step that ends with it has moved.
    fn account(&mut self, work: &Work, first: bool) {
        let ledger = &mut self.ledger;
        (ledger.kinetic, ledger.rotational) = (work.kinetic, work.rotational);
        (ledger.bonds, ledger.contacts) = (self.sums.bonds, self.sums.contacts);
        (ledger.broken_bonds, ledger.friction) = (self.particles.broken_bonds() as u64, self.particles.friction_loss());
        if first {
            ledger.initial = ledger.stored() + ledger.friction;
        } else {
            // Work of the cell, half by the forces before and half by those after its step.
            ledger.external += self.ahead[0] + work.external[0] + 0.5 * self.sums.virial.dot(&self.gradient);
            ledger.damping += self.ahead[1] + work.damping[0];
            ledger.fracture += self.sums.broken.energy;
        }
        self.ahead = [work.external[1], work.damping[1]];
    }

    /// Move the cell by the servo's answer to the stress now.
    fn drive_cell(&mut self) -> Result<()> {
        let Some(servo) = &self.servo else { return Ok(()) };
        let stress = mean_stress(&self.particles, &self.sums.virial).unwrap_or_else(Matrix3::zeros);
        self.gradient = servo.gradient(&stress, self.verlet.step)?;
        self.ahead[0] += 0.5 * self.sums.virial.dot(&self.gradient);
        self.particles.deform(&self.gradient);
        Ok(())
    }

    fn check_bounds(&self) -> Result<()> {
        let Some([low, high]) = &self.bounds else { return Ok(()) };
        let outside = |x: &nalgebra::Vector3<f64>| (0..3).any(|i| !(low[i] <= x[i] && x[i] <= high[i]));
        match self.particles.positions().iter().enumerate().find(|(_, x)| outside(x)) {
            None => Ok(()),
            Some((i, x)) => Err(Error::input(
                format!("sphere {} has left the box: it is at ({}, {}, {}) m", i + 1, x.x, x.y, x.z),
                "hold the body, damp the motion, or give a larger box",
            )
            .at(self.moment())),
        }
    }

    fn exploded(&self, runaway: &Runaway) -> Error {
        let x = self.particles.positions()[runaway.sphere];
        Error::input(
            format!(
                "sphere {} at ({}, {}, {}) m moves at {} m/s, beyond {} m/s: the motion has exploded",
                runaway.sphere + 1,
                x.x,
                x.y,
                x.z,
                runaway.speed,
                self.fastest
            ),
            "use a smaller time step, slower loading or more damping",
        )
        .at(self.moment())
    }

    fn moment(&self) -> String {
        format!("step {}, t = {} s", self.steps, self.time())
    }

    /// Time (s).
    pub fn time(&self) -> f64 {
        self.steps as f64 * self.verlet.step
    }

    /// Steps so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Time step (s).
    pub fn step(&self) -> f64 {
        self.verlet.step
    }

    /// Stable step of the bonds at the start (s).
    pub fn stable(&self) -> f64 {
        self.stable
    }

    /// The spheres.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// The spheres, to be changed between steps: velocities, cut bonds.
    pub fn particles_mut(&mut self) -> &mut Particles {
        &mut self.particles
    }

    /// The servo, to be changed between steps.
    pub fn servo_mut(&mut self) -> Option<&mut Servo> {
        self.servo.as_mut()
    }

    /// Displacement gradient of the cell over the last step (–).
    pub fn gradient(&self) -> &Matrix3<f64> {
        &self.gradient
    }

    /// Energies, at the moment before the last step.
    pub fn ledger(&self) -> &ParticleLedger {
        &self.ledger
    }

    /// Energy, virial and broken bonds of the last evaluation.
    pub fn sums(&self) -> &Sums {
        &self.sums
    }

    /// Mean stress of a periodic body (Pa), tension positive.
    pub fn stress(&self) -> Option<Matrix3<f64>> {
        mean_stress(&self.particles, &self.sums.virial)
    }
}

/// The step of a plan.
fn checked_step(plan: &MotionPlan, stable: f64) -> Result<f64> {
    if !(plan.safety.is_finite() && plan.safety > 0.0 && plan.safety <= 1.0) {
        return Err(Error::input(format!("a safety factor of {}", plan.safety), "give one above 0 and at most 1"));
    }
    let step = plan.step.unwrap_or(plan.safety * stable);
    if !(step.is_finite() && step > 0.0) {
        return Err(Error::input(format!("a time step of {step} s"), "give a positive step, and bonds that are stiff"));
    }
    if step > stable && !plan.force_step {
        return Err(Error::input(
            format!("a time step of {step} s is above the stable one, {stable} s"),
            "give a smaller step or none, or force the step",
        ));
    }
    Ok(step)
}
