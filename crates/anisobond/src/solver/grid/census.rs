//! What every node of a body has of its bonds: looked at once, used by free modes and preconditioner alike.

use std::collections::HashMap;

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::connected::{ConnectedPart, visit_bonds};
use super::links::Links;
use crate::operator::GridOperator;

/// A node is whole when it has all but this share of its bonds.
const WHOLE: f64 = 1.0 - 1e-9;

/// How whole every node's neighbourhood is, which parts bonds hold together, and what cracks part.
pub(super) struct Census {
    /// Share of bonds that are there (–), 0 for empty nodes.
    pub wholeness: Vec<f64>,
    /// Parts held together by bonds.
    pub parts: Vec<ConnectedPart>,
    /// Neighbours that cracks part.
    pub links: Links,
}

impl Census {
    /// Look at every bond.
    pub fn new(operator: &dyn GridOperator) -> Self {
        let body = operator.body();
        let (parts, links) = visit_bonds(operator);
        let wholeness = |node| if body.has(node) { operator.wholeness(node) } else { 0.0 };
        Census { wholeness: (0..body.grid.len()).into_par_iter().map(wholeness).collect(), parts, links }
    }

    /// Whether a node has all its bonds.
    pub fn whole(&self, node: usize) -> bool {
        self.wholeness[node] >= WHOLE
    }
}

/// The diagonal blocks of all nodes. Most nodes are in the bulk and share theirs.
pub(super) struct Blocks {
    /// Distinct blocks (N/m): 11 22 33 23 13 12.
    pub distinct: Vec<[f64; 6]>,
    /// Block of each node.
    pub kind: Vec<u32>,
}

impl Blocks {
    /// Ask for every node's.
    pub fn new(operator: &dyn GridOperator) -> Self {
        let grid = &operator.body().grid;
        let plane = grid.nodes[0] * grid.nodes[1];
        let mut blocks = Blocks { distinct: Vec::new(), kind: Vec::with_capacity(grid.len()) };
        let mut known: HashMap<[u64; 6], u32> = HashMap::new();
        let mut last = None;
        for start in (0..grid.len()).step_by(plane) {
            let upper = |node| upper(&operator.diagonal_block(node));
            let here: Vec<[f64; 6]> = (start..start + plane).into_par_iter().map(upper).collect();
            for block in here {
                let key = block.map(f64::to_bits);
                let number = match last {
                    Some((k, number)) if k == key => number,
                    _ => *known.entry(key).or_insert_with(|| {
                        blocks.distinct.push(block);
                        (blocks.distinct.len() - 1) as u32
                    }),
                };
                last = Some((key, number));
                blocks.kind.push(number);
            }
        }
        blocks
    }

    /// Block (N/m) of a node.
    pub fn of(&self, node: usize) -> Matrix3<f64> {
        let [a, b, c, d, e, f] = self.distinct[self.kind[node] as usize];
        Matrix3::new(a, f, e, f, b, d, e, d, c)
    }
}

/// 11 22 33 23 13 12.
fn upper(m: &Matrix3<f64>) -> [f64; 6] {
    [m[(0, 0)], m[(1, 1)], m[(2, 2)], m[(1, 2)], m[(0, 2)], m[(0, 1)]]
}
