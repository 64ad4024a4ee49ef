//! A packing of spheres, in a periodic cell or free.

use nalgebra::Vector3;

use crate::{Error, Result};

/// Spheres in a periodic rectangular cell, or free.
#[derive(Clone, Debug, PartialEq)]
pub struct Packing {
    cell: Option<Vector3<f64>>,
    centres: Vec<Vector3<f64>>,
    radii: Vec<f64>,
}

impl Packing {
    /// Spheres of given centres (m) and radii (m); with a cell (edge lengths, m) the packing is periodic and centres are
    /// wrapped into 0 ≤ x < edge.
    ///
    /// # Errors
    /// No sphere, lists of different length, numbers that are not finite, radii or edges that are not positive.
    pub fn new(cell: Option<Vector3<f64>>, centres: Vec<Vector3<f64>>, radii: Vec<f64>) -> Result<Self> {
        if centres.is_empty() {
            return Err(Error::input("the packing has no sphere", "give at least one"));
        }
        if centres.len() != radii.len() {
            return Err(Error::input(
                format!("{} centres but {} radii", centres.len(), radii.len()),
                "give one radius per centre",
            ));
        }
        if let Some(edges) = cell
            && !edges.iter().all(|e| e.is_finite() && *e > 0.0)
        {
            return Err(Error::input(
                format!("the cell's edges are {} {} {} m", edges.x, edges.y, edges.z),
                "give three positive lengths",
            ));
        }
        for (i, (x, r)) in centres.iter().zip(&radii).enumerate() {
            if !x.iter().all(|c| c.is_finite()) {
                return Err(Error::input(
                    format!("sphere {} is at ({}, {}, {}) m", i + 1, x.x, x.y, x.z),
                    "give finite positions",
                ));
            }
            if !(r.is_finite() && *r > 0.0) {
                return Err(Error::input(format!("sphere {} has radius {r} m", i + 1), "give positive radii"));
            }
        }
        let centres = match cell {
            None => centres,
            Some(edges) => centres.into_iter().map(|x| wrapped(x, &edges)).collect(),
        };
        Ok(Packing { cell, centres, radii })
    }

    /// Edges of the periodic cell (m); `None` for a free packing.
    pub fn cell(&self) -> Option<Vector3<f64>> {
        self.cell
    }

    /// Volume of the cell (m³); `None` for a free packing.
    pub fn volume(&self) -> Option<f64> {
        self.cell.map(|edges| edges.product())
    }

    /// Centres (m), in the cell if there is one.
    pub fn centres(&self) -> &[Vector3<f64>] {
        &self.centres
    }

    /// Radii (m).
    pub fn radii(&self) -> &[f64] {
        &self.radii
    }

    /// Number of spheres.
    pub fn len(&self) -> usize {
        self.centres.len()
    }

    /// Never: a packing has at least one sphere.
    pub fn is_empty(&self) -> bool {
        false
    }
}

/// A point taken into 0 ≤ x < edge.
fn wrapped(x: Vector3<f64>, edges: &Vector3<f64>) -> Vector3<f64> {
    x.zip_map(edges, |x, edge| {
        let inside = x.rem_euclid(edge);
        // rem_euclid may round a tiny negative number up to the edge itself.
        if inside < edge { inside } else { 0.0 }
    })
}
