//! Spheres chosen by face, solid, region or point, and the areas that they carry.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::body::Spheres;
use crate::io::case::CaseFile;
use crate::io::case::loads::{Depth, Place, Where, face_name};
use crate::io::case::matter::axis_name;
use crate::lattice::Solid;
use crate::lattice::solid::{Face, Patch, exposed_spheres};
use crate::{Error, Result};

/// A probe's point may be so many mean radii away from the nearest centre.
const FAR: f64 = 4.0;

/// Spheres within so many mean radii of a surface are looked at for a pressure on it.
const REACH: f64 = 3.0;

/// Cells along the sides of a face whose area is counted.
const FACE_CELLS: usize = 200;

/// The spheres of a choice, ascending; at least one.
pub(super) fn select(case: &CaseFile, spheres: &Spheres, on: &Where) -> Result<Vec<u32>> {
    let n = spheres.packing.len() as u32;
    let chosen = |keep: &(dyn Fn(&Vector3<f64>) -> bool + Sync)| -> Vec<u32> {
        (0..n).into_par_iter().filter(|&s| keep(&spheres.position(s as usize))).collect()
    };
    let nodes = match &on.place {
        Place::All => (0..n).collect(),
        Place::Region(name) => {
            let number = case.regions.iter().position(|r| r.name == *name);
            (0..n).filter(|&s| Some(usize::from(spheres.region[s as usize])) == number).collect()
        }
        Place::Face(face, depth) => layer(spheres, on, *face, *depth)?,
        Place::Solid(shape) => {
            let nodes = chosen(&|x| shape.contains(x, 0.0));
            // Of a hole, those around it.
            if nodes.is_empty() { patches(spheres, shape)?.iter().map(|p| p.node).collect() } else { nodes }
        }
        Place::Points(points) => points.iter().map(|x| nearest(spheres, on, x)).collect::<Result<_>>()?,
    };
    if nodes.is_empty() {
        return Err(on.spot.wrong("no sphere of the body is there", "check place, thickness and units"));
    }
    Ok(nodes)
}

/// Spheres whose centres are within a depth of the body's side.
fn layer(spheres: &Spheres, on: &Where, face: Face, depth: Depth) -> Result<Vec<u32>> {
    if spheres.periodic[face.axis] {
        let axis = axis_name(face.axis);
        let problem = format!("{} is no face: the packing is periodic along {axis}", face_name(face));
        return Err(on.spot.wrong(problem, "choose a face along another axis"));
    }
    let depth = depth.metres(2.0 * spheres.mean_radius());
    let [low, high] = spheres.bounds;
    let within = |s: &u32| {
        let x = spheres.position(*s as usize)[face.axis];
        if face.upper { x >= high[face.axis] - depth } else { x <= low[face.axis] + depth }
    };
    Ok((0..spheres.packing.len() as u32).filter(within).collect())
}

/// The sphere whose centre is nearest to a point; the first of equals.
fn nearest(spheres: &Spheres, on: &Where, point: &Vector3<f64>) -> Result<u32> {
    let distance = |s: u32| (spheres.position(s as usize) - point).norm();
    let all = (0..spheres.packing.len() as u32).into_par_iter().map(|s| (distance(s), s));
    let best = all.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    match best {
        Some((away, sphere)) if away <= FAR * spheres.mean_radius() => Ok(sphere),
        _ => {
            let away = best.map_or(f64::INFINITY, |b| b.0);
            Err(on.spot.wrong(
                format!("the nearest sphere is {away:.3e} m away"),
                format!("give a point within {FAR} radii of the body"),
            ))
        }
    }
}

/// The spheres at a face or at the surface of a solid, with the areas that they carry.
///
/// A face's area is that of the body's section just inside it, shared in proportion to r² by the spheres of its layer.
pub(super) fn surface(spheres: &Spheres, on: &Where) -> Result<Vec<Patch>> {
    let found = match &on.place {
        Place::Face(face, depth) => {
            let nodes = layer(spheres, on, *face, *depth)?;
            let radii = spheres.packing.radii();
            let squares: f64 = nodes.iter().map(|&s| radii[s as usize].powi(2)).sum();
            let share = face_area(spheres, *face) / squares;
            let patch = |&node: &u32| Patch { node, area: share * radii[node as usize].powi(2), normal: face.normal() };
            nodes.iter().map(patch).collect()
        }
        Place::Solid(shape) => patches(spheres, shape).map_err(|e| on.spot.at(e))?,
        Place::All | Place::Region(_) | Place::Points(_) => Vec::new(),
    };
    if found.is_empty() {
        return Err(on.spot.wrong(
            "no sphere of the body is at that surface",
            "name the solid whose surface is a surface of the body, as a hole that was cut out",
        ));
    }
    Ok(found)
}

/// Patches of a solid's surface, in the coordinates of the case. The solid is a hole if no sphere is inside.
fn patches(spheres: &Spheres, shape: &Solid) -> Result<Vec<Patch>> {
    let hole = !(0..spheres.packing.len()).any(|s| shape.contains(&spheres.position(s), 0.0));
    let moved = Solid::Moved {
        solid: Box::new(shape.clone()),
        rotation: nalgebra::Matrix3::identity(),
        shift: -spheres.origin,
    };
    let [low, high] = spheres.bounds.map(|x| x - spheres.origin);
    let region = Some([low, high]);
    exposed_spheres(&spheres.packing, &moved, hole, REACH * spheres.mean_radius(), region)
        .map_err(|e: Error| e.at("surface"))
}

/// Area (m²) of a body's outer face: the part of the plane just inside it that is in the body, on a raster; exact for boxes.
fn face_area(spheres: &Spheres, face: Face) -> f64 {
    let [low, high] = spheres.bounds;
    let (right, up) = ((face.axis + 1) % 3, (face.axis + 2) % 3);
    let sides = [right, up].map(|a| high[a] - low[a]);
    let inside = |i: usize, j: usize| {
        let mut x = Vector3::zeros();
        x[right] = low[right] + (i as f64 + 0.5) / FACE_CELLS as f64 * sides[0];
        x[up] = low[up] + (j as f64 + 0.5) / FACE_CELLS as f64 * sides[1];
        let depth = 1e-6 * (high[face.axis] - low[face.axis]);
        x[face.axis] = if face.upper { high[face.axis] - depth } else { low[face.axis] + depth };
        spheres.shape.as_ref().is_none_or(|s| s.contains(&x, 0.0))
    };
    let cells = (0..FACE_CELLS * FACE_CELLS).filter(|n| inside(n % FACE_CELLS, n / FACE_CELLS)).count();
    sides[0] * sides[1] * cells as f64 / (FACE_CELLS * FACE_CELLS) as f64
}
