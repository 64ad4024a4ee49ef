//! Equilibrium of bodies on grids.

mod banded;
mod census;
mod coarsening;
mod connected;
mod element;
mod equilibrium;
mod free_modes;
mod hexahedra;
mod linear;
mod links;
mod multigrid;
mod nonlinear;
mod pieces;
mod preconditioner;
mod relaxation;
mod rigid;
mod supports;
mod symmetric3;
mod tangent;
mod transfer;
mod vectors;
mod waves;

pub use connected::{ConnectedPart, separate_parts};
pub use equilibrium::{Equilibrium, Method, Prepared};
pub use free_modes::FreeModes;
pub use linear::FreePart;
pub use multigrid::Smoothing;
pub use preconditioner::{NodeBlocks, Scheme, TwoScale};
pub use supports::Supports;
