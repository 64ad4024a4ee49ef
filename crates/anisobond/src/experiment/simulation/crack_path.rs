//! Cracks from the times at which nodes cracked: where each has been, how long it is, how fast its tip ran.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::crack::{FROM_THE_START, WHOLE};
use super::crack_tips::{CrackTip, crack_tips};
use super::unrolled;
use crate::lattice::Grid;

/// Square of the distance (in spacings) up to which cracked nodes belong to one crack. Ways along such hops are at most 3 %
/// longer than straight.
const REACH: i32 = 6;

/// Part of the way over which the tip's largest speed is taken.
pub(super) const WINDOW: f64 = 0.2;

/// Share of a crack's nodes all of whose neighbours along the axes are cracked, above which it is a zone and not a surface: of a
/// crack with two rows of nodes none is, with three a third.
const ZONE: f64 = 0.45;

/// A node of a crack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrackPoint {
    /// Place (m).
    pub place: Vector3<f64>,
    /// When it was found cracked: time (s), or load factor in equilibrium.
    pub time: f64,
    /// Way along the crack from where it began (m): from a pre-crack's edge, or from the node that cracked first.
    pub way: f64,
}

/// A crack that grew: cracked nodes that hang together. One that branches is one crack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrackPath {
    /// The longest way from where it began (m).
    pub length: f64,
    /// Nodes.
    pub nodes: usize,
    /// Where it began (m).
    pub start: [f64; 3],
    /// Its end farthest along the way (m).
    pub tip: [f64; 3],
    /// The direction of the straight line of least squares through its nodes, a unit vector from start to tip.
    pub direction: [f64; 3],
    /// When its first and its last node cracked: times (s), or load factors in equilibrium.
    pub times: [f64; 2],
    /// Speed of the farthest tip (m/s), by least squares over the way; `None` in equilibrium or of too few moments.
    pub speed: Option<f64>,
    /// The largest mean speed over a fifth of the way (m/s).
    pub largest_speed: Option<f64>,
    /// Whether its nodes fill a zone, several nodes thick, instead of lying on a surface. Of its tips only the farthest is told then.
    #[serde(default)]
    pub diffuse: bool,
    /// Its tips, the longest first; a crack that does not branch has one. In a body of many layers they are points of its front.
    pub tips: Vec<CrackTip>,
    /// Its nodes in the order of time.
    #[serde(skip)]
    pub points: Vec<CrackPoint>,
}

/// Cracks that have grown by three nodes or more, the longest first. `times` by node.
pub(super) fn crack_paths(grid: &Grid, times: &[f64], motion: bool) -> Vec<CrackPath> {
    let hops = hops(grid);
    let grown: Vec<usize> = (0..times.len()).filter(|&n| (0.0..WHOLE).contains(&times[n])).collect();
    let mut paths: Vec<CrackPath> = components(grid, &grown, &hops)
        .into_iter()
        .filter(|nodes| nodes.len() >= 3)
        .map(|nodes| path(grid, times, &nodes, &hops, motion))
        .collect();
    paths.sort_by(|a, b| b.length.total_cmp(&a.length));
    paths
}

/// Offsets of nodes that belong to one crack, and their lengths (m).
fn hops(grid: &Grid) -> Vec<([i32; 3], f64)> {
    let range = || -2..=2;
    let all = range().flat_map(|i| range().flat_map(move |j| range().map(move |k| [i, j, k])));
    let square = |o: &[i32; 3]| o.iter().map(|x| x * x).sum::<i32>();
    // One periodic layer is its own neighbour: hops across it lead nowhere else.
    let flat = |o: &[i32; 3]| (0..3).all(|a| o[a] == 0 || grid.nodes[a] > 1);
    all.filter(|o| (1..=REACH).contains(&square(o)) && flat(o))
        .map(|o| (o, f64::from(square(&o)).sqrt() * grid.spacing))
        .collect()
}

/// Nodes that hang together, each list ascending.
fn components(grid: &Grid, nodes: &[usize], hops: &[([i32; 3], f64)]) -> Vec<Vec<usize>> {
    let mut left: BTreeMap<usize, ()> = nodes.iter().map(|&n| (n, ())).collect();
    let mut found = Vec::new();
    while let Some((first, ())) = left.pop_first() {
        let (mut component, mut next) = (vec![first], vec![first]);
        while let Some(node) = next.pop() {
            for other in hops.iter().filter_map(|(offset, _)| grid.neighbour(node, *offset)) {
                if left.remove(&other).is_some() {
                    component.push(other);
                    next.push(other);
                }
            }
        }
        component.sort_unstable();
        found.push(component);
    }
    found
}

/// Whether nodes fill a zone.
fn is_zone(grid: &Grid, times: &[f64], nodes: &[usize]) -> bool {
    let sides = (0..3).filter(|&a| grid.nodes[a] > 1).flat_map(|a| {
        [1, -1].map(|way| {
            let mut offset = [0; 3];
            offset[a] = way;
            offset
        })
    });
    let sides: Vec<[i32; 3]> = sides.collect();
    let cracked = |node: usize, side: &[i32; 3]| grid.neighbour(node, *side).is_some_and(|other| times[other] < WHOLE);
    let inner = nodes.iter().filter(|&&node| sides.iter().all(|side| cracked(node, side))).count();
    inner as f64 > ZONE * nodes.len() as f64
}

fn path(grid: &Grid, times: &[f64], nodes: &[usize], hops: &[([i32; 3], f64)], motion: bool) -> CrackPath {
    let ways = ways(grid, times, nodes, hops);
    let point = |&node: &usize| CrackPoint { place: grid.position(node), time: times[node], way: ways[&node] };
    let mut order = nodes.to_vec();
    order.sort_by(|a, b| times[*a].total_cmp(&times[*b]).then(ways[a].total_cmp(&ways[b])));
    let points: Vec<CrackPoint> = order.iter().map(point).collect();
    let by_way = |a: &&usize, b: &&usize| ways[a].total_cmp(&ways[b]);
    let first = order.iter().min_by(by_way).map_or(order[0], |n| *n);
    let last = order.iter().max_by(by_way).map_or(order[0], |n| *n);
    let (start, tip) = (point(&first), point(&last));
    let unrolled = unrolled::around(grid, nodes, hops, first);
    let places: Vec<Vector3<f64>> = order.iter().map(|n| unrolled[n]).collect();
    let history = tip_history(&points);
    let moving = motion && history.len() >= 3;
    let largest = history.iter().filter_map(|from| speed_from(from, &history, WINDOW * tip.way));
    let diffuse = is_zone(grid, times, nodes);
    let mut tips = crack_tips(grid, times, &ways, hops, motion);
    if diffuse {
        tips.truncate(1);
    }
    CrackPath {
        length: tip.way,
        nodes: points.len(),
        start: start.place.into(),
        tip: tip.place.into(),
        direction: line(&places, &(unrolled[&last] - unrolled[&first])).into(),
        times: [points[0].time, points[points.len() - 1].time],
        speed: moving.then(|| slope(&history)),
        largest_speed: largest.reduce(f64::max).filter(|_| moving),
        diffuse,
        tips,
        points,
    }
}

/// Shortest way (m) over a crack's nodes from the pre-crack that it left, or from its first node.
fn ways(grid: &Grid, times: &[f64], nodes: &[usize], hops: &[([i32; 3], f64)]) -> BTreeMap<usize, f64> {
    let around = |node: usize| {
        hops.iter().filter_map(move |(offset, length)| grid.neighbour(node, *offset).map(|other| (other, *length)))
    };
    let from_start =
        |&node: &usize| around(node).filter(|(n, _)| times[*n] == FROM_THE_START).map(|(_, l)| l).reduce(f64::min);
    let mut ways: BTreeMap<usize, f64> =
        nodes.iter().filter_map(|node| from_start(node).map(|way| (*node, way))).collect();
    if ways.is_empty() {
        let first = nodes.iter().min_by(|a, b| times[**a].total_cmp(&times[**b]));
        ways.extend(first.map(|&node| (node, 0.0)));
    }
    // Dijkstra's shortest ways. Positive numbers are in the order of their bits.
    let mut heap: BinaryHeap<_> = ways.iter().map(|(&node, way)| Reverse((way.to_bits(), node))).collect();
    while let Some(Reverse((bits, node))) = heap.pop() {
        let way = f64::from_bits(bits);
        if ways[&node] < way {
            continue;
        }
        for (other, length) in around(node).filter(|(n, _)| (0.0..WHOLE).contains(&times[*n])) {
            let known = ways.entry(other).or_insert(f64::INFINITY);
            if way + length < *known {
                *known = way + length;
                heap.push(Reverse((known.to_bits(), other)));
            }
        }
    }
    ways
}

/// Time and way of the farthest node so far, at each moment at which it moved.
pub(super) fn tip_history(points: &[CrackPoint]) -> Vec<[f64; 2]> {
    let mut history: Vec<[f64; 2]> = Vec::new();
    for p in points {
        match history.last_mut() {
            Some([t, far]) if *t == p.time => *far = far.max(p.way),
            Some([_, far]) if p.way <= *far => {}
            _ => history.push([p.time, p.way]),
        }
    }
    history
}

/// Mean speed (m/s) from a moment over the next part of the way.
pub(super) fn speed_from(from: &[f64; 2], history: &[[f64; 2]], part: f64) -> Option<f64> {
    let to = history.iter().find(|to| to[1] >= from[1] + part)?;
    (to[0] > from[0]).then(|| (to[1] - from[1]) / (to[0] - from[0]))
}

/// Slope of the straight line of least squares through points.
pub(super) fn slope(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let [t, x] = [0, 1].map(|a| points.iter().map(|p| p[a]).sum::<f64>() / n);
    let (up, across) = points
        .iter()
        .fold((0.0, 0.0), |(up, across), p| (up + (p[0] - t) * (p[1] - x), across + (p[0] - t) * (p[0] - t)));
    up / across
}

/// Direction of the straight line of least squares through places, on the side of `along`.
pub(super) fn line(places: &[Vector3<f64>], along: &Vector3<f64>) -> Vector3<f64> {
    let mean = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    let spread: Matrix3<f64> = places.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let axis: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    if axis.dot(along) < 0.0 { -axis } else { axis }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pre-crack along x up to `edge`, from which branches grow: each given by its angle, with a speed (m/s).
    fn grown(edge: f64, branches: &[f64], speed: f64) -> (Grid, Vec<f64>) {
        let grid = Grid::new([81, 81, 1], 1e-3, Vector3::zeros(), [false, false, true]).unwrap();
        let middle = 40.0e-3;
        let mut times = vec![WHOLE; grid.len()];
        for (node, time) in times.iter_mut().enumerate() {
            let p = grid.position(node);
            let (x, y) = (p.x - edge, p.y - middle);
            if x <= 0.0 && y.abs() < 0.6e-3 {
                *time = FROM_THE_START;
            }
            for angle in branches {
                let (sin, cos) = angle.to_radians().sin_cos();
                let (along, across) = (x * cos + y * sin, y * cos - x * sin);
                if along > 0.0 && across.abs() < 0.6e-3 {
                    *time = time.min(along / speed);
                }
            }
        }
        (grid, times)
    }

    #[test]
    fn a_straight_crack_has_its_direction_length_and_speed() {
        for angle in [0.0, 20.0, 30.0, 45.0, 68.0, -50.0f64] {
            let (grid, times) = grown(30.0e-3, &[angle], 1500.0);
            let paths = crack_paths(&grid, &times, true);
            assert_eq!(paths.len(), 1, "{angle}");
            let crack = &paths[0];
            let found = crack.direction[1].atan2(crack.direction[0]).to_degrees();
            assert!((found - angle).abs() < 1.0, "{found} for {angle}");
            let (start, tip) = (Vector3::from(crack.start), Vector3::from(crack.tip));
            let straight = (tip - start).norm();
            assert!((0.99..1.06).contains(&(crack.length / straight)), "{} for {straight}", crack.length);
            let (speed, largest) = (crack.speed.unwrap(), crack.largest_speed.unwrap());
            assert!((speed / 1500.0 - 1.0).abs() < 0.05, "{speed} m/s at {angle}°");
            assert!((1400.0..1700.0).contains(&largest), "{largest} m/s at {angle}°");
            let [tip] = &crack.tips[..] else { panic!("{} tips at {angle}°", crack.tips.len()) };
            assert_eq!((tip.tip, tip.length, tip.branch), (crack.tip, crack.length, None));
            let (direction, speed) = (Vector3::from(tip.direction), tip.speed.unwrap());
            let found = direction.y.atan2(direction.x).to_degrees();
            assert!(
                (found - angle).abs() < 1.5 && (speed / 1500.0 - 1.0).abs() < 0.05,
                "{found}° {speed} m/s, {angle}°"
            );
            assert!(tip.history.windows(2).all(|w| w[0].time < w[1].time && w[0].length < w[1].length));
            let middle = tip.history[tip.history.len() / 2].speed.unwrap();
            assert!((middle / 1500.0 - 1.0).abs() < 0.15, "{middle} m/s at {angle}°");
        }
    }

    /// Two branches are one crack whose tip is that of either, and symmetric branches point ahead.
    #[test]
    fn branches_are_one_crack() {
        let (grid, times) = grown(30.0e-3, &[25.0, -25.0], 1000.0);
        let paths = crack_paths(&grid, &times, true);
        assert_eq!(paths.len(), 1);
        assert!((paths[0].speed.unwrap() / 1000.0 - 1.0).abs() < 0.05);
        assert!(paths[0].direction[1].abs() < 0.02);
        // Of its two tips the second left the first where both began, at twice the angle.
        let [first, second] = &paths[0].tips[..] else { panic!("{:?}", paths[0].tips) };
        let angle = |tip: &CrackTip| tip.direction[1].atan2(tip.direction[0]).to_degrees();
        assert!((angle(first) + angle(second)).abs() < 2.0 && (angle(first).abs() - 25.0).abs() < 1.5);
        let (parent, between) = second.branch.unwrap();
        assert!(parent == 1 && (between - 50.0).abs() < 3.0, "{between}°");
    }

    /// A wide band of cracked nodes is a zone; cracks of a few rows, which may branch, are none.
    #[test]
    fn a_zone_is_told_from_a_crack() {
        let grid = Grid::new([60, 40, 1], 1e-3, Vector3::zeros(), [false, false, true]).unwrap();
        for (rows, zone) in [(1, false), (2, false), (3, false), (4, true), (12, true)] {
            let mut times = vec![WHOLE; grid.len()];
            for (node, time) in times.iter_mut().enumerate() {
                let [i, j, _] = grid.coordinates(node);
                if (10..50).contains(&i) && (10..10 + rows).contains(&j) {
                    *time = i as f64;
                }
            }
            let [crack] = &crack_paths(&grid, &times, true)[..] else { panic!("{rows}") };
            assert_eq!(crack.diffuse, zone, "{rows} rows");
            assert!(!zone || crack.tips.len() == 1);
        }
        let (grid, times) = grown(30.0e-3, &[25.0, -25.0], 1000.0);
        assert!(!crack_paths(&grid, &times, true)[0].diffuse);
    }

    /// Without a pre-crack the way begins at the first node; in equilibrium there is no speed.
    #[test]
    fn a_crack_may_begin_anywhere() {
        let (grid, mut times) = grown(30.0e-3, &[0.0], 1000.0);
        times.iter_mut().filter(|t| **t == FROM_THE_START).for_each(|t| *t = WHOLE);
        let paths = crack_paths(&grid, &times, false);
        assert!((paths[0].length / 49.0e-3 - 1.0).abs() < 0.03, "{}", paths[0].length);
        assert_eq!((paths[0].speed, paths[0].largest_speed), (None, None));
        assert!(crack_paths(&grid, &[], true).is_empty());
    }
}
