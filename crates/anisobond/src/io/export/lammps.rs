//! LAMMPS: harmonic bonds in a periodic box, and an input that strains the box six ways and prints the stiffness.

use std::fmt::Write;

use super::{BondedCell, ExportFile, refuse_tangential};
use crate::Result;

/// Strain of the engine's test: central differences of ± it leave an error of its square.
const STRAIN: f64 = 1e-5;

/// Force that may be left on a node (root mean square), relative to that of a mean bond at the strain.
const BALANCE: f64 = 1e-8;

/// The files `bonds.data` and `in.element_test`.
pub(super) fn files(cell: &BondedCell) -> Result<Vec<ExportFile>> {
    refuse_tangential(
        cell,
        "LAMMPS",
        "bpm/rotational, its bond with shear, does not answer rotations of the nodes with the same forces",
    )?;
    Ok(vec![("bonds.data".into(), data(cell).into_bytes()), ("in.element_test".into(), input(cell).into_bytes())])
}

/// The data file: `bond_style harmonic` has the energy K (r − r₀)², so K = k_n/2.
fn data(cell: &BondedCell) -> String {
    let (types, of) = cell.types();
    let mut text = format!(
        "{}: bonds of anisobond {}; units si\n\n{} atoms\n{} bonds\n1 atom types\n{} bond types\n\n",
        cell.material.replace(char::is_control, " "),
        env!("CARGO_PKG_VERSION"),
        cell.nodes.len(),
        cell.bonds.len(),
        types.len()
    );
    for (axis, edge) in ["x", "y", "z"].iter().zip(cell.edges.iter()) {
        let _ = writeln!(text, "0 {edge:?} {axis}lo {axis}hi");
    }
    text += "0 0 0 xy xz yz\n\nMasses\n\n1 1\n\nBond Coeffs # harmonic\n\n";
    for (n, kind) in types.iter().enumerate() {
        let _ = writeln!(text, "{} {:?} {:?}", n + 1, 0.5 * kind.normal, kind.length);
    }
    text += "\nAtoms # bond\n\n";
    for (n, x) in cell.nodes.iter().enumerate() {
        let _ = writeln!(text, "{} 1 1 {:?} {:?} {:?}", n + 1, x.x, x.y, x.z);
    }
    text += "\nBonds\n\n";
    for (n, (bond, kind)) in cell.bonds.iter().zip(&of).enumerate() {
        let _ = writeln!(text, "{} {} {} {}", n + 1, kind + 1, bond.a + 1, bond.b + 1);
    }
    text
}

/// Changes of the box by case: the axis or plane, whether it is a stretch, and the edge that a shear is relative to.
const CASES: [(&str, Option<usize>); 6] =
    [("x", None), ("y", None), ("z", None), ("yz", Some(2)), ("xz", Some(2)), ("xy", Some(1))];

/// Names of LAMMPS' pressures in Voigt order.
const PRESSURES: [&str; 6] = ["pxx", "pyy", "pzz", "pyz", "pxz", "pxy"];

fn input(cell: &BondedCell) -> String {
    let longest = cell.longest();
    let force: f64 = cell.bonds.iter().map(|b| b.normal * b.branch.norm()).sum::<f64>() / cell.bonds.len() as f64;
    let reach = 1.1 * longest;
    let mut text = format!(
        "# Element test of the bonds in bonds.data: six strains of ±{STRAIN:e}, nodes relaxed, stiffness in Pa (Voigt).\n\
         # lmp -in in.element_test, or mpirun -n 2 lmp -in in.element_test; measured.csv must be expected.csv.\n\
         units           si\n\
         atom_style      bond\n\
         boundary        p p p\n\
         special_bonds   lj/coul 1 1 1\n\
         pair_style      zero {longest:?} nocoeff\n\
         bond_style      harmonic\n\
         read_data       bonds.data\n\
         pair_coeff      * *\n\
         neighbor        {:?} bin\n\
         comm_modify     cutoff {reach:?}\n\
         thermo_style    custom step pe {}\n\
         min_style       cg\n\
         # A step of the line search goes no further than the strains do; the engine's own 0.1 m is farther than a cell.\n\
         min_modify      dmax {:?}\n\n",
        reach - longest,
        PRESSURES.join(" "),
        STRAIN * cell.edges.max(),
    );
    let tolerance = BALANCE * STRAIN * force * (cell.nodes.len() as f64).sqrt();
    for (case, (name, shear)) in CASES.iter().enumerate() {
        for (sign, strain) in [("p", STRAIN), ("m", -STRAIN)] {
            let change = |strain: f64, back: bool| match shear {
                Some(edge) => format!("{name} delta {:?}", strain * cell.edges[*edge] * if back { -1.0 } else { 1.0 }),
                None if back => format!("{name} scale {:?}", 1.0 / (1.0 + strain)),
                None => format!("{name} scale {:?}", 1.0 + strain),
            };
            let _ = writeln!(text, "change_box      all {} remap units box", change(strain, false));
            let _ = writeln!(text, "minimize        0 {tolerance:e} 2000 20000");
            for (row, pressure) in PRESSURES.iter().enumerate() {
                let _ = writeln!(text, "variable        {sign}{}{} equal $(-{pressure}:%.17g)", row + 1, case + 1);
            }
            let _ = writeln!(text, "change_box      all {} remap units box", change(strain, true));
        }
    }
    text += "\nprint           \"11,22,33,23,13,12\" file measured.csv screen no\n";
    for row in 1..=6 {
        let entries = (1..=6).map(|case| format!("$((v_p{row}{case}-v_m{row}{case})/{:e}:%.12g)", 2.0 * STRAIN));
        let _ = writeln!(text, "print           \"{}\" append measured.csv", entries.collect::<Vec<_>>().join(","));
    }
    text
}
