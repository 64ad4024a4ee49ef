//! Spheres in motion with the ledger of their energies: what every run, test and study of packings steps with.

mod motion;

pub(in crate::experiment) use motion::Progress;
pub(in crate::experiment) use motion::checked_step;
pub use motion::{MotionPlan, ParticleMotion};
