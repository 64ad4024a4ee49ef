//! The grid around a solid, and its nodes that are inside.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::Solid;
use crate::lattice::Grid;
use crate::{Error, Result};

/// More nodes than this are refused before memory is taken.
pub const MOST_BODY_NODES: f64 = 2e9;

/// Bytes of a node in a run at horizon 3, for the message that refuses too many.
const BYTES_PER_NODE: f64 = 100.0;

/// A node outside by no more than this many spacings belongs to the solid; decided here and nowhere else.
pub(super) const ON_BORDER: f64 = 1e-9;

/// An extent within this many spacings of a whole multiple is one.
const WHOLE: f64 = 1e-6;

/// An extent of triangles, whose corners files round, is whole within this part of itself.
const ROUNDED: f64 = 1e-6;

/// The grid whose cells cover the box around a solid: nodes at the centres of cells, (i + ½)Δ from the box's corner where
/// its extent is a whole multiple of Δ; else one more cell, in the middle of the box. Along `plane_strain` the grid is
/// one periodic layer, whatever the extent.
///
/// # Errors
/// An empty box; one that is infinite along an axis other than `plane_strain`; a periodic extent that is no whole
/// multiple of the spacing; more than 2·10⁹ nodes (with the memory they would take); a spacing that is not positive.
pub fn grid_around(solid: &Solid, spacing: f64, periodic: [bool; 3], plane_strain: Option<usize>) -> Result<Grid> {
    if !(spacing.is_finite() && spacing > 0.0) {
        return Err(Error::input(format!("a spacing of {spacing} m is not possible"), "give a positive length"));
    }
    let [low, high] = solid.bounds();
    let (mut cells, mut origin, mut periodic) = ([0.0; 3], Vector3::zeros(), periodic);
    for a in 0..3 {
        let axis = ["x", "y", "z"][a];
        let (extent, middle) = (high[a] - low[a], 0.5 * (low[a] + high[a]));
        if plane_strain == Some(a) {
            (cells[a], periodic[a]) = (1.0, true);
            let ends = [middle, low[a] + 0.5 * spacing, high[a] - 0.5 * spacing];
            origin[a] = ends.into_iter().find(|x| x.is_finite()).unwrap_or(0.0);
            continue;
        }
        // An empty intersection has extents of −∞ or NaN.
        if extent.is_nan() || extent <= 0.0 {
            return Err(Error::input("the body is empty", "give solids that have a common volume"));
        }
        if extent.is_infinite() {
            return Err(Error::input(
                format!("the body is infinite along {axis}"),
                format!("bound it, or choose plane strain along {axis}: plane_strain = \"{axis}\""),
            ));
        }
        let exact = extent / spacing;
        // Corners of surfaces may be rounded.
        let tolerance = if has_triangles(solid) { ROUNDED * exact } else { 0.0 }.max(WHOLE);
        let whole = (exact - exact.round()).abs() <= tolerance && exact.round() >= 1.0;
        if periodic[a] && !whole {
            return Err(Error::input(
                format!("the body is periodic along {axis}, but {extent} m are {exact:.6} spacings"),
                "choose a spacing of which the extent is a whole multiple",
            ));
        }
        cells[a] = if whole { exact.round() } else { exact.ceil() };
        origin[a] = middle - 0.5 * (cells[a] - 1.0) * spacing;
    }
    let all: f64 = cells.iter().product();
    if all > MOST_BODY_NODES {
        return Err(Error::input(
            format!(
                "the box around the body holds {all:.2e} nodes, which would take about {:.0} GB",
                all * BYTES_PER_NODE / 1e9
            ),
            format!("use a larger spacing: at most {MOST_BODY_NODES:.0e} nodes are run"),
        ));
    }
    Grid::new(cells.map(|n| n as usize), spacing, origin, periodic)
}

/// Whether triangles bound a solid.
fn has_triangles(solid: &Solid) -> bool {
    match solid {
        Solid::Mesh(_) => true,
        Solid::Union(parts) | Solid::Intersection(parts) => parts.iter().any(has_triangles),
        Solid::Difference(from, _) => has_triangles(from),
        Solid::Moved { solid, .. } => has_triangles(solid),
        Solid::Box { .. } | Solid::Cylinder { .. } | Solid::Sphere { .. } | Solid::HalfSpace { .. } => false,
    }
}

/// Per node of a grid, whether it is inside a solid, or outside by no more than 10⁻⁹ spacings. Along a periodic axis of
/// one layer (plane strain) the solid is cut at the layer.
pub fn inside(solid: &Solid, grid: &Grid) -> Vec<bool> {
    let tolerance = ON_BORDER * grid.spacing;
    (0..grid.len()).into_par_iter().map(|n| solid.contains(&grid.position(n), tolerance)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(x: f64, y: f64, z: f64) -> Solid {
        Solid::Box { min: Vector3::zeros(), max: Vector3::new(x, y, z) }
    }

    #[test]
    fn a_box_of_whole_spacings_has_its_exact_volume() {
        let mut cases = vec![(0.1, 0.04, 0.001, [100, 40, 1])];
        cases.extend([(0.3, 0.6, 0.7, [300, 600, 700]), (0.001, 0.003, 0.029, [1, 3, 29])]);
        for (x, y, z, nodes) in cases {
            let grid = grid_around(&block(x, y, z), 0.001, [false; 3], None).unwrap();
            assert_eq!(grid.nodes, nodes);
            assert!((grid.position(0) - Vector3::repeat(0.0005)).norm() < 1e-12);
            if grid.len() < 10_000 {
                assert!(inside(&block(x, y, z), &grid).iter().all(|&b| b));
            }
        }
    }

    #[test]
    fn volumes_converge() {
        let (r, h) = (1.0, 0.8);
        let pi = std::f64::consts::PI;
        let ball = Solid::Sphere { centre: Vector3::new(0.03, 0.01, 0.02), radius: r };
        let rod = Solid::Cylinder {
            centre: Vector3::zeros(),
            axis: Vector3::new(0.3, 0.5, 0.8).normalize(),
            radius: r,
            half_length: h,
        };
        let hollow = Solid::Difference(
            Box::new(block(2.0, 2.0, 2.0)),
            vec![Solid::Sphere { centre: Vector3::repeat(1.0), radius: 0.7 }],
        );
        for (solid, exact) in [(ball, 4.0 / 3.0 * pi), (rod, 2.0 * pi * h), (hollow, 8.0 - 4.0 / 3.0 * pi * 0.343)] {
            let mut errors = Vec::new();
            for spacing in [0.1, 0.025] {
                let grid = grid_around(&solid, spacing, [false; 3], None).unwrap();
                let count = inside(&solid, &grid).iter().filter(|&&b| b).count();
                errors.push((count as f64 * spacing.powi(3) / exact - 1.0).abs());
            }
            assert!(errors[1] < 2e-3 && errors[0] < 3e-2, "{solid:?} {errors:?}");
        }
    }

    #[test]
    fn grids_that_cannot_be() {
        let plate =
            Solid::Box { min: Vector3::new(0.0, 0.0, f64::NEG_INFINITY), max: Vector3::new(1.0, 1.0, f64::INFINITY) };
        let message = |solid: &Solid, spacing, periodic, plane| {
            grid_around(solid, spacing, periodic, plane).unwrap_err().to_string()
        };
        assert!(message(&plate, 0.1, [false; 3], None).contains("infinite along z"));
        assert!(message(&block(1.0, 1.0, 1.05), 0.1, [false, false, true], None).contains("10.500000 spacings"));
        assert!(message(&block(1.0, 1.0, 1.0), 1e-4, [false; 3], None).contains("about 100000 GB"));
        assert!(message(&block(-1.0, 1.0, 1.0), 0.1, [false; 3], None).contains("empty"));
        assert!(message(&block(1.0, 1.0, 1.0), f64::NAN, [false; 3], None).contains("not possible"));
        let layer = grid_around(&plate, 0.1, [false; 3], Some(2)).unwrap();
        assert_eq!((layer.nodes, layer.periodic, layer.origin.z), ([10, 10, 1], [false, false, true], 0.0));
    }
}
