//! Neighbours that a crack parts.

use std::collections::HashMap;

/// Pairs of nodes, at most one step apart along every axis, that nothing joins although both are material.
#[derive(Clone, Default)]
pub(super) struct Links {
    /// Of every node that is parted from any: from which.
    parted: HashMap<u32, Vec<u32>>,
}

impl Links {
    /// Note that two nodes are parted.
    pub fn part(&mut self, a: usize, b: usize) {
        for (a, b) in [(a, b), (b, a)] {
            self.parted.entry(a as u32).or_default().push(b as u32);
        }
    }

    /// Whether no crack parts two nodes.
    pub fn joined(&self, a: usize, b: usize) -> bool {
        self.parted.get(&(a as u32)).is_none_or(|others| !others.contains(&(b as u32)))
    }

    /// Whether a node is parted from any.
    pub fn touches(&self, node: usize) -> bool {
        self.parted.contains_key(&(node as u32))
    }
}
