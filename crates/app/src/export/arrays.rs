//! For everyone else: the linear system of the element test as MatrixMarket files, and nodes and bonds as NumPy arrays.
//!
//! Unknowns are displacements and, where bonds have tangential stiffness, rotations of every node. With K the stiffness
//! matrix, F the forces of the six unit strains and A their energies at uniform strain, C = (A − Fᵀ K⁺ F)/V.

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write;

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Matrix6x3, SMatrix, Vector3, Vector6};
use rayon::prelude::*;

use super::{BondedCell, ExportFile};
use anisobond::Result;
use anisobond::operator::{NodalTerm, StiffBond, symmetric_part};
use anisobond::tensor::{PAIRS, mandel_weight};
use anisobond_formats::results::npy;

/// Python that solves the system, shipped with it.
const SCRIPT: &str = include_str!("element_test.py");

/// Unknowns of two nodes: u_A, θ_A, u_B, θ_B.
type Ends = SMatrix<f64, 3, 12>;

/// K, F and A of a cell.
struct System {
    /// Unknowns of a node: displacements, or with rotations.
    per_node: usize,
    /// What adds to the lower triangle of K, by column: rows and values.
    columns: Vec<Vec<(usize, f64)>>,
    /// The forces that a strain of the cell puts on the nodes, of six unit strains.
    forces: Vec<[f64; 6]>,
    /// Twice the energy of pairs of unit strains, nodes following.
    uniform: Matrix6<f64>,
}

impl System {
    fn new(cell: &BondedCell) -> Result<Self> {
        let rotations = cell.bonds.iter().any(|b| b.tangential != 0.0);
        let per_node = if rotations { 6 } else { 3 };
        let size = per_node * cell.nodes.len();
        let (columns, forces) = (vec![Vec::new(); size], vec![[0.0; 6]; size]);
        let mut system = System { per_node, columns, forces, uniform: Matrix6::zeros() };
        cell.bonds.iter().for_each(|bond| system.add_bond(bond));
        if let Some(term) = &cell.nodal {
            system.add_nodal(cell, term)?;
        }
        Ok(system)
    }

    fn add_bond(&mut self, bond: &StiffBond) {
        let per_node = self.per_node;
        let b = strain_of_ends(&bond.branch);
        let d = response(bond);
        let strains = affine(&bond.branch);
        let (k, f) = (b.transpose() * d * b, b.transpose() * d * strains);
        self.uniform += strains.transpose() * d * strains;
        // Column (row) of each of the twelve unknowns that counts.
        let unknowns = (0..12).filter(|i| i % 6 < per_node).map(|i| {
            let node = if i < 6 { bond.a } else { bond.b };
            (i, per_node * node as usize + i % 6)
        });
        for (i, row) in unknowns.clone() {
            (0..6).for_each(|case| self.forces[row][case] -= f[(i, case)]);
            for (j, column) in unknowns.clone().filter(|&(_, column)| column <= row) {
                self.add(column, row, k[(i, j)]);
            }
        }
    }

    /// The nodal term: ε̄ of a node is B u + E, its energy ½ V ε̄:Z:ε̄.
    fn add_nodal(&mut self, cell: &BondedCell, term: &NodalTerm) -> Result<()> {
        let per_node = self.per_node;
        let z = term.stiffness.mandel();
        let unit = Matrix6::from_diagonal(&Vector6::from_fn(|case, _| 1.0 / mandel_weight(case)));
        let averages = averages(cell, term)?;
        // The nodes whose average strain a node's displacements are part of.
        let mut part_of: Vec<Vec<(usize, Matrix6x3<f64>)>> = vec![Vec::new(); averages.len()];
        for (node, average) in averages.iter().enumerate().filter(|(_, average)| !average.is_empty()) {
            self.uniform += term.volumes[node] * unit * z * unit;
            for (&moved, b) in average {
                part_of[moved].push((node, *b));
            }
        }
        // Row by row of nodes: V Bᵀ Z and what it meets.
        let rows = part_of.par_iter().enumerate().map(|(row, part_of)| {
            let mut force = Matrix3x6::zeros();
            let mut blocks: HashMap<usize, Matrix3<f64>> = HashMap::new();
            for (node, b) in part_of {
                let stress = term.volumes[*node] * b.transpose() * z;
                force += stress * unit;
                for (&column, right) in averages[*node].range(..=row) {
                    *blocks.entry(column).or_insert_with(Matrix3::zeros) += stress * right;
                }
            }
            (force, blocks)
        });
        for (row, (force, blocks)) in rows.collect::<Vec<_>>().into_iter().enumerate() {
            for i in 0..3 {
                (0..6).for_each(|case| self.forces[per_node * row + i][case] -= force[(i, case)]);
            }
            for (column, k) in blocks {
                for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                    if column < row || j <= i {
                        self.add(per_node * column + j, per_node * row + i, k[(i, j)]);
                    }
                }
            }
        }
        Ok(())
    }

    /// K += a value at a column and a row not above it.
    fn add(&mut self, column: usize, row: usize, value: f64) {
        self.columns[column].push((row, value));
    }

    /// Every entry once, rows rising.
    fn gather(&mut self) {
        for column in &mut self.columns {
            // In the order in which they were added: sums do not depend on chance.
            column.sort_by_key(|entry| entry.0);
            column.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                if same {
                    kept.1 += next.1;
                }
                same
            });
        }
    }
}

/// B of every node: what the displacements of which node add to its ε̄.
fn averages(cell: &BondedCell, term: &NodalTerm) -> Result<Vec<BTreeMap<usize, Matrix6x3<f64>>>> {
    let mut averages = vec![BTreeMap::new(); cell.nodes.len()];
    for (bond, at) in cell.bonds.iter().zip(term.gradients(cell.nodes.len(), &cell.bonds)?) {
        let ends = [bond.a as usize, bond.b as usize];
        for (node, g) in ends.into_iter().zip(at).filter(|(_, g)| *g != Vector3::zeros()) {
            let part = symmetric_part(&g);
            *averages[node].entry(ends[1]).or_insert_with(Matrix6x3::zeros) += part;
            *averages[node].entry(ends[0]).or_insert_with(Matrix6x3::zeros) -= part;
        }
    }
    Ok(averages)
}

/// The files `stiffness.mtx`, `forces.mtx`, `uniform.mtx` and a script that solves them.
pub(super) fn matrix_market(cell: &BondedCell) -> Result<Vec<ExportFile>> {
    let mut system = System::new(cell)?;
    system.gather();
    let System { per_node, columns, forces, uniform } = system;
    let size = forces.len();
    let mut matrix = format!(
        "%%MatrixMarket matrix coordinate real symmetric\n% Stiffness: {} of every node in turn; N/m, N, N m.\n{size} {size} {}\n",
        if per_node == 6 { "u_x u_y u_z θ_x θ_y θ_z" } else { "u_x u_y u_z" },
        columns.iter().map(Vec::len).sum::<usize>()
    );
    for (column, entries) in columns.iter().enumerate() {
        for (row, value) in entries {
            let _ = writeln!(matrix, "{} {} {value:?}", row + 1, column + 1);
        }
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

/// The arrays `cell`, `nodes`, `radii`, `bonds` (ends), `branches`, `stiffness` (k_n, k_t); with a nodal term `nodal_stiffness`
/// (Z, Voigt), `nodal_volumes` and `nodal_weights` (ω of the bonds).
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
    if let Some(term) = &cell.nodal {
        files.push(("nodal_stiffness.npy".into(), npy(term.stiffness.voigt_rows().as_flattened(), [6, 6])));
        files.push(("nodal_volumes.npy".into(), npy(&term.volumes, [nodes, 1])));
        files.push(("nodal_weights.npy".into(), npy(&term.weights, [bonds, 1])));
    }
    files
}
