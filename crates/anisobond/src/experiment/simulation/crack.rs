//! When the nodes of a body crack.

use crate::experiment::problem::Problem;
use crate::lattice::Grid;
use crate::operator::grid::{FailingBonds, Stencil};

use super::crack_path::{CrackPath, crack_paths};

/// Damage above which a node counts as cracked, where all bonds can break. A flat crack at a distance d has cut
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
    /// Damage by pre-cracks, by node.
    at_start: Vec<f64>,
    /// By node: the share of its stencil's bonds that can break. Where the material is strongly anisotropic, bonds of some
    /// directions have no stiffness; damage counts them, but the crack does not break them.
    breakable: Vec<f64>,
    /// Energy lost with failing bonds (J) when it was last looked at.
    seen: f64,
}

impl CrackFront {
    /// Before the first step, pre-cracks cut.
    pub(super) fn new(problem: &Problem, bonds: &FailingBonds) -> Self {
        if !problem.regions.iter().any(|r| r.fracture.is_some()) {
            return CrackFront { times: Vec::new(), at_start: Vec::new(), breakable: Vec::new(), seen: 0.0 };
        }
        let at_start = bonds.damage();
        let shares: Vec<f64> = bonds.grid().stencils().iter().map(breakable_share).collect();
        let share = |&s: &u16| usize::from(s).checked_sub(1).map_or(1.0, |s| shares[s]);
        CrackFront {
            times: at_start.iter().map(|&d| if d > CRACKED { FROM_THE_START } else { WHOLE }).collect(),
            breakable: bonds.grid().stencil_of().iter().map(share).collect(),
            at_start,
            seen: 0.0,
        }
    }

    /// Note the nodes that are cracked now; `lost` energy of failing bonds so far (J), without which there is nothing new.
    pub(super) fn look(&mut self, bonds: &FailingBonds, time: f64, lost: f64) {
        if self.times.is_empty() || lost == self.seen {
            return;
        }
        self.seen = lost;
        let nodes = self.times.iter_mut().zip(bonds.damage()).zip(self.at_start.iter().zip(&self.breakable));
        for ((since, damage), (at_start, breakable)) in nodes {
            if *since == WHOLE && at_start + (damage - at_start) / breakable > CRACKED {
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

/// Share of the bonds of a stencil that have stiffness and can break; 1 where none can.
fn breakable_share(stencil: &Stencil) -> f64 {
    let bonds = stencil.critical.iter().zip(&stencil.stiffness);
    let count = bonds.filter(|(s, k)| s.is_finite() && **k != 0.0).count();
    if count == 0 { 1.0 } else { count as f64 / stencil.critical.len() as f64 }
}
