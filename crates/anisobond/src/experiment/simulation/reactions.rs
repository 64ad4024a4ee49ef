//! Forces of the bonds on the nodes of reaction probes, taken from the forces that a step has found anyway.

use nalgebra::Vector3;

use crate::experiment::field::Quantity;
use crate::experiment::problem::Problem;

/// The nodes of all reaction probes, ascending, and the forces on them (N) in the last step.
#[derive(Clone, Debug, Default)]
pub(super) struct Reactions {
    nodes: Vec<u32>,
    forces: Vec<Vector3<f64>>,
}

impl Reactions {
    /// The nodes of a problem's probes; no forces are known yet.
    pub(super) fn new(problem: &Problem) -> Self {
        let probes = problem.probes.iter().filter(|p| p.quantity == Quantity::Reaction);
        let mut nodes: Vec<u32> = probes.flat_map(|p| p.nodes.iter().copied()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        Reactions { nodes, forces: Vec::new() }
    }

    /// Those of the nodes that are in a range.
    pub(super) fn within(&self, nodes: std::ops::Range<usize>) -> &[u32] {
        let from = |node: usize| self.nodes.partition_point(|&n| (n as usize) < node);
        &self.nodes[from(nodes.start)..from(nodes.end)]
    }

    /// Note the forces of a step, node by node.
    pub(super) fn note(&mut self, forces: impl Iterator<Item = Vector3<f64>>) {
        self.forces.clear();
        self.forces.extend(forces);
    }

    /// Note the forces of a step from those on all nodes.
    pub(super) fn note_of(&mut self, at: impl Fn(usize) -> Vector3<f64>) {
        self.forces.clear();
        self.forces.extend(self.nodes.iter().map(|&node| at(node as usize)));
    }

    /// Nothing is known of the present state.
    pub(super) fn forget(&mut self) {
        self.forces.clear();
    }

    /// The force on a node; `None` if it was not noted.
    pub(super) fn at(&self, node: usize) -> Option<Vector3<f64>> {
        let place = self.nodes.binary_search(&u32::try_from(node).ok()?).ok()?;
        self.forces.get(place).copied()
    }
}
