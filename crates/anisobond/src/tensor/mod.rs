//! An elastic tensor and what can be said of it without a lattice.

mod cauchy;
mod class;
mod material;
mod stiffness;

pub use cauchy::{MONOMIALS, Quartic, cauchy_coordinates, quartic_of, quartic_weights, tensor_of};
pub use class::{SymmetryClass, closure, project};
pub use material::Material;
pub use stiffness::{PAIRS, Stiffness, mandel_rotation, mandel_weight, row_of};
