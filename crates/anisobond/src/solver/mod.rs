//! Equilibrium and motion, written against the operator only.

mod conjugate_gradients;
pub mod grid;
mod motion;
pub mod particles;
mod preconditioner;
mod watch;

pub use conjugate_gradients::{
    SolverReport, Stopping, conjugate_gradients, conjugate_gradients_seen, conjugate_gradients_watched,
};
pub use motion::{Kick, stable_step};
pub use preconditioner::BlockJacobi;
pub use watch::{Look, Watch};
