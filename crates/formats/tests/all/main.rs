//! Tests of the readers of files.

mod digits;
mod foreign;
mod tables;
