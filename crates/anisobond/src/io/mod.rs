//! What a user writes is read here, and what a model says is written: one file per format.

mod words;
mod tree;
pub mod units;
pub mod orientation;
pub mod material;
mod record;
pub mod table;
mod atomic;
mod bonds;
pub mod picture;
mod vtk;
mod packing;
pub mod report;
pub mod lattice_report;
mod journal;
mod flat;
mod calibrate_table;
mod find;
mod influence;
pub mod sweep;
pub mod element_sweep;

pub use atomic::write_atomically;
pub use bonds::{BondTable, bonds_csv, read_bonds, write_bonds};
pub use calibrate_table::{TableResults, calibrate_table};
pub use find::find_material;
pub use influence::read_influence;
pub use journal::Journal;
pub use lattice_report::{ElementTestReport, LatticeReport};
pub use material::{parse_class, parse_material, read_material};
pub use orientation::{Orientation, parse_orientation, smallest_rotation};
pub use packing::{PackingFormat, packing_text, parse_packing, read_packing, write_packing};
pub use report::{CalibrationReport, TensorReport};
pub use table::{Row, Table, is_table, parse_table, read_table};
pub use units::{Dimension, parse_angle, parse_density, parse_length, parse_stress};
pub use vtk::{neighbourhood_vtp, write_vtp};
