//! The lattice of a folder as spheres and lines, coloured by one of some quantities.

use std::path::Path;

use nalgebra::Vector3;
use serde::Serialize;

use super::encoded;
use crate::export::contact_bonds;
use anisobond::Result;
use anisobond::operator::StiffBond;
use anisobond_formats::bonds::{BondTable, read_bonds};
use anisobond_formats::packing::read_packing;

/// Radius of a node of a neighbourhood, in shortest bonds.
const NODE: f64 = 0.08;

/// More bonds than this are left out of the picture of a lattice; its spheres are shown.
const MOST_BONDS: usize = 400_000;

/// Spheres and lines; numbers of single precision in base64.
#[derive(Serialize)]
pub(super) struct Scene {
    title: &'static str,
    help: String,
    /// x y z r of each.
    spheres: String,
    /// Two points of each.
    lines: String,
    quantities: Vec<Quantity>,
}

/// A value of every sphere and every line.
#[derive(Serialize)]
struct Quantity {
    name: &'static str,
    unit: &'static str,
    values: String,
    line_values: String,
}

/// Numbers of single precision.
fn packed(values: impl Iterator<Item = f64>) -> String {
    encoded(&values.flat_map(|v| (v as f32).to_le_bytes()).collect::<Vec<u8>>())
}

impl Quantity {
    /// Of a neighbourhood: a node has the value of its bond.
    fn of_bonds(name: &'static str, values: &[f64]) -> Self {
        let values = packed(values.iter().copied());
        Quantity { name, unit: "N/m⁶", line_values: values.clone(), values }
    }

    /// Of a lattice: a sphere has the mean of its bonds.
    fn of_contacts(name: &'static str, spheres: usize, bonds: &[StiffBond], value: impl Fn(&StiffBond) -> f64) -> Self {
        let mut sums = vec![(0.0, 0usize); spheres];
        for bond in bonds {
            for end in [bond.a, bond.b] {
                sums[end as usize].0 += value(bond);
                sums[end as usize].1 += 1;
            }
        }
        Quantity {
            name,
            unit: "N/m",
            values: packed(sums.iter().map(|(sum, count)| sum / (*count).max(1) as f64)),
            line_values: packed(drawn(bonds).iter().map(value)),
        }
    }
}

/// The bonds of a lattice that are drawn.
fn drawn(bonds: &[StiffBond]) -> &[StiffBond] {
    if bonds.len() <= MOST_BONDS { bonds } else { &[] }
}

/// The neighbourhood or the lattice of a folder; `None` if it has neither.
pub(super) fn of_folder(folder: &Path) -> Result<Option<Scene>> {
    let bonds = folder.join("bonds.csv");
    if folder.join("calibration.json").is_file() && bonds.is_file() {
        return Ok(Some(neighbourhood(&read_bonds(bonds)?)));
    }
    if folder.join("packing.csv").is_file() && bonds.is_file() {
        return lattice(folder, &bonds).map(Some);
    }
    Ok(None)
}

/// The bonds of one node.
pub(super) fn neighbourhood(table: &BondTable) -> Scene {
    let shortest = table.length.iter().copied().fold(f64::INFINITY, f64::min);
    let mut quantities = Vec::new();
    match &table.tangential {
        None => quantities.push(Quantity::of_bonds("micromodulus c", &table.micromodulus)),
        Some(tangential) => {
            quantities.push(Quantity::of_bonds("normal micromodulus c_n", &table.micromodulus));
            quantities.push(Quantity::of_bonds("tangential micromodulus c_t", &tangential.micromodulus));
        }
    }
    Scene {
        title: "Neighbourhood",
        help: format!("{} bonds of one node, coloured by micromodulus.", table.len()),
        spheres: packed(table.xi.iter().flat_map(|x| [x.x, x.y, x.z, NODE * shortest])),
        lines: packed(table.xi.iter().flat_map(|x| [0.0, 0.0, 0.0, x.x, x.y, x.z])),
        quantities,
    }
}

/// Spheres coloured by the mean stiffness of their bonds.
fn lattice(folder: &Path, path: &Path) -> Result<Scene> {
    let packing = read_packing(folder.join("packing.csv"))?;
    let bonds = contact_bonds(path, &packing)?;
    let centres = packing.centres();
    let line = |bond: &StiffBond| {
        let from = centres[bond.a as usize];
        let to: Vector3<f64> = from + bond.branch;
        [from.x, from.y, from.z, to.x, to.y, to.z]
    };
    let mut quantities = vec![Quantity::of_contacts("normal stiffness k_n", packing.len(), &bonds, |b| b.normal)];
    if bonds.iter().any(|b| b.tangential != 0.0) {
        quantities.push(Quantity::of_contacts("tangential stiffness k_t", packing.len(), &bonds, |b| b.tangential));
    }
    Ok(Scene {
        title: "Lattice",
        help: match drawn(&bonds).len() {
            0 => format!(
                "{} spheres, coloured by the mean stiffness of their bonds. Their {} bonds are not drawn: a picture takes \
                 at most {MOST_BONDS}.",
                packing.len(),
                bonds.len()
            ),
            _ => format!(
                "{} spheres, coloured by the mean stiffness of their bonds, and {} bonds, coloured by their own.",
                packing.len(),
                bonds.len()
            ),
        },
        spheres: packed(centres.iter().zip(packing.radii()).flat_map(|(x, r)| [x.x, x.y, x.z, *r])),
        lines: packed(drawn(&bonds).iter().flat_map(line)),
        quantities,
    })
}
