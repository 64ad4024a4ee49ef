//! Rigid motions that no support prevents, and nodes that no bond holds.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::census::Census;
use super::connected::ConnectedPart;
use super::supports::Supports;
use super::symmetric3::SINGULAR;
use crate::lattice::Body;
use crate::operator::{GridOperator, VectorField};
use crate::{Error, Result};

/// Motions of the supports below this share of the largest are none.
const FREE: f64 = 1e-12;

/// A load does work on a mode if its part along the mode is above this share of it.
const WORK: f64 = 1e-8;

/// Rigid motion u = t + ω × (x − c) of a connected part, of unit norm over its nodes.
#[derive(Clone, Debug)]
struct Mode {
    part: usize,
    translation: Vector3<f64>,
    rotation: Vector3<f64>,
}

/// A node that can move without energy in some direction.
#[derive(Clone, Debug)]
struct LooseNode {
    node: usize,
    /// Projector on the directions that bonds hold or supports prescribe.
    held: Matrix3<f64>,
}

/// What costs no energy although no support prevents it: rigid motions of connected parts, single nodes without bonds
/// in some direction. K is singular along these; equilibrium exists if the load does no work on them.
#[derive(Clone, Debug)]
pub struct FreeModes {
    parts: Vec<ConnectedPart>,
    modes: Vec<Mode>,
    loose: Vec<LooseNode>,
    supports: Supports,
}

impl FreeModes {
    /// Find them.
    pub fn new(operator: &dyn GridOperator, supports: &Supports) -> Self {
        FreeModes::of(operator.body(), &Census::new(operator), |node| operator.diagonal_block(node), supports)
    }

    /// The same with what is known of the nodes, and their blocks (N/m).
    pub(super) fn of(
        body: &Body,
        census: &Census,
        block: impl Fn(usize) -> Matrix3<f64> + Sync,
        supports: &Supports,
    ) -> Self {
        let loose = loose_nodes(body, census, block, supports);
        let mut free = FreeModes { parts: Vec::new(), modes: Vec::new(), loose, supports: supports.clone() };
        for part in &census.parts {
            let number = free.parts.len();
            let modes = free.modes_of(part, number);
            if !modes.is_empty() {
                free.modes.extend(modes);
                free.parts.push(part.clone());
            }
        }
        free
    }

    /// Whether every motion costs energy.
    pub fn none(&self) -> bool {
        self.modes.is_empty() && self.loose.is_empty()
    }

    /// What they are, in words: "translation along x of …".
    pub fn describe(&self) -> Vec<String> {
        (0..self.parts.len()).flat_map(|part| self.describe_part(part)).collect()
    }

    /// Number of nodes that no bond holds in some direction.
    pub fn loose_nodes(&self) -> usize {
        self.loose.len()
    }

    /// Refuses a load (N) that does work on a free mode.
    ///
    /// # Errors
    /// Names the part of the body, its free modes and the remedy; or the loose node and its direction.
    pub fn require_balanced(&self, operator: &dyn GridOperator, load: &VectorField) -> Result<()> {
        for loose in &self.loose {
            let force = load.at(loose.node);
            let mut along = force - loose.held * force;
            let at = operator.body().grid.position(loose.node);
            for a in 0..3 {
                if self.supports.fixed(loose.node)[a] {
                    along[a] = 0.0;
                }
            }
            if along.norm() > WORK * force.norm() {
                return Err(Error::mechanism(
                    format!(
                        "the node at {} m is pulled along {} but no bond holds it in that direction",
                        words(&at),
                        words(&along.normalize())
                    ),
                    "prescribe its displacement, give it bonds, or leave it without load",
                ));
            }
        }
        for (number, part) in self.parts.iter().enumerate() {
            let load_norm: f64 = part.nodes.iter().map(|n| load.at(*n as usize).norm_squared()).sum::<f64>().sqrt();
            let works = self.modes.iter().filter(|m| m.part == number).any(|mode| {
                let work: f64 = part.nodes.iter().map(|n| load.at(*n as usize).dot(&self.motion(mode, *n))).sum();
                work.abs() > WORK * load_norm
            });
            if works {
                return Err(Error::mechanism(
                    format!("the load moves a body that nothing holds: {}", self.describe_part(number).join(", ")),
                    "prescribe displacements that prevent these motions, or give loads that balance",
                ));
            }
        }
        Ok(())
    }

    /// Take the free modes out of a field, and zero its prescribed components.
    pub fn project(&self, v: &mut VectorField) {
        if self.none() {
            return;
        }
        for loose in &self.loose {
            let held = loose.held * v.at(loose.node);
            v.set(loose.node, &held);
        }
        for mode in &self.modes {
            let nodes = &self.parts[mode.part].nodes;
            let share: f64 = nodes.iter().map(|n| v.at(*n as usize).dot(&self.motion(mode, *n))).sum();
            for n in nodes {
                let rest = v.at(*n as usize) - share * self.motion(mode, *n);
                v.set(*n as usize, &rest);
            }
        }
        self.supports.clear(v);
    }

    /// Displacement of a node in a mode.
    fn motion(&self, mode: &Mode, node: u32) -> Vector3<f64> {
        let arm = self.parts[mode.part].arm(node as usize);
        self.held(node as usize) * (mode.translation + mode.rotation.cross(&arm))
    }

    /// Projector on what holds a node.
    fn held(&self, node: usize) -> Matrix3<f64> {
        match self.loose.binary_search_by_key(&node, |l| l.node) {
            Ok(i) => self.loose[i].held,
            Err(_) => Matrix3::identity(),
        }
    }

    /// Orthonormal rigid motions of a part that no support prevents.
    fn modes_of(&self, part: &ConnectedPart, number: usize) -> Vec<Mode> {
        let size = part.radius();
        let (mut moved, mut resisted) = (Matrix6::zeros(), Matrix6::zeros());
        for node in &part.nodes {
            let rows = rigid_rows(&(part.arm(*node as usize) / size), part.turns());
            let held = self.held(*node as usize);
            let fixed = self.supports.fixed(*node as usize);
            let motion = held * rows;
            moved += motion.transpose() * motion;
            for a in (0..3).filter(|a| fixed[*a]) {
                resisted += rows.row(a).transpose() * rows.row(a);
            }
        }
        // Coordinates in which every rigid motion has unit norm; motions that move no node drop out.
        let eigen = moved.symmetric_eigen();
        let floor = FREE * eigen.eigenvalues.amax();
        let unit: Vec<Vector6<f64>> = (0..6)
            .filter(|i| eigen.eigenvalues[*i] > floor)
            .map(|i| eigen.eigenvectors.column(i) / eigen.eigenvalues[i].sqrt())
            .collect();
        if unit.is_empty() {
            return Vec::new();
        }
        let w = nalgebra::DMatrix::from_fn(6, unit.len(), |r, c| unit[c][r]);
        let eigen = (w.transpose() * resisted * &w).symmetric_eigen();
        let floor = FREE * eigen.eigenvalues.amax();
        (0..unit.len())
            .filter(|i| eigen.eigenvalues[*i] <= floor)
            .map(|i| {
                let m = &w * eigen.eigenvectors.column(i);
                Mode {
                    part: number,
                    translation: Vector3::new(m[0], m[1], m[2]),
                    rotation: Vector3::new(m[3], m[4], m[5]) / size,
                }
            })
            .collect()
    }

    /// The free modes of one part, in words, each as simple as can be.
    fn describe_part(&self, number: usize) -> Vec<String> {
        let part = &self.parts[number];
        let size = part.radius();
        let mut rows: Vec<Vector6<f64>> = self
            .modes
            .iter()
            .filter(|m| m.part == number)
            .map(|m| {
                let (t, r) = (m.translation, m.rotation * size);
                Vector6::new(t.x, t.y, t.z, r.x, r.y, r.z)
            })
            .collect();
        reduce(&mut rows);
        rows.iter()
            .map(|m| {
                let (t, r) = (Vector3::new(m[0], m[1], m[2]), Vector3::new(m[3], m[4], m[5]) / size);
                let motion = if r.norm() * size < 1e-6 * t.norm() {
                    format!("translation along {}", direction(&t))
                } else {
                    let through = part.centre() + r.cross(&t) / r.norm_squared();
                    format!("rotation about {} through {} m", direction(&r), words(&through))
                };
                format!("{motion} of {} nodes around {} m", part.nodes.len(), words(&part.centre()))
            })
            .collect()
    }
}

/// Displacement of a point by three translations and three rotations; rotations that are not free are zero.
fn rigid_rows(arm: &Vector3<f64>, turns: [bool; 3]) -> nalgebra::Matrix3x6<f64> {
    let mut rows = nalgebra::Matrix3x6::zeros();
    for a in 0..3 {
        rows[(a, a)] = 1.0;
        if turns[a] {
            rows.set_column(3 + a, &Vector3::ith(a, 1.0).cross(arm));
        }
    }
    rows
}

/// Gauss-Jordan elimination: each row ends with as few entries as can be.
fn reduce(rows: &mut [Vector6<f64>]) {
    let mut done = 0;
    for column in 0..6 {
        let Some(pivot) = (done..rows.len()).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))
        else {
            return;
        };
        if rows[pivot][column].abs() < 1e-6 * rows[pivot].norm() {
            continue;
        }
        rows.swap(done, pivot);
        let row = rows[done] / rows[done][column];
        rows[done] = row;
        for (i, other) in rows.iter_mut().enumerate() {
            if i != done {
                *other -= row * other[column];
            }
        }
        done += 1;
    }
}

/// x, y, z or three components.
fn direction(v: &Vector3<f64>) -> String {
    let unit = v.normalize();
    match (0..3).find(|a| unit[*a].abs() > 1.0 - 1e-9) {
        Some(a) => ["x", "y", "z"][a].to_string(),
        None => words(&unit),
    }
}

/// (1.5 0 2): five digits, and zero for what is rounding beside the others.
fn words(v: &Vector3<f64>) -> String {
    let least = 1e-9 * v.norm();
    let short = |x: f64| if x.abs() <= least { 0.0 } else { format!("{x:.4e}").parse().unwrap_or(x) };
    let [x, y, z] = [short(v.x), short(v.y), short(v.z)];
    format!("({x} {y} {z})")
}

/// Nodes whose own block, prescribed components aside, is singular.
fn loose_nodes(
    body: &Body,
    census: &Census,
    block: impl Fn(usize) -> Matrix3<f64> + Sync,
    supports: &Supports,
) -> Vec<LooseNode> {
    use rayon::prelude::*;
    (0..body.grid.len())
        .into_par_iter()
        .filter(|n| body.has(*n) && !census.whole(*n))
        .filter_map(|node| {
            let mut block = block(node);
            let scale = block.trace();
            if block.determinant() > 1e-6 * (scale / 3.0).powi(3) {
                return None;
            }
            let scale = if scale > 0.0 { scale } else { 1.0 };
            let fixed = supports.fixed(node);
            for a in (0..3).filter(|a| fixed[*a]) {
                block.row_mut(a).fill(0.0);
                block.column_mut(a).fill(0.0);
                block[(a, a)] = scale;
            }
            let eigen = block.symmetric_eigen();
            let mut held = Matrix3::identity();
            for (value, v) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
                if *value <= SINGULAR * scale {
                    held -= v * v.transpose();
                }
            }
            (held != Matrix3::identity()).then_some(LooseNode { node, held })
        })
        .collect()
}
