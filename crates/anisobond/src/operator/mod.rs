//! The sum over bonds: fast kernels on a bond list, and the dense matrix they must agree with.

mod bond_list;
pub mod grid;
mod grid_cell;
mod grid_operator;
mod hybrid_naive;
pub(crate) mod lanczos;
mod local_strain;
mod morton;
pub mod naive;
mod nodal_term;
pub mod particles;
mod vector_field;

pub use bond_list::{BondList, Field, Measured, Network, NodeField, StiffBond};
pub use grid_cell::GridCell;
pub use grid_operator::{GridOperator, Kinematics};
pub use hybrid_naive::{BlockResponse, PeriodicHybrid};
pub use local_strain::{GradientFit, LocalGradient, LocalState};
pub use nodal_term::{NodalTerm, symmetric_part};
pub use vector_field::VectorField;
