//! Studies: many calibrations at once, and the document's own, recomputed beside its printed values.

pub mod batch;
pub mod closed_forms;
mod corrected;
pub mod element_test;
mod lattice_study;
pub mod prakash;
mod problem;
mod simulation;
pub mod smilauer;
mod verification;

pub use corrected::{CorrectedLattice, CorrectedModuli, Correction, CorrectionForm, CorrectionReport};
pub use lattice_study::{LatticeStudy, anisotropy_axis, turned_to_axis};
pub use problem::{
    Condition, Crack, FieldName, FractureEnergy, History, OutputPlan, Probe, Problem, Quantity, RegionMaterial,
    Schedule, Slice, Softening,
};
pub use simulation::{Ledger, RegionEvidence, SavedState, Simulation, SpeedFit, StaticEvidence, StepEvidence};
pub use verification::{Finding, Verdict};
