//! The dense matrix: slow, obvious, the oracle of the kernels.

use nalgebra::{DMatrix, Matrix6, SMatrix, Vector3};

use super::bond_list::Network;
use crate::calibration::strain_dot;
use crate::tensor::Stiffness;

/// Energy of one bond as ½ qᵀ k q of q = (u_A, θ_A, u_B, θ_B, E·L), as the 15×15 matrix k.
fn bond_matrix(branch: &Vector3<f64>, kn: f64, kt: f64) -> SMatrix<f64, 15, 15> {
    let n = branch.normalize();
    let nn = n * n.transpose();
    let k = kn * nn + kt * (nalgebra::Matrix3::identity() - nn);
    // Δ = u_B − u_A + E·L + ½ L×(θ_A + θ_B).
    let mut delta = SMatrix::<f64, 3, 15>::zeros();
    for i in 0..3 {
        delta[(i, i)] = -1.0;
        delta[(i, 6 + i)] = 1.0;
        delta[(i, 12 + i)] = 1.0;
    }
    let half_cross = 0.5 * branch.cross_matrix();
    delta.fixed_view_mut::<3, 3>(0, 3).copy_from(&half_cross);
    delta.fixed_view_mut::<3, 3>(0, 9).copy_from(&half_cross);
    delta.transpose() * k * delta
}

/// The matrix of the quadratic form ½ qᵀ K q, q = (six numbers per node …, E in Kelvin-Mandel coordinates): nodes first,
/// the strain's six rows last.
pub fn dense_matrix(network: &Network) -> DMatrix<f64> {
    let strain = 6 * network.nodes.len();
    let mut k = DMatrix::zeros(strain + 6, strain + 6);
    for bond in &network.bonds {
        let mut from_q = DMatrix::zeros(15, strain + 6);
        for i in 0..6 {
            from_q[(i, 6 * bond.a as usize + i)] += 1.0;
            from_q[(6 + i, 6 * bond.b as usize + i)] += 1.0;
            let mut unit = nalgebra::Vector6::zeros();
            unit[i] = 1.0;
            let el = strain_dot(&unit, &bond.branch);
            for j in 0..3 {
                from_q[(12 + j, strain + i)] = el[j];
            }
        }
        k += from_q.transpose() * bond_matrix(&bond.branch, bond.normal, bond.tangential) * from_q;
    }
    k
}

/// C = (K_EE − K_Eq K_qq⁺ K_qE)/V (Pa), K_qq⁺ by singular values; rotations free or zero.
pub fn dense_element_test(network: &Network, rotations_free: bool) -> Stiffness {
    let k = dense_matrix(network);
    let strain = 6 * network.nodes.len();
    let free: Vec<usize> = (0..strain).filter(|i| rotations_free || i % 6 < 3).collect();
    // Displacements and rotations differ in unit: scale to a unit diagonal.
    let scale: Vec<f64> = free.iter().map(|&i| if k[(i, i)] > 0.0 { k[(i, i)].sqrt().recip() } else { 1.0 }).collect();
    let qq = DMatrix::from_fn(free.len(), free.len(), |i, j| k[(free[i], free[j])] * scale[i] * scale[j]);
    let qe = DMatrix::from_fn(free.len(), 6, |i, j| k[(free[i], strain + j)] * scale[i]);
    let relaxed = qq.svd(true, true).solve(&qe, 1e-11).map_or_else(|_| qe.clone() * f64::NAN, |q| qe.transpose() * q);
    Stiffness::from_mandel(
        Matrix6::from_fn(|a, b| k[(strain + a, strain + b)] - 0.5 * (relaxed[(a, b)] + relaxed[(b, a)]))
            / network.volume,
    )
}
