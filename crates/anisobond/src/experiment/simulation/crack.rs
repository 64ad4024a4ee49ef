//! When the nodes of a body crack.

use crate::experiment::problem::Problem;
use crate::lattice::Grid;
use crate::operator::grid::FailingBonds;

use super::crack_path::{CrackPath, crack_paths};

/// Damage above which a node counts as cracked. A flat crack at a distance d has cut
/// (1 − d/δ)² (2 + d/δ)/4 of a node's bonds: at a horizon of three spacings those nearer than 0.6 Δ count, one or two rows
/// whatever the crack's direction.
const CRACKED: f64 = 0.35;

/// Time of nodes that are whole, and of nodes that were cracked at the start.
pub(super) const WHOLE: f64 = f64::MAX;
pub(super) const FROM_THE_START: f64 = -1.0;

/// When each node was first seen cracked.
pub(super) struct CrackFront {
    /// Empty for a body whose bonds do not break.
    times: Vec<f64>,
    /// Energy lost with failing bonds (J) when it was last looked at.
    seen: f64,
}

impl CrackFront {
    /// Before the first step; `damage` of the pre-cracks by node.
    pub(super) fn new(problem: &Problem, damage: Vec<f64>) -> Self {
        let breakable = problem.regions.iter().any(|r| r.fracture.is_some());
        let times = damage.into_iter().map(|d| if d > CRACKED { FROM_THE_START } else { WHOLE });
        CrackFront { times: if breakable { times.collect() } else { Vec::new() }, seen: 0.0 }
    }

    /// Note the nodes that are cracked now; `lost` energy of failing bonds so far (J), without which there is nothing new.
    pub(super) fn look(&mut self, bonds: &FailingBonds, time: f64, lost: f64) {
        if self.times.is_empty() || lost == self.seen {
            return;
        }
        self.seen = lost;
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

    /// The cracks that have grown, the longest first.
    pub(super) fn paths(&self, grid: &Grid, motion: bool) -> Vec<CrackPath> {
        crack_paths(grid, &self.times, motion)
    }
}
