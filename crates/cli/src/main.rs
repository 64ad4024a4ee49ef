//! The command line of anisobond.
fn main() {}
