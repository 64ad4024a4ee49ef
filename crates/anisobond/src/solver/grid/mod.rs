//! Equilibrium of bodies on grids.

mod banded;
mod census;
mod coarsening;
mod conjugate_gradients;
mod connected;
mod element;
mod equilibrium;
mod free_modes;
mod hexahedra;
mod links;
mod load_steps;
mod multigrid;
mod nonlinear;
mod pieces;
mod preconditioner;
mod relaxation;
mod rigid;
mod supports;
mod symmetric3;
mod transfer;
mod vectors;
mod watch;
mod waves;

pub use conjugate_gradients::{Ending, GridSolverReport};
pub use connected::{ConnectedPart, separate_parts};
pub use equilibrium::{Equilibrium, Method, Prepared};
pub use free_modes::FreeModes;
pub use load_steps::{Breaking, LoadStep, Settled, SettlingEnd, load_steps, settle};
pub use multigrid::Smoothing;
pub use preconditioner::{NodeBlocks, Preconditioner, Scheme, TwoScale};
pub use supports::Supports;
