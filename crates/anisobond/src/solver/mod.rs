//! Equilibrium, written against the operator only.

mod conjugate_gradients;
pub mod grid;
mod preconditioner;

pub use conjugate_gradients::{SolverReport, Stopping, conjugate_gradients};
pub use preconditioner::BlockJacobi;
