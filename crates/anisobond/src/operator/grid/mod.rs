//! Bonds of a body on a regular grid, without a bond list.
//!
//! A node's bonds are those of its stencil; of each only one bit is stored, whether it is unbroken. Bulk nodes, all of
//! whose neighbours have the same stencil or are missing, are taken a vector at a time (`kernels`); the others one by one,
//! with the mean of what both ends of a bond say (`special`).

pub(super) mod ahead;
mod aligned;
mod beyond;
mod build;
mod departed;
mod failed;
mod failing;
mod hybrid;
mod interface;
mod kernels;
pub(super) mod lanes;
mod law;
mod layout;
mod linear_operator;
mod measure;
pub mod naive;
mod nodal;
mod nonlinear;
mod offsets;
mod openings;
mod padded;
mod pulling;
mod real;
mod shortened;
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
pub use failed::BondLoss;
pub use failing::{FailingBonds, Failure, Overstretched, Way};
pub use interface::InterfaceBonds;
pub use lanes::InstructionSet;
pub use measure::NodeState;
pub use openings::Opening;
pub use padded::Padded;
pub use real::{Real, Word};
pub use state::KeptBonds;
pub use stencil::Stencil;
pub use sweep::Broken;
