//! All tests of the crate in one program, which links once.

mod common;

mod analysis;
mod calibration;
mod closed_forms;
mod conventions;
mod corrected;
mod damping;
mod element_test;
mod equilibrium;
mod examples;
mod exposed;
mod fracture;
mod grid_cells;
mod grid_kernels;
mod in_energy;
mod micropolar;
mod near_extreme;
mod noisy;
mod nodal_term;
mod objective;
mod particle_bodies;
mod particle_contacts;
mod particle_forces;
mod particle_laws;
mod particle_motion;
mod servo;
mod solver;
mod stability;
mod surface;
mod waves;
