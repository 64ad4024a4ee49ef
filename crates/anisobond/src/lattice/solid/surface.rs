//! Surfaces of a body of nodes: which nodes carry how much area, and where it faces.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::Solid;
use super::boundary::{Surface, Window, shared_surface};
use super::fill::ON_BORDER;
use crate::lattice::Body;

/// One of the six outer faces of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// Axis normal to it (0, 1, 2).
    pub axis: usize,
    /// Whether at the largest coordinate.
    pub upper: bool,
}

impl Face {
    /// Outward unit normal.
    pub fn normal(&self) -> Vector3<f64> {
        let mut n = Vector3::zeros();
        n[self.axis] = if self.upper { 1.0 } else { -1.0 };
        n
    }
}

/// Area of the surface that a node stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// The node.
    pub node: u32,
    /// Area (m²).
    pub area: f64,
    /// Outward unit normal of the body there.
    pub normal: Vector3<f64>,
}

/// The nodes of a body within a thickness (m) of its outermost nodes' cells on one side, ascending. The area of a column
/// (Δ²) is shared equally by its nodes in the layer, so that all areas sum to that of the face.
pub fn face_layer(body: &Body, face: Face, thickness: f64) -> Vec<Patch> {
    let grid = &body.grid;
    let along = |n: usize| grid.coordinates(n)[face.axis];
    let filled: Vec<usize> = (0..grid.len()).into_par_iter().filter(|&n| body.has(n)).collect();
    let ends = filled.iter().map(|&n| along(n)).fold((usize::MAX, 0), |(low, high), i| (low.min(i), high.max(i)));
    let layer = |n: &usize| {
        let depth = if face.upper { ends.1 - along(*n) } else { along(*n) - ends.0 };
        (depth as f64 + 0.5) * grid.spacing <= thickness * (1.0 + ON_BORDER)
    };
    let nodes: Vec<usize> = filled.into_iter().filter(layer).collect();
    let column = |n: usize| {
        let mut at = grid.coordinates(n);
        at[face.axis] = 0;
        grid.index(at)
    };
    let mut share = std::collections::HashMap::new();
    nodes.iter().for_each(|&n| *share.entry(column(n)).or_insert(0u32) += 1);
    let area = |n: usize| grid.spacing.powi(2) / f64::from(share[&column(n)]);
    nodes.iter().map(|&n| Patch { node: n as u32, area: area(n), normal: face.normal() }).collect()
}

/// Pieces of a surface along a spacing.
const PIECES: f64 = 4.0;

/// The surface that a solid shares with the body of a grid, `shape` what the nodes fill: a hole that was cut out, or part of
/// the body's outside. Every piece is carried by the node nearest to it, so areas sum to that of the true surface, not to
/// the staircase's.
pub fn surface_patches(body: &Body, shape: &Solid, solid: &Solid) -> Surface {
    let grid = &body.grid;
    let half = Vector3::repeat(0.5 * grid.spacing);
    let last = grid.position(grid.len() - 1);
    let window = Window { low: grid.origin - half, high: last + half, periodic: grid.periodic };
    let pieces = shared_surface(solid, shape, &window, grid.spacing / PIECES);
    Surface::shared(&pieces, |x| nearest_node(body, x))
}

/// The body's node nearest to a point, the first of equals; not through periodic faces.
fn nearest_node(body: &Body, x: &Vector3<f64>) -> Option<u32> {
    let grid = &body.grid;
    let from: [i64; 3] = std::array::from_fn(|a| {
        let at = ((x[a] - grid.origin[a]) / grid.spacing).round() as i64;
        at.clamp(0, grid.nodes[a] as i64 - 1)
    });
    let most = grid.nodes.iter().max().map_or(1, |n| *n as i64);
    let mut best: Option<(f64, usize)> = None;
    let mut ring = 1;
    loop {
        let span = |a: usize| (from[a] - ring).max(0)..=(from[a] + ring).min(grid.nodes[a] as i64 - 1);
        for k in span(2) {
            for j in span(1) {
                for i in span(0) {
                    let node = grid.index([i as usize, j as usize, k as usize]);
                    let distance = (grid.position(node) - x).norm();
                    if body.has(node) && best.is_none_or(|b| distance < b.0 * (1.0 - ON_BORDER)) {
                        best = Some((distance, node));
                    }
                }
            }
        }
        // Nothing outside of the cube that was looked at is nearer.
        if best.is_some_and(|b| b.0 <= (ring as f64 + 0.5) * grid.spacing) || ring > most {
            return best.map(|b| b.1 as u32);
        }
        ring *= 2;
    }
}

/// The nodes of a body, ascending, at the surface of a solid: of the two ends of a way to an empty neighbour one is in the
/// solid, the other not. The solid may be a hole in the body or a part of it.
pub fn surface_nodes(body: &Body, solid: &Solid) -> Vec<u32> {
    let grid = &body.grid;
    let tolerance = ON_BORDER * grid.spacing;
    let at_surface = |n: usize| {
        let here = grid.position(n);
        let within = solid.contains(&here, tolerance);
        (0..6).any(|side| {
            let mut offset = [0; 3];
            offset[side / 2] = if side % 2 == 0 { -1 } else { 1 };
            let there = here + Vector3::from(offset.map(f64::from)) * grid.spacing;
            let empty = grid.neighbour(n, offset).is_none_or(|m| !body.has(m));
            empty && solid.contains(&there, tolerance) != within
        })
    };
    (0..grid.len()).into_par_iter().filter(|&n| body.has(n) && at_surface(n)).map(|n| n as u32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::{Grid, solid};

    fn body(shape: &Solid, spacing: f64, plane: Option<usize>) -> Body {
        let grid = solid::grid_around(shape, spacing, [false; 3], plane).unwrap();
        let region = solid::inside(shape, &grid).into_iter().map(u16::from).collect();
        Body { grid, region }
    }

    /// Pressure on holes and balls: the total area, and a resultant of zero.
    #[test]
    fn areas_converge_to_the_true_ones() {
        let pi = std::f64::consts::PI;
        let cube = Solid::Box { min: Vector3::repeat(-1.0), max: Vector3::repeat(1.0) };
        let ball = Solid::Sphere { centre: Vector3::zeros(), radius: 0.6 };
        let rod =
            Solid::Cylinder { centre: Vector3::zeros(), axis: Vector3::z(), radius: 0.6, half_length: f64::INFINITY };
        let hole = |minus: &Solid| Solid::Difference(Box::new(cube.clone()), vec![minus.clone()]);
        let h = 1.0 / 20.0;
        for (shape, on, plane, exact, outward) in [
            (hole(&ball), &ball, None, 4.0 * pi * 0.36, -1.0),
            (ball.clone(), &ball, None, 4.0 * pi * 0.36, 1.0),
            (hole(&rod), &rod, Some(2), 2.0 * pi * 0.6 * h, -1.0),
            (cube.clone(), &cube, None, 24.0, 1.0),
        ] {
            let body = body(&shape, h, plane);
            let surface = surface_patches(&body, &shape, on);
            let (patches, resultant) = (&surface.patches, surface.normal);
            let area: f64 = patches.iter().map(|p| p.area).sum();
            assert!((area / exact - 1.0).abs() < 1e-3, "{shape:?}: {area} for {exact}");
            assert!(resultant.norm() < 1e-9 * exact, "{resultant:?}");
            let radial = |p: &Patch| p.normal.dot(&body.grid.position(p.node as usize)) * outward > 0.0;
            assert!(patches.iter().step_by(97).all(radial));
        }
    }

    #[test]
    fn a_layer_shares_the_area_of_its_face() {
        let grid = Grid::new([4, 5, 6], 0.5, Vector3::zeros(), [false; 3]).unwrap();
        let body = Body::full(grid);
        for (thickness, layers) in [(0.5, 1), (1.5, 3), (1.2, 2), (1.0 + 1e-15, 2)] {
            let top = face_layer(&body, Face { axis: 2, upper: true }, thickness);
            assert_eq!(top.len(), 20 * layers);
            assert!((top.iter().map(|p| p.area).sum::<f64>() - 5.0).abs() < 1e-12);
            assert!(top.iter().all(|p| p.normal == Vector3::z()));
        }
        assert!(face_layer(&body, Face { axis: 0, upper: false }, 0.2).is_empty());
    }
}
