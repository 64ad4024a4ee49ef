//! A coarse grid of hexahedral elements: local elasticity with the regions' tensors.

use rayon::prelude::*;

use super::element::ElementStiffness;
use super::symmetric3::{Symmetric3, pseudo_inverse};
use super::transfer::corners_of;
use crate::tensor::Stiffness;

/// Power iterations for the largest eigenvalue.
const POWER_STEPS: usize = 12;

/// The estimate of the largest eigenvalue is below the true one; this covers the gap.
const MARGIN: f64 = 1.15;

/// How much of one region an element holds.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Number of the region.
    pub region: u16,
    /// Share of the element's volume, weighed by how whole the bonds are (–).
    pub weight: f64,
}

/// A field with parts along all eigenvectors.
pub(super) fn wiggle(nodes: usize) -> Vec<[f64; 3]> {
    let at = |n: usize, a: usize| (1.7 * n as f64 + 2.3 * a as f64 + 0.1 * (n * n % 97) as f64).sin();
    (0..nodes).map(|n| std::array::from_fn(|a| at(n, a))).collect()
}

/// An element with corners beyond the grid.
#[derive(Clone)]
pub struct Extra {
    /// Its place on the grid of elements.
    pub element: u32,
    /// Its nodes x + 2y + 4z.
    pub corners: [u32; 8],
    /// Its parts.
    pub parts: Vec<Part>,
}

/// What elements hold.
#[derive(Clone)]
pub struct Filling {
    /// Parts of every element of the grid.
    pub parts: Vec<Vec<Part>>,
    /// Elements beside them.
    pub extra: Vec<Extra>,
    /// Of every node beyond the grid, the node of the grid on which it lies.
    pub copies: Vec<u32>,
}

impl Filling {
    /// Nothing, of elements of a grid and nodes beyond it.
    pub fn empty(elements: usize, copies: Vec<u32>) -> Self {
        Filling { parts: vec![Vec::new(); elements], extra: Vec::new(), copies }
    }

    /// Put what a piece of an element holds where the piece's corners are: in the element of the grid whose corners are
    /// `usual`, or in one beside it.
    pub fn add(&mut self, element: usize, corners: [u32; 8], usual: [usize; 8], part: Part) {
        let parts = if corners == usual.map(|c| c as u32) {
            &mut self.parts[element]
        } else {
            let same = |e: &Extra| e.element as usize == element && e.corners == corners;
            let at = self.extra.iter().rposition(same).unwrap_or_else(|| {
                self.extra.push(Extra { element: element as u32, corners, parts: Vec::new() });
                self.extra.len() - 1
            });
            &mut self.extra[at].parts
        };
        match parts.iter_mut().find(|p| p.region == part.region) {
            Some(p) => p.weight += part.weight,
            None => parts.push(part),
        }
    }
}

/// Elements, springs to ground at supports, and the inverse of each node's block.
pub struct Hexahedra {
    /// Nodes along each axis.
    pub nodes: [usize; 3],
    /// Elements along each axis: as many as nodes where the axis wraps.
    pub elements: [usize; 3],
    /// Edges of an element (m).
    pub edges: [f64; 3],
    /// What the elements hold.
    pub filling: Filling,
    /// Springs to ground, per node and component (N/m).
    pub support: Vec<[f64; 3]>,
    stiffness: Vec<ElementStiffness>,
    inverse: Vec<Symmetric3>,
    largest: f64,
}

impl Hexahedra {
    /// A grid of elements of the given regions' tensors (Pa).
    pub(super) fn new(
        nodes: [usize; 3],
        elements: [usize; 3],
        edges: [f64; 3],
        filling: Filling,
        support: Vec<[f64; 3]>,
        tensors: &[Stiffness],
    ) -> Self {
        let stiffness = tensors.iter().map(|c| ElementStiffness::new(c, edges)).collect();
        let mut grid =
            Hexahedra { nodes, elements, edges, filling, support, stiffness, inverse: Vec::new(), largest: 1.0 };
        grid.inverse = grid.diagonals().par_iter().map(pseudo_inverse).collect();
        grid.largest = MARGIN * grid.largest_eigenvalue();
        grid
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.grid_len() + self.filling.copies.len()
    }

    /// Number of nodes of the grid.
    pub fn grid_len(&self) -> usize {
        self.nodes.iter().product()
    }

    /// The node of the grid on which a node lies.
    fn place(&self, node: usize) -> usize {
        if node < self.grid_len() { node } else { self.filling.copies[node - self.grid_len()] as usize }
    }

    /// Every element that holds anything: its place on the grid of elements, its corners and parts.
    pub(super) fn filled(&self) -> impl Iterator<Item = (usize, [u32; 8], &[Part])> {
        let on_grid = self.filling.parts.iter().enumerate().filter(|(_, parts)| !parts.is_empty());
        let on_grid = on_grid.map(|(e, parts)| (e, self.corners(self.element_at(e)).map(|c| c as u32), &parts[..]));
        on_grid.chain(self.filling.extra.iter().map(|e| (e.element as usize, e.corners, &e.parts[..])))
    }

    /// The place of an element along each axis.
    pub(super) fn element_at(&self, e: usize) -> [usize; 3] {
        let [e1, e2, _] = self.elements;
        [e % e1, e / e1 % e2, e / (e1 * e2)]
    }

    /// Whether an axis leads back to its first node.
    pub fn wraps(&self) -> [bool; 3] {
        std::array::from_fn(|a| self.nodes[a] == self.elements[a])
    }

    /// The 3×3 block of every node.
    pub(super) fn diagonals(&self) -> Vec<[[f64; 3]; 3]> {
        let mut blocks: Vec<[[f64; 3]; 3]> = (0..self.grid_len()).into_par_iter().map(|n| self.diagonal(n)).collect();
        blocks.extend(
            self.support[self.grid_len()..].iter().map(|s| [[s[0], 0.0, 0.0], [0.0, s[1], 0.0], [0.0, 0.0, s[2]]]),
        );
        for extra in &self.filling.extra {
            for (l, corner) in extra.corners.iter().enumerate() {
                self.add_diagonal(&extra.parts, l, &mut blocks[*corner as usize]);
            }
        }
        blocks
    }

    /// The 3×3 block of a node of the grid by the elements of the grid.
    fn diagonal(&self, node: usize) -> [[f64; 3]; 3] {
        let [n1, n2, _] = self.nodes;
        let at = [node % n1, node / n1 % n2, node / (n1 * n2)];
        let mut block = [[0.0; 3]; 3];
        for (a, row) in block.iter_mut().enumerate() {
            row[a] = self.support[node][a];
        }
        for l in 0..8usize {
            // The element of which this node is local node l; an axis of one node has both ends in the same element.
            if let Some(e) = self.element_below(at, [l & 1, l >> 1 & 1, l >> 2 & 1]) {
                self.add_diagonal(&self.filling.parts[e], l, &mut block);
            }
        }
        block
    }

    /// Add the block of an element's local node l.
    fn add_diagonal(&self, parts: &[Part], l: usize, block: &mut [[f64; 3]; 3]) {
        for part in parts {
            let k = self.stiffness[part.region as usize].diagonal(l);
            for a in 0..3 {
                for b in 0..3 {
                    block[a][b] += part.weight * k[a][b];
                }
            }
        }
    }

    /// The element whose lower corner is `back` nodes behind a node.
    fn element_below(&self, at: [usize; 3], back: [usize; 3]) -> Option<usize> {
        let mut e = [0; 3];
        for a in 0..3 {
            let n = self.elements[a];
            e[a] = match (at[a], back[a]) {
                (i, 0) if i < n => i,
                (i, 1) if i > 0 => i - 1,
                (0, 1) if self.nodes[a] == n => n - 1,
                _ => return None,
            };
        }
        Some(e[0] + self.elements[0] * (e[1] + self.elements[1] * e[2]))
    }

    /// The eight nodes of an element of the grid.
    pub(super) fn corners(&self, e: [usize; 3]) -> [usize; 8] {
        corners_of(e, self.nodes)
    }

    /// y = A u. Every plane of nodes gathers from the elements below and above it, in that order.
    pub fn apply(&self, u: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let [n1, n2, n3] = self.nodes;
        let layers = self.elements[2];
        let grid = self.grid_len();
        y[..grid].par_chunks_mut(n1 * n2).enumerate().for_each(|(k, plane)| {
            let start = k * n1 * n2;
            for (i, y) in plane.iter_mut().enumerate() {
                let (s, u) = (&self.support[start + i], &u[start + i]);
                *y = [s[0] * u[0], s[1] * u[1], s[2] * u[2]];
            }
            let below = if k > 0 { Some(k - 1) } else { (layers == n3).then_some(layers - 1) };
            if let Some(layer) = below {
                self.add_layer(u, layer, 1, plane);
            }
            if k < layers {
                self.add_layer(u, k, 0, plane);
            }
        });
        for (y, (s, u)) in y[grid..].iter_mut().zip(self.support.iter().zip(u).skip(grid)) {
            *y = [s[0] * u[0], s[1] * u[1], s[2] * u[2]];
        }
        for extra in &self.filling.extra {
            let corners = extra.corners.map(|c| c as usize);
            for face in 0..2 {
                let forces = self.face_forces(u, &corners, &extra.parts, face);
                for l in 0..4 {
                    for a in 0..3 {
                        y[corners[4 * face + l]][a] += forces[3 * l + a];
                    }
                }
            }
        }
    }

    /// Add the forces of one layer of elements on the plane of nodes that is its lower (0) or upper (1) face.
    fn add_layer(&self, u: &[[f64; 3]], layer: usize, face: usize, plane: &mut [[f64; 3]]) {
        let [e1, e2, _] = self.elements;
        let start = {
            let k = if face == 0 { layer } else { (layer + 1) % self.nodes[2] };
            k * self.nodes[0] * self.nodes[1]
        };
        for j in 0..e2 {
            for i in 0..e1 {
                let parts = &self.filling.parts[i + e1 * (j + e2 * layer)];
                if parts.is_empty() {
                    continue;
                }
                let corners = self.corners([i, j, layer]);
                let forces = self.face_forces(u, &corners, parts, face);
                for l in 0..4 {
                    let y = &mut plane[corners[4 * face + l] - start];
                    for a in 0..3 {
                        y[a] += forces[3 * l + a];
                    }
                }
            }
        }
    }

    /// Forces of an element on the nodes of one of its faces.
    #[inline(always)]
    fn face_forces(&self, u: &[[f64; 3]], corners: &[usize; 8], parts: &[Part], face: usize) -> [f64; 12] {
        let mut forces = [0.0; 12];
        for part in parts {
            let k = &self.stiffness[part.region as usize].faces[face];
            let w = part.weight;
            let mut sum = [0.0; 12];
            for (l, corner) in corners.iter().enumerate() {
                let v = &u[*corner];
                for a in 0..3 {
                    for row in 0..12 {
                        sum[row] += k[3 * l + a][row] * v[a];
                    }
                }
            }
            for row in 0..12 {
                forces[row] += w * sum[row];
            }
        }
        forces
    }

    /// Largest eigenvalue of D⁻¹A, from below.
    fn largest_eigenvalue(&self) -> f64 {
        let mut u = wiggle(self.len());
        let mut au = vec![[0.0; 3]; u.len()];
        let mut largest = 1.0;
        for _ in 0..POWER_STEPS {
            self.apply(&u, &mut au);
            // Rayleigh quotient u·Au/u·Du needs D; with v = D⁻¹Au it is (v·Au)/(u·Au), which is as good.
            let (mut above, mut below) = (0.0, 0.0);
            let mut norm: f64 = 0.0;
            for ((u, au), m) in u.iter_mut().zip(&au).zip(&self.inverse) {
                let v = m.times(au);
                for a in 0..3 {
                    above += v[a] * au[a];
                    below += u[a] * au[a];
                    norm = norm.max(v[a].abs());
                }
                *u = v;
            }
            if !(below > 0.0 && norm > 0.0) {
                break;
            }
            largest = above / below;
            u.iter_mut().flatten().for_each(|x| *x /= norm);
        }
        largest
    }

    /// x = q(D⁻¹A) D⁻¹ b by Chebyshev iteration from zero, `degree` ≥ 1 steps over the upper part of the spectrum.
    pub fn smooth(&self, b: &[[f64; 3]], degree: usize, span: f64) -> Vec<[f64; 3]> {
        let (theta, delta) = (0.5 * self.largest * (1.0 + 1.0 / span), 0.5 * self.largest * (1.0 - 1.0 / span));
        let mut d: Vec<[f64; 3]> = vec![[0.0; 3]; b.len()];
        self.scale_into(b, 1.0 / theta, &mut d);
        let mut x = d.clone();
        if degree == 1 {
            return x;
        }
        let mut r = b.to_vec();
        let mut ad = vec![[0.0; 3]; b.len()];
        let mut rho = delta / theta;
        for _ in 1..degree {
            self.apply(&d, &mut ad);
            let next = 1.0 / (2.0 * theta / delta - rho);
            let (keep, add) = (next * rho, 2.0 * next / delta);
            d.par_iter_mut().zip(&mut x).zip(&mut r).zip(&ad).zip(&self.inverse).with_min_len(4096).for_each(
                |((((d, x), r), ad), m)| {
                    for a in 0..3 {
                        r[a] -= ad[a];
                    }
                    let v = m.times(r);
                    for a in 0..3 {
                        d[a] = keep * d[a] + add * v[a];
                        x[a] += d[a];
                    }
                },
            );
            rho = next;
        }
        x
    }

    /// z = s D⁻¹ b.
    fn scale_into(&self, b: &[[f64; 3]], s: f64, z: &mut [[f64; 3]]) {
        z.par_iter_mut().zip(b).zip(&self.inverse).with_min_len(4096).for_each(|((z, b), m)| {
            *z = m.times(b).map(|v| s * v);
        });
    }

    /// Entries (row, column, value) of A on and below the diagonal, degree of freedom 3·place + a, with nodes placed so
    /// that the longest axis varies slowest. Returns them with the places.
    pub fn entries(&self) -> (Vec<(usize, usize, f64)>, Vec<usize>) {
        let mut order = [0, 1, 2];
        order.sort_by_key(|&a| self.nodes[a]);
        let n = self.nodes;
        let key = |node: usize| {
            let place = self.place(node);
            let at = [place % n[0], place / n[0] % n[1], place / (n[0] * n[1])];
            (at[order[0]] + n[order[0]] * (at[order[1]] + n[order[1]] * at[order[2]]), node)
        };
        let mut sorted: Vec<usize> = (0..self.len()).collect();
        sorted.sort_by_key(|node| key(*node));
        let mut place = vec![0; self.len()];
        sorted.into_iter().enumerate().for_each(|(i, node)| place[node] = i);
        let mut entries = Vec::new();
        for (node, support) in self.support.iter().enumerate() {
            entries.extend((0..3).map(|a| (3 * place[node] + a, 3 * place[node] + a, support[a])));
        }
        for (_, corners, parts) in self.filled() {
            for part in parts {
                let k = &self.stiffness[part.region as usize];
                for row in 0..24 {
                    for column in 0..24 {
                        let r = 3 * place[corners[row / 3] as usize] + row % 3;
                        let c = 3 * place[corners[column / 3] as usize] + column % 3;
                        if c <= r {
                            entries.push((r, c, part.weight * k.entry(row, column)));
                        }
                    }
                }
            }
        }
        (entries, place)
    }
}
