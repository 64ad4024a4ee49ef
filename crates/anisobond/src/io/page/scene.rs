//! The lattice of a folder as spheres and lines.

use std::path::Path;

use nalgebra::Vector3;
use serde::Serialize;

use super::encoded;
use crate::Result;
use crate::io::bonds::read_bonds;
use crate::io::export::contact_bonds;
use crate::io::packing::read_packing;

/// Radius of a node of a neighbourhood, in shortest bonds.
const NODE: f64 = 0.08;

/// More bonds than this are left out of the picture of a lattice; its spheres are shown.
const MOST_BONDS: usize = 400_000;

/// Spheres and lines, coloured by a value; numbers of single precision in base64.
#[derive(Serialize)]
pub(super) struct Scene {
    title: &'static str,
    quantity: &'static str,
    unit: &'static str,
    help: String,
    /// x y z r of each.
    spheres: String,
    values: String,
    /// Two points of each.
    lines: String,
    line_values: String,
}

/// What is drawn, before it is encoded.
#[derive(Default)]
struct Shapes {
    spheres: Vec<f32>,
    values: Vec<f32>,
    lines: Vec<f32>,
    line_values: Vec<f32>,
}

impl Shapes {
    fn sphere(&mut self, x: &Vector3<f64>, radius: f64, value: f64) {
        self.spheres.extend(x.iter().chain([&radius]).map(|x| *x as f32));
        self.values.push(value as f32);
    }

    fn line(&mut self, from: &Vector3<f64>, to: &Vector3<f64>, value: f64) {
        self.lines.extend(from.iter().chain(to.iter()).map(|x| *x as f32));
        self.line_values.push(value as f32);
    }

    fn scene(self, title: &'static str, [quantity, unit]: [&'static str; 2], help: String) -> Scene {
        let bytes = |values: &[f32]| encoded(&values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>());
        Scene {
            title,
            quantity,
            unit,
            help,
            spheres: bytes(&self.spheres),
            values: bytes(&self.values),
            lines: bytes(&self.lines),
            line_values: bytes(&self.line_values),
        }
    }
}

/// The neighbourhood or the lattice of a folder; `None` if it has neither.
pub(super) fn of_folder(folder: &Path) -> Result<Option<Scene>> {
    let bonds = folder.join("bonds.csv");
    if folder.join("calibration.json").is_file() && bonds.is_file() {
        return neighbourhood(&bonds).map(Some);
    }
    if folder.join("packing.csv").is_file() && bonds.is_file() {
        return lattice(folder, &bonds).map(Some);
    }
    Ok(None)
}

fn neighbourhood(path: &Path) -> Result<Scene> {
    let table = read_bonds(path)?;
    let shortest = table.length.iter().copied().fold(f64::INFINITY, f64::min);
    let mut shapes = Shapes::default();
    for (xi, &c) in table.xi.iter().zip(&table.micromodulus) {
        shapes.sphere(xi, NODE * shortest, c);
        shapes.line(&Vector3::zeros(), xi, c);
    }
    let help = format!("{} bonds of one node, coloured by micromodulus.", table.len());
    Ok(shapes.scene("Neighbourhood", ["micromodulus c", "N/m⁶"], help))
}

/// Spheres coloured by the mean normal stiffness of their bonds.
fn lattice(folder: &Path, path: &Path) -> Result<Scene> {
    let packing = read_packing(folder.join("packing.csv"))?;
    let bonds = contact_bonds(path, &packing)?;
    let mut sums = vec![(0.0, 0usize); packing.len()];
    for bond in &bonds {
        for end in [bond.a, bond.b] {
            sums[end as usize].0 += bond.normal;
            sums[end as usize].1 += 1;
        }
    }
    let mut shapes = Shapes::default();
    for ((x, r), (sum, count)) in packing.centres().iter().zip(packing.radii()).zip(&sums) {
        shapes.sphere(x, *r, sum / (*count).max(1) as f64);
    }
    for bond in bonds.iter().filter(|_| bonds.len() <= MOST_BONDS) {
        let from = packing.centres()[bond.a as usize];
        shapes.line(&from, &(from + bond.branch), bond.normal);
    }
    let help = format!(
        "{} spheres, coloured by the mean normal stiffness of their bonds, and {} bonds, coloured by their own.",
        packing.len(),
        bonds.len()
    );
    Ok(shapes.scene("Lattice", ["normal stiffness k_n", "N/m"], help))
}
