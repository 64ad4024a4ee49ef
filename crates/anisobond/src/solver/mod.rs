//! Equilibrium and motion, written against the operator only.

mod conjugate_gradients;
pub mod grid;
mod motion;
pub mod particles;
mod preconditioner;

pub use conjugate_gradients::{SolverReport, Stopping, conjugate_gradients};
pub use motion::{Kick, stable_step};
pub use preconditioner::BlockJacobi;
