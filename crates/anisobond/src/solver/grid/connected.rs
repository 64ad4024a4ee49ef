//! Parts of a body held together by unbroken bonds.

use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::links::Links;
use crate::lattice::{Body, Grid};
use crate::operator::GridOperator;

/// Nodes connected by bonds. Along a periodic axis that the part does not go around, positions are unwrapped.
#[derive(Clone, Debug)]
pub struct ConnectedPart {
    /// The nodes, ascending.
    pub nodes: Vec<u32>,
    grid: Grid,
    /// Per axis, the place where counting starts; `None` along an axis that the part goes around.
    start: [Option<usize>; 3],
    centroid: Vector3<f64>,
}

impl ConnectedPart {
    fn new(nodes: Vec<u32>, grid: &Grid) -> Self {
        let mut held = grid.nodes.map(|n| vec![false; n]);
        for node in &nodes {
            let at = grid.coordinates(*node as usize);
            for a in 0..3 {
                held[a][at[a]] = true;
            }
        }
        let start = std::array::from_fn(|a| match grid.periodic[a] {
            false => Some(0),
            true => {
                let n = grid.nodes[a];
                let gap = (0..n).find(|i| !held[a][*i])?;
                (1..=n).map(|step| (gap + step) % n).find(|i| held[a][*i])
            }
        });
        let mut part = ConnectedPart { nodes, grid: grid.clone(), start, centroid: Vector3::zeros() };
        let sum: Vector3<f64> = part.nodes.iter().map(|n| part.arm(*n as usize)).sum();
        part.centroid = sum / part.nodes.len() as f64;
        part
    }

    /// Position of a node relative to the centroid (m).
    pub fn arm(&self, node: usize) -> Vector3<f64> {
        let at = self.grid.coordinates(node);
        let unwrapped = Vector3::from_fn(|a, _| {
            let n = self.grid.nodes[a];
            self.start[a].map_or(at[a], |s| if s == 0 { at[a] } else { s + (at[a] + n - s) % n }) as f64
        });
        unwrapped * self.grid.spacing - self.centroid
    }

    /// The centroid (m).
    pub fn centre(&self) -> Vector3<f64> {
        self.grid.origin + self.centroid
    }

    /// Largest distance of a node from the centroid (m), at least one spacing.
    pub fn radius(&self) -> f64 {
        self.nodes.iter().map(|n| self.arm(*n as usize).norm()).fold(self.grid.spacing, f64::max)
    }

    /// Axes about which the part can turn: those whose two others it does not go around.
    pub fn turns(&self) -> [bool; 3] {
        std::array::from_fn(|a| (0..3).all(|b| b == a || self.start[b].is_some()))
    }
}

/// The connected parts of a body by their first nodes, if there is more than one.
pub fn separate_parts(operator: &dyn GridOperator) -> Vec<ConnectedPart> {
    let body = operator.body();
    let parent: Vec<AtomicU32> = (0..body.grid.len() as u32).map(AtomicU32::new).collect();
    let is_root = |node: &usize| body.has(*node) && parent[*node].load(Relaxed) == *node as u32;
    let one_part = || (0..body.grid.len()).filter(is_root).take(2).count() < 2;
    // The shortest bonds make one part of most bodies.
    for offset in [[1, 0, 0], [0, 1, 0], [0, 0, 1]] {
        operator.bonds_along(offset, &|a, b| join(&parent, a as u32, b as u32));
    }
    if one_part() {
        return Vec::new();
    }
    let nodes = (0..body.grid.len()).into_par_iter().with_min_len(1024).filter(|&node| body.has(node));
    nodes.for_each(|node| operator.half_bonds(node, &mut |other| join(&parent, node as u32, other as u32)));
    if one_part() { Vec::new() } else { parts(body, &parent) }
}

/// The connected parts of a body by their first nodes, and the neighbours that cracks part.
pub(super) fn visit_bonds(operator: &dyn GridOperator) -> (Vec<ConnectedPart>, Links) {
    let body = operator.body();
    let parent: Vec<AtomicU32> = (0..body.grid.len() as u32).map(AtomicU32::new).collect();
    let steps = half_steps();
    let seen: Vec<Seen> = (0..body.grid.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|node| {
            let mut seen = Seen::default();
            if !body.has(node) {
                return seen;
            }
            let near = steps.map(|step| body.grid.neighbour(node, step).filter(|&n| n != node && body.has(n)));
            operator.half_bonds(node, &mut |other| {
                join(&parent, node as u32, other as u32);
                for (s, near) in near.iter().enumerate() {
                    seen.bonds |= u16::from(*near == Some(other)) << s;
                }
            });
            for (s, near) in near.iter().enumerate() {
                seen.missing |= u16::from(near.is_some()) << s;
            }
            seen.missing &= !seen.bonds;
            seen
        })
        .collect();
    (parts(body, &parent), parted(body, &steps, &seen))
}

/// What a node sees of the half of its nearest neighbours, a bit each.
#[derive(Clone, Copy, Default)]
struct Seen {
    /// Bonds to them.
    bonds: u16,
    /// Nodes without a bond to them.
    missing: u16,
}

/// The steps to the nearest neighbours that come later in the order of nodes.
fn half_steps() -> [[i32; 3]; 13] {
    let all = (-1..=1).flat_map(|z| (-1..=1).flat_map(move |y| (-1..=1).map(move |x| [x, y, z])));
    let mut later = all.filter(|[x, y, z]| [*z, *y, *x] > [0; 3]);
    std::array::from_fn(|_| later.next().unwrap_or_default())
}

/// Nearest neighbours without a bond. A step along which no node of a region has a bond says nothing: the material has
/// none there.
fn parted(body: &Body, steps: &[[i32; 3]; 13], seen: &[Seen]) -> Links {
    let mut usual: Vec<u16> = Vec::new();
    for (seen, &region) in seen.iter().zip(&body.region) {
        let region = usize::from(region);
        usual.resize(usual.len().max(region + 1), 0);
        usual[region] |= seen.bonds;
    }
    let mut links = Links::default();
    for (node, seen) in seen.iter().enumerate().filter(|s| s.1.missing != 0) {
        let missing = seen.missing & usual[usize::from(body.region[node])];
        for (_, step) in steps.iter().enumerate().filter(|(s, _)| missing >> s & 1 == 1) {
            if let Some(other) = body.grid.neighbour(node, *step) {
                links.part(node, other);
            }
        }
    }
    links
}

/// The trees' nodes, by their first ones.
fn parts(body: &Body, parent: &[AtomicU32]) -> Vec<ConnectedPart> {
    let mut number = vec![u32::MAX; body.grid.len()];
    let mut lists: Vec<Vec<u32>> = Vec::new();
    for node in (0..body.grid.len()).filter(|n| body.has(*n)) {
        let first = root(parent, node as u32) as usize;
        if number[first] == u32::MAX {
            number[first] = lists.len() as u32;
            lists.push(Vec::new());
        }
        lists[number[first] as usize].push(node as u32);
    }
    lists.into_iter().map(|nodes| ConnectedPart::new(nodes, &body.grid)).collect()
}

/// Put two nodes into one tree. A root only ever gets a smaller parent, so that the root of a part is its first node in
/// whatever order threads join.
fn join(parent: &[AtomicU32], a: u32, b: u32) {
    let (mut a, mut b) = (root(parent, a), root(parent, b));
    while a != b {
        let (low, high) = (a.min(b), a.max(b));
        match parent[high as usize].compare_exchange(high, low, Relaxed, Relaxed) {
            Ok(_) => return,
            Err(_) => (a, b) = (root(parent, low), root(parent, high)),
        }
    }
}

/// The root of a node's tree, halving the path to it.
fn root(parent: &[AtomicU32], mut node: u32) -> u32 {
    loop {
        let up = parent[node as usize].load(Relaxed);
        if up == node {
            return node;
        }
        let above = parent[up as usize].load(Relaxed);
        // Fails only where another thread has put a higher ancestor there.
        let _ = parent[node as usize].compare_exchange(up, above, Relaxed, Relaxed);
        node = above;
    }
}
