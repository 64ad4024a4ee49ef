//! Spheres chosen by face, solid, region or point, and the areas that they carry.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::body::Spheres;
use crate::case::CaseFile;
use crate::case::loads::{Depth, Place, Where, face_name};
use crate::case::matter::axis_name;
use anisobond::lattice::Solid;
use anisobond::lattice::solid::{Face, Patch, Surface, Window, exposed_spheres};
use anisobond::{Error, Result};

/// A probe's point may be so many mean radii away from the nearest centre.
const FAR: f64 = 4.0;

/// Spheres within so many mean radii of a surface are looked at for a pressure on it.
const REACH: f64 = 3.0;

/// Cells along the sides of a face whose area is counted, how often those at its edges are halved, and at how many depths of
/// its layer the body is looked for.
const FACE_CELLS: usize = 60;
const HALVINGS: usize = 5;
const DEPTHS: usize = 8;

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
            let parts = number.map_or(0..0, |number| spheres.ranges[number].clone());
            (0..n).filter(|&s| parts.contains(&usize::from(spheres.region[s as usize]))).collect()
        }
        Place::Face(face, depth) => layer(spheres, on, *face, *depth)?,
        Place::Solid(shape) => {
            let nodes = chosen(&|x| shape.contains(x, 0.0));
            // Of a hole, those around it.
            if nodes.is_empty() { carriers(spheres, shape) } else { nodes }
        }
        Place::Points(points) => points.iter().map(|x| nearest(spheres, on, x)).collect::<Result<_>>()?,
    };
    if nodes.is_empty() {
        return Err(on.spot.wrong("no sphere of the body is there", "check place, thickness and units"));
    }
    Ok(nodes)
}

/// The spheres at the surface that a solid shares with the body, ascending.
fn carriers(spheres: &Spheres, shape: &Solid) -> Vec<u32> {
    let mut nodes: Vec<u32> =
        exposed(spheres, shape).map_or(Vec::new(), |s| s.patches.iter().map(|p| p.node).collect());
    nodes.dedup();
    nodes
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

/// The surface at a face or of a solid, with the areas that spheres carry, in the packing's coordinates.
///
/// A face's area is what the body shows of it: its shadow along the face's normal, as deep as the layer, shared in proportion
/// to r² by the spheres of the layer.
pub(super) fn surface(spheres: &Spheres, on: &Where) -> Result<Surface> {
    match &on.place {
        Place::Face(face, depth) => {
            let nodes = layer(spheres, on, *face, *depth)?;
            let radii = spheres.packing.radii();
            let squares: f64 = nodes.iter().map(|&s| radii[s as usize].powi(2)).sum();
            let depth = depth.metres(2.0 * spheres.mean_radius());
            let (area, moment) = shadow(spheres, *face, depth, &nodes);
            if nodes.is_empty() || area <= 0.0 {
                return Err(on.spot.wrong("no sphere of the body is at that face", "check thickness and units"));
            }
            let normal = face.normal();
            let share = area / squares;
            let patch = |&node: &u32| Patch { node, area: share * radii[node as usize].powi(2), normal };
            let patches = nodes.iter().map(patch).collect();
            let moment = moment - spheres.origin * area;
            Ok(Surface { patches, normal: normal * area, moment, turning: moment.cross(&normal) })
        }
        Place::Solid(shape) => exposed(spheres, shape).map_err(|e| on.spot.at(e)),
        Place::All | Place::Region(_) | Place::Points(_) => {
            Err(on.spot.wrong("that has no surface", "name a face (x-min … z-max) or a solid"))
        }
    }
}

/// The surface that a solid shares with the body.
fn exposed(spheres: &Spheres, shape: &Solid) -> Result<Surface> {
    let Some(body) = &spheres.shape else {
        return Err(Error::input("the whole periodic cell is the body, which has no surface", "add [body]"));
    };
    let moved = |solid: &Solid| Solid::Moved {
        solid: Box::new(solid.clone()),
        rotation: nalgebra::Matrix3::identity(),
        shift: -spheres.origin,
    };
    let [low, high] = spheres.bounds.map(|x| x - spheres.origin);
    let window = Window { low, high, periodic: spheres.periodic };
    let reach = REACH * spheres.mean_radius();
    exposed_spheres(&spheres.packing, &moved(shape), &moved(body), reach, &window)
}

/// Area (m²) and ∫ x dA (m³) of the shadow that a body throws along the normal of one of its faces, as deep (m) as the layer of
/// the given spheres: columns that meet the body in the layer, on a raster that is halved where it is cut by an edge.
fn shadow(spheres: &Spheres, face: Face, depth: f64, nodes: &[u32]) -> (f64, Vector3<f64>) {
    let [low, high] = spheres.bounds;
    let axes = [(face.axis + 1) % 3, (face.axis + 2) % 3];
    let (room, level) = (FAR * spheres.mean_radius(), if face.upper { high } else { low }[face.axis]);
    let inwards = if face.upper { -depth } else { depth };
    let span = axes.map(|a| {
        let along = || nodes.iter().map(|&s| spheres.position(s as usize)[a]);
        let (least, most) = along().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), x| (l.min(x), m.max(x)));
        [low[a].max(least - room), high[a].min(most + room)]
    });
    let at = |u: f64, v: f64, part: f64| {
        let mut x = Vector3::zeros();
        (x[axes[0]], x[axes[1]], x[face.axis]) = (u, v, level + part * inwards);
        x
    };
    let shown = |u: f64, v: f64| {
        let inside = |part: f64| spheres.shape.as_ref().is_none_or(|s| s.contains(&at(u, v, part), 0.0));
        inside(1e-6) || (1..=DEPTHS).any(|n| inside(n as f64 / DEPTHS as f64))
    };
    let [right, up] = span.map(|s| (s[1] - s[0]) / FACE_CELLS as f64);
    let rows = (0..FACE_CELLS).into_par_iter().map(|j| {
        let mut sum = (0.0, Vector3::zeros());
        for i in 0..FACE_CELLS {
            let corner = [span[0][0] + i as f64 * right, span[1][0] + j as f64 * up];
            raster(&shown, corner, [right, up], HALVINGS, &mut |u, v, area| {
                sum.0 += area;
                sum.1 += at(u, v, 0.0) * area;
            });
        }
        sum
    });
    rows.collect::<Vec<_>>().into_iter().fold((0.0, Vector3::zeros()), |all, row| (all.0 + row.0, all.1 + row.1))
}

/// The part of a cell that is shown: middles and areas of what is left after halvings where an edge cuts it.
fn raster(
    shown: &impl Fn(f64, f64) -> bool,
    [u, v]: [f64; 2],
    [right, up]: [f64; 2],
    halvings: usize,
    add: &mut impl FnMut(f64, f64, f64),
) {
    let (near, far) = (1e-3, 1.0 - 1e-3);
    let middle = [u + 0.5 * right, v + 0.5 * up];
    let here = shown(middle[0], middle[1]);
    let corners = [(near, near), (far, near), (near, far), (far, far)];
    if halvings > 0 && corners.iter().any(|(s, t)| shown(u + s * right, v + t * up) != here) {
        for (s, t) in [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)] {
            raster(shown, [u + s * right, v + t * up], [0.5 * right, 0.5 * up], halvings - 1, add);
        }
    } else if here {
        add(middle[0], middle[1], right * up);
    }
}
