//! From a grid to one of twice the spacing and back: trilinear interpolation and its transpose.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::pieces::{Piece, Pieces};

/// How one axis is coarsened. Coarse node I lies on fine node 2I, or I of an axis that stays as it is.
#[derive(Clone)]
pub struct AxisTransfer {
    /// Whether the last element leads back to node 0: a periodic axis, or one of a single layer.
    pub wraps: bool,
    /// Coarse nodes.
    pub nodes: usize,
    /// Coarse elements.
    pub elements: usize,
    /// Coarse edge over fine edge.
    pub factor: usize,
    /// Of every fine node: two coarse nodes, with the weight of each.
    up: Vec<[(usize, f64); 2]>,
    /// Of every coarse node: fine nodes and weights, the transpose.
    down: Vec<Vec<(usize, f64)>>,
}

impl AxisTransfer {
    /// For n fine nodes; `wraps` as for the field. Not `coarsened`, coarse nodes are the fine ones.
    pub fn new(n: usize, wraps: bool, coarsened: bool) -> Self {
        let fine_elements = if wraps { n } else { n - 1 };
        let factor = if coarsened && fine_elements > 1 { 2 } else { 1 };
        let elements = fine_elements.div_ceil(factor);
        let nodes = if wraps { elements } else { elements + 1 };
        let up: Vec<[(usize, f64); 2]> = (0..n)
            .map(|i| match i % factor {
                0 => [(i / factor, 1.0), (i / factor, 0.0)],
                _ => [(i / 2, 0.5), ((i / 2 + 1) % nodes, 0.5)],
            })
            .collect();
        let mut down = vec![Vec::new(); nodes];
        for (i, pair) in up.iter().enumerate() {
            for &(coarse, weight) in pair.iter().filter(|p| p.1 > 0.0) {
                down[coarse].push((i, weight));
            }
        }
        AxisTransfer { wraps, nodes, elements, factor, up, down }
    }

    /// Elements that share a fine node's material, with the shares; they sum to 1.
    pub fn shares_of_node(&self, i: usize) -> Vec<(usize, f64)> {
        if i % self.factor == 1 {
            return vec![(i / 2, 1.0)];
        }
        let right = i / self.factor;
        let left = if right > 0 { Some(right - 1) } else { self.wraps.then_some(self.elements - 1) };
        match (left, right < self.elements) {
            // The only element of an axis that wraps.
            (Some(left), true) if left == right => vec![(left, 1.0)],
            (Some(left), true) => vec![(left, 0.5), (right, 0.5)],
            (Some(left), false) => vec![(left, 1.0)],
            (None, _) => vec![(right, 1.0)],
        }
    }

    /// Elements in or on which a fine node lies.
    fn elements_of_node(&self, i: usize) -> Vec<usize> {
        self.shares_of_node(i).into_iter().map(|s| s.0).collect()
    }

    /// Fine elements of n fine nodes.
    fn fine_elements(&self, n: usize) -> usize {
        if self.wraps { n } else { n - 1 }
    }

    /// Fine cells that make a coarse element; the last of an odd periodic axis has one only.
    pub fn cells(&self, element: usize, n: usize) -> f64 {
        if self.factor == 1 || (self.wraps && element + 1 == self.elements && n % 2 == 1) { 1.0 } else { 2.0 }
    }
}

/// P and Pᵀ between the nodes of two grids.
pub struct Transfer {
    /// Fine nodes along each axis.
    pub fine: [usize; 3],
    /// The axes.
    pub axes: [AxisTransfer; 3],
    /// Fine nodes beyond the grid of them.
    beyond: usize,
    /// Coarse nodes beyond the grid of them.
    copies: usize,
    /// Fine nodes (ascending) beside cracks, each with the coarse nodes that it takes instead of the usual ones, and weights.
    exceptions: Vec<(u32, Vec<(u32, f64)>)>,
}

impl Transfer {
    /// For fine nodes, axes that wrap and axes to coarsen.
    pub fn new(fine: [usize; 3], wraps: [bool; 3], coarsened: [bool; 3]) -> Self {
        let axes = std::array::from_fn(|a| AxisTransfer::new(fine[a], wraps[a], coarsened[a]));
        Transfer { fine, axes, beyond: 0, copies: 0, exceptions: Vec::new() }
    }

    /// The same with the coarse nodes of pieces, between grids of which the fine one has some nodes beyond its grid, too, each
    /// on a node of that grid.
    pub(super) fn with(mut self, pieces: &Pieces, beyond: &[u32]) -> Self {
        self.beyond = beyond.len();
        self.copies = pieces.copies.len();
        let grid = self.fine_grid() as u32;
        let mut nodes: BTreeSet<u32> = (0..beyond.len() as u32).map(|n| grid + n).collect();
        nodes.extend(&pieces.left);
        let apart = |element: u32, piece: &Piece| piece.corners != self.corners(element as usize).map(|c| c as u32);
        for (element, own) in &pieces.of {
            own.iter().filter(|p| apart(*element, p)).for_each(|p| nodes.extend(&p.nodes));
        }
        let place = |node: u32| if node < grid { node } else { beyond[(node - grid) as usize] };
        self.exceptions =
            nodes.into_iter().map(|node| (node, self.parents_in(pieces, node, place(node) as usize))).collect();
        self
    }

    /// Coarse nodes from which a fine node at a place takes its displacement, and the weights of each.
    fn parents_in(&self, pieces: &Pieces, node: u32, place: usize) -> Vec<(u32, f64)> {
        if pieces.left.contains(&node) {
            return Vec::new();
        }
        let usual = self.parents(place).into_iter().map(|(at, weight)| (self.coarse_index(at) as u32, weight));
        // Any piece that holds the node has all of its coarse nodes.
        let at = self.coordinates(place);
        let along = [0, 1, 2].map(|a| self.axes[a].elements_of_node(at[a]));
        let mut around = along[2].iter().flat_map(|&k| along[1].iter().map(move |&j| (j, k)));
        let mut around = around.by_ref().flat_map(|(j, k)| along[0].iter().map(move |&i| [i, j, k]));
        let found = around.find_map(|e| Some((self.element_index(e), pieces.holding(self.element_index(e), node)?)));
        let Some((element, piece)) = found else { return usual.collect() };
        let corners = self.corners(element);
        let own = |c: u32| corners.iter().position(|k| *k as u32 == c).map_or(c, |l| piece.corners[l]);
        usual.map(|(c, weight)| (own(c), weight)).collect()
    }

    /// Coordinates of a fine node.
    pub(super) fn coordinates(&self, node: usize) -> [usize; 3] {
        let [n1, n2, _] = self.fine;
        [node % n1, node / n1 % n2, node / (n1 * n2)]
    }

    /// Index of a fine node.
    pub(super) fn fine_index(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.fine[0] * (j + self.fine[1] * k)
    }

    /// Index of a coarse node.
    pub(super) fn coarse_index(&self, [i, j, k]: [usize; 3]) -> usize {
        let [n1, n2, _] = self.coarse();
        i + n1 * (j + n2 * k)
    }

    /// Coarse elements along each axis.
    pub(super) fn elements(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| self.axes[a].elements)
    }

    /// Index of a coarse element.
    pub(super) fn element_index(&self, [i, j, k]: [usize; 3]) -> usize {
        let [e1, e2, _] = self.elements();
        i + e1 * (j + e2 * k)
    }

    /// The place of a coarse element along each axis.
    fn element_at(&self, element: usize) -> [usize; 3] {
        let [e1, e2, _] = self.elements();
        [element % e1, element / e1 % e2, element / (e1 * e2)]
    }

    /// The coarse nodes at the corners of an element.
    pub(super) fn corners(&self, element: usize) -> [usize; 8] {
        corners_of(self.element_at(element), self.coarse())
    }

    /// The fine nodes in and on an element, ascending.
    pub(super) fn nodes_of(&self, element: usize) -> Vec<usize> {
        let at = self.element_at(element);
        let along = [0, 1, 2].map(|a| {
            let (axis, n) = (&self.axes[a], self.fine[a]);
            let from = at[a] * axis.factor;
            let to = from + axis.cells(at[a], axis.fine_elements(n)) as usize;
            let mut nodes: Vec<usize> =
                (from..=to).map(|i| if axis.wraps { i % n } else { i }).filter(|i| *i < n).collect();
            nodes.sort_unstable();
            nodes.dedup();
            nodes
        });
        self.product(&along, |at| self.fine_index(at))
    }

    /// The fine elements in a coarse one.
    pub(super) fn elements_in(&self, element: usize, fine: [usize; 3]) -> Vec<usize> {
        let at = self.element_at(element);
        let along = [0, 1, 2].map(|a| {
            let from = at[a] * self.axes[a].factor;
            (from..(from + self.axes[a].factor).min(fine[a])).collect()
        });
        self.product(&along, |[i, j, k]| i + fine[0] * (j + fine[1] * k))
    }

    /// The elements around a coarse node.
    pub(super) fn elements_around(&self, coarse: usize) -> Vec<usize> {
        let [n1, n2, _] = self.coarse();
        let at = [coarse % n1, coarse / n1 % n2, coarse / (n1 * n2)];
        let along = [0, 1, 2].map(|a| {
            let (axis, i) = (&self.axes[a], at[a]);
            let below = if i > 0 { Some(i - 1) } else { axis.wraps.then_some(axis.elements - 1) };
            let mut all: Vec<usize> = below.into_iter().chain((i < axis.elements).then_some(i)).collect();
            all.dedup();
            all
        });
        self.product(&along, |at| self.element_index(at))
    }

    fn product(&self, [x, y, z]: &[Vec<usize>; 3], index: impl Fn([usize; 3]) -> usize) -> Vec<usize> {
        let mut all = Vec::with_capacity(x.len() * y.len() * z.len());
        for &k in z {
            for &j in y {
                all.extend(x.iter().map(|&i| index([i, j, k])));
            }
        }
        all
    }

    /// The coarse nodes from which a fine one takes its displacement, and the weights of each.
    fn parents(&self, node: usize) -> Vec<([usize; 3], f64)> {
        let at = self.coordinates(node);
        let up = |a: usize| self.axes[a].up[at[a]].iter().filter(|p| p.1 > 0.0);
        let mut all = Vec::new();
        for &(k, wk) in up(2) {
            for &(j, wj) in up(1) {
                all.extend(up(0).map(|&(i, wi)| ([i, j, k], wi * wj * wk)));
            }
        }
        all
    }

    /// Exceptions among fine nodes of a range.
    fn exceptions_in(&self, range: std::ops::Range<usize>) -> &[(u32, Vec<(u32, f64)>)] {
        let from = self.exceptions.partition_point(|e| (e.0 as usize) < range.start);
        let to = self.exceptions.partition_point(|e| (e.0 as usize) < range.end);
        &self.exceptions[from..to]
    }

    /// Fine nodes of the grid.
    pub(super) fn fine_grid(&self) -> usize {
        self.fine.iter().product()
    }

    /// Coarse nodes of the grid.
    pub(super) fn coarse_grid(&self) -> usize {
        self.coarse().iter().product()
    }

    /// Coarse nodes along each axis.
    pub fn coarse(&self) -> [usize; 3] {
        std::array::from_fn(|a| self.axes[a].nodes)
    }

    /// Pᵀ r, with the fine field read by `fine(node)`.
    pub fn restrict(&self, fine: impl Fn(usize) -> [f64; 3] + Sync) -> Vec<[f64; 3]> {
        let [n1, n2, _] = self.coarse();
        let [f1, f2, _] = self.fine;
        let [ax, ay, az] = &self.axes;
        let grid = self.coarse_grid();
        let mut coarse = vec![[0.0; 3]; grid + self.copies];
        coarse[..grid].par_chunks_mut(n1).enumerate().for_each(|(row, out)| {
            let (j, k) = (row % n2, row / n2);
            for &(fk, wk) in &az.down[k] {
                for &(fj, wj) in &ay.down[j] {
                    let (base, w) = (f1 * (fj + f2 * fk), wj * wk);
                    for (out, down) in out.iter_mut().zip(&ax.down) {
                        for &(fi, wi) in down {
                            let r = fine(base + fi);
                            for a in 0..3 {
                                out[a] += w * wi * r[a];
                            }
                        }
                    }
                }
            }
        });
        for (node, own) in &self.exceptions {
            let r = fine(*node as usize);
            let on_grid = (*node as usize) < self.fine_grid();
            let usual = if on_grid { self.parents(*node as usize) } else { Vec::new() };
            let usual = usual.into_iter().map(|(at, weight)| (self.coarse_index(at), -weight));
            for (at, weight) in usual.chain(own.iter().map(|p| (p.0 as usize, p.1))) {
                for a in 0..3 {
                    coarse[at][a] += weight * r[a];
                }
            }
        }
        coarse
    }

    /// (P x) along one row (j, k) of the fine grid, given to `take(i, value)`.
    pub fn row(&self, coarse: &[[f64; 3]], j: usize, k: usize, mut take: impl FnMut(usize, [f64; 3])) {
        let [n1, n2, _] = self.coarse();
        let [ax, ay, az] = &self.axes;
        // The coarse row at (j, k) first, then along it.
        let mut line = vec![[0.0; 3]; n1];
        for &(ck, wk) in az.up[k].iter().filter(|p| p.1 > 0.0) {
            for &(cj, wj) in ay.up[j].iter().filter(|p| p.1 > 0.0) {
                let from = n1 * (cj + n2 * ck);
                for (line, c) in line.iter_mut().zip(&coarse[from..from + n1]) {
                    for a in 0..3 {
                        line[a] += wj * wk * c[a];
                    }
                }
            }
        }
        let start = self.fine_index([0, j, k]);
        let mut exceptions = self.exceptions_in(start..start + self.fine[0]).iter().peekable();
        for (i, [(a, wa), (b, wb)]) in ax.up.iter().enumerate() {
            if let Some((_, own)) = exceptions.next_if(|e| e.0 as usize == start + i) {
                take(i, weighed(own, coarse));
            } else {
                take(i, std::array::from_fn(|c| wa * line[*a][c] + wb * line[*b][c]));
            }
        }
    }

    /// x += P coarse.
    pub fn prolong_add(&self, coarse: &[[f64; 3]], x: &mut [[f64; 3]]) {
        let [f1, f2, _] = self.fine;
        let (grid, beyond) = x.split_at_mut(self.fine_grid());
        grid.par_chunks_mut(f1).enumerate().for_each(|(row, out)| {
            self.row(coarse, row % f2, row / f2, |i, value| {
                for a in 0..3 {
                    out[i][a] += value[a];
                }
            });
        });
        let from = self.fine_grid();
        for ((_, own), x) in self.exceptions_in(from..from + self.beyond).iter().zip(beyond) {
            let value = weighed(own, coarse);
            for a in 0..3 {
                x[a] += value[a];
            }
        }
    }
}

/// Σ w x over coarse nodes and their weights.
fn weighed(own: &[(u32, f64)], coarse: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|c| own.iter().map(|&(at, w)| w * coarse[at as usize][c]).sum())
}

/// The corners x + 2y + 4z of an element of a grid of nodes.
pub(super) fn corners_of(e: [usize; 3], [n1, n2, n3]: [usize; 3]) -> [usize; 8] {
    let ends = [[e[0], (e[0] + 1) % n1], [e[1], (e[1] + 1) % n2], [e[2], (e[2] + 1) % n3]];
    std::array::from_fn(|l| ends[0][l & 1] + n1 * (ends[1][l >> 1 & 1] + n2 * ends[2][l >> 2 & 1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pᵀ is the transpose of P, P of ones is ones, and shares of material sum to one, for odd, even and tiny axes.
    #[test]
    fn interpolation_and_its_transpose() {
        for (fine, wraps, coarsened) in [
            ([1, 2, 5], [true, false, true], [true; 3]),
            ([4, 3, 2], [true, true, true], [true; 3]),
            ([6, 7, 2], [false; 3], [true; 3]),
            ([6, 5, 4], [false, true, false], [true, false, false]),
        ] {
            let t = Transfer::new(fine, wraps, coarsened);
            let n: usize = fine.iter().product();
            let m: usize = t.coarse().iter().product();
            let value = |s: f64, i: usize| -> [f64; 3] { std::array::from_fn(|a| (s * i as f64 + a as f64).sin()) };
            let x: Vec<[f64; 3]> = (0..m).map(|i| value(1.3, i)).collect();
            let y: Vec<[f64; 3]> = (0..n).map(|i| value(0.7, i)).collect();
            let mut px = vec![[0.0; 3]; n];
            t.prolong_add(&x, &mut px);
            let pty = t.restrict(|i| y[i]);
            let dot = |a: &[[f64; 3]], b: &[[f64; 3]]| -> f64 {
                a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1] + a[2] * b[2]).sum()
            };
            assert!((dot(&px, &y) - dot(&x, &pty)).abs() < 1e-12);
            let mut ones = vec![[0.0; 3]; n];
            t.prolong_add(&vec![[1.0; 3]; m], &mut ones);
            assert!(ones.iter().flatten().all(|v: &f64| (v - 1.0).abs() < 1e-15));
            for a in 0..3 {
                for i in 0..fine[a] {
                    let shares = t.axes[a].shares_of_node(i);
                    assert!((shares.iter().map(|s| s.1).sum::<f64>() - 1.0).abs() < 1e-15);
                    assert!(shares.iter().all(|s| s.0 < t.axes[a].elements));
                }
            }
        }
    }
}
