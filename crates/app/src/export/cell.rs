//! The periodic cell that is exported, read from a folder of results.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::folder::require_own;
use anisobond::experiment::element_test::{ElementTest, Mechanisms};
use anisobond::experiment::nodal_on_contacts;
use anisobond::lattice::Packing;
use anisobond::operator::{Network, NodalTerm, StiffBond};
use anisobond::tensor::Stiffness;
use anisobond::{Error, Result};
use anisobond_formats::bonds::{BondTable, read_bonds};
use anisobond_formats::packing::read_packing;
use anisobond_formats::tree::read_text;

/// More nodes and bonds than these are refused before memory is taken.
const MOST_NODES: f64 = 4e6;
const MOST_BONDS: f64 = 2e8;

/// A rectangular periodic cell of bonded nodes. Along no edge is a bond longer than half of it, so that engines that look for
/// the nearest image find the right one.
#[derive(Clone, Debug)]
pub struct BondedCell {
    /// Name of the material.
    pub material: String,
    /// Edges of the cell (m), along the axes.
    pub edges: Vector3<f64>,
    /// Nodes (m), 0 ≤ x < edge. Those of a grid that is turned stand along the grid's own axes.
    pub nodes: Vec<Vector3<f64>>,
    /// Radii of spheres (m), of a packing.
    pub radii: Option<Vec<f64>>,
    /// Spacing of the nodes (m), of a grid.
    pub spacing: Option<f64>,
    /// Bonds, each once.
    pub bonds: Vec<StiffBond>,
    /// The nodal term of the hybrid model.
    pub nodal: Option<NodalTerm>,
}

/// Bonds that are alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BondType {
    /// k_n (N/m).
    pub normal: f64,
    /// Length at rest (m).
    pub length: f64,
}

impl BondedCell {
    /// The cell of a folder that `calibrate -o` or `lattice -o` wrote. Of a grid a block of `nodes` along each axis, by
    /// default just wide enough; of a packing its own cell, repeated where it is narrower than two bonds.
    ///
    /// # Errors
    /// A folder without such results, files that do not fit each other, a block that is too narrow or too large.
    pub fn read(folder: impl AsRef<Path>, nodes: Option<[usize; 3]>) -> Result<Self> {
        let folder = folder.as_ref();
        if folder.join("calibration.json").is_file() {
            return of_grid(folder, nodes).map_err(|e| e.at(folder.display()));
        }
        if folder.join("lattice.json").is_file() {
            if nodes.is_some() {
                return Err(Error::input("a number of nodes for a packing", "it is for grids; leave it out"));
            }
            return of_packing(folder).map_err(|e| e.at(folder.display()));
        }
        let problem = if folder.join("element-test.json").is_file() {
            format!("{} is of an element test, which may have changed its bonds", folder.display())
        } else {
            format!("{} holds no bonds", folder.display())
        };
        Err(Error::input(problem, "give a folder that calibrate or lattice wrote"))
    }

    /// Volume (m³).
    pub fn volume(&self) -> f64 {
        self.edges.product()
    }

    /// The kinds of bonds by two numbers that tell them apart, and of each bond its kind.
    pub fn kinds(&self, by: impl Fn(&StiffBond) -> [f64; 2]) -> (Vec<[f64; 2]>, Vec<u32>) {
        let mut kinds = Vec::new();
        let mut known = HashMap::new();
        let of = self.bonds.iter().map(|b| {
            let kind = by(b);
            *known.entry(kind.map(f64::to_bits)).or_insert_with(|| {
                kinds.push(kind);
                kinds.len() as u32 - 1
            })
        });
        let of = of.collect();
        (kinds, of)
    }

    /// The kinds of bonds by stiffness and length at rest, and of each bond its kind.
    pub fn types(&self) -> (Vec<BondType>, Vec<u32>) {
        let (kinds, of) = self.kinds(|b| [b.normal, b.branch.norm()]);
        (kinds.into_iter().map(|[normal, length]| BondType { normal, length }).collect(), of)
    }

    /// The network of the cell.
    pub fn network(&self) -> Network {
        let (nodes, bonds) = (self.nodes.clone(), self.bonds.clone());
        Network { nodes, bonds, volume: self.volume(), nodal: self.nodal.clone() }
    }

    /// The stiffness (Pa) that a static element test of the cell measures, node rotations free; and what moves freely in it,
    /// if anything does.
    ///
    /// # Errors
    /// Bonds that are no lattice.
    pub fn measured(&self) -> Result<(Stiffness, Option<Error>)> {
        let network = self.network();
        match ElementTest::default().run(&network) {
            Ok(result) => Ok((result.measured, None)),
            Err(mechanism) => {
                let test = ElementTest { mechanisms: Mechanisms::Report, ..ElementTest::default() };
                Ok((test.run(&network)?.measured, Some(mechanism)))
            }
        }
    }

    /// Cells around which a bond goes: x_b + shift = x_a + branch, in numbers of edges.
    pub fn shift(&self, bond: &StiffBond) -> [i32; 3] {
        let apart = self.nodes[bond.a as usize] + bond.branch - self.nodes[bond.b as usize];
        std::array::from_fn(|i| (apart[i] / self.edges[i]).round() as i32)
    }

    /// Length of the longest bond (m).
    pub fn longest(&self) -> f64 {
        self.bonds.iter().map(|b| b.branch.norm()).fold(0.0, f64::max)
    }

    /// The cell repeated n₁ × n₂ × n₃ times.
    fn repeated(&self, n: [usize; 3]) -> Self {
        let number = self.nodes.len();
        let place = |c: [usize; 3]| number * (c[0] + n[0] * (c[1] + n[1] * c[2]));
        let (mut nodes, mut bonds) = (Vec::new(), Vec::new());
        for cell in (0..n.iter().product()).map(|c: usize| [c % n[0], c / n[0] % n[1], c / (n[0] * n[1])]) {
            let offset = Vector3::from_fn(|i, _| cell[i] as f64 * self.edges[i]);
            nodes.extend(self.nodes.iter().map(|x| x + offset));
            bonds.extend(self.bonds.iter().map(|b| {
                let shift = self.shift(b);
                let other = std::array::from_fn(|i| (cell[i] as i32 + shift[i]).rem_euclid(n[i] as i32) as usize);
                StiffBond { a: b.a + place(cell) as u32, b: b.b + place(other) as u32, ..*b }
            }));
        }
        let again = |list: &Vec<f64>, length: usize| list.iter().copied().cycle().take(length).collect();
        BondedCell {
            material: self.material.clone(),
            edges: Vector3::from_fn(|i, _| n[i] as f64 * self.edges[i]),
            radii: self.radii.as_ref().map(|r| again(r, nodes.len())),
            spacing: self.spacing,
            nodal: self.nodal.as_ref().map(|term| NodalTerm {
                stiffness: term.stiffness,
                volumes: again(&term.volumes, nodes.len()),
                weights: again(&term.weights, bonds.len()),
            }),
            nodes,
            bonds,
        }
    }

    fn refuse_too_large(nodes: f64, bonds: f64) -> Result<()> {
        if nodes <= MOST_NODES && bonds <= MOST_BONDS {
            return Ok(());
        }
        Err(Error::input(
            format!("{nodes:e} nodes and {bonds:e} bonds to export"),
            format!("give a cell of at most {MOST_NODES:e} nodes and {MOST_BONDS:e} bonds"),
        ))
    }
}

fn json(path: &Path) -> Result<Value> {
    serde_json::from_str(&read_text(path)?)
        .map_err(|e| Error::input(format!("{} is not a report: {e}", path.display()), "write the folder again"))
}

/// An entry of a report that a model with a nodal term has.
fn entry<T: DeserializeOwned>(report: &Value) -> Result<T> {
    serde_json::from_value(report.clone())
        .map_err(|e| Error::input(format!("the report of the nodal term is not whole: {e}"), "write the folder again"))
}

/// Z (Pa) of a report of the hybrid model.
fn nodal_stiffness(report: &Value) -> Result<Option<Stiffness>> {
    if report["model"] != "hybrid" {
        return Ok(None);
    }
    let rows: [[f64; 6]; 6] = entry(&report["nodal_term"])?;
    Stiffness::from_voigt_rows(&rows).map(Some)
}

/// A block of a grid.
fn of_grid(folder: &Path, nodes: Option<[usize; 3]>) -> Result<BondedCell> {
    let report = json(&folder.join("calibration.json"))?;
    let spacing = report["neighbourhood"]["spacing"].as_f64().filter(|s| *s > 0.0);
    let spacing = spacing.ok_or_else(|| Error::input("calibration.json has no spacing", "write the folder again"))?;
    require_own(&report, folder, "bonds.csv")?;
    let table = read_bonds(folder.join("bonds.csv"))?;
    let reach: [usize; 3] =
        std::array::from_fn(|i| table.offset.iter().map(|o| o[i].unsigned_abs() as usize).max().unwrap_or(0));
    let n = nodes.unwrap_or(reach.map(|reach| 2 * reach + 2));
    if n.iter().zip(reach).any(|(&n, reach)| n <= 2 * reach) {
        let [a, b, c] = reach.map(|reach| 2 * reach + 1);
        return Err(Error::input(
            format!("a block of {n:?} nodes for bonds of up to {reach:?} spacings"),
            format!("give at least {a},{b},{c} nodes along the axes"),
        ));
    }
    let half = half_offsets(&table);
    let number: f64 = n.iter().map(|&n| n as f64).product();
    BondedCell::refuse_too_large(number, number * half.len() as f64)?;
    let nodal = nodal_stiffness(&report)?.map(|z| {
        let axes: [[f64; 3]; 3] = entry(&report["neighbourhood"]["orientation"])?;
        let number: usize = n.iter().product();
        let along: Vec<f64> = half.iter().map(|&p| table.influence[p]).collect();
        Ok(NodalTerm {
            // The block stands along the grid's axes.
            stiffness: z.rotated(&Matrix3::from_fn(|i, j| axes[j][i])),
            volumes: vec![spacing.powi(3); number],
            weights: along.repeat(number),
        })
    });
    Ok(BondedCell {
        material: report["material"].as_str().unwrap_or("").into(),
        edges: Vector3::from_fn(|i, _| n[i] as f64 * spacing),
        nodes: places(n).map(|at| Vector3::from_fn(|i, _| at[i] as f64 * spacing)).collect(),
        radii: None,
        spacing: Some(spacing),
        bonds: grid_bonds(&table, &half, n, spacing),
        nodal: nodal.transpose()?,
    })
}

/// Places of a block, the first axis fastest.
fn places(n: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..n.iter().product()).map(move |p: usize| [p % n[0], p / n[0] % n[1], p / (n[0] * n[1])])
}

/// The half of the offsets whose last component that is not zero is positive.
fn half_offsets(table: &BondTable) -> Vec<usize> {
    let half = |o: &[i32; 3]| o.iter().rev().find(|&&x| x != 0).is_some_and(|&x| x > 0);
    (0..table.len()).filter(|&p| half(&table.offset[p])).collect()
}

/// The bonds of a block, each once: from every node in turn those along half of its offsets.
fn grid_bonds(table: &BondTable, half: &[usize], n: [usize; 3], spacing: f64) -> Vec<StiffBond> {
    let index = |at: [usize; 3]| (at[0] + n[0] * (at[1] + n[1] * at[2])) as u32;
    let bond = |at: [usize; 3], p: usize| {
        let offset = table.offset[p];
        let to = std::array::from_fn(|i| (at[i] as i32 + offset[i]).rem_euclid(n[i] as i32) as usize);
        StiffBond {
            a: index(at),
            b: index(to),
            branch: Vector3::from_fn(|i, _| f64::from(offset[i]) * spacing),
            normal: both_ways(&table.spring_stiffness, p),
            tangential: table.tangential.as_ref().map_or(0.0, |t| both_ways(&t.spring_stiffness, p)),
        }
    };
    places(n).flat_map(|at| half.iter().map(move |&p| (at, p))).map(|(at, p)| bond(at, p)).collect()
}

/// The mean over ξ and −ξ, which stand at opposite places of the table.
fn both_ways(stiffness: &[f64], p: usize) -> f64 {
    0.5 * (stiffness[p] + stiffness[stiffness.len() - 1 - p])
}

/// A packing with its bonds.
fn of_packing(folder: &Path) -> Result<BondedCell> {
    let report = json(&folder.join("lattice.json"))?;
    require_own(&report, folder, "packing.csv")?;
    require_own(&report, folder, "bonds.csv")?;
    let packing = read_packing(folder.join("packing.csv"))?;
    let edges = packing.cell().ok_or_else(|| {
        Error::input("the packing has no periodic cell", "element tests need a periodic packing; make one with pack")
    })?;
    let bonds = contact_bonds(&folder.join("bonds.csv"), &packing)?;
    let on_contacts = |z: Stiffness| nodal_on_contacts(&z, packing.radii(), &bonds, edges.product());
    let cell = BondedCell {
        material: report["material"].as_str().unwrap_or("").into(),
        edges,
        nodes: packing.centres().to_vec(),
        radii: Some(packing.radii().to_vec()),
        spacing: None,
        nodal: nodal_stiffness(&report)?.map(on_contacts).transpose()?,
        bonds,
    };
    // Strictly more than two bonds, so that the nearest image is the right one.
    let times = |edge: f64| (2.0 * cell.longest() * (1.0 + 1e-6) / edge).floor() + 1.0;
    let n = [times(edges.x), times(edges.y), times(edges.z)];
    let cells: f64 = n.iter().product();
    BondedCell::refuse_too_large(cells * cell.nodes.len() as f64, cells * cell.bonds.len() as f64)?;
    let n = n.map(|n| n as usize);
    Ok(if n == [1; 3] { cell } else { cell.repeated(n) })
}

/// The contacts of a lattice's `bonds.csv`.
pub fn contact_bonds(path: &Path, packing: &Packing) -> Result<Vec<StiffBond>> {
    let at = |e: Error| e.at(path.display());
    let text = read_text(path)?;
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let mut bonds = Vec::new();
    for row in reader.deserialize::<(u32, u32, f64, f64, f64, f64, f64, f64)>() {
        let (a, b, x, y, z, _, normal, tangential) =
            row.map_err(|e| at(Error::input(e.to_string(), "write the folder again with lattice")))?;
        if a.max(b) as usize >= packing.len() {
            let problem = format!("a bond between spheres {a} and {b} of {}", packing.len());
            return Err(at(Error::input(problem, "write the folder again with lattice")));
        }
        bonds.push(StiffBond { a, b, branch: Vector3::new(x, y, z), normal, tangential });
    }
    Ok(bonds)
}
