//! Files in and out: one module per format.

mod atomic;
mod bonds;

pub mod picture;
mod vtk;

pub use atomic::write_atomically;
pub use bonds::{BondTable, bonds_csv, read_bonds, write_bonds};
pub use vtk::{neighbourhood_vtp, write_vtp};
