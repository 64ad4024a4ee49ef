//! Equilibrium of a body whose bonds fail.

use serde::Serialize;

use crate::Result;
use crate::solver::SolverReport;

/// Equilibria of one load step at most; a body that still breaks then comes apart.
const MOST_EQUILIBRIA: usize = 10_000;

/// How a body came to rest under its loads, or did not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Settled {
    /// Equilibria that were solved until nothing failed.
    pub equilibria: usize,
    /// Bonds that failed.
    pub broken: usize,
    /// The last solve; `None` where there was none.
    pub report: Option<SolverReport>,
    /// Why it ended.
    pub ended: SettlingEnd,
}

/// Why a body's settling ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum SettlingEnd {
    /// Nothing fails any more.
    AtRest,
    /// The last solve did not converge.
    NotConverged,
    /// The loads move something that nothing holds.
    Unheld,
    /// Bonds still failed after the most equilibria that are looked for.
    StillFailing,
}

/// Equilibrium of a body whose bonds fail: `solve(body, start)` gives the state u (displacements, of spheres with their turns), or `None` where the loads move something that nothing
/// holds; `fail(body, start, u)` lets fail what u stretches too far and returns how many bonds that is; both again until nothing fails.
/// A solve that does not converge ends it, with the report as its evidence: nothing fails by displacements that are no
/// equilibrium. Returned are the last displacements, and how it ended.
///
/// # Errors
/// What `solve` and `fail` report.
pub fn settle<B, U>(
    body: &mut B,
    start: U,
    mut solve: impl FnMut(&B, &U) -> Result<Option<(U, SolverReport)>>,
    mut fail: impl FnMut(&mut B, &U, &U) -> Result<usize>,
) -> Result<(U, Settled)> {
    let mut u = start;
    let mut settled = Settled { equilibria: 0, broken: 0, report: None, ended: SettlingEnd::StillFailing };
    while settled.equilibria < MOST_EQUILIBRIA {
        let Some((next, report)) = solve(body, &u)? else {
            return Ok((u, Settled { ended: SettlingEnd::Unheld, ..settled }));
        };
        let from = std::mem::replace(&mut u, next);
        settled.equilibria += 1;
        settled.report = Some(report);
        if !report.converged() {
            return Ok((u, Settled { ended: SettlingEnd::NotConverged, ..settled }));
        }
        let failed = fail(body, &from, &u)?;
        settled.broken += failed;
        if failed == 0 {
            return Ok((u, Settled { ended: SettlingEnd::AtRest, ..settled }));
        }
    }
    Ok((u, settled))
}
