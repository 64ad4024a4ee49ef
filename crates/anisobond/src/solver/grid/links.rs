//! Neighbours that a crack parts, on the grid and on every coarser one.
//!
//! A coarse node lies on a grid node. Displacements jump across a crack, so a grid node takes them from coarse nodes of its
//! own side only, and an element whose corners lie on both sides holds nothing.

use std::collections::{BTreeSet, HashSet};

use super::transfer::Transfer;

/// Pairs of nodes, at most one step apart along every axis, that nothing joins although both are material.
#[derive(Clone, Default)]
pub(super) struct Links {
    /// Lower node first.
    parted: HashSet<(u32, u32)>,
}

impl Links {
    /// Note that two nodes are parted.
    pub fn part(&mut self, a: usize, b: usize) {
        self.parted.insert((a.min(b) as u32, a.max(b) as u32));
    }

    /// Whether no crack parts two nodes.
    pub fn joined(&self, a: usize, b: usize) -> bool {
        !self.parted.contains(&(a.min(b) as u32, a.max(b) as u32))
    }

    /// The same on the coarse grid: two coarse nodes are parted where a step between the grid nodes below them is.
    pub fn coarse(&self, transfer: &Transfer) -> Links {
        // Only coarse nodes around the ends of parted steps can be.
        let unique = |list: Vec<[usize; 3]>| -> BTreeSet<[usize; 3]> { list.into_iter().collect() };
        let below = |node: usize| -> [usize; 3] {
            let at = transfer.coordinates(node);
            [0, 1, 2].map(|a| at[a] / transfer.axes[a].factor)
        };
        let lower = unique(self.ends().map(|node| below(node as usize)).collect());
        let near = unique(lower.into_iter().flat_map(|at| transfer.around(at)).collect());
        let mut coarse = Links::default();
        for corner in near {
            let from = transfer.coarse_index(corner);
            for other in transfer.around(corner) {
                let to = transfer.coarse_index(other);
                if from < to && !self.path(transfer, corner, other) {
                    coarse.part(from, to);
                }
            }
        }
        coarse
    }

    /// Ends of parted steps, some more than once.
    fn ends(&self) -> impl Iterator<Item = u32> {
        self.parted.iter().flat_map(|&(a, b)| [a, b])
    }

    /// Whether the steps from a coarse node to a neighbour, by way of the grid node between them, are joined.
    fn path(&self, transfer: &Transfer, from: [usize; 3], to: [usize; 3]) -> bool {
        let (Some(start), Some(end)) = (transfer.fine_of(from), transfer.fine_of(to)) else { return true };
        let middle = [0, 1, 2].map(|a| transfer.axes[a].between(start[a], end[a], transfer.fine[a]));
        let [start, middle, end] = [start, middle, end].map(|at| transfer.fine_index(at));
        self.joined(start, middle) && self.joined(middle, end)
    }

    /// Grid nodes that take their displacement from fewer coarse nodes than usual, ascending, and from which, with what weight.
    pub fn exceptions(&self, transfer: &Transfer) -> Vec<(u32, Vec<(u32, f64)>)> {
        let nodes: BTreeSet<u32> = self.ends().collect();
        nodes.into_iter().filter_map(|node| Some((node, self.parents(transfer, node as usize)?))).collect()
    }

    /// Coarse nodes on a node's own side, with weights that sum to 1; `None` where these are all, or none.
    fn parents(&self, transfer: &Transfer, node: usize) -> Option<Vec<(u32, f64)>> {
        let usual = transfer.parents(node);
        let mut own: Vec<(u32, f64)> = usual
            .iter()
            .filter(|(coarse, _)| transfer.fine_of(*coarse).is_none_or(|at| self.joined(node, transfer.fine_index(at))))
            .map(|(coarse, weight)| (transfer.coarse_index(*coarse) as u32, *weight))
            .collect();
        let sum: f64 = own.iter().map(|p| p.1).sum();
        own.iter_mut().for_each(|p| p.1 /= sum);
        (own.len() < usual.len() && !own.is_empty()).then_some(own)
    }

    /// Whether any two corners of an element are parted.
    pub fn splits(&self, corners: &[usize; 8]) -> bool {
        !self.parted.is_empty() && (0..8).any(|a| (0..a).any(|b| !self.joined(corners[a], corners[b])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block cut between two layers: every coarser grid is cut there too, displacements come from a node's own side, and
    /// P stays the transpose of Pᵀ and keeps constants.
    #[test]
    fn a_crack_is_passed_on_to_coarser_grids() {
        for (n, wraps, layer) in
            [([9, 9, 9], [false; 3], 3), ([8, 8, 12], [true, true, false], 6), ([5, 1, 16], [false, true, false], 7)]
        {
            let mut links = Links::default();
            let index = |[x, y, z]: [usize; 3]| x + n[0] * (y + n[1] * z);
            let whole = Transfer::new(n, wraps);
            // The transfer of a grid to itself has the neighbours of every node; use the coarse side of a finer one.
            let finer = Transfer::new(n.map(|n| if n > 1 { 2 * n } else { 1 }), [true; 3]);
            for y in 0..n[1] {
                for x in 0..n[0] {
                    for [x2, y2, z2] in finer.around([x, y, layer]).into_iter().filter(|at| at[2] == layer + 1) {
                        let inside = x.abs_diff(x2) <= 1 && y.abs_diff(y2) <= 1;
                        if inside || wraps[0] {
                            links.part(index([x, y, layer]), index([x2, y2, z2]));
                        }
                    }
                }
            }
            let transfer = Transfer::new(n, wraps).beside(&links);
            let coarse = links.coarse(&whole);
            let [c1, c2, _] = transfer.coarse();
            let lower = layer / 2;
            for j in 0..c2 {
                for i in 0..c1 {
                    let at = |k: usize| i + c1 * (j + c2 * k);
                    assert!(!coarse.joined(at(lower), at(lower + 1)), "{n:?}");
                    assert!(lower == 0 || coarse.joined(at(lower - 1), at(lower)), "{n:?}");
                }
            }
            // The two sides move apart: so do the fine nodes, without anything in between.
            let side = |k: usize| if k <= lower { -1.0 } else { 1.0 };
            let jump: Vec<[f64; 3]> =
                (0..transfer.coarse().iter().product()).map(|node| [side(node / (c1 * c2)), 1.0, 0.0]).collect();
            let mut fine = vec![[0.0; 3]; n.iter().product()];
            transfer.prolong_add(&jump, &mut fine);
            for (node, v) in fine.iter().enumerate() {
                let wanted = if node / (n[0] * n[1]) <= layer { -1.0 } else { 1.0 };
                assert!((v[0] - wanted).abs() < 1e-14 && (v[1] - 1.0).abs() < 1e-14, "{n:?} {node}: {v:?}");
            }
            let value = |s: f64, i: usize| -> [f64; 3] { std::array::from_fn(|a| (s * i as f64 + a as f64).sin()) };
            let x: Vec<[f64; 3]> = (0..jump.len()).map(|i| value(1.3, i)).collect();
            let y: Vec<[f64; 3]> = (0..fine.len()).map(|i| value(0.7, i)).collect();
            let mut px = vec![[0.0; 3]; fine.len()];
            transfer.prolong_add(&x, &mut px);
            let pty = transfer.restrict(|i| y[i]);
            let dot = |a: &[[f64; 3]], b: &[[f64; 3]]| -> f64 {
                a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1] + a[2] * b[2]).sum()
            };
            assert!((dot(&px, &y) - dot(&x, &pty)).abs() < 1e-12, "{n:?}");
        }
    }
}
