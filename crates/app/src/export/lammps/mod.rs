//! LAMMPS: bonds in a periodic box, and an input that strains the box six ways and prints the stiffness. Normal bonds are of
//! style harmonic, and energy is minimised; bonds with tangential stiffness of style bpm/rotational, and nodes come to rest by
//! damped motion.

mod turning;

use std::fmt::Write;

use super::{BondedCell, ExportFile};

/// Strain of the engine's test: central differences of ± it leave an error of its square.
const STRAIN: f64 = 1e-5;

/// Force that may be left on a node (root mean square), relative to that of a mean bond at the strain.
const BALANCE: f64 = 1e-8;

/// The files `bonds.data` and `in.element_test`; with tangential stiffness `bonds.coeffs` too.
pub(super) fn files(cell: &BondedCell) -> Vec<ExportFile> {
    if cell.bonds.iter().any(|b| b.tangential != 0.0) {
        return turning::files(cell);
    }
    vec![("bonds.data".into(), data(cell).into_bytes()), ("in.element_test".into(), input(cell).into_bytes())]
}

/// The data file: `bond_style harmonic` has the energy K (r − r₀)², so K = k_n/2.
fn data(cell: &BondedCell) -> String {
    let (types, of) = cell.types();
    let mut text = head(cell, types.len());
    text += "Masses\n\n1 1\n\nBond Coeffs # harmonic\n\n";
    for (n, kind) in types.iter().enumerate() {
        let _ = writeln!(text, "{} {:?} {:?}", n + 1, 0.5 * kind.normal, kind.length);
    }
    text += "\nAtoms # bond\n\n";
    for (n, x) in cell.nodes.iter().enumerate() {
        let _ = writeln!(text, "{} 1 1 {:?} {:?} {:?}", n + 1, x.x, x.y, x.z);
    }
    text + &connections(cell, &of)
}

/// The beginning of a data file.
fn head(cell: &BondedCell, types: usize) -> String {
    let mut text = format!(
        "{}: bonds of anisobond {}; units si\n\n{} atoms\n{} bonds\n1 atom types\n{types} bond types\n\n",
        cell.material.replace(char::is_control, " "),
        env!("CARGO_PKG_VERSION"),
        cell.nodes.len(),
        cell.bonds.len(),
    );
    for (axis, edge) in ["x", "y", "z"].iter().zip(cell.edges.iter()) {
        let _ = writeln!(text, "0 {edge:?} {axis}lo {axis}hi");
    }
    text + "0 0 0 xy xz yz\n\n"
}

/// The section of bonds, each with its type.
fn connections(cell: &BondedCell, types: &[u32]) -> String {
    let mut text = String::from("\nBonds\n\n");
    for (n, (bond, kind)) in cell.bonds.iter().zip(types).enumerate() {
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
    let text = format!(
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
    text + &strains(cell, STRAIN, &format!("minimize        0 {tolerance:e} 2000 20000"), &PRESSURES.map(String::from))
}

/// Six strains of ±`strain`, `relax` in each, and the stiffness from the pressures of these names (Voigt order).
fn strains(cell: &BondedCell, strain: f64, relax: &str, pressures: &[String; 6]) -> String {
    let mut text = String::new();
    for (case, (name, shear)) in CASES.iter().enumerate() {
        for (sign, strain) in [("p", strain), ("m", -strain)] {
            let change = |back: bool| match shear {
                Some(edge) => format!("{name} delta {:?}", strain * cell.edges[*edge] * if back { -1.0 } else { 1.0 }),
                None if back => format!("{name} scale {:?}", 1.0 / (1.0 + strain)),
                None => format!("{name} scale {:?}", 1.0 + strain),
            };
            let _ = writeln!(text, "change_box      all {} remap units box\n{relax}", change(false));
            for (row, pressure) in pressures.iter().enumerate() {
                let _ = writeln!(text, "variable        {sign}{}{} equal $(-{pressure}:%.17g)", row + 1, case + 1);
            }
            let _ = writeln!(text, "change_box      all {} remap units box", change(true));
        }
    }
    text += "\nprint           \"11,22,33,23,13,12\" file measured.csv screen no\n";
    for row in 1..=6 {
        let entries = (1..=6).map(|case| format!("$((v_p{row}{case}-v_m{row}{case})/{:e}:%.12g)", 2.0 * strain));
        let _ = writeln!(text, "print           \"{}\" append measured.csv", entries.collect::<Vec<_>>().join(","));
    }
    text
}
