//! The conditions of a problem, sorted by the rows of its grid.

use nalgebra::Vector3;

use crate::experiment::problem::{Condition, History, Problem};
use crate::lattice::Grid;
use crate::operator::VectorField;
use crate::{Error, Result};

/// A force on a node: `force` (N) times a history.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NodeForce {
    pub(super) node: u32,
    history: u32,
    force: Vector3<f64>,
}

/// A prescribed component: `value` (m or m/s) times a history.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Prescribed {
    pub(super) node: u32,
    pub(super) axis: u8,
    pub(super) velocity: bool,
    history: u32,
    value: f64,
}

impl Prescribed {
    /// Whether both prescribe the same at all times.
    fn says_as(&self, other: &Prescribed, histories: &[History]) -> bool {
        let history = |p: &Prescribed| &histories[p.history as usize];
        self.velocity == other.velocity
            && self.value == other.value
            && (self.value == 0.0 || history(self) == history(other))
    }
}

/// What acts on the body, row by row.
#[derive(Clone, Debug)]
pub(super) struct Loading {
    histories: Vec<History>,
    forces: ByRow<NodeForce>,
    prescribed: ByRow<Prescribed>,
}

/// Entries sorted by node, and where each row of the grid begins.
#[derive(Clone, Debug)]
struct ByRow<T> {
    entries: Vec<T>,
    start: Vec<u32>,
}

impl<T> ByRow<T> {
    fn new(mut entries: Vec<T>, node: impl Fn(&T) -> u32, grid: &Grid) -> Self {
        entries.sort_by_key(&node);
        let row_length = grid.nodes[0];
        let rows = grid.nodes[1] * grid.nodes[2];
        let start = (0..=rows).map(|row| entries.partition_point(|e| (node(e) as usize) < row * row_length) as u32);
        let start = start.collect();
        ByRow { entries, start }
    }

    fn row(&self, row: usize) -> &[T] {
        &self.entries[self.start[row] as usize..self.start[row + 1] as usize]
    }
}

/// The factors of all histories at one moment.
pub(super) struct Factors(Vec<f64>);

impl Loading {
    /// # Errors
    /// A component that two conditions prescribe differently.
    pub(super) fn new(problem: &Problem) -> Result<Self> {
        let (mut histories, mut forces, mut prescribed) = (Vec::new(), Vec::new(), Vec::new());
        for condition in &problem.conditions {
            let number = histories.len() as u32;
            match condition {
                Condition::Force { nodes, force, history } => {
                    histories.push(history.clone());
                    // A node may carry several surfaces.
                    for (&node, &force) in nodes.iter().zip(force) {
                        match forces.last_mut().filter(|f: &&mut NodeForce| (f.node, f.history) == (node, number)) {
                            Some(last) => last.force += force,
                            None => forces.push(NodeForce { node, history: number, force }),
                        }
                    }
                }
                Condition::Displacement { nodes, value, history } | Condition::Velocity { nodes, value, history } => {
                    histories.push(history.clone());
                    let velocity = matches!(condition, Condition::Velocity { .. });
                    for (axis, value) in value.iter().enumerate().filter_map(|(a, v)| v.map(|v| (a as u8, v))) {
                        let entry = |&node: &u32| Prescribed { node, axis, velocity, history: number, value };
                        prescribed.extend(nodes.iter().map(entry));
                    }
                }
            }
        }
        prescribed.sort_by_key(|p| (p.node, p.axis));
        // Edges and corners may belong to two conditions that say the same.
        prescribed.dedup_by(|a, b| (a.node, a.axis) == (b.node, b.axis) && a.says_as(b, &histories));
        let twice = prescribed.windows(2).find(|w| (w[0].node, w[0].axis) == (w[1].node, w[1].axis));
        if let Some(pair) = twice {
            let place = problem.body.grid.position(pair[0].node as usize);
            return Err(Error::input(
                format!(
                    "component {} of the node at ({}, {}, {}) m is prescribed differently by two conditions",
                    ["x", "y", "z"][usize::from(pair[0].axis)],
                    place.x,
                    place.y,
                    place.z
                ),
                "let the regions of the two conditions not share nodes, or prescribe other components",
            ));
        }
        let grid = &problem.body.grid;
        Ok(Loading {
            histories,
            forces: ByRow::new(forces, |f| f.node, grid),
            prescribed: ByRow::new(prescribed, |p| p.node, grid),
        })
    }

    /// All histories at time t (s).
    pub(super) fn at(&self, t: f64) -> Factors {
        Factors(self.histories.iter().map(|h| h.at(t)).collect())
    }

    /// Forces on the nodes of a row (N).
    pub(super) fn forces<'a>(
        &'a self,
        row: usize,
        at: &'a Factors,
    ) -> impl Iterator<Item = (usize, Vector3<f64>)> + 'a {
        self.forces.row(row).iter().map(|f| (f.node as usize, f.force * at.0[f.history as usize]))
    }

    /// Prescribed components of the nodes of a row, with their value (m or m/s).
    pub(super) fn prescribed<'a>(
        &'a self,
        row: usize,
        at: &'a Factors,
    ) -> impl Iterator<Item = (&'a Prescribed, f64)> + 'a {
        self.prescribed.row(row).iter().map(|p| (p, p.value * at.0[p.history as usize]))
    }

    /// Forces of all nodes (N).
    pub(super) fn force_field(&self, nodes: usize, at: &Factors) -> VectorField {
        let mut field = VectorField::zeros(nodes);
        for f in &self.forces.entries {
            let sum = field.at(f.node as usize) + f.force * at.0[f.history as usize];
            field.set(f.node as usize, &sum);
        }
        field
    }

    /// Prescribed displacements (m): node and components.
    pub(super) fn displacements(&self, at: &Factors) -> Vec<(u32, [Option<f64>; 3])> {
        let entries = self.prescribed.entries.iter().filter(|p| !p.velocity);
        entries
            .map(|p| {
                let mut value = [None; 3];
                value[usize::from(p.axis)] = Some(p.value * at.0[p.history as usize]);
                (p.node, value)
            })
            .collect()
    }
}
