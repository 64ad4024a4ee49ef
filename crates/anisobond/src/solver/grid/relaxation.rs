//! Dynamic relaxation with kinetic damping: the second opinion on equilibrium, linear or not.

use super::free_modes::FreeModes;
use super::preconditioner::NodeBlocks;
use super::vectors::{Vectors, add_scaled, dot};
use crate::operator::VectorField;
use crate::solver::{Look, Progress, SolverReport, Stopping};

/// Steps without a new least residual after which relaxation has stagnated.
const PATIENCE: usize = 20_000;

/// Follow the undamped motion of nodes whose masses are their own stiffness blocks, and stop them all whenever their
/// kinetic energy has passed a peak; the motion ends at rest.
///
/// With masses M = D λ/(4 s²) and unit steps, a step is stable while s < 1: λ bounds the eigenvalues of D⁻¹K, and is 2
/// for any bonds that are springs. `residual(u, r)` gives r = f − forces held back, zero on prescribed components.
pub(super) fn relax(
    residual: impl Fn(&VectorField, &mut VectorField),
    blocks: &NodeBlocks,
    free: &FreeModes,
    scale: f64,
    u: &mut VectorField,
    seen: (&Stopping, Look),
) -> SolverReport {
    let n = u.len();
    let (mut r, mut a, mut v) = (VectorField::zeros(n), VectorField::zeros(n), VectorField::zeros(n));
    let mut report = SolverReport::begun(0);
    let mut progress = Progress::new(seen, scale, PATIENCE);
    let mut kinetic_last = 0.0;
    let mass = LARGEST / (4.0 * SAFETY * SAFETY);
    loop {
        residual(u, &mut r);
        free.project(&mut r);
        report.applications += 1;
        if progress.ends(&Vectors(n), &r, &mut report) {
            return report;
        }
        blocks.times(&r, &mut a);
        free.project(&mut a);
        // Work of the residual forces along the motion: its sign change is the peak of the kinetic energy.
        let power = dot(&r, &v);
        if power < 0.0 && kinetic_last > 0.0 {
            // Back by half a step, to about where the peak was, and from rest.
            add_scaled(u, -0.5, &v);
            v = VectorField::zeros(n);
            kinetic_last = 0.0;
            report.iterations += 1;
            continue;
        }
        add_scaled(&mut v, 1.0 / mass, &a);
        add_scaled(u, 1.0, &v);
        kinetic_last = 1.0;
        report.iterations += 1;
    }
}

/// Bound of the eigenvalues of D⁻¹K: a spring's matrix is at most twice its own two blocks.
const LARGEST: f64 = 2.0;

/// Share of the stable step.
const SAFETY: f64 = 0.95;
