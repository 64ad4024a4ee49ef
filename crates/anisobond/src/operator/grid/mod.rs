//! Bonds of a body on a regular grid, without a bond list.
//!
//! A node's bonds are those of its stencil; of each only one bit is stored, whether it is unbroken. Bulk nodes, all of
//! whose neighbours have the same stencil or are missing, are taken a vector at a time (`kernels`); the others one by one,
//! with the mean of what both ends of a bond say (`special`).

pub(super) mod ahead;
mod aligned;
mod build;
mod failing;
mod hybrid;
mod kernels;
pub(super) mod lanes;
mod law;
mod layout;
mod linear_operator;
mod measure;
pub mod naive;
mod nodal;
mod offsets;
mod padded;
mod real;
mod softening;
mod special;
mod spectrum;
mod state;
mod stencil;
mod strain;
mod strip;
mod surroundings;
mod sweep;
mod tables;

pub use build::GridBonds;
pub use failing::{FailingBonds, Failure, Overstretched, Way};
pub use lanes::InstructionSet;
pub use measure::NodeState;
pub use padded::Padded;
pub use real::{Real, Word};
pub use softening::LinearSoftening;
pub use stencil::Stencil;
pub use sweep::Broken;
