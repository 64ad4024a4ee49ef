//! Spheres at a surface: which carry how much of a pressure on it.

use nalgebra::Vector3;

use super::Solid;
use super::boundary::{Surface, Window, shared_surface};
use crate::lattice::Packing;
use crate::{Error, Result};

/// Pieces of a surface along a mean radius.
const PIECES: f64 = 4.0;

/// The surface that a solid shares with the body of a packing (a hole that was cut out, or part of the body's outside), every
/// piece carried by the sphere whose centre is nearest to it. So areas sum to that of the surface, and −p Σ A n is the
/// pressure's resultant. Spheres within `reach` (m) of the solid's surface are looked at.
///
/// # Errors
/// No sphere within reach of the surface, or a surface that is none of the body's; a reach that is not positive.
pub fn exposed_spheres(packing: &Packing, solid: &Solid, body: &Solid, reach: f64, window: &Window) -> Result<Surface> {
    if !(reach.is_finite() && reach > 0.0) {
        return Err(Error::input(format!("a reach of {reach} m"), "give a positive length"));
    }
    let mean = packing.radii().iter().sum::<f64>() / packing.len() as f64;
    let near: Vec<u32> =
        (0..packing.len() as u32).filter(|&i| solid.distance(&packing.centres()[i as usize]).abs() <= reach).collect();
    if near.is_empty() {
        return Err(Error::input(
            format!("no sphere is within {reach} m of the surface"),
            "give a larger reach, or a solid whose surface is at the packing",
        ));
    }
    let boxes = Boxes::new(packing, &near, mean);
    let pieces = shared_surface(solid, body, window, mean / PIECES);
    if pieces.is_empty() {
        return Err(Error::input(
            "the surface of the solid is none of the body's",
            "name the solid whose surface is a surface of the body, as a hole that was cut out",
        ));
    }
    Ok(Surface::shared(&pieces, |x| boxes.nearest(packing, x)))
}

/// Spheres near the surface in boxes.
struct Boxes {
    edge: f64,
    of: std::collections::HashMap<[i64; 3], Vec<u32>>,
    /// Least and largest box that holds any.
    ends: [[i64; 3]; 2],
}

impl Boxes {
    fn new(packing: &Packing, near: &[u32], mean: f64) -> Self {
        let mut boxes =
            Boxes { edge: 2.0 * mean, of: std::collections::HashMap::new(), ends: [[i64::MAX; 3], [i64::MIN; 3]] };
        for &i in near {
            let key = boxes.key(&packing.centres()[i as usize]);
            boxes.of.entry(key).or_default().push(i);
            for a in 0..3 {
                boxes.ends[0][a] = boxes.ends[0][a].min(key[a]);
                boxes.ends[1][a] = boxes.ends[1][a].max(key[a]);
            }
        }
        boxes
    }

    fn key(&self, x: &Vector3<f64>) -> [i64; 3] {
        std::array::from_fn(|i| (x[i] / self.edge).floor() as i64)
    }

    /// The sphere whose centre is nearest to a point; the smaller number of equals.
    fn nearest(&self, packing: &Packing, x: &Vector3<f64>) -> Option<u32> {
        let key = self.key(x);
        let furthest = (0..3).map(|a| (key[a] - self.ends[0][a]).abs().max((self.ends[1][a] - key[a]).abs())).max()?;
        let mut best: Option<(f64, u32)> = None;
        for ring in 0..=furthest {
            // Boxes of this ring are at least so far away.
            let least = (ring - 1).max(0) as f64 * self.edge;
            if best.is_some_and(|(distance, _)| distance < least) {
                break;
            }
            for i in -ring..=ring {
                for j in -ring..=ring {
                    let shell = if i.abs() == ring || j.abs() == ring { 1 } else { (2 * ring).max(1) };
                    for k in (-ring..=ring).step_by(shell as usize) {
                        for &sphere in self.of.get(&[key[0] + i, key[1] + j, key[2] + k]).into_iter().flatten() {
                            let found = ((packing.centres()[sphere as usize] - x).norm(), sphere);
                            if best.is_none_or(|b| found.0.total_cmp(&b.0).then(found.1.cmp(&b.1)).is_lt()) {
                                best = Some(found);
                            }
                        }
                    }
                }
            }
        }
        best.map(|b| b.1)
    }
}
