//! What every node of a body has of its bonds: looked at once, used by free modes and preconditioner alike.

use std::collections::{BTreeMap, HashMap};

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::connected::{ConnectedPart, visit_bonds};
use super::links::Links;
use super::pieces::Sets;
use super::transfer::Transfer;
use crate::lattice::Body;
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

    /// The nodes of every piece of the coarse elements that are not all material in one piece.
    pub fn pieces(&self, body: &Body, transfer: &Transfer) -> BTreeMap<u32, Vec<Vec<u32>>> {
        let elements: usize = transfer.elements().iter().product();
        let parted = |element: usize| Some((element as u32, self.pieces_of(body, &transfer.nodes_of(element))?));
        (0..elements).into_par_iter().with_min_len(64).filter_map(parted).collect()
    }

    /// Nodes of an element in pieces that neighbours hold together; `None` where they are all of them, in one piece.
    fn pieces_of(&self, body: &Body, nodes: &[usize]) -> Option<Vec<Vec<u32>>> {
        let held: Vec<usize> = nodes.iter().copied().filter(|n| self.wholeness[*n] > 0.0).collect();
        if held.len() == nodes.len() && !nodes.iter().any(|n| self.links.touches(*n)) {
            return None;
        }
        let at: Vec<[usize; 3]> = held.iter().map(|n| body.grid.coordinates(*n)).collect();
        let near = |i: usize, j: usize| {
            (0..3).all(|a| {
                let (n, d) = (body.grid.nodes[a], at[i][a].abs_diff(at[j][a]));
                d <= 1 || body.grid.periodic[a] && d + 1 >= n
            })
        };
        let mut sets = Sets::new(held.len());
        for i in 0..held.len() {
            for j in (0..i).filter(|j| near(i, *j)) {
                if self.links.joined(held[i], held[j]) {
                    sets.join(i, j);
                }
            }
        }
        let number = sets.numbers();
        let mut pieces = vec![Vec::new(); number.iter().max().map_or(0, |m| m + 1)];
        held.iter().zip(number).for_each(|(node, piece)| pieces[piece].push(*node as u32));
        (held.len() < nodes.len() || pieces.len() > 1).then_some(pieces)
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
