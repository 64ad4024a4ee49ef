//! A regular grid of nodes, and the body that fills a part of it.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::{Error, Result};

/// More nodes than this are refused before memory is taken.
const MOST_NODES: f64 = 4e9;

/// A regular grid of nodes, periodic along some of its axes.
///
/// Nodes are numbered i + n₁(j + n₂k) for 0 ≤ i < n₁, 0 ≤ j < n₂, 0 ≤ k < n₃.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Nodes along each axis, n₁ n₂ n₃.
    pub nodes: [usize; 3],
    /// Grid spacing Δ (m).
    pub spacing: f64,
    /// Position of node 0 (m).
    pub origin: Vector3<f64>,
    /// Axes along which the last node is followed by the first.
    pub periodic: [bool; 3],
}

impl Grid {
    /// A grid.
    ///
    /// # Errors
    /// No nodes, more than 4·10⁹, or a spacing that is not positive and finite.
    pub fn new(nodes: [usize; 3], spacing: f64, origin: Vector3<f64>, periodic: [bool; 3]) -> Result<Self> {
        let [i, j, k] = nodes;
        if nodes.contains(&0) || nodes.map(|n| n as f64).iter().product::<f64>() > MOST_NODES {
            return Err(Error::input(
                format!("the grid has {i} × {j} × {k} nodes"),
                "give a body and a spacing that make at least one node along each axis and at most 4e9 in all",
            ));
        }
        if !(spacing.is_finite() && spacing > 0.0) {
            return Err(Error::input(format!("spacing = {spacing}"), "give a positive, finite length"));
        }
        Ok(Grid { nodes, spacing, origin, periodic })
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.iter().product()
    }

    /// Whether the grid has no nodes; [`Grid::new`] refuses such.
    pub fn is_empty(&self) -> bool {
        self.nodes.contains(&0)
    }

    /// Number of a node.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.nodes[0] * (j + self.nodes[1] * k)
    }

    /// Place of a node along the axes.
    pub fn coordinates(&self, index: usize) -> [usize; 3] {
        let [n1, n2, _] = self.nodes;
        [index % n1, index / n1 % n2, index / (n1 * n2)]
    }

    /// Position of a node (m).
    pub fn position(&self, index: usize) -> Vector3<f64> {
        self.origin + Vector3::from(self.coordinates(index).map(|i| i as f64)) * self.spacing
    }

    /// The node at an offset from another, through periodic faces; `None` outside.
    pub fn neighbour(&self, index: usize, offset: [i32; 3]) -> Option<usize> {
        let at = self.coordinates(index);
        let mut to = [0; 3];
        for a in 0..3 {
            let n = self.nodes[a] as i64;
            let x = at[a] as i64 + i64::from(offset[a]);
            to[a] = if self.periodic[a] { x.rem_euclid(n) } else { x } as usize;
            if !(self.periodic[a] || (0..n).contains(&x)) {
                return None;
            }
        }
        Some(self.index(to))
    }

    /// By node: whether its value is not 0 and that of all nodes within a reach (nodes, by axis) along every axis, none of
    /// which is outside the grid. What holds for nodes of equal surroundings need be asked of few others.
    pub fn uniform_around(&self, values: &[u16], reach: [usize; 3]) -> Vec<bool> {
        let mut uniform: Vec<bool> = values.iter().map(|&v| v > 0).collect();
        let mut stride = 1;
        for (a, &reach) in reach.iter().enumerate() {
            let (n, before) = (self.nodes[a], uniform.clone());
            let is_uniform = |node: usize| {
                let (at, first) = (node / stride % n, node - node / stride % n * stride);
                let same = |to: usize| {
                    let other = first + to % n * stride;
                    before[other] && values[other] == values[node]
                };
                let inside = self.periodic[a] || (at >= reach && at + reach < n);
                inside && (1..=reach).all(|d| same(at + d) && same(at + reach * n - d))
            };
            uniform.par_iter_mut().enumerate().for_each(|(node, uniform)| *uniform &= *uniform && is_uniform(node));
            stride *= n;
        }
        uniform
    }
}

/// Which nodes of a grid are material, and of which region.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// The grid.
    pub grid: Grid,
    /// Per node: 0 where there is no material, else 1 + number of the region.
    pub region: Vec<u16>,
}

impl Body {
    /// A body that fills its grid, of one region.
    pub fn full(grid: Grid) -> Self {
        let region = vec![1; grid.len()];
        Body { grid, region }
    }

    /// Number of nodes that are material.
    pub fn nodes(&self) -> usize {
        self.region.iter().filter(|&&r| r > 0).count()
    }

    /// Whether a node is material.
    pub fn has(&self, index: usize) -> bool {
        self.region[index] > 0
    }
}
