//! Yade and Woo: spheres and bonds as text, and a script that makes contacts of them and strains the periodic cell.

use std::fmt::Write;

use super::{BondedCell, ExportFile};

/// Python for Yade's interpreter.
pub(super) const YADE: &str = include_str!("yade.py");

/// Python for Woo's interpreter.
pub(super) const WOO: &str = include_str!("woo.py");

/// The files `cell.txt` (edges), `spheres.txt` (x y z r), `bonds.txt` (ends, k_n, k_t) and the script as `element_test.py`. Spheres that are
/// none (nodes of a grid) have the radius 0.
pub(super) fn files(cell: &BondedCell, script: &str) -> Vec<ExportFile> {
    let edges = format!("# Edges of the periodic cell (m)\n{:?} {:?} {:?}\n", cell.edges.x, cell.edges.y, cell.edges.z);
    let mut spheres = String::from("# x y z radius (m)\n");
    for (n, x) in cell.nodes.iter().enumerate() {
        let radius = cell.radii.as_ref().map_or(0.0, |r| r[n]);
        let _ = writeln!(spheres, "{:?} {:?} {:?} {radius:?}", x.x, x.y, x.z);
    }
    let mut bonds = String::from("# a b (from 0) k_n k_t (N/m), to the nearest image\n");
    for b in &cell.bonds {
        let _ = writeln!(bonds, "{} {} {:?} {:?}", b.a, b.b, b.normal, b.tangential);
    }
    [("cell.txt", edges.as_str()), ("spheres.txt", &spheres), ("bonds.txt", &bonds), ("element_test.py", script)]
        .map(|(name, text)| (name.into(), text.as_bytes().to_vec()))
        .into()
}
