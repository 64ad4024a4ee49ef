//! Studies: many calibrations at once, and the document's own, recomputed beside its printed values.

pub mod batch;
pub mod cavity;
mod checked;
pub mod closed_forms;
mod corrected;
pub mod element_test;
mod field;
mod grid_study;
mod lattice_study;
mod memory;
mod outcome;
mod packing_simulation;
pub mod particles;
pub mod prakash;
mod problem;
mod simulation;
pub mod smilauer;
mod verification;

pub use checked::Checked;
pub use corrected::{
    CorrectedModuli, CorrectedNetwork, Correction, CorrectionForm, CorrectionReport, NodalReport, central_by_sum,
    hybrid_by_sum, nodal_on_contacts,
};
pub use field::{FieldAbout, FieldName, Quantity, Shown};
pub use grid_study::GridStudy;
pub use lattice_study::{CorrectionChoice, LatticePlan, LatticeStudy, anisotropy_axis, turned_to_axis};
pub use memory::{machine_memory, refuse_beyond_memory};
pub use outcome::{Break, Collapse, Outcome, StepLook, WithinStep};
pub use packing_simulation::{
    CellDrive, CellState, Leavers, PackingEvidence, PackingFacts, PackingProblem, PackingSimulation, Peak, ServoPlan,
};
pub use problem::{
    Condition, Crack, FractureEnergy, History, OutputPlan, Probe, Problem, RegionMaterial, Schedule, Slice,
};
pub use simulation::{
    Between, CrackPath, CrackPoint, CrackTip, GridFacts, InterfaceEvidence, InterfaceFracture, Ledger, Overlap,
    RegionEvidence, RunCost, SavedState, Simulation, StaticEvidence, StepEvidence, TipPoint, diffuse_warning,
};
pub use verification::{Finding, Verdict};
