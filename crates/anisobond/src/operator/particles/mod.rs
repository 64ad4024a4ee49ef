//! Spheres with rotations, joined by bonds and touching each other, in motion or at rest.
//!
//! A [`ParticleModel`] says what the spheres and bonds are; [`Particles`] is their state and computes forces from it. Who
//! moves the state is `solver::particles`.

mod bond;
mod contact;
mod departed;
mod gather;
mod ghosts;
mod kernel;
mod model;
pub mod naive;
mod pose;
mod rows;
mod system;
mod three;

pub use bond::Carried;
pub use contact::{ContactLaw, TouchingPair};
pub use model::{ParticleModel, Strength, bulk_masses, sphere_masses};
pub use pose::Pose;
pub use system::{Broken, Particles, Snapshot, Sums};
