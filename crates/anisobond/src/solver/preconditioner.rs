//! Block-Jacobi: the inverse of every node's own 6×6 block.

use nalgebra::{Matrix3, Matrix6};

use super::bonds::add_products;
use super::linear::{LinearOperator, Preconditioner, VectorSpace};
use crate::operator::{BondList, Field, NodeField};

/// Cholesky is trusted while every pivot (of a block scaled to a unit diagonal) is above this: the rounding of a singular
/// block's last pivots is magnified by the small ones before them.
const DEFINITE: f64 = 1e-6;

/// An eigenvalue below this share of the block's largest is zero: the mode costs no energy.
const SINGULAR: f64 = 1e-12;

/// The inverse of each node's 6×6 block of K; pseudo-inverse where a block is singular. With blocked rotations the
/// rotational rows are zero, so that conjugate gradients never leave θ = 0.
pub struct BlockJacobi {
    blocks: Vec<[[f64; 6]; 6]>,
    lowest: f64,
}

impl BlockJacobi {
    /// From a bond list.
    pub fn new(list: &BondList, rotations_free: bool) -> Self {
        let mut lowest = 0.0;
        let mut invert = |block: &Matrix6<f64>| {
            if rotations_free { inverse(block, &mut lowest) } else { blocked_inverse(block, &mut lowest) }
        };
        let blocks = list
            .diagonal_blocks()
            .iter()
            .map(|block| {
                let m = invert(block);
                std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))
            })
            .collect();
        BlockJacobi { blocks, lowest }
    }

    /// With components that are held (`true`; displacement, then rotation) node by node in the list's order: their rows
    /// are zero, so that conjugate gradients never move them.
    pub fn with_held(list: &BondList, held: &[[bool; 6]]) -> Self {
        let mut lowest = 0.0;
        let blocks = list
            .diagonal_blocks()
            .iter()
            .zip(held)
            .map(|(block, held)| {
                let kept = |i: usize, j: usize| !held[i] && !held[j];
                let free = Matrix6::from_fn(|i, j| if kept(i, j) { block[(i, j)] } else { f64::from(i == j) });
                let m = inverse(&free, &mut lowest);
                std::array::from_fn(|i| std::array::from_fn(|j| if kept(i, j) { m[(i, j)] } else { 0.0 }))
            })
            .collect();
        BlockJacobi { blocks, lowest }
    }

    /// The lowest eigenvalue of a node's block, relative to its largest, where that is negative: the node alone can move so that
    /// the energy falls, and K is not positive semidefinite.
    pub fn negative(&self) -> Option<f64> {
        (self.lowest < 0.0).then_some(self.lowest)
    }

    /// z = M⁻¹ r at one node.
    #[inline(always)]
    pub fn at<const L: usize>(&self, node: usize, r: &NodeField<L>) -> NodeField<L> {
        let mut z = [[0.0; L]; 6];
        for (row, z) in self.blocks[node].iter().zip(&mut z) {
            for (m, r) in row.iter().zip(r) {
                for l in 0..L {
                    z[l] += m * r[l];
                }
            }
        }
        z
    }
}

impl<const L: usize> Preconditioner<Field<L>, L> for BlockJacobi {
    #[inline(always)]
    fn apply(&self, _: &dyn LinearOperator<Field<L>>, r: &Field<L>, z: &mut Field<L>) -> usize {
        for (node, (r, z)) in r.iter().zip(z).enumerate() {
            *z = self.at(node, r);
        }
        0
    }

    #[inline(always)]
    fn apply_and_dot<S: VectorSpace<L, Vector = Field<L>>>(
        &self,
        _: &S,
        _: &dyn LinearOperator<Field<L>>,
        r: &Field<L>,
        z: &mut Field<L>,
    ) -> (usize, [f64; L]) {
        let mut sum = [0.0; L];
        for (node, (r, z)) in r.iter().zip(z).enumerate() {
            *z = self.at(node, r);
            add_products(&mut sum, r, z);
        }
        (0, sum)
    }
}

/// Inverse of a symmetric semidefinite block, scaled to a unit diagonal first: displacements and rotations differ in
/// unit. By Cholesky where it is definite, over its eigenvectors where it is not.
fn inverse(block: &Matrix6<f64>, lowest: &mut f64) -> Matrix6<f64> {
    let scale = block.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 1.0 });
    let scaled = Matrix6::from_fn(|i, j| block[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled
        .cholesky()
        .filter(|c| c.l_dirty().diagonal().iter().all(|p| p * p > DEFINITE))
        .map_or_else(|| pseudo_inverse(&scaled, lowest), |c| c.inverse());
    Matrix6::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j])
}

/// Σ v vᵀ/λ over the positive eigenpairs; the lowest eigenvalue is noted if it is negative.
fn pseudo_inverse(scaled: &Matrix6<f64>, lowest: &mut f64) -> Matrix6<f64> {
    let eigen = scaled.symmetric_eigen();
    let floor = SINGULAR * eigen.eigenvalues.amax();
    let mut sum = Matrix6::zeros();
    for (value, v) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > floor {
            sum += v * v.transpose() / *value;
        }
        if *value < -floor {
            *lowest = lowest.min(*value / eigen.eigenvalues.amax());
        }
    }
    sum
}

/// Inverse of the displacement block alone.
fn blocked_inverse(block: &Matrix6<f64>, lowest: &mut f64) -> Matrix6<f64> {
    let mut only = Matrix6::zeros();
    only.fixed_view_mut::<3, 3>(0, 0).copy_from(&block.fixed_view::<3, 3>(0, 0));
    let mut inverse = inverse(&(only + rotational_identity()), lowest);
    inverse.fixed_view_mut::<3, 3>(3, 3).copy_from(&Matrix3::zeros());
    inverse
}

/// Ones on the rotational diagonal.
fn rotational_identity() -> Matrix6<f64> {
    Matrix6::from_diagonal(&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0].into())
}
