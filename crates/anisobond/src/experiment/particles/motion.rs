//! Spheres in motion, one step at a time, with the ledger of their energies.

use nalgebra::{Matrix3, Vector3};

use crate::experiment::simulation::Ledger;
use crate::operator::particles::{Particles, Snapshot, Sums};
use crate::solver::particles::{Acting, Runaway, Servo, Verlet, Work, damped_step, mean_stress};
use crate::{Error, Result};

/// A sphere that moves further than this part of the smallest radius in a step has been thrown out, not moved.
const FARTHEST: f64 = 0.5;

/// How spheres are moved in time.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionPlan {
    /// Time step (s); `None`: the stable one times the safety factor.
    pub step: Option<f64>,
    /// Part of the stable step that is used, 0 < safety ≤ 1.
    pub safety: f64,
    /// Run although the step is above the stable one.
    pub force_step: bool,
    /// Viscous damping α (1/s).
    pub viscous: f64,
    /// Local damping λ (–), 0 ≤ λ < 1 (Cundall).
    pub local: f64,
    /// What drives the periodic cell; `None`: it stays.
    pub servo: Option<Servo>,
    /// Where the packing's origin lies in the coordinates that messages use (m).
    pub origin: Vector3<f64>,
}

impl Default for MotionPlan {
    fn default() -> Self {
        MotionPlan {
            step: None,
            safety: 0.8,
            force_step: false,
            viscous: 0.0,
            local: 0.0,
            servo: None,
            origin: Vector3::zeros(),
        }
    }
}

/// Spheres on their way: displacements at a moment, velocities half a step ahead of it.
///
/// What acts on them is asked for at every step, as a function of the spheres, the time (s) and the step ahead (s).
#[derive(Clone, Debug)]
pub struct ParticleMotion {
    particles: Particles,
    verlet: Verlet,
    fastest: f64,
    servo: Option<Servo>,
    origin: Vector3<f64>,
    stable: f64,
    pub(in crate::experiment) progress: Progress,
    sums: Sums,
    gradient: Matrix3<f64>,
}

/// How far a motion has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(in crate::experiment) struct Progress {
    pub steps: u64,
    pub ledger: Ledger,
    /// Lost to viscous and local damping so far (J); friction is counted by the contacts.
    pub lost: f64,
    /// Work and losses (J) of the half step ahead, due when it is done.
    pub ahead: [f64; 2],
}

/// The step of a plan for a stable one (s).
///
/// # Errors
/// A step or safety factor out of range; a step above the stable one without `force_step`.
pub(in crate::experiment) fn checked_step(plan: &MotionPlan, stable: f64) -> Result<f64> {
    if !(plan.safety > 0.0 && plan.safety <= 1.0) {
        return Err(Error::input(format!("a safety factor of {}", plan.safety), "give one above 0 and at most 1"));
    }
    let step = plan.step.unwrap_or(plan.safety * stable);
    if !(step.is_finite() && step > 0.0) {
        return Err(Error::input(format!("a time step of {step} s"), "give a positive step, and bonds that are stiff"));
    }
    if step > stable && !plan.force_step {
        return Err(Error::input(
            format!("the time step {step:.4e} s is above the stable one, {stable:.4e} s"),
            "leave the step out, give a smaller one, or set force_step = true",
        ));
    }
    Ok(step)
}

impl ParticleMotion {
    /// Spheres ready to move: forces evaluated, velocities brought half a step ahead.
    ///
    /// # Errors
    /// A step that is not positive, or above the stable one without `force_step`; damping out of range; a servo without a
    /// cell; a sphere thrown out by the first kick.
    pub fn new(
        mut particles: Particles,
        plan: &MotionPlan,
        acting: impl FnOnce(&Particles, f64, f64) -> Acting,
    ) -> Result<Self> {
        if plan.servo.is_some() && particles.cell().is_none() {
            return Err(Error::input("a servo drives a periodic cell, and there is none", "give the packing a cell"));
        }
        if !(plan.viscous.is_finite() && plan.viscous >= 0.0 && (0.0..1.0).contains(&plan.local)) {
            return Err(Error::input(
                format!("viscous damping {} 1/s, local damping {}", plan.viscous, plan.local),
                "give a viscous damping of at least 0 and a local one of at least 0 and below 1",
            ));
        }
        let stable = damped_step(&particles, plan.local)?;
        let step = checked_step(plan, stable)?;
        let smallest = particles.model().packing.radii().iter().copied().fold(f64::INFINITY, f64::min);
        let sums = particles.evaluate(0.0)?;
        let mut motion = ParticleMotion {
            particles,
            verlet: Verlet { step, viscous: plan.viscous, local: plan.local },
            fastest: FARTHEST * smallest / step,
            servo: plan.servo.clone(),
            origin: plan.origin,
            stable,
            progress: Progress::default(),
            sums,
            gradient: Matrix3::zeros(),
        };
        let acting = acting(&motion.particles, 0.0, step);
        let work = motion.kick(&acting, 0.5 * step)?;
        motion.settle(&work);
        let ledger = &mut motion.progress.ledger;
        ledger.initial = ledger.kinetic + ledger.strain + ledger.damping + ledger.fracture;
        Ok(motion)
    }

    /// One step: drift, forces, kick.
    ///
    /// # Errors
    /// A sphere that is thrown out, named with its place and time; a cell that has collapsed; something that acts on a
    /// sphere that does not exist.
    pub fn advance(&mut self, acting: impl FnOnce(&Particles, f64, f64) -> Acting) -> Result<()> {
        let step = self.verlet.step;
        // What lay ahead of the last kick is now behind.
        let [work, lost] = self.progress.ahead;
        self.progress.ledger.external += work;
        self.progress.lost += lost;
        if let Some(servo) = &self.servo {
            let stress = mean_stress(&self.particles, &self.sums.virial).unwrap_or_else(Matrix3::zeros);
            self.gradient = servo.gradient(&stress, step)?;
        }
        let before = self.sums.virial;
        self.progress.steps += 1;
        let driven = self.servo.is_some().then_some(&self.gradient);
        self.sums = self.verlet.move_on(&mut self.particles, driven).map_err(|e| e.at(self.moment()))?;
        let acting = acting(&self.particles, self.time(), step);
        let work = self.kick(&acting, step)?;
        // The cell's work: half by the forces before its step, half by those after it.
        self.progress.ledger.external += work.external[0] + 0.5 * (before + self.sums.virial).dot(&self.gradient);
        self.progress.lost += work.damping[0];
        self.settle(&work);
        Ok(())
    }

    fn kick(&mut self, acting: &Acting, span: f64) -> Result<Work> {
        let spheres = acting.loads.iter().map(|l| l.sphere).chain(acting.held.iter().map(|h| h.sphere));
        if let Some(missing) = spheres.max().filter(|&s| s as usize >= self.particles.len()) {
            return Err(Error::input(
                format!("sphere {} is held or loaded, but there are {}", u64::from(missing) + 1, self.particles.len()),
                "use the spheres that exist",
            ));
        }
        self.verlet.kick(&mut self.particles, acting, span, self.fastest).map_err(|runaway| self.thrown_out(&runaway))
    }

    /// Bring the ledger to the moment of the displacements.
    fn settle(&mut self, work: &Work) {
        let Progress { ledger, lost, ahead, .. } = &mut self.progress;
        ledger.kinetic = work.kinetic + work.rotational;
        ledger.strain = self.sums.bonds + self.sums.contacts;
        ledger.damping = *lost + self.particles.friction_loss();
        ledger.fracture += self.sums.broken.energy;
        ledger.broken_bonds += self.sums.broken.bonds as u64;
        *ahead = [work.external[1], work.damping[1]];
    }

    /// A sphere is faster than anything that a step can follow.
    fn thrown_out(&self, runaway: &Runaway) -> Error {
        let Runaway { sphere, speed } = *runaway;
        let x = self.particles.model().packing.centres()[sphere] + self.particles.displacement(sphere) + self.origin;
        Error::diverged(
            format!(
                "sphere {} at ({:.4e}, {:.4e}, {:.4e}) m has been thrown out at {speed:.3e} m/s, beyond {:.3e} m/s",
                sphere + 1,
                x.x,
                x.y,
                x.z,
                self.fastest
            ),
            "use a smaller time step (motion.safety), slower loads, or look at spheres that overlap without a bond",
        )
        .at(self.moment())
    }

    fn moment(&self) -> String {
        format!("step {}, t = {:.4e} s", self.progress.steps, self.time())
    }

    /// Go on from kept progress, the virial (J) and the spheres' snapshot.
    pub(in crate::experiment) fn go_on(
        &mut self,
        progress: Progress,
        virial: Matrix3<f64>,
        spheres: Snapshot,
    ) -> Result<()> {
        self.particles.restore(spheres)?;
        self.sums.virial = virial;
        self.progress = progress;
        Ok(())
    }

    /// Time (s).
    pub fn time(&self) -> f64 {
        self.progress.steps as f64 * self.verlet.step
    }

    /// Steps so far.
    pub fn steps(&self) -> u64 {
        self.progress.steps
    }

    /// Time step (s).
    pub fn step(&self) -> f64 {
        self.verlet.step
    }

    /// Stable step of the bonds at the start (s), with local damping the largest that it damps at.
    pub fn stable(&self) -> f64 {
        self.stable
    }

    /// The spheres.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// The servo, to be changed between steps.
    pub fn servo_mut(&mut self) -> Option<&mut Servo> {
        self.servo.as_mut()
    }

    /// Energies at the moment of the displacements.
    pub fn ledger(&self) -> &Ledger {
        &self.progress.ledger
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
