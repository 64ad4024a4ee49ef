//! Equilibrium of a body on a grid: checks, preconditioner, solution.

use super::conjugate_gradients::{GridSolverReport, conjugate_gradients};
use super::free_modes::FreeModes;
use super::multigrid::Smoothing;
use super::preconditioner::{NodeBlocks, Preconditioner, Scheme, TwoScale};
use super::supports::{Supports, check_load};
use crate::Result;
use crate::operator::{GridOperator, VectorField};
use crate::solver::Stopping;

/// How equilibrium is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Conjugate gradients with coarse grids.
    CoarseGrids(Scheme, Smoothing),
    /// Conjugate gradients with node blocks only.
    NodeBlocks,
}

impl Default for Method {
    fn default() -> Self {
        Method::CoarseGrids(Scheme::Additive { weight: 1.0 }, Smoothing::default())
    }
}

/// A body with supports, prepared for loads.
pub struct Equilibrium<'a> {
    operator: &'a dyn GridOperator,
    supports: &'a Supports,
    free: FreeModes,
    preconditioner: Box<dyn Preconditioner + 'a>,
}

impl<'a> Equilibrium<'a> {
    /// Find free modes and set up the preconditioner.
    pub fn new(operator: &'a dyn GridOperator, supports: &'a Supports, method: Method) -> Self {
        let free = FreeModes::new(operator, supports);
        let preconditioner: Box<dyn Preconditioner + 'a> = match method {
            Method::CoarseGrids(scheme, smoothing) => Box::new(TwoScale::new(operator, supports, scheme, smoothing)),
            Method::NodeBlocks => Box::new(NodeBlocks::new(operator, supports)),
        };
        Equilibrium { operator, supports, free, preconditioner }
    }

    /// What nothing holds.
    pub fn free_modes(&self) -> &FreeModes {
        &self.free
    }

    /// The preconditioner.
    pub fn preconditioner(&self) -> &dyn Preconditioner {
        &*self.preconditioner
    }

    /// Displacements u (m) with f − K u = 0 under a load f (N), from a start. Free modes do not appear in u − start.
    ///
    /// # Errors
    /// A load that is not finite, outside the body, or does work on a free mode.
    pub fn solve(
        &self,
        load: &VectorField,
        start: VectorField,
        stopping: &Stopping,
    ) -> Result<(VectorField, GridSolverReport)> {
        check_load(self.operator.body(), load)?;
        self.free.require_balanced(self.operator, load)?;
        let mut u = start;
        let report = conjugate_gradients(
            self.operator,
            load,
            self.supports,
            &self.free,
            self.preconditioner(),
            &mut u,
            stopping,
        );
        Ok((u, report))
    }
}
