//! What solvers see of a body on a grid.

use nalgebra::Matrix3;

use super::vector_field::VectorField;
use crate::lattice::Body;
use crate::tensor::Stiffness;

/// How bonds stretch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kinematics {
    /// Small displacements: the force is linear in them (P eqs 14-15).
    #[default]
    Linear,
    /// Finite stretch along the deformed bond (P eq 5); of spheres, finite rotations too.
    Finite,
}

/// A body whose linearised forces are −K u.
///
/// Solvers of equilibrium are written against this; the kernels are behind it.
pub trait GridOperator: Sync {
    /// The body.
    fn body(&self) -> &Body;

    /// Forces of linear bonds f = −K u (N) of displacements u (m). Entries of empty nodes are zero and stay so.
    fn forces(&self, u: &VectorField, f: &mut VectorField);

    /// The 3×3 diagonal block of K of a node (N/m); zero for an empty node.
    fn diagonal_block(&self, node: usize) -> Matrix3<f64>;

    /// Visit the other end of every unbroken bond of a node's half-neighbourhood, so that a visit of all nodes meets
    /// every bond that has stiffness once.
    fn half_bonds(&self, node: usize, visit: &mut dyn FnMut(usize));

    /// Visit both ends of unbroken bonds that have stiffness and are at an offset from their first end, on several threads: some of
    /// those that [`GridOperator::half_bonds`] visits, faster.
    fn bonds_along(&self, offset: [i32; 3], visit: &(dyn Fn(usize, usize) + Sync)) {
        let _ = (offset, visit);
    }

    /// The stiffness tensor of a region's bulk (Pa), for coarse grids; the region of a node is `body.region` − 1.
    fn bulk_stiffness(&self, region: u16) -> Stiffness;

    /// The bonds of a node in a region's bulk: offset in spacings and stiffness (N/m), for coarse grids. None if the operator does
    /// not know them; the nodal term has no part in them.
    fn bulk_bonds(&self, region: u16) -> Vec<([i32; 3], f64)> {
        let _ = region;
        Vec::new()
    }

    /// Share of a node's bonds, weighed by stiffness, that exist and are unbroken (–), 0…1.
    fn wholeness(&self, node: usize) -> f64;
}
