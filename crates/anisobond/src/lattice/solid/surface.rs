//! Surfaces of a body of nodes: which nodes carry how much area, and where it faces.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::Solid;
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

/// The patches of a body's surface that are surface of a solid: one for each face of a cell between a node of the body
/// and an empty place, one in the solid and the other not. The solid may be a hole in the body or a part of it.
///
/// A face of normal e (Δ² large) stands for the area Δ²|n·e|, n the solid's normal at the face's centre: a piece dA of
/// the true surface shows dA|n·e|/Δ² faces of each of the three normals, hence Σ Δ²|n·e| = dA Σ (n·e)² = dA. The total
/// area converges to the true one; the staircase's own would not.
pub fn surface_patches(body: &Body, solid: &Solid) -> Vec<Patch> {
    let grid = &body.grid;
    let (tolerance, step) = (ON_BORDER * grid.spacing, 1e-3 * grid.spacing);
    (0..grid.len())
        .into_par_iter()
        .filter(|&n| body.has(n))
        .flat_map_iter(|n| {
            let here = grid.position(n);
            let within = solid.contains(&here, tolerance);
            (0..6).filter_map(move |side| {
                let (axis, sign) = (side / 2, if side % 2 == 0 { -1 } else { 1 });
                let mut offset = [0; 3];
                offset[axis] = sign;
                if grid.neighbour(n, offset).is_some_and(|m| body.has(m)) {
                    return None;
                }
                let e = Vector3::from(offset.map(f64::from));
                if solid.contains(&(here + e * grid.spacing), tolerance) == within {
                    return None;
                }
                let outwards = solid.normal(&(here + e * (0.5 * grid.spacing)), step);
                let normal = if within { outwards } else { -outwards };
                let area = grid.spacing.powi(2) * normal.dot(&e).abs();
                (area > 0.0).then_some(Patch { node: n as u32, area, normal })
            })
        })
        .collect()
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
        let h = 1.0 / 40.0;
        for (shape, on, plane, exact, outward) in [
            (hole(&ball), &ball, None, 4.0 * pi * 0.36, -1.0),
            (ball.clone(), &ball, None, 4.0 * pi * 0.36, 1.0),
            (hole(&rod), &rod, Some(2), 2.0 * pi * 0.6 * h, -1.0),
            (cube.clone(), &cube, None, 24.0, 1.0),
        ] {
            let body = body(&shape, h, plane);
            let patches = surface_patches(&body, on);
            let area: f64 = patches.iter().map(|p| p.area).sum();
            assert!((area / exact - 1.0).abs() < 5e-3, "{shape:?}: {area} for {exact}");
            let resultant: Vector3<f64> = patches.iter().map(|p| p.normal * p.area).sum();
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
