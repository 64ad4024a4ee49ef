//! The bonds of a lattice in files: a CSV table, and VTK PolyData with spheres as points and bonds as lines.

use std::fmt::Write;

use nalgebra::Vector3;

use crate::csv_text::in_comment;
use crate::vtk::{array, exact};
use anisobond::calibration::LatticeStiffness;
use anisobond::lattice::Lattice;
use anisobond::operator::Network;
use anisobond::{Error, Result};

/// The text of a lattice's `bonds.csv`: one line per contact. Every number reads back to the same bits.
pub fn lattice_bonds_csv(lattice: &Lattice, stiffness: &LatticeStiffness, material: &str) -> String {
    let material = in_comment(material);
    let mut text = format!(
        "# Bonds of a lattice on {} spheres at contact radius {}, by anisobond {}.\n\
         # Material: {material}.\n\
         # a, b              spheres, numbered from 0 as in the packing\n\
         # branch_x,y,z (m)  from the centre of a to that periodic image of b\n\
         # length (m)        length of the branch\n\
         # k_n, k_t (N/m)    normal and tangential stiffness: f_n = k_n Δ·n, f_t = k_t (Δ − n n·Δ)\n\
         a,b,branch_x,branch_y,branch_z,length,k_n,k_t\n",
        lattice.packing.len(),
        lattice.contact_radius,
        env!("CARGO_PKG_VERSION")
    );
    let stiffnesses = stiffness.normal.iter().zip(&stiffness.tangential);
    for (c, (kn, kt)) in lattice.contacts.iter().zip(stiffnesses) {
        row(&mut text, [c.a, c.b], &c.branch, *kn, *kt);
    }
    text
}

/// The text of a grid cell's `bonds.csv`: one line per bond, as [`lattice_bonds_csv`].
pub fn network_bonds_csv(network: &Network, material: &str) -> String {
    let material = in_comment(material);
    let mut text = format!(
        "# Bonds of a periodic cell of {} nodes, by anisobond {}.\n\
         # Material: {material}.\n\
         # a, b              nodes, numbered from 0, first axis fastest, missing ones not counted\n\
         # branch_x,y,z (m)  from a to that periodic image of b\n\
         # length (m)        length of the branch\n\
         # k_n, k_t (N/m)    normal and tangential stiffness\n\
         a,b,branch_x,branch_y,branch_z,length,k_n,k_t\n",
        network.nodes.len(),
        env!("CARGO_PKG_VERSION")
    );
    for bond in &network.bonds {
        row(&mut text, [bond.a, bond.b], &bond.branch, bond.normal, bond.tangential);
    }
    text
}

/// One line of a table of bonds.
fn row(text: &mut String, [a, b]: [u32; 2], l: &Vector3<f64>, kn: f64, kt: f64) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{a},{b},{:?},{:?},{:?},{:?},{kn:?},{kt:?}", l.x, l.y, l.z, l.norm());
}

/// A lattice as VTK XML PolyData: points are the centres with point data `radius` (m), then, for contacts across the
/// cell's border, the ends of their branches (`radius` 0); lines are the contacts with cell data `k_n`, `k_t` (N/m).
///
/// # Errors
/// Other numbers of stiffnesses than contacts.
pub fn lattice_vtp(lattice: &Lattice, stiffness: &LatticeStiffness) -> Result<String> {
    let contacts = lattice.contacts.len();
    if stiffness.normal.len() != contacts || stiffness.tangential.len() != contacts {
        return Err(Error::input("stiffnesses and contacts differ in number", "give one of each per contact"));
    }
    let mut points: Vec<[f64; 3]> = lattice.packing.centres().iter().map(|x| (*x).into()).collect();
    let mut radii = lattice.packing.radii().to_vec();
    let mut lines = Vec::with_capacity(contacts);
    for c in &lattice.contacts {
        let centres = lattice.packing.centres();
        let (from, to) = (centres[c.a as usize], centres[c.b as usize]);
        let end = from + c.branch;
        if (end - to).norm() < 1e-9 * c.branch.norm() {
            lines.push([c.a as usize, c.b as usize]);
        } else {
            lines.push([c.a as usize, points.len()]);
            points.push(end.into());
            radii.push(0.0);
        }
    }
    let mut file = String::from("<?xml version=\"1.0\"?>\n<!-- A lattice; SI units: m, N/m. -->\n");
    file.push_str("<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\">\n<PolyData>\n");
    let _ = writeln!(
        file,
        "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"{contacts}\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"0\">\n<PointData Scalars=\"radius\">",
        points.len()
    );
    array(&mut file, "Float64", "radius", 1, radii.iter().map(exact));
    file.push_str("</PointData>\n<CellData Scalars=\"k_n\">\n");
    array(&mut file, "Float64", "k_n", 1, stiffness.normal.iter().map(exact));
    array(&mut file, "Float64", "k_t", 1, stiffness.tangential.iter().map(exact));
    file.push_str("</CellData>\n<Points>\n");
    array(&mut file, "Float64", "Points", 3, points.iter().flatten().map(exact));
    file.push_str("</Points>\n<Lines>\n");
    // One component each, whatever the cells: readers refuse two.
    array(&mut file, "Int64", "connectivity", 1, lines.iter().flatten());
    array(&mut file, "Int64", "offsets", 1, (1..=contacts).map(|n| 2 * n));
    file.push_str("</Lines>\n</Piece>\n</PolyData>\n</VTKFile>\n");
    Ok(file)
}
