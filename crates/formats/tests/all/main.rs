//! Tests of the readers of files.

mod foreign;
mod packings;
mod packings_vtk;
mod tables;
