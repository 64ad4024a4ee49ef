//! Spheres at a surface: which carry how much of a pressure on it.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::{Patch, Solid};
use crate::lattice::Packing;
use crate::{Error, Result};

/// Sample points on a surface per square of the mean radius.
const DENSITY: f64 = 16.0;

/// A part of a surface in which points are shared out.
struct Sample {
    point: Vector3<f64>,
    /// Outward normal of the solid.
    normal: Vector3<f64>,
    area: f64,
}

/// The patches of a packing's spheres that carry a pressure on the surface of a solid (a hole in the body, or the body's
/// own outside), within a box `region` if the surface is infinite: every piece of the surface belongs to the sphere
/// nearest to it. Normals point out of the body: `hole` says that the solid is the hole. Areas sum to that of the surface
/// where a sphere is within `reach` (m) of it, so that −p Σ A n is the pressure's resultant there.
///
/// The surface is sampled by the solid's signed distance on a grid of a quarter of the mean radius: a cell of size h
/// through which the surface passes stands for the area h³ δ(d), δ a hat of half width h (|∇d| = 1). The sampled area is
/// exact on average and within about 1 % for surfaces of some radii.
///
/// # Errors
/// No sphere within reach of the surface; a reach that is not positive.
pub fn exposed_spheres(
    packing: &Packing,
    solid: &Solid,
    hole: bool,
    reach: f64,
    region: Option<[Vector3<f64>; 2]>,
) -> Result<Vec<Patch>> {
    if !(reach.is_finite() && reach > 0.0) {
        return Err(Error::input(format!("a reach of {reach} m"), "give a positive length"));
    }
    let mean = packing.radii().iter().sum::<f64>() / packing.len() as f64;
    let spacing = mean / DENSITY.sqrt();
    let near: Vec<u32> = (0..packing.len() as u32)
        .filter(|&i| {
            let x = &packing.centres()[i as usize];
            solid.distance(x).abs() <= reach + 2.0 * spacing && within(x, &region)
        })
        .collect();
    if near.is_empty() {
        return Err(Error::input(
            format!("no sphere is within {reach} m of the surface"),
            "give a larger reach, or a solid whose surface is at the packing",
        ));
    }
    let boxes = Boxes::new(packing, &near, reach);
    let samples = samples(packing, solid, &near, reach, spacing, region);
    let shared: Vec<Option<u32>> = samples.par_iter().map(|s| boxes.nearest(packing, &s.point)).collect();
    let mut patches = std::collections::BTreeMap::<u32, Vector3<f64>>::new();
    for (sample, sphere) in samples.iter().zip(shared) {
        let Some(sphere) = sphere else { continue };
        let outward = sample.normal * if hole { -1.0 } else { 1.0 };
        *patches.entry(sphere).or_insert_with(Vector3::zeros) += sample.area * outward;
    }
    // Area and normal such that area · normal is the integral of the normal: exact resultants.
    let patch = |(node, vector): (u32, Vector3<f64>)| {
        let area = vector.norm();
        (area > 0.0).then(|| Patch { node, area, normal: vector / area })
    };
    Ok(patches.into_iter().filter_map(patch).collect())
}

fn within(x: &Vector3<f64>, region: &Option<[Vector3<f64>; 2]>) -> bool {
    region.is_none_or(|[low, high]| (0..3).all(|i| low[i] <= x[i] && x[i] < high[i]))
}

/// Points of the surface on a grid over the spheres near it.
fn samples(
    packing: &Packing,
    solid: &Solid,
    near: &[u32],
    reach: f64,
    spacing: f64,
    region: Option<[Vector3<f64>; 2]>,
) -> Vec<Sample> {
    let centre = |i: &u32| packing.centres()[*i as usize];
    let start = centre(&near[0]);
    let (mut low, mut high) =
        near.iter().map(centre).fold((start, start), |(low, high), x| (low.inf(&x), high.sup(&x)));
    (low, high) = (low.add_scalar(-reach), high.add_scalar(reach));
    if let Some([from, to]) = region {
        (low, high) = (low.sup(&from), high.inf(&to));
    }
    // A whole number of cells per axis, so that areas fill the region exactly.
    let count: [usize; 3] = std::array::from_fn(|i| (((high[i] - low[i]) / spacing).ceil() as usize).max(1));
    let edges = Vector3::from_fn(|i, _| (high[i] - low[i]) / count[i] as f64);
    let width = spacing;
    let volume = edges.product();
    (0..count[2])
        .into_par_iter()
        .flat_map_iter(|k| {
            (0..count[1] * count[0]).filter_map(move |ij| {
                let at = Vector3::new((ij % count[0]) as f64, (ij / count[0]) as f64, k as f64).add_scalar(0.5);
                let x = low + edges.component_mul(&at);
                let d = solid.distance(&x);
                let weight = (1.0 - d.abs() / width) / width;
                if weight <= 0.0 {
                    return None;
                }
                let normal = solid.normal(&x, 1e-3 * spacing);
                Some(Sample { point: x - d * normal, normal, area: weight * volume })
            })
        })
        .collect()
}

/// Spheres near the surface in boxes of the reach.
struct Boxes {
    edge: f64,
    of: std::collections::HashMap<[i64; 3], Vec<u32>>,
}

impl Boxes {
    fn new(packing: &Packing, near: &[u32], edge: f64) -> Self {
        let mut boxes = Boxes { edge, of: std::collections::HashMap::new() };
        for &i in near {
            let key = boxes.key(&packing.centres()[i as usize]);
            boxes.of.entry(key).or_default().push(i);
        }
        boxes
    }

    fn key(&self, x: &Vector3<f64>) -> [i64; 3] {
        std::array::from_fn(|i| (x[i] / self.edge).floor() as i64)
    }

    /// The sphere whose centre is nearest to a point and within the reach; the smaller number of equals.
    fn nearest(&self, packing: &Packing, x: &Vector3<f64>) -> Option<u32> {
        let key = self.key(x);
        let around = (0..27).map(|n| [key[0] + n % 3 - 1, key[1] + n / 3 % 3 - 1, key[2] + n / 9 - 1]);
        let candidates = around.filter_map(|key| self.of.get(&key)).flatten();
        candidates
            .map(|&i| ((packing.centres()[i as usize] - x).norm(), i))
            .filter(|(distance, _)| *distance <= self.edge)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, i)| i)
    }
}
