//! The triaxial test: a periodic body under a confining stress is strained along one axis until it fails.

use nalgebra::Matrix3;

use super::motion::{MotionPlan, ParticleMotion};
use crate::operator::Network;
use crate::operator::particles::Particles;
use crate::solver::particles::{Control, Servo, affine_stiffness};
use crate::{Error, Result};

/// A triaxial test; stresses with tension positive, so that a confining stress is negative.
#[derive(Clone, Debug, PartialEq)]
pub struct TriaxialTest {
    /// Axis along which strain is prescribed (0, 1, 2).
    pub axis: usize,
    /// Stress on the other two axes, and on all three to begin with (Pa).
    pub confinement: f64,
    /// Logarithmic strain rate along the axis (1/s), negative in compression.
    pub rate: f64,
    /// Logarithmic strain at which the test ends, of the rate's sign.
    pub strain: f64,
    /// Number of points of the curve.
    pub points: usize,
    /// Share of missing lateral stress that the servo makes good per step (–).
    pub gain: f64,
    /// Largest lateral strain rate relative to the axial one (–).
    pub lateral_rate: f64,
    /// Steps in which the confinement is applied.
    pub confining_steps: usize,
    /// Step, damping and faults; its servo is the test's own.
    pub plan: MotionPlan,
}

/// A point of the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriaxialPoint {
    /// Time since the axial strain began (s).
    pub time: f64,
    /// Logarithmic strains ε since confinement.
    pub strain: Matrix3<f64>,
    /// Mean stress (Pa), tension positive.
    pub stress: Matrix3<f64>,
    /// Bonds broken so far.
    pub broken_bonds: usize,
    /// Whole bonds and touching pairs per sphere, each counted at both.
    pub coordination: f64,
    /// Kinetic energy relative to the bonds' (–): how far from static the test is.
    pub kinetic_share: f64,
}

/// What a triaxial test measured.
#[derive(Clone, Debug)]
pub struct TriaxialResult {
    /// The curve, its first point at the end of confinement.
    pub curve: Vec<TriaxialPoint>,
    /// Place in the curve of the largest deviator |σ_axial − mean lateral|.
    pub peak: usize,
    /// The spheres at the end.
    pub motion: ParticleMotion,
}

impl TriaxialTest {
    /// Run it.
    ///
    /// # Errors
    /// No cell; strain or rate of zero or of unlike sign; no points or steps; what [`ParticleMotion`] refuses.
    pub fn run(&self, particles: Particles) -> Result<TriaxialResult> {
        self.check()?;
        let mut motion = self.confined(particles)?;
        let begin = motion.time();
        let mut strain = Matrix3::zeros();
        if let Some(servo) = motion.servo_mut() {
            servo.controls[self.axis] = Control::Rate(self.rate);
            servo.fastest = self.lateral_rate * self.rate.abs();
        }
        let steps = (self.strain / (self.rate * motion.step())).ceil().max(1.0) as u64;
        let every = steps.div_ceil(self.points as u64).max(1);
        let mut curve = vec![point(&motion, begin, &strain)];
        for step in 1..=steps {
            motion.advance()?;
            strain += motion.gradient();
            if step % every == 0 || step == steps {
                curve.push(point(&motion, begin, &strain));
            }
        }
        let peak = (0..curve.len()).max_by(|&i, &j| self.deviator(&curve[i]).total_cmp(&self.deviator(&curve[j])));
        Ok(TriaxialResult { peak: peak.unwrap_or(0), curve, motion })
    }

    /// |σ_axial − mean of the lateral stresses| (Pa).
    pub fn deviator(&self, point: &TriaxialPoint) -> f64 {
        let axial = point.stress[(self.axis, self.axis)];
        (axial - 0.5 * (point.stress.trace() - axial)).abs()
    }

    /// The body under the confining stress, at rest as far as damping brings it there.
    fn confined(&self, particles: Particles) -> Result<ParticleMotion> {
        let model = particles.model();
        let Some(volume) = particles.volume() else {
            return Err(Error::input("a triaxial test needs a periodic packing", "give the packing a cell"));
        };
        let network =
            Network { nodes: model.packing.centres().to_vec(), bonds: model.bonds.clone(), volume, nodal: None };
        let hydrostatic = [Control::Stress(self.confinement); 3];
        let [a, b, c] = hydrostatic;
        let still = Control::Rate(0.0);
        let servo = Servo {
            controls: [a, b, c, still, still, still],
            gain: self.gain,
            fastest: f64::INFINITY,
            stiffness: affine_stiffness(&network)?,
        };
        let plan = MotionPlan { servo: Some(servo), ..self.plan.clone() };
        let mut motion = ParticleMotion::new(particles, Vec::new(), &plan)?;
        for _ in 0..self.confining_steps {
            motion.advance()?;
        }
        Ok(motion)
    }

    fn check(&self) -> Result<()> {
        let signs = self.rate * self.strain > 0.0 && self.rate.is_finite() && self.strain.abs() < 1.0;
        let counts = self.points > 0 && self.axis < 3 && self.confinement.is_finite();
        if signs && counts && self.gain > 0.0 && self.lateral_rate > 0.0 {
            return Ok(());
        }
        Err(Error::input(
            format!(
                "a triaxial test along axis {} to strain {} at {} 1/s, {} points, gain {}, lateral rate {}",
                self.axis, self.strain, self.rate, self.points, self.gain, self.lateral_rate
            ),
            "give an axis 0, 1 or 2, strain (below 1) and rate of the same sign, at least one point, and a positive gain \
             and lateral rate",
        ))
    }
}

/// What is measured now.
fn point(motion: &ParticleMotion, begin: f64, strain: &Matrix3<f64>) -> TriaxialPoint {
    let particles = motion.particles();
    let held = particles.whole().len() - particles.broken_bonds() + particles.touching().len();
    let ledger = motion.ledger();
    TriaxialPoint {
        time: motion.time() - begin,
        strain: *strain,
        stress: motion.stress().unwrap_or_else(Matrix3::zeros),
        broken_bonds: particles.broken_bonds(),
        coordination: 2.0 * held as f64 / particles.len() as f64,
        kinetic_share: (ledger.kinetic + ledger.rotational) / ledger.bonds.max(f64::MIN_POSITIVE),
    }
}
