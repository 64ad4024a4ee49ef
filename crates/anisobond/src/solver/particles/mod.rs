//! Spheres brought into motion or to rest.

mod servo;
mod spectrum;
mod statics;
mod verlet;

pub use servo::{Control, Servo, affine_stiffness, mean_stress};
pub use spectrum::{damped_step, largest_squared_frequency, stable_step};
pub use statics::{Resting, SpheresAtRest, Support, equilibrium};
pub use verlet::{Acting, Held, PointLoad, Runaway, Verlet, Work};
