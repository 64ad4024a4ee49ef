//! How far parts of a body have gone through each other: grids have no contact, so it is said.

use nalgebra::Vector3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::experiment::problem::Problem;
use crate::lattice::Body;
use crate::operator::GridOperator;
use crate::operator::grid::{FailingBonds, Padded};

/// Faces count as gone through each other where they came nearer by more than so many times what the most compressed bond beside
/// them says, ...
const BEYOND: f64 = 2.0;

/// ... by more than this part of the largest opening or closing anywhere, ...
const RELATIVE: f64 = 0.01;

/// ... by more than this part of the largest displacement, which rounding and solvers may leave, ...
const ROUNDING: f64 = 1e-6;

/// ... by more than this part of the whole relative displacement, most of which may be sliding, ...
const CLOSING: f64 = 0.1;

/// ... and, in motion, where waves press faces together everywhere, by more than this part of a spacing.
const FLOOR: f64 = 0.01;

/// Nodes that no bond joins and that are nearer than this part of a spacing lie in each other.
const NEAR: f64 = 0.5;

/// Steps that are gone from a node to the outside of its body at most.
const DEEPEST: usize = 1000;

/// Parts of a body that lie in each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overlap {
    /// Depth (m): of cracks, by how much the faces came nearer than they were; of pieces, to half a spacing.
    pub depth: f64,
    /// Where it is deepest (m), as placed at the start.
    pub at: [f64; 3],
    /// When it was deepest: time (s), or load factor (–).
    pub time: f64,
    /// What lies in what.
    pub between: Between,
}

/// What lies in what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Between {
    /// The two faces of a crack.
    CrackFaces,
    /// Pieces that no bond joins.
    Pieces,
}

impl Overlap {
    /// In words.
    pub(super) fn warning(&self, spacing: f64, motion: bool) -> String {
        let [x, y, z] = self.at;
        let when = if motion { format!("t = {:.4e} s", self.time) } else { format!("load factor {:.4}", self.time) };
        let (what, remedy) = match self.between {
            Between::CrackFaces => ("faces of a crack", "no force holds closed faces apart"),
            Between::Pieces => ("pieces that no bond joins", "they meet no resistance"),
        };
        format!(
            "{what} lie in each other by up to {:.3e} m ({:.3} spacings), the deepest at ({x:.4e}, {y:.4e}, {z:.4e}) m at {when}: \
             bodies on grids have no contact, {remedy}, and results that depend on it are not right",
            self.depth,
            self.depth / spacing
        )
    }
}

/// The deeper of what was found before and what is found now.
pub(super) fn look(
    problem: &Problem,
    bonds: &FailingBonds,
    u: &Padded<f64>,
    (time, motion, cracked): (f64, bool, bool),
    before: Option<Overlap>,
) -> Option<Overlap> {
    let spacing = problem.body.grid.spacing;
    let openings = if cracked { bonds.grid().openings(u, problem.kinematics) } else { Vec::new() };
    let largest = openings.iter().map(|o| o.opening.abs()).fold(0.0, f64::max);
    let farthest = farthest(&problem.body, u);
    let floor = (RELATIVE * largest).max(ROUNDING * farthest).max(if motion { FLOOR * spacing } else { 0.0 });
    let closed = openings.iter().filter(|o| -o.opening > floor.max(BEYOND * o.compression).max(CLOSING * o.jump));
    let faces =
        closed.max_by(|a, b| b.opening.total_cmp(&a.opening)).map(|o| (-o.opening, o.node, Between::CrackFaces));
    // Nodes start a spacing apart.
    let near = (0.5 * (1.0 - NEAR) * spacing..f64::INFINITY).contains(&farthest);
    let pieces = near.then(|| deepest_pieces(&problem.body, bonds, u, cracked)).flatten();
    let pieces = pieces.map(|(depth, node)| (depth, node, Between::Pieces));
    let found = faces.into_iter().chain(pieces).map(|(depth, node, between)| Overlap {
        depth,
        at: problem.body.grid.position(node as usize).into(),
        time,
        between,
    });
    before.into_iter().chain(found).reduce(|a, b| if b.depth > a.depth { b } else { a })
}

/// The depth (m) and a node of the deepest of pieces that lie in each other. A node s steps from the outside of its body is as
/// deep as (s − ½) Δ; two that are at one place add up.
fn deepest_pieces(body: &Body, bonds: &FailingBonds, u: &Padded<f64>, cracked: bool) -> Option<(f64, u32)> {
    let (grid, spacing) = (&body.grid, body.grid.spacing);
    let nodes: Vec<u32> = (0..grid.len() as u32).filter(|&node| body.has(node as usize)).collect();
    let moved = |node: u32| Vector3::from(u.at(node as usize));
    // Nodes at faces, and those that lost bonds.
    let steps = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
    let at_face = |node: usize| steps.iter().any(|s| grid.neighbour(node, *s).is_none_or(|n| !body.has(n)));
    let exposed = |node: u32| match cracked {
        true => bonds.wholeness(node as usize) < 1.0 - 1e-9,
        false => at_face(node as usize),
    };
    let outer: Vec<u32> = nodes.par_iter().copied().filter(|&node| exposed(node)).collect();
    let place = |node: u32| grid.position(node as usize) + moved(node) - grid.origin;
    let cell = |x: &Vector3<f64>| [0, 1, 2].map(|a| (x[a] / spacing).floor() as i64);
    let mut cells: Vec<([i64; 3], u32)> = nodes.par_iter().map(|&node| (reversed(cell(&place(node))), node)).collect();
    cells.par_sort_unstable();
    let of_node = |&node: &u32| {
        let x = place(node);
        let (low, high) = (cell(&x.add_scalar(-NEAR * spacing)), cell(&x.add_scalar(NEAR * spacing)));
        let mut deepest: Option<(f64, u32)> = None;
        for (k, j) in (low[2]..=high[2]).flat_map(|k| (low[1]..=high[1]).map(move |j| (k, j))) {
            let from = cells.partition_point(|(c, _)| *c < [k, j, low[0]]);
            let here = cells[from..].iter().take_while(|(c, _)| *c <= [k, j, high[0]]);
            for &(_, other) in here.filter(|(_, other)| *other != node) {
                let distance = (place(other) - x).norm();
                if distance >= NEAR * spacing || bonds.grid().joined(node as usize, other as usize) {
                    continue;
                }
                let steps = (steps_inside(body, node) + steps_inside(body, other) - 1) as f64;
                let depth = steps * spacing - distance;
                if deepest.is_none_or(|(d, _)| depth > d) {
                    deepest = Some((depth, node));
                }
            }
        }
        deepest
    };
    let deeper = |a: (f64, u32), b: (f64, u32)| if (b.0, a.1) > (a.0, b.1) { b } else { a };
    outer.par_iter().filter_map(of_node).reduce_with(deeper)
}

/// The largest displacement of a node (m).
fn farthest(body: &Body, u: &Padded<f64>) -> f64 {
    let length = |node: usize| if body.has(node) { Vector3::from(u.at(node)).norm() } else { 0.0 };
    (0..body.grid.len()).into_par_iter().with_min_len(4096).map(length).reduce(|| 0.0, f64::max)
}

/// Third axis first, so that cells in a row follow each other.
fn reversed([x, y, z]: [i64; 3]) -> [i64; 3] {
    [z, y, x]
}

/// The fewest steps along an axis from a node to the outside of its body; 1 at a face.
fn steps_inside(body: &Body, node: u32) -> usize {
    let along = |axis: usize, step: i32| {
        let mut at = node as usize;
        let mut offset = [0; 3];
        offset[axis] = step;
        (1..DEEPEST)
            .find(|_| match body.grid.neighbour(at, offset).filter(|&next| body.has(next)) {
                Some(next) => {
                    at = next;
                    false
                }
                None => true,
            })
            .unwrap_or(DEEPEST)
    };
    (0..3).flat_map(|axis| [along(axis, 1), along(axis, -1)]).min().unwrap_or(1)
}
