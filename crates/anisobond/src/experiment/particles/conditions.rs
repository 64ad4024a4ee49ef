//! What holds, drives and loads spheres.

use crate::experiment::History;
use crate::operator::particles::Particles;
use crate::solver::particles::{Acting, Held, PointLoad};
use crate::{Error, Result};

/// What holds, drives or loads some spheres. Later conditions win where two prescribe the same component; loads add.
#[derive(Clone, Debug, PartialEq)]
pub enum ParticleCondition {
    /// Components of displacement (m) that are prescribed, times the history.
    Displacement {
        /// Spheres.
        spheres: Vec<u32>,
        /// Prescribed components; `None` is free.
        value: [Option<f64>; 3],
        /// In time.
        history: History,
    },
    /// Components of velocity (m/s) that are prescribed, times the history.
    Velocity {
        /// Spheres.
        spheres: Vec<u32>,
        /// Prescribed components; `None` is free.
        value: [Option<f64>; 3],
        /// In time.
        history: History,
    },
    /// Components of angular velocity (rad/s) that are prescribed, times the history; 0 keeps spheres from rotating.
    Spin {
        /// Spheres.
        spheres: Vec<u32>,
        /// Prescribed components; `None` is free.
        value: [Option<f64>; 3],
        /// In time.
        history: History,
    },
    /// Forces (N) and moments (N·m) on spheres, times the history.
    Load {
        /// One load per sphere.
        loads: Vec<PointLoad>,
        /// In time.
        history: History,
    },
}

impl ParticleCondition {
    /// Spheres that it concerns.
    pub fn spheres(&self) -> Vec<u32> {
        match self {
            ParticleCondition::Displacement { spheres, .. }
            | ParticleCondition::Velocity { spheres, .. }
            | ParticleCondition::Spin { spheres, .. } => spheres.clone(),
            ParticleCondition::Load { loads, .. } => loads.iter().map(|l| l.sphere).collect(),
        }
    }

    /// What is wrong with it for so many spheres.
    pub(super) fn check(&self, spheres: usize) -> Result<()> {
        if let Some(missing) = self.spheres().into_iter().find(|&s| s as usize >= spheres) {
            return Err(Error::input(
                format!("a condition concerns sphere {}, but there are {spheres}", u64::from(missing) + 1),
                "use the spheres that exist",
            ));
        }
        Ok(())
    }

    /// What it does at time t (s): loads now, held velocities such that the step h (s) ahead ends where it should.
    pub(super) fn act(&self, particles: &Particles, t: f64, step: f64, acting: &mut Acting) {
        match self {
            ParticleCondition::Displacement { spheres, value, history } => {
                let factor = history.at(t + step);
                for (axis, value) in value.iter().enumerate() {
                    let Some(value) = value else { continue };
                    acting.held.extend(spheres.iter().map(|&sphere| {
                        let now = particles.displacement(sphere as usize)[axis];
                        Held { sphere, component: axis, velocity: (value * factor - now) / step }
                    }));
                }
            }
            ParticleCondition::Velocity { spheres, value, history } => {
                hold(spheres, value, 0, history.at(t + 0.5 * step), acting);
            }
            ParticleCondition::Spin { spheres, value, history } => {
                hold(spheres, value, 3, history.at(t + 0.5 * step), acting);
            }
            ParticleCondition::Load { loads, history } => {
                let factor = history.at(t);
                acting.loads.extend(loads.iter().map(|l| PointLoad {
                    sphere: l.sphere,
                    force: l.force * factor,
                    moment: l.moment * factor,
                }));
            }
        }
    }
}

/// Prescribe velocities from component `first` on.
fn hold(spheres: &[u32], value: &[Option<f64>; 3], first: usize, factor: f64, acting: &mut Acting) {
    for (axis, value) in value.iter().enumerate() {
        let Some(value) = value else { continue };
        let velocity = value * factor;
        acting.held.extend(spheres.iter().map(|&sphere| Held { sphere, component: first + axis, velocity }));
    }
}
