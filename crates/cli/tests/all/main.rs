//! All tests of the program in one, which links once.

mod common;

mod cli;
mod corrections;
mod cracks;
mod doors;
mod export;
mod faults;
mod models;
mod packings;
mod rank;
mod report;
mod runs;
mod studio;
