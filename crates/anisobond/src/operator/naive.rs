//! The dense matrix: slow, obvious, the oracle of the kernels.

use nalgebra::{DMatrix, Matrix3, Matrix6, SMatrix, Vector3};

use super::bond_list::Network;
use crate::calibration::strain_dot;
use crate::tensor::{PAIRS, Stiffness, mandel_weight};

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
    if let Some(term) = &network.nodal {
        for node in 0..network.nodes.len() {
            let average = average_strain(network, &term.weights, node);
            k += term.volumes[node] * average.transpose() * term.stiffness.mandel() * average;
        }
    }
    k
}

/// The 6×(6n + 6) matrix that takes q to a node's average strain, sym Σ ω η⊗K⁻¹ξ over its bonds seen from it.
fn average_strain(network: &Network, weights: &[f64], node: usize) -> DMatrix<f64> {
    let columns = 6 * network.nodes.len() + 6;
    let mut seen = Vec::new();
    for (bond, weight) in network.bonds.iter().zip(weights) {
        if bond.a as usize == node {
            seen.push((bond.b as usize, bond.branch, *weight));
        }
        if bond.b as usize == node {
            seen.push((bond.a as usize, -bond.branch, *weight));
        }
    }
    let shape = seen.iter().fold(Matrix3::zeros(), |k, (_, xi, w)| k + *w * xi * xi.transpose());
    let Some(inverse) = shape.try_inverse() else { return DMatrix::zeros(6, columns) };
    let mut average = DMatrix::zeros(6, columns);
    for (other, xi, weight) in seen {
        let g = weight * (inverse * xi);
        for q in 0..columns {
            // η of a unit of q.
            let eta = match q.checked_sub(columns - 6) {
                Some(strain) => strain_dot(&nalgebra::Vector6::from_fn(|a, _| f64::from(a == strain)), &xi),
                None if q % 6 < 3 => {
                    let sign = f64::from(q / 6 == other) - f64::from(q / 6 == node);
                    Vector3::from_fn(|i, _| if i == q % 6 { sign } else { 0.0 })
                }
                None => Vector3::zeros(),
            };
            for (a, &(i, j)) in PAIRS.iter().enumerate() {
                average[(a, q)] += 0.5 * (eta[i] * g[j] + eta[j] * g[i]) * mandel_weight(a);
            }
        }
    }
    average
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
