//! The cavity: a circular hole under pressure in anisotropic rock, the last section of the cross-anisotropy document (S,
//! "Videos"). Its three observations as numbers, on grids and on packings:
//!
//! 1. the wave is faster along the stiffer direction: speeds of arrival against those of Christoffel's tensor;
//! 2. deformation is larger along the softer direction: ratio of the wall's displacements;
//! 3. radial load displaces axially where the axis of anisotropy leaves the section: sign and size against generalised
//!    plane strain.

mod body;
mod closed;
mod statics;
mod waves;

pub use body::CavityBody;
pub use closed::{Cavity, WallMotion};
pub use statics::{CavityStatics, statics};
pub use waves::{Arrival, CavityWaves, Rays, waves};
