//! Where bonds are.

mod contacts;
mod influence;
mod neighbourhood;
mod packing;

pub use contacts::{Contact, Lattice, naive_contacts};
pub use influence::Influence;
pub use neighbourhood::{Bond, Neighbourhood, Shape};
pub use packing::Packing;
