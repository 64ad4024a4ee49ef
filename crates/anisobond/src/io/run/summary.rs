//! What a run comes to, as one JSON document.

use serde::Serialize;

use crate::experiment::{CrackPath, Ledger, RegionEvidence, Simulation, StaticEvidence, StepEvidence};

/// Cracks told of.
const MOST_CRACKS: usize = 10;

/// The end of a run.
#[derive(Clone, Debug, Serialize)]
pub struct RunSummary {
    /// Name of the case.
    pub case: String,
    /// Material nodes.
    pub nodes: usize,
    /// Bonds, each pair once.
    pub bonds: u64,
    /// Time steps or load steps done.
    pub steps: u64,
    /// Time reached (s), or load factor (–).
    pub time: f64,
    /// The time step; `None` in equilibrium.
    pub time_step: Option<StepEvidence>,
    /// The last load step; `None` in motion.
    pub equilibrium: Option<StaticEvidence>,
    /// Materials: what was asked, what the bonds reach.
    pub regions: Vec<RegionEvidence>,
    /// Energies at the end (J).
    pub energy: Ledger,
    /// Drift of the energy relative to the largest energy (–).
    pub relative_drift: f64,
    /// Largest damage of a node (–).
    pub largest_damage: f64,
    /// Cracks that have grown, the longest first, ten at most.
    pub cracks: Vec<CrackPath>,
    /// Seconds of wall time, all sessions together.
    pub seconds: f64,
    /// What to look at.
    pub warnings: Vec<String>,
}

impl RunSummary {
    /// The summary of a run that has ended, with its cracks.
    pub fn new(simulation: &Simulation, cracks: &[CrackPath], seconds: f64, mut warnings: Vec<String>) -> Self {
        let energy = *simulation.ledger();
        let relative_drift = energy.relative_drift();
        warnings.extend(simulation.drift_warning());
        RunSummary {
            case: simulation.problem().name.clone(),
            nodes: simulation.problem().body.nodes(),
            bonds: simulation.bonds(),
            steps: simulation.step(),
            time: simulation.time(),
            time_step: simulation.step_evidence(),
            equilibrium: simulation.static_evidence(),
            regions: simulation.regions().to_vec(),
            energy,
            relative_drift,
            largest_damage: simulation.largest_damage(),
            cracks: cracks.iter().take(MOST_CRACKS).cloned().collect(),
            seconds,
            warnings,
        }
    }
}
