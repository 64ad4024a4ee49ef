//! Where and when a body cracks.

use nalgebra::Vector3;
use serde::Serialize;

use crate::experiment::problem::Problem;
use crate::lattice::Grid;
use crate::operator::grid::GridBonds;

/// Share of broken bonds above which a node counts as cracked: a node beside a flat crack has lost about 0.37 of them.
const CRACKED: f64 = 0.35;

/// Time of nodes that are whole, and of nodes that were cracked at the start.
const WHOLE: f64 = f64::MAX;
const FROM_THE_START: f64 = -1.0;

/// When each node was first seen cracked.
pub(super) struct CrackFront {
    times: Vec<f64>,
}

/// The motion of a crack's tip, a straight line fitted to when nodes cracked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpeedFit {
    /// Speed of the farthest cracked node along `direction` (m/s), by least squares over the run.
    pub speed: f64,
    /// The largest mean speed over a fifth of the way (m/s).
    pub largest_speed: f64,
    /// Unit vector from the first to the last cracked node.
    pub direction: [f64; 3],
    /// Length of the way (m).
    pub length: f64,
}

impl CrackFront {
    /// No times for a body whose bonds do not break.
    pub(super) fn new(problem: &Problem, damage: Vec<f64>) -> Self {
        let breakable = problem.regions.iter().any(|r| r.fracture.is_some());
        let times = damage.into_iter().map(|d| if d > CRACKED { FROM_THE_START } else { WHOLE });
        CrackFront { times: if breakable { times.collect() } else { Vec::new() } }
    }

    /// Note the nodes that are cracked now.
    pub(super) fn look(&mut self, bonds: &GridBonds<f64>, time: f64) {
        if self.times.is_empty() {
            return;
        }
        for (since, damage) in self.times.iter_mut().zip(bonds.damage()) {
            if damage > CRACKED && *since == WHOLE {
                *since = time;
            }
        }
    }

    pub(super) fn times(&self) -> &[f64] {
        &self.times
    }

    pub(super) fn restore(&mut self, times: Vec<f64>) {
        self.times = times;
    }

    /// Nodes that cracked during the run, in the order of time.
    pub(super) fn path(&self, grid: &Grid) -> Vec<(Vector3<f64>, f64)> {
        let cracked = self.times.iter().enumerate().filter(|(_, t)| (0.0..WHOLE).contains(*t));
        let mut path: Vec<_> = cracked.map(|(node, &time)| (grid.position(node), time)).collect();
        path.sort_by(|a, b| a.1.total_cmp(&b.1));
        path
    }

    /// The tip's motion, if nodes cracked at three moments or more.
    pub(super) fn speed(&self, grid: &Grid) -> Option<SpeedFit> {
        let path = self.path(grid);
        let (first, last) = (path.first()?, path.last()?);
        let way = last.0 - first.0;
        if last.1 <= first.1 || way.norm() < 3.0 * grid.spacing {
            return None;
        }
        let direction = way.normalize();
        // The farthest place so far, at each moment.
        let mut tip: Vec<[f64; 2]> = Vec::new();
        for (place, time) in &path {
            let x = direction.dot(&(place - first.0));
            match tip.last_mut() {
                Some([t, far]) if *t == *time => *far = far.max(x),
                Some([_, far]) if x <= *far => {}
                _ => tip.push([*time, x]),
            }
        }
        if tip.len() < 3 {
            return None;
        }
        let fifth = 0.2 * way.norm();
        let mean = |from: &[f64; 2]| {
            let to = tip.iter().find(|to| to[1] >= from[1] + fifth)?;
            (to[0] > from[0]).then(|| (to[1] - from[1]) / (to[0] - from[0]))
        };
        Some(SpeedFit {
            speed: slope(&tip),
            largest_speed: tip.iter().filter_map(mean).fold(0.0, f64::max),
            direction: direction.into(),
            length: way.norm(),
        })
    }
}

/// Slope of the straight line of least squares through points.
fn slope(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let [t, x] = [0, 1].map(|a| points.iter().map(|p| p[a]).sum::<f64>() / n);
    let (up, across) = points
        .iter()
        .fold((0.0, 0.0), |(up, across), p| (up + (p[0] - t) * (p[1] - x), across + (p[0] - t) * (p[0] - t)));
    up / across
}
