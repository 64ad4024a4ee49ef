//! Studies: many calibrations at once, and the document's own, recomputed beside its printed values.

pub mod batch;
pub mod cavity;
pub mod closed_forms;
mod corrected;
pub mod element_test;
mod grid_study;
mod lattice_study;
mod packing_simulation;
pub mod particles;
pub mod prakash;
mod problem;
mod simulation;
pub mod smilauer;
mod verification;

pub use corrected::{
    CorrectedModuli, CorrectedNetwork, Correction, CorrectionForm, CorrectionReport, NodalReport, central_by_sum,
    hybrid_by_sum, nodal_on_contacts,
};
pub use grid_study::GridStudy;
pub use lattice_study::{CorrectionChoice, LatticePlan, LatticeStudy, anisotropy_axis, turned_to_axis};
pub use packing_simulation::{
    CellDrive, CellState, Leavers, PackingEvidence, PackingProblem, PackingSimulation, Peak, ServoPlan,
};
pub use problem::{
    Condition, Crack, FieldName, FractureEnergy, History, OutputPlan, Probe, Problem, Quantity, RegionMaterial,
    Schedule, Slice, Softening,
};
pub use simulation::{
    CrackPath, CrackPoint, CrackTip, InterfaceEvidence, InterfaceFracture, Ledger, RegionEvidence, RunCost, SavedState,
    Simulation, StaticEvidence, StepEvidence, TipPoint, diffuse_warning,
};
pub use verification::{Finding, Verdict};
