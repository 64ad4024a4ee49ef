//! What a run on a packing would take, counted without running it.

use serde::Serialize;

use crate::case::{CaseFile, ConditionPlan, plan::conditions};
use anisobond::experiment::{PackingEvidence, PackingProblem};

/// Numbers of a case on a packing.
#[derive(Clone, Debug, Serialize)]
pub struct PackingPlan {
    /// Name of the case.
    pub name: String,
    /// Spheres.
    pub particles: usize,
    /// Mean radius (m).
    pub radius: f64,
    /// Bonds, each pair counted once.
    pub bonds: usize,
    /// Axes along which the body is periodic.
    pub periodic: [bool; 3],
    /// Volume of rock that the spheres stand for (m³), pores included.
    pub volume: f64,
    /// Mass (kg).
    pub mass: f64,
    /// Whether bonds break.
    pub breaks: bool,
    /// Estimate of the memory of a run (bytes).
    pub memory: u64,
    /// The lattice, by region.
    pub lattice: Vec<PackingEvidence>,
    /// What to look at before a run: spheres that nothing joins, parts that nothing holds together.
    pub warnings: Vec<String>,
    /// Conditions.
    pub conditions: Vec<ConditionPlan>,
    /// Names of probes, with the number of their spheres.
    pub probes: Vec<(String, usize)>,
}

pub fn plan(case: &CaseFile, problem: &PackingProblem) -> PackingPlan {
    PackingPlan {
        name: problem.name.clone(),
        particles: problem.model.packing.len(),
        radius: problem.mean_radius(),
        bonds: problem.model.bonds.len(),
        periodic: problem.periodic,
        volume: problem.volumes.iter().sum(),
        mass: problem.model.mass.iter().sum(),
        breaks: problem.model.strength.is_some(),
        memory: problem.memory(),
        lattice: problem.evidence.clone(),
        warnings: case.notes().into_iter().chain(problem.warnings()).collect(),
        conditions: conditions(case, &problem.conditions),
        probes: problem.probes.iter().map(|p| (p.name.clone(), p.nodes.len())).collect(),
    }
}
