//! A coarse grid of hexahedral elements: local elasticity with the regions' tensors.

use rayon::prelude::*;

use super::element::ElementStiffness;
use super::links::Links;
use super::symmetric3::{Symmetric3, pseudo_inverse};
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

/// Elements, springs to ground at supports, and the inverse of each node's block.
pub struct Hexahedra {
    /// Nodes along each axis.
    pub nodes: [usize; 3],
    /// Elements along each axis: as many as nodes where the axis wraps.
    pub elements: [usize; 3],
    /// Edges of an element (m).
    pub edges: [f64; 3],
    /// Parts of every element.
    pub parts: Vec<Vec<Part>>,
    /// Springs to ground, per node and component (N/m).
    pub support: Vec<[f64; 3]>,
    stiffness: Vec<ElementStiffness>,
    inverse: Vec<Symmetric3>,
    largest: f64,
}

impl Hexahedra {
    /// A grid of elements of the given regions' tensors (Pa). Elements that a crack splits hold nothing.
    pub(super) fn new(
        nodes: [usize; 3],
        elements: [usize; 3],
        edges: [f64; 3],
        parts: Vec<Vec<Part>>,
        support: Vec<[f64; 3]>,
        links: &Links,
        tensors: &[Stiffness],
    ) -> Self {
        let stiffness = tensors.iter().map(|c| ElementStiffness::new(c, edges)).collect();
        let mut grid =
            Hexahedra { nodes, elements, edges, parts, support, stiffness, inverse: Vec::new(), largest: 1.0 };
        grid.empty_split(links);
        grid.inverse = (0..grid.len()).into_par_iter().map(|n| pseudo_inverse(&grid.diagonal(n))).collect();
        grid.largest = MARGIN * grid.largest_eigenvalue();
        grid
    }

    fn empty_split(&mut self, links: &Links) {
        let [e1, e2, _] = self.elements;
        for e in 0..self.parts.len() {
            if links.splits(&self.corners([e % e1, e / e1 % e2, e / (e1 * e2)])) {
                self.parts[e].clear();
            }
        }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.iter().product()
    }

    /// Whether an axis leads back to its first node.
    pub fn wraps(&self) -> [bool; 3] {
        std::array::from_fn(|a| self.nodes[a] == self.elements[a])
    }

    /// The 3×3 block of a node.
    fn diagonal(&self, node: usize) -> [[f64; 3]; 3] {
        let [n1, n2, _] = self.nodes;
        let at = [node % n1, node / n1 % n2, node / (n1 * n2)];
        let mut block = [[0.0; 3]; 3];
        for (a, row) in block.iter_mut().enumerate() {
            row[a] = self.support[node][a];
        }
        for l in 0..8usize {
            // The element of which this node is local node l; an axis of one node has both ends in the same element.
            let Some(e) = self.element_below(at, [l & 1, l >> 1 & 1, l >> 2 & 1]) else { continue };
            for part in &self.parts[e] {
                let k = self.stiffness[part.region as usize].diagonal(l);
                for a in 0..3 {
                    for b in 0..3 {
                        block[a][b] += part.weight * k[a][b];
                    }
                }
            }
        }
        block
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

    /// The eight nodes of an element.
    fn corners(&self, e: [usize; 3]) -> [usize; 8] {
        let [n1, n2, n3] = self.nodes;
        let ends = [[e[0], (e[0] + 1) % n1], [e[1], (e[1] + 1) % n2], [e[2], (e[2] + 1) % n3]];
        std::array::from_fn(|l| ends[0][l & 1] + n1 * (ends[1][l >> 1 & 1] + n2 * ends[2][l >> 2 & 1]))
    }

    /// y = A u. Every plane of nodes gathers from the elements below and above it, in that order.
    pub fn apply(&self, u: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let [n1, n2, n3] = self.nodes;
        let layers = self.elements[2];
        y.par_chunks_mut(n1 * n2).enumerate().for_each(|(k, plane)| {
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
                let parts = &self.parts[i + e1 * (j + e2 * layer)];
                if parts.is_empty() {
                    continue;
                }
                let corners = self.corners([i, j, layer]);
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
                for l in 0..4 {
                    let y = &mut plane[corners[4 * face + l] - start];
                    for a in 0..3 {
                        y[a] += forces[3 * l + a];
                    }
                }
            }
        }
    }

    /// Largest eigenvalue of D⁻¹A, from below.
    fn largest_eigenvalue(&self) -> f64 {
        let mut u: Vec<[f64; 3]> = (0..self.len())
            .map(|n| std::array::from_fn(|a| (1.7 * n as f64 + 2.3 * a as f64 + 0.1 * (n * n % 97) as f64).sin()))
            .collect();
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
        let place: Vec<usize> = (0..self.len())
            .map(|node| {
                let at = [node % n[0], node / n[0] % n[1], node / (n[0] * n[1])];
                at[order[0]] + n[order[0]] * (at[order[1]] + n[order[1]] * at[order[2]])
            })
            .collect();
        let mut entries = Vec::new();
        for (node, support) in self.support.iter().enumerate() {
            entries.extend((0..3).map(|a| (3 * place[node] + a, 3 * place[node] + a, support[a])));
        }
        for (e, parts) in self.parts.iter().enumerate() {
            let [e1, e2, _] = self.elements;
            let corners = self.corners([e % e1, e / e1 % e2, e / (e1 * e2)]);
            for part in parts {
                let k = &self.stiffness[part.region as usize];
                for row in 0..24 {
                    for column in 0..24 {
                        let r = 3 * place[corners[row / 3]] + row % 3;
                        let c = 3 * place[corners[column / 3]] + column % 3;
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
