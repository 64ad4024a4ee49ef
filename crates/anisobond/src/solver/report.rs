//! When to stop, and how a solve ended.

use serde::{Deserialize, Serialize};

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stopping {
    /// Largest residual accepted, relative to that of the right-hand side.
    pub tolerance: f64,
    /// Most iterations.
    pub most_iterations: usize,
}

impl Default for Stopping {
    fn default() -> Self {
        Stopping { tolerance: 1e-8, most_iterations: 20_000 }
    }
}

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Ending {
    /// The residual met the tolerance.
    Converged,
    /// The most iterations were done.
    MostIterations,
    /// A direction p with p·Kp ≤ 0: the body is unstable, or a mechanism. Where random loads converge without meeting one of
    /// negative energy, there is none beyond the tolerance: the part of a load along it could only have grown.
    NegativeCurvature {
        /// p·Kp (J); of a node's own block, its lowest eigenvalue relative to the largest.
        curvature: f64,
    },
    /// A number that is none.
    NotFinite {
        /// The first node with such a residual.
        node: usize,
    },
    /// Many iterations without a smaller residual, or what is left pulls at motions that cost no energy.
    Stagnated,
    /// Whoever saw the solve ended it.
    Stopped,
}

/// How a solve went.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolverReport {
    /// Iterations, of the slowest right-hand side.
    pub iterations: usize,
    /// Applications of the operator, those of the preconditioner included; where several solves are one, of the slowest.
    pub applications: usize,
    /// The residual left, relative to that of the right-hand side; the largest of all of them. On grids ‖f − K u‖ over free
    /// components, computed anew at the end; of bond lists √(r·M⁻¹r), 0 where all that is left is rounding.
    pub residual: f64,
    /// How it ended.
    pub ending: Ending,
}

impl SolverReport {
    /// Of a solve that begins, after so many applications of the operator.
    pub fn begun(applications: usize) -> Self {
        SolverReport { iterations: 0, applications, residual: 0.0, ending: Ending::Converged }
    }

    /// Whether the residual met the tolerance.
    pub fn converged(&self) -> bool {
        self.ending == Ending::Converged
    }

    /// Whether a direction was met that costs no energy, or less.
    pub fn negative_curvature(&self) -> bool {
        matches!(self.ending, Ending::NegativeCurvature { .. })
    }

    /// Both solves as one: the worse of each.
    pub fn and(self, other: SolverReport) -> SolverReport {
        let ending = match (self.ending, other.ending) {
            (Ending::Converged, other) => other,
            (_, other @ Ending::NegativeCurvature { .. }) if !self.negative_curvature() => other,
            (own, _) => own,
        };
        SolverReport {
            iterations: self.iterations.max(other.iterations),
            applications: self.applications.max(other.applications),
            residual: self.residual.max(other.residual),
            ending,
        }
    }
}
