//! Spheres under conditions: motion in time with its energies, and a triaxial test to failure.

mod conditions;
mod ledger;
mod motion;
mod triaxial;

pub use conditions::ParticleCondition;
pub use ledger::ParticleLedger;
pub use motion::{MotionPlan, ParticleMotion};
pub use triaxial::{TriaxialPoint, TriaxialResult, TriaxialTest};
