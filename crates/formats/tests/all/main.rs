//! Tests of the readers of files.

mod foreign;
mod tables;
