//! Equilibrium of a body on a grid: checks, preconditioner, solution.

use std::sync::Arc;

use super::census::{Blocks, Census};
use super::free_modes::FreeModes;
use super::linear::{FreePart, Projected, reference, solve};
use super::multigrid::Smoothing;
use super::nonlinear::newton;
use super::preconditioner::{NodeBlocks, Scheme, TwoScale};
use super::relaxation::relax;
use super::supports::{Supports, check_load};
use super::vectors::add_scaled;
use crate::Result;
use crate::operator::{GridOperator, VectorField};
use crate::solver::{Look, Preconditioner, SolverReport, Stopping};

/// Residual of the linear step that begins a non-linear solve.
const FIRST_STEP: f64 = 1e-3;

/// How equilibrium is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Conjugate gradients with coarse grids.
    CoarseGrids(Scheme, Smoothing),
    /// Conjugate gradients with node blocks only.
    NodeBlocks,
    /// Dynamic relaxation with kinetic damping.
    Relaxation,
}

impl Default for Method {
    fn default() -> Self {
        Method::CoarseGrids(Scheme::default(), Smoothing::default())
    }
}

/// A body with supports, prepared for loads.
pub struct Equilibrium<'a> {
    operator: &'a dyn GridOperator,
    supports: &'a Supports,
    free: FreeModes,
    prepared: Arc<Prepared>,
    look: Look<'a>,
}

/// Sees nothing, and lets every solve go on.
const UNSEEN: Look = &|_, _| true;

/// What a method needs of a body and its supports.
pub enum Prepared {
    /// Conjugate gradients with this preconditioner.
    Gradients(Box<dyn Preconditioner<VectorField> + Send + Sync>),
    /// Relaxation with these node blocks.
    Relaxation(NodeBlocks),
}

impl Prepared {
    /// Set up a method for a body and its supports, whose displacements do not matter.
    pub fn new(operator: &dyn GridOperator, supports: &Supports, method: Method) -> Self {
        Prepared::of(operator, &Census::new(operator), &Blocks::new(operator), supports, method)
    }

    fn of(operator: &dyn GridOperator, census: &Census, blocks: &Blocks, supports: &Supports, method: Method) -> Self {
        let node_blocks = || NodeBlocks::of(blocks, operator.body().grid.nodes[0], supports);
        match method {
            Method::CoarseGrids(scheme, smoothing) => {
                Prepared::Gradients(Box::new(TwoScale::of(operator, census, blocks, supports, scheme, smoothing)))
            }
            Method::NodeBlocks => Prepared::Gradients(Box::new(node_blocks())),
            Method::Relaxation => Prepared::Relaxation(node_blocks()),
        }
    }
}

impl<'a> Equilibrium<'a> {
    /// Find free modes and set up the preconditioner. The supports' displacements do not matter to either: see
    /// [`Equilibrium::with_supports`].
    pub fn new(operator: &'a dyn GridOperator, supports: &'a Supports, method: Method) -> Self {
        let census = Census::new(operator);
        let blocks = Blocks::new(operator);
        let prepared = Arc::new(Prepared::of(operator, &census, &blocks, supports, method));
        let free = FreeModes::of(operator.body(), &census, |node| blocks.of(node), supports);
        Equilibrium { operator, supports, free, prepared, look: UNSEEN }
    }

    /// With what was prepared for the same supports, of this body or before it lost a few bonds; free modes are found anew.
    pub fn prepared(operator: &'a dyn GridOperator, supports: &'a Supports, prepared: Arc<Prepared>) -> Self {
        Equilibrium { operator, supports, free: FreeModes::new(operator, supports), prepared, look: UNSEEN }
    }

    /// The same body with other displacements of the same supports ([`Supports::scaled`]).
    pub fn with_supports(self, supports: &'a Supports) -> Self {
        Equilibrium { supports, ..self }
    }

    /// The same, its solves seen at every iteration by whoever may end them.
    pub fn seen_by(self, look: Look<'a>) -> Self {
        Equilibrium { look, ..self }
    }

    /// What nothing holds.
    pub fn free_modes(&self) -> &FreeModes {
        &self.free
    }

    /// The preconditioner.
    pub fn preconditioner(&self) -> &dyn Preconditioner<VectorField> {
        match &*self.prepared {
            Prepared::Gradients(p) => &**p,
            Prepared::Relaxation(blocks) => blocks,
        }
    }

    /// Displacements u (m) with f − K u = 0 on free components under a load f (N), from a start. Free modes do not
    /// appear in u − start.
    ///
    /// # Errors
    /// A load that is not finite, outside the body, or does work on a free mode. Not to converge is an outcome, told by
    /// the report.
    pub fn solve(
        &self,
        load: &VectorField,
        start: VectorField,
        stopping: &Stopping,
    ) -> Result<(VectorField, SolverReport)> {
        self.check(load)?;
        let mut u = start;
        let report = match &*self.prepared {
            Prepared::Gradients(p) => solve(&self.projected(&**p, self.supports), load, &mut u, (stopping, self.look)),
            Prepared::Relaxation(blocks) => {
                let scale = self.scale(load);
                self.supports.impose(&mut u);
                let forces = |u: &VectorField, r: &mut VectorField| self.operator.forces(u, r);
                relax(self.residual(&forces, load), blocks, &self.free, scale, &mut u, (stopping, self.look))
            }
        };
        Ok((u, report))
    }

    /// Displacements u (m) at which bond forces `forces(u, f)` (N), not linear in u, balance a load (N).
    ///
    /// The first step is that of the linear body; it must be a fair approximation, so large displacements need load
    /// steps. The residual is relative to the load's on the linear body.
    ///
    /// # Errors
    /// As [`Equilibrium::solve`].
    pub fn solve_nonlinear(
        &self,
        forces: &(dyn Fn(&VectorField, &mut VectorField) + Sync),
        load: &VectorField,
        start: VectorField,
        stopping: &Stopping,
    ) -> Result<(VectorField, SolverReport)> {
        self.check(load)?;
        let scale = self.scale(load);
        let residual = self.residual(forces, load);
        let mut u = start;
        let report = match &*self.prepared {
            Prepared::Gradients(p) => {
                let mut rest = VectorField::zeros(load.len());
                residual(&u, &mut rest);
                let rise = self.supports.relative_to(&u);
                let first = Stopping { tolerance: FIRST_STEP, ..*stopping };
                let mut step = VectorField::zeros(load.len());
                let linear = solve(&self.projected(&**p, &rise), &rest, &mut step, (&first, self.look));
                add_scaled(&mut u, 1.0, &step);
                self.supports.impose(&mut u);
                let projected = self.projected(&**p, self.supports);
                let mut report = newton(residual, &projected, scale, &mut u, (stopping, self.look));
                report.iterations += linear.iterations;
                report.applications += linear.applications + 1;
                report
            }
            Prepared::Relaxation(blocks) => {
                self.supports.impose(&mut u);
                relax(residual, blocks, &self.free, scale, &mut u, (stopping, self.look))
            }
        };
        Ok((u, report))
    }

    fn check(&self, load: &VectorField) -> Result<()> {
        check_load(self.operator.body(), load)?;
        self.free.require_balanced(self.operator, load)
    }

    /// What residuals are relative to.
    fn scale(&self, load: &VectorField) -> f64 {
        let body = FreePart { operator: self.operator, supports: self.supports };
        reference(body, load, &self.free, &mut VectorField::zeros(load.len()))
    }

    /// A preconditioner that leaves free modes alone, under supports.
    fn projected<'b>(&'b self, m: &'b dyn Preconditioner<VectorField>, supports: &'b Supports) -> Projected<'b> {
        Projected { preconditioner: m, body: FreePart { operator: self.operator, supports }, free: &self.free }
    }

    /// r = f + forces(u), zero on prescribed components.
    fn residual<'b>(
        &'b self,
        forces: &'b dyn Fn(&VectorField, &mut VectorField),
        load: &'b VectorField,
    ) -> impl Fn(&VectorField, &mut VectorField) + 'b {
        move |u, r| {
            forces(u, r);
            add_scaled(r, 1.0, load);
            self.supports.clear(r);
        }
    }
}
