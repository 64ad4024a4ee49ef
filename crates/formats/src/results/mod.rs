//! What a run writes: frames for ParaView, probes, pictures, checkpoints.

mod appended;
mod checkpoint;
mod image_data;
mod npy;
mod point_data;
mod series;
mod table;
mod writer;

pub use appended::FieldArray;
pub use checkpoint::{Checkpoint, Checkpoints};
pub use image_data::image_data;
pub use npy::{NpyNumber, npy, read_npy};
pub use point_data::point_data;
pub use series::{Series, pvd};
pub use table::ProbeTable;
pub use writer::BackgroundWriter;
