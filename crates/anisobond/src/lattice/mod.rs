//! Where bonds are.

mod contacts;
pub mod generate;
mod grid;
mod influence;
mod neighbourhood;
mod packing;
mod search;
pub mod solid;
mod statistics;

pub use contacts::{Contact, Lattice, contacts, naive_contacts};
pub use grid::{Body, Grid};
pub use influence::Influence;
pub use neighbourhood::{Bond, Neighbourhood, Shape};
pub use packing::Packing;
pub use solid::Solid;
pub use statistics::{PackingStatistics, Range};
