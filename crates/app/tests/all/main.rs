//! All tests of the crate in one program, which links once.

#[path = "../../../anisobond/tests/all/common/mod.rs"]
mod common;
mod given;

mod bodies;
mod bond_laws;
mod capabilities;
mod case_errors;
mod case_files;
mod cases;
mod cavity;
mod checked;
mod cracks;
mod doubts;
mod fields;
mod hybrid;
mod interfaces;
mod kinds;
mod large_motion;
mod outcomes;
mod packing;
mod packing_laws;
mod packing_regions;
mod peers;
mod reading;
mod reading_errors;
mod reading_tables;
mod softening;
mod surface_loads;
mod sweep;
mod watch;
