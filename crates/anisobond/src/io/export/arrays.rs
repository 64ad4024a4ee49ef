//! For everyone else: the linear system of the element test as MatrixMarket files, and nodes and bonds as NumPy arrays.
//!
//! Unknowns are displacements and, where bonds have tangential stiffness, rotations of every node. With K the stiffness
//! matrix, F the forces of the six unit strains and A their energies at uniform strain, C = (A − Fᵀ K⁺ F)/V.

use std::collections::BTreeMap;
use std::fmt::Write;

use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3};

use super::{BondedCell, ExportFile};
use crate::Result;
use crate::io::results::npy;
use crate::operator::StiffBond;
use crate::tensor::PAIRS;

/// Python that solves the system, shipped with it.
const SCRIPT: &str = include_str!("element_test.py");

/// Unknowns of two nodes: u_A, θ_A, u_B, θ_B.
type Ends = SMatrix<f64, 3, 12>;

/// The files `stiffness.mtx`, `forces.mtx`, `uniform.mtx` and a script that solves them.
pub(super) fn matrix_market(cell: &BondedCell) -> Result<Vec<ExportFile>> {
    let rotations = cell.bonds.iter().any(|b| b.tangential != 0.0);
    let per_node = if rotations { 6 } else { 3 };
    let size = per_node * cell.nodes.len();
    let mut stiffness: BTreeMap<[usize; 2], f64> = BTreeMap::new();
    let mut forces = vec![[0.0; 6]; size];
    let mut uniform = Matrix6::zeros();
    for bond in &cell.bonds {
        let b = strain_of_ends(&bond.branch);
        let d = response(bond);
        let strains = affine(&bond.branch);
        let (k, f) = (b.transpose() * d * b, b.transpose() * d * strains);
        uniform += strains.transpose() * d * strains;
        // Column (row) of each of the twelve unknowns that counts.
        let unknowns = (0..12).filter(|i| i % 6 < per_node).map(|i| {
            let node = if i < 6 { bond.a } else { bond.b };
            (i, per_node * node as usize + i % 6)
        });
        for (i, row) in unknowns.clone() {
            (0..6).for_each(|case| forces[row][case] -= f[(i, case)]);
            for (j, column) in unknowns.clone().filter(|&(_, column)| column <= row) {
                *stiffness.entry([column, row]).or_insert(0.0) += k[(i, j)];
            }
        }
    }
    let mut matrix = format!(
        "%%MatrixMarket matrix coordinate real symmetric\n% Stiffness: {} of every node in turn; N/m, N, N m.\n{size} {size} {}\n",
        if rotations { "u_x u_y u_z θ_x θ_y θ_z" } else { "u_x u_y u_z" },
        stiffness.len()
    );
    for ([column, row], value) in &stiffness {
        let _ = writeln!(matrix, "{} {} {value:?}", row + 1, column + 1);
    }
    let dense = |comment: &str, rows: usize, value: &dyn Fn(usize, usize) -> f64| {
        let mut text = format!("%%MatrixMarket matrix array real general\n% {comment}\n{rows} 6\n");
        for case in 0..6 {
            (0..rows).for_each(|row| {
                let _ = writeln!(text, "{:?}", value(row, case));
            });
        }
        text.into_bytes()
    };
    let of = "unit strains 11, 22, 33, 23, 13, 12 (shears γ)";
    Ok(vec![
        ("stiffness.mtx".into(), matrix.into_bytes()),
        ("forces.mtx".into(), dense(&format!("Forces (N, N m) of {of}"), size, &|row, case| forces[row][case])),
        ("uniform.mtx".into(), dense(&format!("Energies (J) of {of}"), 6, &|row, case| uniform[(row, case)])),
        ("volume.txt".into(), format!("{:?}\n", cell.volume()).into_bytes()),
        ("element_test.py".into(), SCRIPT.into()),
    ])
}

/// Δ = u_B − u_A − ½(θ_A + θ_B)×L as a matrix on the unknowns of both ends.
fn strain_of_ends(branch: &Vector3<f64>) -> Ends {
    let mut b = Ends::zeros();
    let half = 0.5 * branch.cross_matrix();
    b.fixed_view_mut::<3, 3>(0, 0).copy_from(&-Matrix3::identity());
    b.fixed_view_mut::<3, 3>(0, 3).copy_from(&half);
    b.fixed_view_mut::<3, 3>(0, 6).copy_from(&Matrix3::identity());
    b.fixed_view_mut::<3, 3>(0, 9).copy_from(&half);
    b
}

/// k_t I + (k_n − k_t) n⊗n.
fn response(bond: &StiffBond) -> Matrix3<f64> {
    let n = bond.branch.normalize();
    Matrix3::identity() * bond.tangential + n * n.transpose() * (bond.normal - bond.tangential)
}

/// E·L of the six unit strains.
fn affine(branch: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    let mut columns = SMatrix::zeros();
    for (case, &(i, j)) in PAIRS.iter().enumerate() {
        let share = if i == j { 1.0 } else { 0.5 };
        columns[(i, case)] += share * branch[j];
        if i != j {
            columns[(j, case)] += share * branch[i];
        }
    }
    columns
}

/// The arrays `cell`, `nodes`, `radii`, `bonds` (ends), `branches`, `stiffness` (k_n, k_t).
pub(super) fn numpy(cell: &BondedCell) -> Vec<ExportFile> {
    let (nodes, bonds) = (cell.nodes.len(), cell.bonds.len());
    let flat =
        |vectors: &mut dyn Iterator<Item = Vector3<f64>>| vectors.flat_map(|v| [v.x, v.y, v.z]).collect::<Vec<_>>();
    let ends: Vec<u32> = cell.bonds.iter().flat_map(|b| [b.a, b.b]).collect();
    let stiffness: Vec<f64> = cell.bonds.iter().flat_map(|b| [b.normal, b.tangential]).collect();
    let mut files = vec![
        ("cell.npy".into(), npy(cell.edges.as_slice(), [1, 3])),
        ("nodes.npy".into(), npy(&flat(&mut cell.nodes.iter().copied()), [nodes, 3])),
        ("bonds.npy".into(), npy(&ends, [bonds, 2])),
        ("branches.npy".into(), npy(&flat(&mut cell.bonds.iter().map(|b| b.branch)), [bonds, 3])),
        ("stiffness.npy".into(), npy(&stiffness, [bonds, 2])),
    ];
    if let Some(radii) = &cell.radii {
        files.push(("radii.npy".into(), npy(radii, [nodes, 1])));
    }
    files
}
