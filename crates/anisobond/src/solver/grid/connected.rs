//! Parts of a body held together by unbroken bonds.

use nalgebra::Vector3;

use crate::lattice::Grid;
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

/// The connected parts of a body, by their first nodes.
pub fn connected_parts(operator: &dyn GridOperator) -> Vec<ConnectedPart> {
    let body = operator.body();
    let mut parent: Vec<u32> = (0..body.grid.len() as u32).collect();
    for node in (0..body.grid.len()).filter(|n| body.has(*n)) {
        let mut own = root(&mut parent, node as u32);
        operator.half_bonds(node, &mut |other| {
            if parent[other] == own {
                return;
            }
            let theirs = root(&mut parent, other as u32);
            // The smaller number is the root, so that parts are ordered by their first nodes.
            let (low, high) = (own.min(theirs), own.max(theirs));
            parent[high as usize] = low;
            own = low;
        });
    }
    let mut number = vec![u32::MAX; body.grid.len()];
    let mut lists: Vec<Vec<u32>> = Vec::new();
    for node in (0..body.grid.len()).filter(|n| body.has(*n)) {
        let first = root(&mut parent, node as u32) as usize;
        if number[first] == u32::MAX {
            number[first] = lists.len() as u32;
            lists.push(Vec::new());
        }
        lists[number[first] as usize].push(node as u32);
    }
    lists.into_iter().map(|nodes| ConnectedPart::new(nodes, &body.grid)).collect()
}

/// The root of a node's tree, halving the path to it.
fn root(parent: &mut [u32], mut node: u32) -> u32 {
    while parent[node as usize] != node {
        let up = parent[parent[node as usize] as usize];
        parent[node as usize] = up;
        node = up;
    }
    node
}
