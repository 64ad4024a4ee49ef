//! The tips of a crack: where each was at what time, where it branched off, how fast it ran.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::crack_path::{CrackPoint, WINDOW, line, slope, speed_from, tip_history};
use super::unrolled;
use crate::lattice::Grid;

/// Nodes no farther than this (in spacings) from the way of a tip belong to it.
const WIDTH: i32 = 3;

/// The least length of a branch (in spacings).
const LEAST: f64 = 8.0;

/// Tips of a crack at most.
const MOST: usize = 16;

/// Half the way (in spacings) over which the speed of a moment is taken.
const HALF_WINDOW: f64 = 6.0;

/// A tip of a crack at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipPoint {
    /// Time (s), or load factor in equilibrium.
    pub time: f64,
    /// Place (m).
    pub place: Vector3<f64>,
    /// Length of the crack up to it (m).
    pub length: f64,
    /// Speed (m/s), by least squares over six spacings of the way before and after; `None` in equilibrium.
    pub speed: Option<f64>,
}

/// One tip of a crack, with the way that led to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrackTip {
    /// Where it began, or branched off from the way of a longer one (m).
    pub start: [f64; 3],
    /// Where it ended (m).
    pub tip: [f64; 3],
    /// The way from where the crack began to the tip (m).
    pub length: f64,
    /// Unit vector of the straight line of least squares through its own way, from `start` on.
    pub direction: [f64; 3],
    /// Number (from 1) of the tip it branched off from, and the angle (degrees) between its line and that of the other from there
    /// on.
    pub branch: Option<(usize, f64)>,
    /// Mean speed over its own way (m/s), by least squares; `None` in equilibrium or of too few moments.
    pub speed: Option<f64>,
    /// Largest mean speed over a fifth of the whole way (m/s).
    pub largest_speed: Option<f64>,
    /// Where it was, moment by moment, from the crack's beginning on.
    #[serde(skip)]
    pub history: Vec<TipPoint>,
}

/// The tips of a crack whose nodes have times and ways, the longest first: the farthest node, then the farthest of those off the
/// ways that led to tips before, if it is eight spacings away from where it left them.
pub(super) fn crack_tips(
    grid: &Grid,
    times: &[f64],
    ways: &BTreeMap<usize, f64>,
    hops: &[([i32; 3], f64)],
    motion: bool,
) -> Vec<CrackTip> {
    let mut order: Vec<usize> = ways.keys().copied().collect();
    order.sort_by(|a, b| ways[b].total_cmp(&ways[a]).then(times[*a].total_cmp(&times[*b])).then(a.cmp(b)));
    // Nodes of known tips' ways and around them, by tip.
    let mut known: BTreeMap<usize, usize> = BTreeMap::new();
    let mut trails: Vec<Vec<usize>> = Vec::new();
    let mut tips = Vec::new();
    for node in order {
        if tips.len() == MOST || known.contains_key(&node) {
            continue;
        }
        let trail = trail(grid, ways, hops, node);
        let own: Vec<usize> = trail.iter().copied().take_while(|n| !known.contains_key(n)).collect();
        let parent = trail.get(own.len()).and_then(|n| known.get(n)).copied();
        let from = own.last().map_or(0.0, |n| ways[n]);
        if !tips.is_empty() && (ways[&node] - from < LEAST * grid.spacing || parent.is_none()) {
            continue;
        }
        let number = tips.len();
        for &n in &own {
            around(grid, n, |near| {
                known.entry(near).or_insert(number);
            });
        }
        let branch = parent.map(|parent| (parent, from));
        tips.push(tip(grid, times, ways, &trail, own.len(), motion));
        trails.push(trail);
        if let (Some((parent, from)), Some(tip)) = (branch, tips.last_mut()) {
            let other: Vec<usize> = trails[parent].iter().copied().filter(|n| ways[n] >= from).collect();
            let angle = chord(&unrolled::along(grid, &other)).angle(&Vector3::from(tip.direction)).to_degrees();
            tip.branch = Some((parent + 1, angle));
        }
    }
    tips
}

/// From a node back to where the crack began, each time to the neighbour on the shortest way.
fn trail(grid: &Grid, ways: &BTreeMap<usize, f64>, hops: &[([i32; 3], f64)], from: usize) -> Vec<usize> {
    let (mut trail, mut seen) = (vec![from], BTreeSet::from([from]));
    loop {
        let node = trail[trail.len() - 1];
        let back = hops
            .iter()
            .filter_map(|(offset, length)| grid.neighbour(node, *offset).map(|n| (n, *length)))
            .filter_map(|(n, length)| ways.get(&n).map(|way| (n, way + length)))
            .filter(|(n, way)| ways[n] < ways[&node] && *way <= ways[&node] * (1.0 + 1e-9))
            .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        match back {
            Some((n, _)) if seen.insert(n) => trail.push(n),
            _ => return trail,
        }
    }
}

/// Visit the nodes around a node.
fn around(grid: &Grid, node: usize, mut visit: impl FnMut(usize)) {
    let range = |a: usize| if grid.nodes[a] > 1 { -WIDTH..=WIDTH } else { 0..=0 };
    for i in range(0) {
        for j in range(1) {
            for k in range(2).filter(|k| i * i + j * j + k * k <= WIDTH * WIDTH) {
                grid.neighbour(node, [i, j, k]).into_iter().for_each(&mut visit);
            }
        }
    }
}

/// A tip from its trail back, of which the first `own` nodes are its alone.
fn tip(grid: &Grid, times: &[f64], ways: &BTreeMap<usize, f64>, trail: &[usize], own: usize, motion: bool) -> CrackTip {
    let mut points: Vec<CrackPoint> = Vec::new();
    for &node in trail.iter().rev() {
        // A tip is where all of its way has cracked.
        let time = points.last().map_or(times[node], |p| p.time.max(times[node]));
        points.push(CrackPoint { place: grid.position(node), time, way: ways[&node] });
    }
    let whole = tip_history(&points);
    let at = |way: f64| points.iter().find(|p| p.way == way).map_or(points[0].place, |p| p.place);
    let near = |way: f64| -> Vec<[f64; 2]> {
        whole.iter().copied().filter(|p| (p[1] - way).abs() <= HALF_WINDOW * grid.spacing).collect()
    };
    let speed = |points: &[[f64; 2]]| (motion && points.len() >= 3).then(|| slope(points));
    let history =
        whole.iter().map(|&[time, length]| TipPoint { time, place: at(length), length, speed: speed(&near(length)) });
    let places: Vec<Vector3<f64>> = unrolled::along(grid, &trail[..own]).into_iter().rev().collect();
    let (first, last) = (points[trail.len() - own], points[points.len() - 1]);
    let own_history: Vec<[f64; 2]> = whole.iter().copied().filter(|p| p[1] >= first.way).collect();
    let largest = whole.iter().filter_map(|from| speed_from(from, &whole, WINDOW * last.way)).reduce(f64::max);
    CrackTip {
        start: first.place.into(),
        tip: last.place.into(),
        length: last.way,
        direction: line(&places, &(places[own - 1] - places[0])).into(),
        branch: None,
        speed: speed(&own_history),
        largest_speed: largest.filter(|_| motion && whole.len() >= 3),
        history: history.collect(),
    }
}

/// Direction of the line through points that are listed from the far end on.
fn chord(points: &[Vector3<f64>]) -> Vector3<f64> {
    match points {
        [first, .., last] => line(points, &(first - last)),
        _ => Vector3::zeros(),
    }
}
