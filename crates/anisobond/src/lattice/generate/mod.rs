//! Packings of our own: random ones by overlap removal, and crystals.

mod crystal;
mod radii;
mod random;
mod relax;
mod stream;

pub use crystal::{Crystal, crystal};
pub use radii::{Radii, Share};
pub use random::{
    Extent, Generated, GenerationReport, Outcome, Progress, RandomPacking, Target, random, random_observed,
};
pub(in crate::lattice) use stream::Stream;
