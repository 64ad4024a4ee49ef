//! What a user writes is read here, and what a model says is written: one file per format.

mod words;
mod tree;
pub mod units;
pub mod orientation;

pub use orientation::{Orientation, parse_orientation, smallest_rotation};
pub use units::{Dimension, parse_angle, parse_density, parse_length, parse_stress};
