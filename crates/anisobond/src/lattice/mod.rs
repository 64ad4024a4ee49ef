//! Where bonds are.

mod contacts;
mod cut;
pub mod generate;
mod grid;
mod influence;
mod neighbourhood;
mod packing;
mod parts;
mod search;
pub mod solid;
mod statistics;

pub use contacts::{Contact, Lattice, contacts, naive_contacts};
pub use cut::CutBody;
pub use grid::{Body, Grid};
pub use influence::Influence;
pub use neighbourhood::{Bond, Neighbourhood, Shape};
pub use packing::Packing;
pub use parts::parts;
pub use solid::Solid;
pub use statistics::{PackingStatistics, Range};
