//! Nodes that move without costing energy.

use serde::Serialize;

use crate::lattice::parts;
use crate::operator::Network;
use crate::{Error, Result};

/// What of a lattice moves freely; all node numbers count from 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Mechanism {
    /// Nodes without any bond.
    pub floaters: Vec<usize>,
    /// Number of parts that no bond joins, floaters not counted.
    pub parts: usize,
    /// Nodes of the smaller parts.
    pub apart: Vec<usize>,
    /// Bonded nodes of the largest part that move relative to it at no cost.
    pub loose: Vec<usize>,
    /// Nodes that only spin at no cost; harmless, they are left at rest.
    pub spinning: Vec<usize>,
    /// Unknowns (translations apart) without a bond force to hold them, even if every bond force counts; 0 says nothing.
    pub missing_constraints: usize,
}

/// How many node numbers a message lists.
const LISTED: usize = 8;

impl Mechanism {
    /// Floaters, parts and the count of constraints; `loose` and `spinning` need a solve.
    pub(super) fn of_graph(network: &Network, rotations_free: bool) -> Self {
        let mut degree = vec![0usize; network.nodes.len()];
        let mut constraints = 0;
        for bond in &network.bonds {
            degree[bond.a as usize] += 1;
            degree[bond.b as usize] += 1;
            constraints += usize::from(bond.normal > 0.0) + 2 * usize::from(bond.tangential > 0.0);
        }
        if let Some(term) = &network.nodal {
            // An average strain holds as many as six unknowns.
            constraints += 6 * term.volumes.iter().filter(|v| **v > 0.0).count();
        }
        let floaters: Vec<usize> = (0..degree.len()).filter(|&i| degree[i] == 0 && degree.len() > 1).collect();
        let roots = parts(degree.len(), network.bonds.iter().map(|b| (b.a, b.b)));
        let mut size = vec![0usize; degree.len()];
        for (i, &r) in roots.iter().enumerate() {
            size[r as usize] += usize::from(degree[i] > 0);
        }
        let parts = size.iter().filter(|s| **s > 0).count();
        let largest = (0..size.len()).max_by_key(|&r| (size[r], std::cmp::Reverse(r))).unwrap_or(0);
        let apart = (0..roots.len()).filter(|&i| degree[i] > 0 && roots[i] as usize != largest).collect();
        let sheared = network.bonds.iter().any(|b| b.tangential > 0.0);
        let per_node = if rotations_free && sheared { 6 } else { 3 };
        let unknowns = (per_node * (degree.len() - floaters.len())).saturating_sub(3);
        Mechanism {
            floaters,
            parts,
            apart,
            missing_constraints: unknowns.saturating_sub(constraints),
            ..Mechanism::default()
        }
    }

    /// Whether nothing but translation (and spin) is free.
    pub fn is_none(&self) -> bool {
        self.floaters.is_empty() && self.parts <= 1 && self.loose.is_empty()
    }

    /// `self` if nothing moves freely.
    ///
    /// # Errors
    /// Otherwise one message: which nodes, and what to do.
    pub fn refuse(&self) -> Result<()> {
        let mut faults = Vec::new();
        if !self.floaters.is_empty() {
            faults.push(format!("{} without any bond ({})", counted(self.floaters.len()), listed(&self.floaters)));
        }
        if self.parts > 1 {
            faults.push(format!(
                "{} parts that no bond joins ({} apart from the largest: {})",
                self.parts,
                counted(self.apart.len()),
                listed(&self.apart)
            ));
        }
        if !self.loose.is_empty() {
            let mut fault = format!(
                "{} that can move relative to the others at no cost ({})",
                counted(self.loose.len()),
                listed(&self.loose)
            );
            if self.missing_constraints > 0 {
                fault += &format!(", at least {} bond forces too few", self.missing_constraints);
            }
            faults.push(fault);
        }
        if faults.is_empty() {
            return Ok(());
        }
        Err(Error::mechanism(
            format!("the lattice is a mechanism: it has {}", faults.join(" and ")),
            "give a larger contact radius, remove these nodes, or ask for mechanisms to be reported only",
        ))
    }
}

fn counted(n: usize) -> String {
    if n == 1 { "1 node".into() } else { format!("{n} nodes") }
}

/// Node numbers as the user counts them, from 1.
fn listed(nodes: &[usize]) -> String {
    let mut names: Vec<String> = nodes.iter().take(LISTED).map(|i| (i + 1).to_string()).collect();
    if nodes.len() > LISTED {
        names.push(format!("and {} more", nodes.len() - LISTED));
    }
    format!("number {}", names.join(", "))
}
