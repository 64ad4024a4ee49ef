//! From a grid to one of twice the spacing and back: trilinear interpolation and its transpose.

use rayon::prelude::*;

use super::links::Links;

/// How one axis is coarsened. Coarse node I lies on fine node 2I; an axis of one element stays as it is.
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
    /// For n fine nodes; `wraps` as for the field.
    pub fn new(n: usize, wraps: bool) -> Self {
        let fine_elements = if wraps { n } else { n - 1 };
        let factor = if fine_elements > 1 { 2 } else { 1 };
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
        if self.factor == 1 {
            // A single element, or (two layers without wrap) one element between two nodes.
            return vec![(0, 1.0)];
        }
        if i % 2 == 1 {
            return vec![(i / 2, 1.0)];
        }
        let right = i / 2;
        let left = if right > 0 { Some(right - 1) } else { self.wraps.then_some(self.elements - 1) };
        match (left, right < self.elements) {
            (Some(left), true) => vec![(left, 0.5), (right, 0.5)],
            (Some(left), false) => vec![(left, 1.0)],
            (None, _) => vec![(right, 1.0)],
        }
    }

    /// The fine node halfway between those of two neighbouring coarse nodes, or a fine neighbour of the first that is the
    /// second.
    pub fn between(&self, from: usize, to: usize, n: usize) -> usize {
        match (to + n - from) % n {
            0 => from,
            1 | 2 if self.wraps || to > from => (from + 1) % n,
            _ => (from + n - 1) % n,
        }
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
    /// Fine nodes (ascending) beside cracks, each with the coarse nodes that it takes instead of the usual ones, and weights.
    exceptions: Vec<(u32, Vec<(u32, f64)>)>,
}

impl Transfer {
    /// For fine nodes and axes that wrap.
    pub fn new(fine: [usize; 3], wraps: [bool; 3]) -> Self {
        Transfer { fine, axes: std::array::from_fn(|a| AxisTransfer::new(fine[a], wraps[a])), exceptions: Vec::new() }
    }

    /// The same with fine nodes beside cracks taking from their own side only.
    pub(super) fn beside(mut self, links: &Links) -> Self {
        self.exceptions = links.exceptions(&self);
        self
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

    /// The fine node on which a coarse one lies; `None` beyond the end of the fine grid.
    pub(super) fn fine_of(&self, coarse: [usize; 3]) -> Option<[usize; 3]> {
        let at = [0, 1, 2].map(|a| coarse[a] * self.axes[a].factor);
        (0..3).all(|a| at[a] < self.fine[a]).then_some(at)
    }

    /// A coarse node and those one step away from it along any axes.
    pub(super) fn around(&self, coarse: [usize; 3]) -> Vec<[usize; 3]> {
        let along = [0, 1, 2].map(|a| {
            let (n, i) = (self.axes[a].nodes, coarse[a]);
            let mut places = vec![i];
            places.extend((i + 1 < n || self.axes[a].wraps).then_some((i + 1) % n));
            places.extend((i > 0 || self.axes[a].wraps).then_some((i + n - 1) % n));
            places.sort_unstable();
            places.dedup();
            places
        });
        let [x, y, z] = &along;
        z.iter().flat_map(|&k| y.iter().flat_map(move |&j| x.iter().map(move |&i| [i, j, k]))).collect()
    }

    /// The coarse nodes from which a fine one takes its displacement, and the weights of each.
    pub(super) fn parents(&self, node: usize) -> Vec<([usize; 3], f64)> {
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

    /// Coarse nodes along each axis.
    pub fn coarse(&self) -> [usize; 3] {
        std::array::from_fn(|a| self.axes[a].nodes)
    }

    /// Pᵀ r, with the fine field read by `fine(node)`.
    pub fn restrict(&self, fine: impl Fn(usize) -> [f64; 3] + Sync) -> Vec<[f64; 3]> {
        let [n1, n2, n3] = self.coarse();
        let [f1, f2, _] = self.fine;
        let [ax, ay, az] = &self.axes;
        let mut coarse = vec![[0.0; 3]; n1 * n2 * n3];
        coarse.par_chunks_mut(n1).enumerate().for_each(|(row, out)| {
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
            let usual = self.parents(*node as usize).into_iter().map(|(at, weight)| (self.coarse_index(at), -weight));
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
                let of = |c: usize| own.iter().map(|&(at, w)| w * coarse[at as usize][c]).sum();
                take(i, std::array::from_fn(of));
            } else {
                take(i, std::array::from_fn(|c| wa * line[*a][c] + wb * line[*b][c]));
            }
        }
    }

    /// x += P coarse.
    pub fn prolong_add(&self, coarse: &[[f64; 3]], x: &mut [[f64; 3]]) {
        let [f1, f2, _] = self.fine;
        x.par_chunks_mut(f1).enumerate().for_each(|(row, out)| {
            self.row(coarse, row % f2, row / f2, |i, value| {
                for a in 0..3 {
                    out[i][a] += value[a];
                }
            });
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pᵀ is the transpose of P, P of ones is ones, and shares of material sum to one, for odd, even and tiny axes.
    #[test]
    fn interpolation_and_its_transpose() {
        for (fine, wraps) in
            [([1, 2, 5], [true, false, true]), ([4, 3, 2], [true, true, true]), ([6, 7, 2], [false; 3])]
        {
            let t = Transfer::new(fine, wraps);
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
