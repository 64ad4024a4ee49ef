//! Text and bytes to values and back: units, materials, tables, packings, bonds, VTK, checkpoints. One file per format.

pub mod words;
pub mod csv_text;
pub mod inputs;
pub mod tree;
pub mod units;
pub mod orientation;
pub mod material;
pub mod table;
pub mod atomic;
pub mod json;
pub mod bonds;
pub mod vtk;
pub mod packing;
pub mod flat;
pub mod find;
pub mod pairs;
pub mod lattice_bonds;
pub mod results;
pub mod stl;

pub use atomic::write_atomically;
pub use bonds::{BondModuli, BondTable, TangentialColumns, bonds_csv, read_bonds, write_bonds};
pub use csv_text::unguarded;
pub use find::{builtin_material, find_material, find_reading, parse_any};
pub use flat::{Column, FlatTable};
pub use inputs::Inputs;
pub use json::{json_file, json_text, json_value};
pub use lattice_bonds::{lattice_bonds_csv, lattice_vtp, network_bonds_csv};
pub use material::{Reading, material_text, parse_class, parse_material, parse_reading, read_material, read_reading};
pub use orientation::{Orientation, parse_orientation, smallest_rotation};
pub use packing::{
    PackingColumn, PackingFormat, PackingOptions, PackingReading, packing_text, parse_packing, read_packing,
    read_packing_as, write_packing,
};
pub use pairs::{find_influence, read_influence, read_pairs};
pub use stl::{parse_stl, read_stl};
pub use table::{Row, Table, is_table, parse_table, read_table};
pub use units::{Dimension, parse_angle, parse_density, parse_length, parse_stress, parse_vector};
pub use vtk::{neighbourhood_vtp, write_vtp};
