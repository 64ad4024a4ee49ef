//! What a run would take, counted without running it.

use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;

use super::CaseFile;
use super::loads::Load;
use anisobond::experiment::{Condition, Problem};
use anisobond::lattice::{Body, Grid, Neighbourhood};

/// Numbers of a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CasePlan {
    /// Name of the case.
    pub name: String,
    /// Nodes of the grid along each axis.
    pub grid: [usize; 3],
    /// Grid spacing Δ (m).
    pub spacing: f64,
    /// Axes along which the grid is periodic.
    pub periodic: [bool; 3],
    /// Nodes of the body.
    pub nodes: usize,
    /// Bonds of a node in the bulk.
    pub bonds_per_node: usize,
    /// Bonds of the body, each pair counted once, before cracks. Bonds through periodic faces are among them.
    pub bonds: u64,
    /// Estimate of the memory of a run (bytes): displacement, velocity and force, region, stencil and one bit per bond.
    pub memory: u64,
    /// Regions.
    pub regions: Vec<RegionPlan>,
    /// What to look at before a run.
    pub warnings: Vec<String>,
    /// Conditions.
    pub conditions: Vec<ConditionPlan>,
    /// Names of probes, with the number of their nodes.
    pub probes: Vec<(String, usize)>,
    /// Pre-cracks.
    pub cracks: usize,
}

/// Numbers of a region.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RegionPlan {
    /// Name.
    pub name: String,
    /// Nodes.
    pub nodes: usize,
    /// Volume (m³): nodes times Δ³.
    pub volume: f64,
    /// Density (kg/m³); 0 if none is given.
    pub density: f64,
    /// Stiffness C33 of the material in the grid's axes and its kin: the diagonal C11, C22, C33 (Pa).
    pub normal_stiffness: [f64; 3],
    /// Whether its bonds break.
    pub breaks: bool,
}

/// Numbers of a condition.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionPlan {
    /// Name.
    pub name: String,
    /// Its key: displacement, traction, …
    pub kind: &'static str,
    /// Nodes.
    pub nodes: usize,
    /// Resultant of its forces (N) at the history's value 1; `None` where it prescribes motion.
    pub force: Option<[f64; 3]>,
    /// Sum of the magnitudes of its forces (N).
    pub load: Option<f64>,
}

/// The plan of a problem.
pub(super) fn plan(case: &CaseFile, problem: &Problem) -> CasePlan {
    let (body, grid) = (&problem.body, &problem.body.grid);
    let bonds_per_node = problem.neighbourhood.bonds().len();
    let mut counts = vec![0usize; problem.regions.len() + 1];
    body.region.iter().for_each(|&r| counts[usize::from(r)] += 1);
    let regions = problem.regions.iter().zip(&counts[1..]).map(|(region, &nodes)| {
        let c = region.stiffness.voigt();
        RegionPlan {
            name: region.name.clone(),
            nodes,
            volume: nodes as f64 * grid.spacing.powi(3),
            density: region.density,
            normal_stiffness: [c[(0, 0)], c[(1, 1)], c[(2, 2)]],
            breaks: region.fracture.is_some(),
        }
    });
    CasePlan {
        name: problem.name.clone(),
        grid: grid.nodes,
        spacing: grid.spacing,
        periodic: grid.periodic,
        nodes: body.nodes(),
        bonds_per_node,
        bonds: bonds(body, &problem.neighbourhood),
        memory: memory(grid, &problem.neighbourhood),
        regions: regions.collect(),
        warnings: case.notes(),
        conditions: conditions(case, &problem.conditions),
        probes: problem.probes.iter().map(|p| (p.name.clone(), p.nodes.len())).collect(),
        cracks: problem.cracks.len(),
    }
}

/// Estimate of the memory of a run (bytes): three vectors, region, stencil and a bit per bond of every node of the grid.
pub(super) fn memory(grid: &Grid, neighbourhood: &Neighbourhood) -> u64 {
    let words = (neighbourhood.bonds().len() / 2).div_ceil(64) as u64;
    grid.len() as u64 * (3 * 24 + 2 + 2 + 8 * words)
}

/// Numbers of the conditions of a case, given as they are resolved.
pub(super) fn conditions(case: &CaseFile, resolved: &[Condition]) -> Vec<ConditionPlan> {
    let plans = case.conditions.iter().zip(resolved).map(|(statement, condition)| {
        let (nodes, force) = match condition {
            Condition::Displacement { nodes, .. } | Condition::Velocity { nodes, .. } => (nodes, None),
            Condition::Force { nodes, force, .. } => (nodes, Some(force)),
        };
        // A node has a force for each of the surfaces that it carries.
        let nodes = nodes.iter().collect::<std::collections::HashSet<_>>().len();
        ConditionPlan {
            name: statement.name.clone(),
            kind: kind(&statement.load),
            nodes,
            force: force.map(|f| f.iter().sum::<Vector3<f64>>().into()),
            load: force.map(|f| f.iter().map(Vector3::norm).sum()),
        }
    });
    plans.collect()
}

fn kind(load: &Load) -> &'static str {
    match load {
        Load::Displacement(_) => "displacement",
        Load::Velocity(_) => "velocity",
        Load::Traction(_) => "traction",
        Load::Pressure(_) => "pressure",
        Load::BodyForce(_) => "body_force",
        Load::Acceleration(_) => "acceleration",
        Load::Force(_) => "force",
    }
}

/// Bonds of a body, each once: for every offset of the half-neighbourhood, rows of nodes laid over shifted rows.
fn bonds(body: &Body, neighbourhood: &Neighbourhood) -> u64 {
    let grid = &body.grid;
    let [n1, n2, n3] = grid.nodes;
    let along = |a: usize, x: usize, offset: i32| -> Option<usize> {
        let n = grid.nodes[a] as i64;
        let to = x as i64 + i64::from(offset);
        let to = if grid.periodic[a] { to.rem_euclid(n) } else { to };
        (0..n).contains(&to).then_some(to as usize)
    };
    let half = &neighbourhood.bonds()[neighbourhood.bonds().len() / 2..];
    let row_pairs = |j: usize, k: usize, offset: [i32; 3]| -> u64 {
        let (Some(j2), Some(k2)) = (along(1, j, offset[1]), along(2, k, offset[2])) else { return 0 };
        let row = |j: usize, k: usize| &body.region[grid.index([0, j, k])..grid.index([0, j, k]) + n1];
        let (from, to) = (row(j, k), row(j2, k2));
        (0..n1).filter(|&i| from[i] > 0 && along(0, i, offset[0]).is_some_and(|i2| to[i2] > 0)).count() as u64
    };
    let rows = (0..n2 * n3).into_par_iter();
    rows.map(|row| half.iter().map(|b| row_pairs(row % n2, row / n2, b.offset)).sum::<u64>()).sum()
}
