//! What a run comes to, as one JSON document.

use serde::{Deserialize, Serialize};

use anisobond::experiment::{
    CellState, CrackPath, InterfaceEvidence, Leavers, Ledger, Outcome, Overlap, PackingEvidence, PackingSimulation,
    Peak, RegionEvidence, Simulation, StaticEvidence, StepEvidence, diffuse_warning,
};

/// Cracks told of.
const MOST_CRACKS: usize = 10;

/// The end of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunSummary {
    /// Name of the case.
    pub case: String,
    /// Material nodes, or particles.
    pub nodes: usize,
    /// Bonds, each pair once.
    pub bonds: u64,
    /// How it ended.
    #[serde(default)]
    pub outcome: Outcome,
    /// Time steps or load steps done.
    pub steps: u64,
    /// Time reached (s), or load factor of the last equilibrium (–).
    pub time: f64,
    /// The time step; `None` in equilibrium.
    pub time_step: Option<StepEvidence>,
    /// The last load step; `None` in motion.
    pub equilibrium: Option<StaticEvidence>,
    /// Materials: what was asked, what the bonds reach.
    pub regions: Vec<RegionEvidence>,
    /// Where regions of a grid meet, by pairs: what the bonds between them are.
    #[serde(default)]
    pub interfaces: Vec<InterfaceEvidence>,
    /// Energies at the end (J).
    pub energy: Ledger,
    /// Drift of the energy relative to the largest energy (–).
    pub relative_drift: f64,
    /// Largest damage of a node (–).
    pub largest_damage: f64,
    /// Cracks that have grown, the longest first, ten at most.
    pub cracks: Vec<CrackPath>,
    /// The deepest that parts of a body on a grid lay in each other; `None` where none did.
    #[serde(default)]
    pub overlap: Option<Overlap>,
    /// Share of the energy of failed bonds that lies beyond the reach of every crack (–); `None` where nothing has failed.
    #[serde(default)]
    pub diffuse_damage: Option<f64>,
    /// What a packing's run has besides; `None` of a grid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub packing: Option<PackingSummary>,
    /// Seconds of wall time, all sessions together.
    pub seconds: f64,
    /// What to look at.
    pub warnings: Vec<String>,
}

/// What a packing's run comes to besides.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PackingSummary {
    /// The lattice, by region.
    pub lattice: Vec<PackingEvidence>,
    /// Spheres without a bond.
    pub floaters: usize,
    /// Spheres that have left the body's box; `None` if none has.
    pub leavers: Option<Leavers>,
    /// Bonds broken.
    pub broken_bonds: u64,
    /// Mean stress and strain at the end of a body that is periodic along all axes.
    pub cell: Option<CellState>,
    /// The largest differential stress under a servo.
    pub peak: Option<Peak>,
}

impl RunSummary {
    /// The summary of a run on a packing that has ended.
    pub(super) fn of_packing(simulation: &PackingSimulation, seconds: f64, mut warnings: Vec<String>) -> Self {
        let energy = *simulation.ledger();
        warnings.extend(simulation.late_warnings());
        RunSummary {
            case: simulation.problem().name.clone(),
            nodes: simulation.particles().len(),
            bonds: simulation.bonds(),
            outcome: simulation.outcome().clone(),
            steps: simulation.step(),
            time: simulation.reached(),
            time_step: simulation.step_evidence(),
            equilibrium: simulation.static_evidence(),
            regions: Vec::new(),
            interfaces: Vec::new(),
            energy,
            relative_drift: energy.relative_drift(),
            largest_damage: simulation.largest_damage(),
            cracks: Vec::new(),
            overlap: None,
            diffuse_damage: None,
            packing: Some(PackingSummary {
                lattice: simulation.problem().evidence.clone(),
                floaters: simulation.floaters().len(),
                leavers: simulation.leavers(),
                broken_bonds: energy.broken_bonds,
                cell: simulation.cell(),
                peak: simulation.peak(),
            }),
            seconds,
            warnings,
        }
    }

    /// The summary of a run on a grid that has ended.
    pub(super) fn of_grid(simulation: &Simulation, seconds: f64, mut warnings: Vec<String>) -> Self {
        let energy = *simulation.ledger();
        let relative_drift = energy.relative_drift();
        warnings.extend(simulation.late_warnings());
        let (cracks, diffuse_damage) = (simulation.cracks(), simulation.diffuse_damage());
        warnings.extend(diffuse_warning(&cracks, diffuse_damage));
        RunSummary {
            case: simulation.problem().name.clone(),
            nodes: simulation.problem().body.nodes(),
            bonds: simulation.bonds(),
            outcome: simulation.outcome().clone(),
            steps: simulation.step(),
            time: simulation.reached(),
            time_step: simulation.step_evidence(),
            equilibrium: simulation.static_evidence(),
            regions: simulation.regions().to_vec(),
            interfaces: simulation.interfaces().to_vec(),
            energy,
            relative_drift,
            largest_damage: simulation.largest_damage(),
            cracks: cracks.into_iter().take(MOST_CRACKS).collect(),
            overlap: simulation.overlap().cloned(),
            diffuse_damage,
            packing: None,
            seconds,
            warnings,
        }
    }
}
