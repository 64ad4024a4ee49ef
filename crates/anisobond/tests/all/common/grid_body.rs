//! A plain implementation of `GridOperator`: bonds between the nodes of a grid, row by row.
#![allow(dead_code)] // each user needs its own part

use anisobond::calibration::{Calibrator, LowerBound};
use anisobond::lattice::{Body, Neighbourhood};
use anisobond::operator::{GridOperator, VectorField};
use anisobond::tensor::Stiffness;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// A body with bonds that may be broken one by one.
pub struct GridBody {
    pub body: Body,
    offsets: Vec<[i32; 3]>,
    normals: Vec<Vector3<f64>>,
    /// |ξ| (m) of every bond.
    pub lengths: Vec<f64>,
    /// Bond stiffness (N/m) by region and bond.
    stiffness: Vec<Vec<f64>>,
    tensors: Vec<Stiffness>,
    /// Per node and bond, whether it is broken; empty while none is.
    broken: Vec<bool>,
    /// Minus the sum over a node's bonds, for the intact path (11 22 33 23 13 12).
    blocks: Vec<[f64; 6]>,
}

impl GridBody {
    /// One calibrated material per region.
    pub fn new(body: Body, neighbourhood: &Neighbourhood, materials: &[Stiffness]) -> Self {
        let calibrator = Calibrator::new(neighbourhood);
        let volume = body.grid.spacing.powi(3);
        let bonds = neighbourhood.bonds();
        let (mut stiffness, mut tensors) = (Vec::new(), Vec::new());
        for c in materials {
            let r = calibrator.calibrate(c, LowerBound::Value(0.0)).unwrap();
            let k = bonds.iter().zip(&r.micromodulus);
            stiffness.push(k.map(|(b, c)| b.influence * c * volume * volume / b.xi.norm()).collect());
            tensors.push(r.reached);
        }
        let offsets: Vec<_> = bonds.iter().map(|b| b.offset).collect();
        let normals = bonds.iter().map(|b| b.xi.normalize()).collect();
        let lengths = bonds.iter().map(|b| b.xi.norm()).collect();
        let mut grid =
            GridBody { body, offsets, normals, lengths, stiffness, tensors, broken: Vec::new(), blocks: Vec::new() };
        grid.remember_blocks();
        grid
    }

    fn remember_blocks(&mut self) {
        self.blocks = (0..self.body.grid.len())
            .into_par_iter()
            .map(|n| {
                let m = self.diagonal_block(n);
                [m[(0, 0)], m[(1, 1)], m[(2, 2)], m[(1, 2)], m[(0, 2)], m[(0, 1)]]
            })
            .collect();
    }

    /// Break every bond that `cut(p, q)` says (positions of its ends, the second unwrapped).
    pub fn cut(&mut self, cut: impl Fn(&Vector3<f64>, &Vector3<f64>) -> bool + Sync) {
        let (n, m) = (self.body.grid.len(), self.offsets.len());
        self.broken.resize(n * m, false);
        let mut broken = std::mem::take(&mut self.broken);
        broken.par_chunks_mut(m).enumerate().for_each(|(node, broken)| {
            let p = self.body.grid.position(node);
            for (b, broken) in broken.iter_mut().enumerate() {
                let q = p + Vector3::from(self.offsets[b].map(f64::from)) * self.body.grid.spacing;
                // The same question from both ends.
                *broken |= if b >= m / 2 { cut(&p, &q) } else { cut(&q, &p) };
            }
        });
        self.broken = broken;
        self.remember_blocks();
    }

    /// The other end of a bond and its stiffness, if it exists and is unbroken.
    pub fn bond(&self, node: usize, b: usize) -> Option<(usize, f64)> {
        if !self.broken.is_empty() && self.broken[node * self.offsets.len() + b] {
            return None;
        }
        let other = self.body.grid.neighbour(node, self.offsets[b])?;
        if other == node || !self.body.has(other) || !self.body.has(node) {
            return None;
        }
        let last = self.offsets.len() - 1;
        let of = |n: usize, b: usize| self.stiffness[self.body.region[n] as usize - 1][b];
        Some((other, 0.5 * (of(node, b) + of(other, last - b))))
    }

    /// Break bonds longer than a critical stretch along the linear kinematics; how many broke, each counted once.
    pub fn break_above(&mut self, u: &VectorField, stretch: f64) -> usize {
        let (n, m) = (self.body.grid.len(), self.offsets.len());
        self.broken.resize(n * m, false);
        let mut count = 0;
        for node in 0..n {
            for b in 0..m {
                let Some((other, _)) = self.bond(node, b) else { continue };
                if self.normals[b].dot(&(u.at(other) - u.at(node))) > stretch * self.lengths[b] {
                    self.broken[node * m + b] = true;
                    self.broken[other * m + (m - 1 - b)] = true;
                    count += 1;
                }
            }
        }
        self.remember_blocks();
        count
    }

    /// Forces of finite stretch (P eq 5).
    pub fn finite_forces(&self, u: &VectorField, f: &mut VectorField) {
        for node in 0..self.body.grid.len() {
            let mut sum = Vector3::zeros();
            for b in 0..self.offsets.len() {
                let Some((other, k)) = self.bond(node, b) else { continue };
                let length = self.lengths[b];
                let y = self.normals[b] * length + u.at(other) - u.at(node);
                sum += y * (k * (y.norm() - length) / y.norm());
            }
            f.set(node, &sum);
        }
    }

    fn one_intact_region(&self) -> bool {
        self.broken.is_empty() && self.stiffness.len() == 1
    }

    fn general_forces(&self, u: &VectorField, f: &mut VectorField) {
        let values: Vec<Vector3<f64>> = (0..self.body.grid.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|node| {
                let own = u.at(node);
                let mut sum = Vector3::zeros();
                if self.body.has(node) {
                    for (b, n) in self.normals.iter().enumerate() {
                        if let Some((other, k)) = self.bond(node, b) {
                            sum += n * (k * n.dot(&(u.at(other) - own)));
                        }
                    }
                }
                sum
            })
            .collect();
        for (node, value) in values.iter().enumerate() {
            f.set(node, value);
        }
    }

    fn intact_forces(&self, u: &VectorField, f: &mut VectorField) {
        let [n1, n2, n3] = self.body.grid.nodes;
        let reach = self.offsets.iter().map(|o| o[0]).max().unwrap() as usize;
        let wide = n1 + 2 * reach;
        let periodic = self.body.grid.periodic;
        let padded: Vec<Vec<f64>> = u
            .components
            .iter()
            .map(|u| {
                let mut rows = vec![0.0; wide * n2 * n3];
                rows.par_chunks_mut(wide).zip(u.par_chunks(n1)).for_each(|(row, u)| {
                    row[reach..reach + n1].copy_from_slice(u);
                    if periodic[0] {
                        for i in 0..reach {
                            row[i] = u[(i as i64 - reach as i64).rem_euclid(n1 as i64) as usize];
                            row[reach + n1 + i] = u[i % n1];
                        }
                    }
                });
                rows
            })
            .collect();
        let skip =
            |o: &[i32; 3]| (0..3).all(|a| periodic[a] && o[a].rem_euclid([n1, n2, n3][a] as i32) == 0 || o[a] == 0);
        let bonds: Vec<usize> =
            (0..self.offsets.len()).filter(|b| self.stiffness[0][*b] > 0.0 && !skip(&self.offsets[*b])).collect();
        let [f1, f2, f3] = &mut f.components;
        let rows = f1.par_chunks_mut(n1).zip(f2.par_chunks_mut(n1)).zip(f3.par_chunks_mut(n1));
        rows.enumerate().for_each(|(row, ((f1, f2), f3))| {
            let (j, k) = (row % n2, row / n2);
            f1.fill(0.0);
            f2.fill(0.0);
            f3.fill(0.0);
            for &b in &bonds {
                let [dx, dy, dz] = self.offsets[b];
                let Some(jj) = moved(j, dy, n2, periodic[1]) else { continue };
                let Some(kk) = moved(k, dz, n3, periodic[2]) else { continue };
                let from = wide * (jj + n2 * kk) + (reach as i32 + dx) as usize;
                let n = self.normals[b];
                let sources = [0, 1, 2].map(|a| &padded[a][from..from + n1]);
                add_bond(self.stiffness[0][b], [n.x, n.y, n.z], sources, [f1, f2, f3]);
            }
            let start = row * n1;
            for i in 0..n1 {
                let [a, b, c, d, e, f] = self.blocks[start + i];
                let [x, y, z] = [0, 1, 2].map(|a| u.components[a][start + i]);
                if self.body.region[start + i] == 0 {
                    (f1[i], f2[i], f3[i]) = (0.0, 0.0, 0.0);
                    continue;
                }
                f1[i] -= a * x + f * y + e * z;
                f2[i] -= f * x + b * y + d * z;
                f3[i] -= e * x + d * y + c * z;
            }
        });
    }
}

/// f += k n (n·u) along a row, with the widest vectors that the processor has.
fn add_bond(k: f64, n: [f64; 3], u: [&[f64]; 3], f: [&mut [f64]; 3]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has the feature that the function was compiled for.
        return unsafe { add_bond_wide(k, n, u, f) };
    }
    add_bond_plain(k, n, u, f)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn add_bond_wide(k: f64, n: [f64; 3], u: [&[f64]; 3], f: [&mut [f64]; 3]) {
    add_bond_plain(k, n, u, f)
}

#[inline(always)]
fn add_bond_plain(k: f64, n: [f64; 3], [u1, u2, u3]: [&[f64]; 3], [f1, f2, f3]: [&mut [f64]; 3]) {
    for (((u1, u2), u3), ((f1, f2), f3)) in u1.iter().zip(u2).zip(u3).zip(f1.iter_mut().zip(f2).zip(f3)) {
        let t = k * (n[0] * u1 + n[1] * u2 + n[2] * u3);
        *f1 += n[0] * t;
        *f2 += n[1] * t;
        *f3 += n[2] * t;
    }
}

/// i + d on an axis of n nodes.
fn moved(i: usize, d: i32, n: usize, periodic: bool) -> Option<usize> {
    let x = i as i64 + i64::from(d);
    if periodic { Some(x.rem_euclid(n as i64) as usize) } else { (0..n as i64).contains(&x).then_some(x as usize) }
}

impl GridOperator for GridBody {
    fn body(&self) -> &Body {
        &self.body
    }

    fn forces(&self, u: &VectorField, f: &mut VectorField) {
        if self.one_intact_region() { self.intact_forces(u, f) } else { self.general_forces(u, f) }
    }

    fn diagonal_block(&self, node: usize) -> Matrix3<f64> {
        let mut block = Matrix3::zeros();
        for (b, n) in self.normals.iter().enumerate() {
            if let Some((_, k)) = self.bond(node, b) {
                block += n * n.transpose() * k;
            }
        }
        block
    }

    fn half_bonds(&self, node: usize, visit: &mut dyn FnMut(usize)) {
        for b in self.offsets.len() / 2..self.offsets.len() {
            if let Some((other, k)) = self.bond(node, b)
                && k > 0.0
            {
                visit(other);
            }
        }
    }

    fn bulk_stiffness(&self, region: u16) -> Stiffness {
        self.tensors[region as usize]
    }

    fn bulk_bonds(&self, region: u16) -> Vec<([i32; 3], f64)> {
        self.offsets.iter().copied().zip(self.stiffness[region as usize].iter().copied()).collect()
    }

    fn wholeness(&self, node: usize) -> f64 {
        if !self.body.has(node) {
            return 0.0;
        }
        let own = &self.stiffness[self.body.region[node] as usize - 1];
        let wholes = (0..own.len()).filter(|b| {
            self.bond(node, *b).is_some() || self.body.grid.neighbour(node, self.offsets[*b]) == Some(node)
        });
        wholes.map(|b| own[b]).sum::<f64>() / own.iter().sum::<f64>()
    }
}
