//! Exact answers as code: what a simulation is measured against.
//!
//! Everything here is two-dimensional in the sense of generalised plane strain: three components of displacement that
//! do not change along x₃. [`Stroh`] solves such problems for any tensor, [`BarnettLothe`] gives what needs no roots.

mod barnett_lothe;
mod beam;
mod crack;
mod hole;
mod rayleigh;
mod stroh;
mod thin;

pub use barnett_lothe::BarnettLothe;
pub use beam::Cantilever;
pub use crack::CentreCrack;
pub use hole::PressurisedHole;
pub use rayleigh::{RayleighWave, rayleigh_wave};
pub use stroh::Stroh;
pub use thin::{bar_wave, plate_waves};
