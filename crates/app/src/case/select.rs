//! Nodes chosen by face, solid, region or point.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::loads::{Place, Where, face_name};
use super::matter::axis_name;
use super::resolve::Filled;
use super::{CaseFile, Spot};
use anisobond::Result;
use anisobond::lattice::Body;
use anisobond::lattice::solid;

/// A probe's point may be so many spacings away from the nearest node.
const FAR: f64 = 2.0;

/// The nodes of a choice, ascending; at least one.
pub(super) fn select(case: &CaseFile, filled: &Filled, on: &Where) -> Result<Vec<u32>> {
    let body = &filled.body;
    let chosen = |keep: &(dyn Fn(usize) -> bool + Sync)| -> Vec<u32> {
        (0..body.region.len()).into_par_iter().filter(|&i| body.has(i) && keep(i)).map(|i| i as u32).collect()
    };
    let nodes = match &on.place {
        Place::All => chosen(&|_| true),
        Place::Face(face, thickness) => {
            if body.grid.periodic[face.axis] {
                let axis = axis_name(face.axis);
                let problem = format!("{} is no face: the grid is periodic along {axis}", face_name(*face));
                return Err(on.spot.wrong(problem, "choose a face along another axis"));
            }
            solid::face_layer(body, *face, thickness.metres(body.grid.spacing)).iter().map(|p| p.node).collect()
        }
        Place::Solid(shape) => {
            let within = solid::inside(shape, &body.grid);
            let mut nodes = chosen(&|i| within[i]);
            if nodes.is_empty() {
                // A hole, say: conditions on its surface need no node inside.
                nodes = solid::surface_nodes(body, shape);
            }
            nodes
        }
        Place::Region(name) => {
            let index = case.regions.iter().position(|r| r.name == *name);
            let range = index.map_or(0..0, |n| filled.ranges[n].clone());
            chosen(&|i| range.contains(&(usize::from(body.region[i]) - 1)))
        }
        Place::Points(points) => {
            let mut nodes = Vec::new();
            for point in points {
                nodes.push(nearest(body, point, &on.spot)?);
            }
            nodes
        }
    };
    if nodes.is_empty() {
        return Err(on.spot.wrong("no node of the body is there", "check place, thickness and units"));
    }
    Ok(nodes)
}

/// The body's node nearest to a point; the first of equals.
fn nearest(body: &Body, point: &Vector3<f64>, spot: &Spot) -> Result<u32> {
    let best = (0..body.region.len())
        .into_par_iter()
        .filter(|&i| body.has(i))
        .map(|i| (((body.grid.position(i) - point).norm_squared()), i))
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let (squared, node) = best.ok_or_else(|| spot.wrong("the body holds no node", "check it"))?;
    // Along a layer of plane strain the place does not matter.
    let mut away = body.grid.position(node) - point;
    (0..3).filter(|&a| body.grid.nodes[a] == 1 && body.grid.periodic[a]).for_each(|a| away[a] = 0.0);
    if away.norm() > FAR * body.grid.spacing {
        return Err(spot.wrong(
            format!("the nearest node is {:.3e} m away", squared.sqrt()),
            format!("give a point within {FAR} spacings of the body"),
        ));
    }
    Ok(node as u32)
}
