//! Pieces of material within a coarse element that nothing joins, and the coarse nodes of each.
//!
//! Displacements jump across cracks, gaps and slots. A coarse element across which material is parted is there once for every
//! piece, each with corners of its own; pieces of neighbouring elements share the corners between them where they share a grid
//! node (the virtual nodes of Molino, Bao & Fedkiw 2004, ACM Trans. Graph. 23, 385). So every part of a body, and every side
//! of a crack, has all linear displacements on every coarse grid, rigid motions among them, and no element is a hinge.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::transfer::Transfer;

/// A piece of material within a coarse element.
pub(super) struct Piece {
    /// Grid nodes, ascending.
    pub nodes: Vec<u32>,
    /// Coarse nodes.
    pub corners: [u32; 8],
}

/// The coarse elements that are not whole.
pub(super) struct Pieces {
    /// Of every element that is not all material in one piece: its pieces.
    pub of: BTreeMap<u32, Vec<Piece>>,
    /// Of every coarse node beyond the grid of them, the node of that grid on which it lies.
    pub copies: Vec<u32>,
    /// Grid nodes that take nothing from coarse nodes.
    pub left: BTreeSet<u32>,
}

impl Pieces {
    /// From the nodes of every piece of the elements that are not whole; the coarse nodes are to be those of a transfer.
    pub fn new(transfer: &Transfer, parted: BTreeMap<u32, Vec<Vec<u32>>>) -> Self {
        let mut of: BTreeMap<u32, Vec<Piece>> = parted
            .into_iter()
            .map(|(e, pieces)| {
                let corners = transfer.corners(e as usize).map(|c| c as u32);
                (e, pieces.into_iter().map(|nodes| Piece { nodes, corners }).collect())
            })
            .collect();
        let places: BTreeSet<u32> = of.keys().flat_map(|e| transfer.corners(*e as usize).map(|c| c as u32)).collect();
        let places: Vec<u32> = places.into_iter().collect();
        let split: Vec<Vec<(u32, u32, u32)>> =
            places.par_iter().map(|place| split_place(transfer, &of, *place as usize)).collect();
        let mut copies = Vec::new();
        for (place, split) in places.into_iter().zip(split) {
            let first = (transfer.coarse_grid() + copies.len()) as u32;
            let most = split.iter().map(|s| s.2).max().unwrap_or(0);
            copies.resize(copies.len() + most as usize, place);
            for (element, piece, number) in split.into_iter().filter(|s| s.2 > 0) {
                let own = of.get_mut(&element).and_then(|pieces| pieces.get_mut(piece as usize));
                let corners = own.into_iter().flat_map(|piece| &mut piece.corners);
                corners.filter(|c| **c == place).for_each(|c| *c = first + number - 1);
            }
        }
        Pieces { of, copies, left: BTreeSet::new() }
    }

    /// The piece of an element that holds a grid node; `None` of a whole element.
    pub fn holding(&self, element: usize, node: u32) -> Option<&Piece> {
        self.of.get(&(element as u32))?.iter().find(|p| p.nodes.binary_search(&node).is_ok())
    }
}

/// Pieces (element, number) around a coarse node, each with the number of its copy of that node, 0 for the first.
fn split_place(transfer: &Transfer, of: &BTreeMap<u32, Vec<Piece>>, place: usize) -> Vec<(u32, u32, u32)> {
    let mut pieces: Vec<(u32, u32)> = Vec::new();
    let mut held: Vec<(u32, u32)> = Vec::new();
    // Whole elements first: they hold the coarse node of the grid.
    let (whole, parted): (Vec<usize>, Vec<usize>) =
        transfer.elements_around(place).into_iter().partition(|e| !of.contains_key(&(*e as u32)));
    for element in whole.into_iter().chain(parted) {
        let mut hold = |piece: usize, nodes: &mut dyn Iterator<Item = u32>| {
            held.extend(nodes.map(|node| (node, pieces.len() as u32)));
            pieces.push((element as u32, piece as u32));
        };
        match of.get(&(element as u32)) {
            None => hold(0, &mut transfer.nodes_of(element).into_iter().map(|n| n as u32)),
            Some(own) => own.iter().enumerate().for_each(|(i, piece)| hold(i, &mut piece.nodes.iter().copied())),
        }
    }
    held.sort_unstable();
    let mut sets = Sets::new(pieces.len());
    held.windows(2).filter(|w| w[0].0 == w[1].0).for_each(|w| sets.join(w[0].1 as usize, w[1].1 as usize));
    let number = sets.numbers();
    pieces.into_iter().zip(number).map(|((element, piece), number)| (element, piece, number as u32)).collect()
}

/// Sets of nodes that share one are one; nodes ascending, sets by their first members in the list.
pub(super) fn merge_sharing(cells: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let mut held: Vec<(u32, usize)> =
        cells.iter().enumerate().flat_map(|(i, nodes)| nodes.iter().map(move |n| (*n, i))).collect();
    held.sort_unstable();
    let mut sets = Sets::new(cells.len());
    held.windows(2).filter(|w| w[0].0 == w[1].0).for_each(|w| sets.join(w[0].1, w[1].1));
    let number = sets.numbers();
    let mut pieces = vec![Vec::new(); number.iter().max().map_or(0, |m| m + 1)];
    held.dedup_by_key(|h| h.0);
    held.into_iter().for_each(|(node, cell)| pieces[number[cell]].push(node));
    pieces
}

/// Disjoint sets.
pub(super) struct Sets(Vec<usize>);

impl Sets {
    /// Each of one member.
    pub fn new(members: usize) -> Self {
        Sets((0..members).collect())
    }

    fn root(&self, mut i: usize) -> usize {
        while self.0[i] != i {
            i = self.0[i];
        }
        i
    }

    /// Make the sets of two members one, whose root is the first of its members.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }

    /// Of every member, the number of its set; sets are numbered by their first members.
    pub fn numbers(&self) -> Vec<usize> {
        let mut number: Vec<usize> = Vec::with_capacity(self.0.len());
        let mut count = 0;
        for i in 0..self.0.len() {
            let root = self.root(i);
            if root == i {
                number.push(count);
                count += 1;
            } else {
                number.push(number[root]);
            }
        }
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::{Body, Grid};
    use crate::solver::grid::census::Census;
    use crate::solver::grid::links::Links;
    use nalgebra::Vector3;

    /// A block cut between two layers, once or twice, far apart or on both sides of one layer: every part has its own coarse nodes, so
    /// that linear displacements of each part alone are those of coarse nodes, and P is the transpose of Pᵀ.
    #[test]
    fn parts_have_their_own_coarse_nodes() {
        let cases: [([usize; 3], [bool; 3], &[usize]); 4] = [
            ([9, 9, 9], [false; 3], &[3]),
            ([8, 8, 12], [true, true, false], &[6]),
            ([5, 1, 16], [false, true, false], &[7, 8]),
            ([6, 4, 9], [false; 3], &[2, 5]),
        ];
        for (n, periodic, layers) in cases {
            let body = Body::full(Grid::new(n, 1.0, Vector3::zeros(), periodic).unwrap());
            let part = |node: usize| layers.iter().filter(|l| body.grid.coordinates(node)[2] > **l).count();
            let mut links = Links::default();
            for node in 0..body.grid.len() {
                for step in (0..9).map(|s| [s % 3 - 1, s / 3 - 1, 1]) {
                    if let Some(other) = body.grid.neighbour(node, step).filter(|other| part(*other) != part(node)) {
                        links.part(node, other);
                    }
                }
            }
            let census = Census { wholeness: vec![1.0; body.grid.len()], parts: Vec::new(), links };
            let wraps = [0, 1, 2].map(|a| periodic[a] || n[a] == 1);
            let usual = Transfer::new(n, wraps, [true; 3]);
            let pieces = Pieces::new(&usual, census.pieces(&body, &usual));
            let transfer = usual.with(&pieces, &[]);
            // Parts of the coarse nodes, by those of the grid nodes that take from them.
            let mut of = vec![None; transfer.coarse_grid() + pieces.copies.len()];
            for element in 0..transfer.elements().iter().product() {
                for node in transfer.nodes_of(element) {
                    let own = pieces.holding(element, node as u32);
                    let corners = own.map_or(transfer.corners(element).map(|c| c as u32), |p| p.corners);
                    for corner in corners {
                        let known = of[corner as usize].get_or_insert(part(node));
                        assert_eq!(*known, part(node), "{n:?}: a coarse node of two parts");
                    }
                }
            }
            let place = |c: usize| {
                if c < transfer.coarse_grid() { c } else { pieces.copies[c - transfer.coarse_grid()] as usize }
            };
            let [c1, c2, _] = transfer.coarse();
            let tilt = |part: usize, z: f64| part as f64 + 0.5 * z * (1.0 + part as f64);
            let x: Vec<[f64; 3]> = (0..of.len())
                .map(|c| [1.0, 0.0, tilt(of[c].unwrap_or(0), 2.0 * (place(c) / (c1 * c2)) as f64)])
                .collect();
            let mut fine = vec![[0.0; 3]; body.grid.len()];
            transfer.prolong_add(&x, &mut fine);
            for (node, v) in fine.iter().enumerate() {
                let wanted = tilt(part(node), body.grid.coordinates(node)[2] as f64);
                assert!((v[0] - 1.0).abs() < 1e-14 && (v[2] - wanted).abs() < 1e-12, "{n:?} {node}: {v:?}, {wanted}");
            }
            let wave = |s: f64, i: usize| -> [f64; 3] { std::array::from_fn(|a| (s * i as f64 + a as f64).sin()) };
            let (x, y): (Vec<_>, Vec<_>) =
                ((0..x.len()).map(|i| wave(1.3, i)).collect(), (0..fine.len()).map(|i| wave(0.7, i)).collect());
            let mut px = vec![[0.0; 3]; fine.len()];
            transfer.prolong_add(&x, &mut px);
            let pty = transfer.restrict(|i| y[i]);
            let dot = |a: &[[f64; 3]], b: &[[f64; 3]]| -> f64 {
                a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1] + a[2] * b[2]).sum()
            };
            assert!((dot(&px, &y) - dot(&x, &pty)).abs() < 1e-11, "{n:?}");
        }
    }
}
