//! The slow, obvious twin of the calibration: all 81 components, no collapsing, no dual.

use nalgebra::{DMatrix, DVector};

use crate::lattice::Neighbourhood;
use crate::tensor::Stiffness;

/// The 81×M matrix X of P eq (35), every component counted: X c is the tensor of the bonds.
pub fn matrix(neighbourhood: &Neighbourhood) -> DMatrix<f64> {
    let bonds = neighbourhood.bonds();
    DMatrix::from_fn(81, bonds.len(), |row, column| {
        let xi = bonds[column].xi;
        let [i, j, k, l] = [row / 27, row / 9 % 3, row / 3 % 3, row % 3];
        let volume = neighbourhood.spacing().powi(3);
        0.5 * bonds[column].influence * xi[i] * xi[j] * xi[k] * xi[l] / xi.norm().powi(3) * volume
    })
}

/// A tensor as its 81 components.
pub fn components(c: &Stiffness) -> DVector<f64> {
    DVector::from_fn(81, |row, _| c.component(row / 27, row / 9 % 3, row / 3 % 3, row % 3))
}

/// The least-norm c ≥ l with X c closest to C (P eqs 36-43), as the projection of 0 on the intersection of the affine
/// set of least-squares solutions and the box c ≥ l, by Dykstra's alternating projections. Converges linearly where a
/// solution exists; wrong where none does. Micromoduli in N/m⁶.
pub fn calibrate(neighbourhood: &Neighbourhood, target: &Stiffness, lower_bound: f64, rounds: usize) -> Vec<f64> {
    let x = matrix(neighbourhood);
    let scale = x.norm();
    let x = x / scale;
    let inverse = x.clone().pseudo_inverse(1e-10).expect("the tolerance is positive");
    let target = components(target) / scale;
    let start = &inverse * &target;
    let mut c = DVector::zeros(x.ncols());
    let mut correction = DVector::zeros(x.ncols());
    for _ in 0..rounds {
        // On the affine set: c − X⁺(X c − X X⁺ C); its correction cancels because the set is affine.
        let on_affine = &c - &inverse * (&x * &c) + &start;
        let before = &on_affine + &correction;
        c = before.map(|value: f64| value.max(lower_bound));
        correction = before - &c;
    }
    c.as_slice().to_vec()
}
