//! Symmetric 3×3 blocks.

use nalgebra::Matrix3;

/// An eigenvalue below this share of the largest costs no energy.
pub const SINGULAR: f64 = 1e-10;

/// A symmetric 3×3 block: 11 22 33 23 13 12.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Symmetric3(pub [f64; 6]);

impl Symmetric3 {
    /// The block times a vector.
    #[inline(always)]
    pub fn times(&self, v: &[f64; 3]) -> [f64; 3] {
        let [a, b, c, d, e, f] = self.0;
        let [x, y, z] = *v;
        [a * x + f * y + e * z, f * x + b * y + d * z, e * x + d * y + c * z]
    }
}

/// The inverse of a symmetric semidefinite block; directions without stiffness give zero.
pub fn pseudo_inverse(block: &[[f64; 3]; 3]) -> Symmetric3 {
    let m = Matrix3::from_fn(|i, j| 0.5 * (block[i][j] + block[j][i]));
    let eigen = m.symmetric_eigen();
    let floor = SINGULAR * eigen.eigenvalues.amax();
    let mut inverse = Matrix3::zeros();
    for (value, v) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > floor {
            inverse += v * v.transpose() / *value;
        }
    }
    let i = &inverse;
    Symmetric3([i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(1, 2)], i[(0, 2)], i[(0, 1)]])
}
