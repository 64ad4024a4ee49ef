//! A case of the cavity on either lattice, as the experiment sees it.

use nalgebra::Vector3;

use super::closed::Cavity;
use crate::Result;
use crate::experiment::field::Quantity;
use crate::experiment::problem::{Condition, History, Probe, Schedule};
use crate::experiment::{PackingProblem, PackingSimulation, Problem, Simulation};

/// The problem of a cavity.
#[derive(Clone, Debug)]
pub enum CavityBody {
    /// On a grid.
    Grid(Box<Problem>),
    /// On a packing.
    Packing(Box<PackingProblem>),
}

/// A simulation of either.
pub(super) enum Running {
    Grid(Box<Simulation>),
    Packing(Box<PackingSimulation>),
}

impl CavityBody {
    /// Its nodes: numbers and places (m).
    pub fn nodes(&self) -> Vec<(u32, Vector3<f64>)> {
        match self {
            CavityBody::Grid(p) => {
                let body = &p.body;
                let filled = (0..body.grid.len()).filter(|&n| body.has(n));
                filled.map(|n| (n as u32, body.grid.position(n))).collect()
            }
            CavityBody::Packing(p) => (0..p.model.packing.len()).map(|s| (s as u32, p.position(s))).collect(),
        }
    }

    /// Distance between neighbouring nodes (m): the grid's spacing, or the mean diameter.
    pub fn spacing(&self) -> f64 {
        match self {
            CavityBody::Grid(p) => p.body.grid.spacing,
            CavityBody::Packing(p) => 2.0 * p.mean_radius(),
        }
    }

    /// Whether it moves or rests.
    pub fn schedule(&self) -> &Schedule {
        match self {
            CavityBody::Grid(p) => &p.schedule,
            CavityBody::Packing(p) => &p.schedule,
        }
    }

    fn conditions_mut(&mut self) -> &mut Vec<Condition> {
        match self {
            CavityBody::Grid(p) => &mut p.conditions,
            CavityBody::Packing(p) => &mut p.conditions,
        }
    }

    /// The same body, what its conditions hold by displacements being held where the closed form has it: then a box of
    /// some radii acts like an infinite body.
    pub fn embedded(mut self, cavity: &Cavity) -> Self {
        let places: std::collections::HashMap<u32, Vector3<f64>> = self.nodes().into_iter().collect();
        let conditions = self.conditions_mut();
        let mut held: Vec<u32> = Vec::new();
        conditions.retain(|condition| match condition {
            Condition::Displacement { nodes, .. } => {
                held.extend(nodes);
                false
            }
            _ => true,
        });
        held.sort_unstable();
        held.dedup();
        let history = History::Ramp { start: 0.0, end: 1.0 };
        conditions.extend(held.into_iter().map(|node| {
            let value = cavity.displacement(&places[&node]).map(Some).into();
            Condition::Displacement { nodes: vec![node], value, history: history.clone() }
        }));
        self
    }

    pub(super) fn start(self) -> Result<Running> {
        Ok(match self {
            CavityBody::Grid(p) => Running::Grid(Box::new(Simulation::new(*p)?)),
            CavityBody::Packing(p) => Running::Packing(Box::new(PackingSimulation::new(*p)?)),
        })
    }
}

impl Running {
    pub(super) fn advance(&mut self) -> Result<()> {
        match self {
            Running::Grid(s) => s.advance(),
            Running::Packing(s) => s.advance(),
        }
    }

    pub(super) fn finished(&self) -> bool {
        match self {
            Running::Grid(s) => s.finished(),
            Running::Packing(s) => s.finished(),
        }
    }

    pub(super) fn time(&self) -> f64 {
        match self {
            Running::Grid(s) => s.time(),
            Running::Packing(s) => s.time(),
        }
    }

    /// Displacement of a node (m).
    pub(super) fn displacements(&self) -> Vec<Vector3<f64>> {
        match self {
            Running::Grid(s) => {
                let u = s.displacement();
                (0..u.len()).map(|n| u.at(n)).collect()
            }
            Running::Packing(s) => s.particles().displacements(),
        }
    }

    /// Mean velocity (m/s) over some nodes.
    pub(super) fn velocity(&self, nodes: &[u32]) -> Vector3<f64> {
        let probe = Probe { name: String::new(), quantity: Quantity::Velocity, nodes: nodes.to_vec() };
        let row = match self {
            Running::Grid(s) => s.measure(&probe),
            Running::Packing(s) => s.measure(&probe),
        };
        Vector3::from_column_slice(&row)
    }
}
