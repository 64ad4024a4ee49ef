//! Studies: many calibrations at once, and the document's own, recomputed beside its printed values.

pub mod batch;
pub mod element_test;
pub mod prakash;
pub mod smilauer;
mod verification;

pub use verification::{Finding, Verdict};
