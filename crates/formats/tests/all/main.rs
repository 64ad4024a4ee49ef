//! Tests of the readers of files.

mod digits;
mod foreign;
mod packings;
mod packings_vtk;
mod tables;
