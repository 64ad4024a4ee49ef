//! Where bonds are.

mod influence;
mod neighbourhood;

pub use influence::Influence;
pub use neighbourhood::{Bond, Neighbourhood, Shape};
