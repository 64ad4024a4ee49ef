//! A Newton step: the tangent's linear system, solved as closely as the step needs.

use std::cell::RefCell;

use super::vectors::{add_scaled, norm};
use crate::operator::VectorField;
use crate::solver::{Ending, LinearOperator, Look, Next, Products, Rule, SolverReport};

/// Iterations of a Newton step at most.
const MOST_INNER: usize = 300;

/// The largest displacement of the difference that stands for a derivative, relative to the grid's spacing. What is neglected
/// is of that order, far below the residual that a step leaves; rounding is some 10⁻⁹ of it.
const DIFFERENCE: f64 = 1e-6;

/// The tangent of forces at u, where their residual is r: the difference of residuals along a direction.
pub(super) struct Tangent<'a, B> {
    balance: &'a B,
    u: &'a VectorField,
    r: &'a VectorField,
    spacing: f64,
    moved: RefCell<VectorField>,
}

impl<'a, B: Fn(&VectorField, &mut VectorField)> Tangent<'a, B> {
    /// Of residuals `balance(u, r)` on a grid of a spacing (m).
    pub(super) fn new(balance: &'a B, u: &'a VectorField, r: &'a VectorField, spacing: f64) -> Self {
        Tangent { balance, u, r, spacing, moved: RefCell::new(u.clone()) }
    }
}

impl<B: Fn(&VectorField, &mut VectorField)> LinearOperator<VectorField> for Tangent<'_, B> {
    fn apply(&self, d: &VectorField, q: &mut VectorField) {
        let largest = d.components.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        let length = DIFFERENCE * self.spacing / largest;
        let mut moved = self.moved.borrow_mut();
        moved.clone_from(self.u);
        add_scaled(&mut moved, length, d);
        (self.balance)(&moved, q);
        for (q, r) in q.components.iter_mut().zip(&self.r.components) {
            q.iter_mut().zip(r).for_each(|(q, r)| *q = (r - *q) / length);
        }
    }
}

/// Ends where the residual is small enough, after the most iterations, or where the tangent is not positive: then with what was
/// found before, or the first direction if there is nothing.
pub(super) struct Inner<'a> {
    pub look: Look<'a>,
    /// A residual (N) that is small enough.
    pub enough: f64,
    /// Steps that were done.
    pub done: usize,
}

impl Rule<1, VectorField> for Inner<'_> {
    fn at(&mut self, _: &VectorField, r: &mut VectorField, report: &mut SolverReport) -> Next {
        if self.done > 0 && norm(r) <= self.enough {
            return Next::End(Ending::Converged);
        }
        if self.done == MOST_INNER {
            return Next::End(Ending::MostIterations);
        }
        if (self.look)(report.iterations, report.residual) { Next::Step } else { Next::End(Ending::Stopped) }
    }

    fn step(&mut self, products: &Products<1, VectorField>, x: &mut VectorField) -> Result<[f64; 1], Ending> {
        let ([rz], [curvature]) = (products.rz, products.energy);
        if curvature.is_nan() || curvature <= 0.0 {
            if self.done == 0 {
                x.clone_from(products.direction);
            }
            return Err(Ending::NegativeCurvature { curvature });
        }
        self.done += 1;
        Ok([rz / curvature])
    }
}
