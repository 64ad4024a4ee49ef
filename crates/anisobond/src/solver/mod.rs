//! Equilibrium and motion, written against the operator only.

mod bonds;
mod conjugate_gradients;
pub mod grid;
mod linear;
mod motion;
pub mod particles;
mod preconditioner;
mod progress;
mod report;
mod semidefinite;
mod settling;
mod true_residual;
mod watch;

pub use bonds::solve_bonds;
pub use conjugate_gradients::{Next, Products, Rule, System};
pub use linear::{LinearOperator, Preconditioner, VectorSpace};
pub use motion::{Kick, damped_step, stable_step};
pub use preconditioner::BlockJacobi;
pub use progress::Progress;
pub use report::{Ending, SolverReport, Stopping};
pub use semidefinite::Semidefinite;
pub use settling::{Settled, SettlingEnd, settle};
pub use true_residual::TrueResidual;
pub use watch::{Look, Watch};
