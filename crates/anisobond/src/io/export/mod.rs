//! Calibrated bonds for the engines that people run: a periodic cell of bonded nodes, in the engine's own format, with an
//! input that performs the engine's own element test, and the tensor that it must measure.

mod arrays;
mod cell;
mod lammps;
mod one_constant;
mod spheres;
mod truss;

pub use cell::BondedCell;
pub(super) use cell::contact_bonds;

use crate::tensor::{PAIRS, Stiffness};
use crate::{Error, Result};

/// A program, or a format, that takes bonds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Engine {
    /// LAMMPS: a data file with harmonic bonds, and an input.
    Lammps,
    /// Abaqus: truss elements (T3D2) with periodic equations.
    Abaqus,
    /// CalculiX: springs (SPRINGA) with periodic equations.
    Calculix,
    /// Yade: spheres and bonds, and a script.
    Yade,
    /// Woo: spheres and bonds, and a script.
    Woo,
    /// Peridigm's bond-based material: one micromodulus, the closest, if its tensor is within this share of the bonds' own.
    Peridigm(f64),
    /// PeriLab's bond-based material, as Peridigm's.
    PeriLab(f64),
    /// The stiffness matrix and the loads of unit strains in MatrixMarket files.
    MatrixMarket,
    /// NumPy arrays of nodes and bonds.
    Numpy,
}

/// The tensor that the engine must measure.
const EXPECTED: &str = "expected.csv";

/// A file of an export: name and contents.
pub type ExportFile = (String, Vec<u8>);

/// The files of a cell for an engine, `expected.csv` with the tensor (Pa, Voigt) that the engine must measure among them.
///
/// # Errors
/// What the engine cannot express, with the reason; a lattice that is a mechanism.
pub fn export(cell: &BondedCell, engine: Engine) -> Result<Vec<ExportFile>> {
    if !matches!(engine, Engine::MatrixMarket | Engine::Numpy) {
        refuse_nodal(cell)?;
    }
    let mut files = match engine {
        Engine::Lammps => lammps::files(cell)?,
        Engine::Abaqus => truss::files(cell, truss::Element::Truss)?,
        Engine::Calculix => truss::files(cell, truss::Element::Spring)?,
        Engine::Yade => spheres::files(cell, spheres::YADE),
        Engine::Woo => spheres::files(cell, spheres::WOO),
        Engine::Peridigm(within) => return one_constant(cell, one_constant::Program::Peridigm, within),
        Engine::PeriLab(within) => return one_constant(cell, one_constant::Program::PeriLab, within),
        Engine::MatrixMarket => arrays::matrix_market(cell)?,
        Engine::Numpy => arrays::numpy(cell),
    };
    files.push((EXPECTED.into(), voigt_csv(&cell.measured()?).into_bytes()));
    Ok(files)
}

/// A tensor as CSV: six rows of the Voigt matrix (Pa).
fn voigt_csv(c: &Stiffness) -> String {
    let name = |(i, j): (usize, usize)| format!("{}{}", i + 1, j + 1);
    let mut text = PAIRS.map(name).join(",") + "\n";
    for row in c.voigt_rows() {
        text += &(row.map(|c| format!("{c:?}")).join(",") + "\n");
    }
    text
}

/// The refusal of the hybrid model's nodal term.
fn refuse_nodal(cell: &BondedCell) -> Result<()> {
    if cell.nodal.is_none() {
        return Ok(());
    }
    Err(Error::input(
        "the hybrid model has a nodal term, which the engine does not know",
        "export to matrix-market or numpy, or make bonds with --model central or micropolar, which are all there is",
    ))
}

/// The refusal of tangential bonds.
fn refuse_tangential(cell: &BondedCell, engine: &str, why: &str) -> Result<()> {
    if cell.bonds.iter().all(|b| b.tangential == 0.0) {
        return Ok(());
    }
    Err(Error::input(
        format!("the bonds have tangential stiffness, which {engine} cannot express: {why}"),
        "export bonds of the central model, or to matrix-market or numpy",
    ))
}

/// The files of an engine whose bonds have one micromodulus; what it must measure is not what the calibrated bonds do.
fn one_constant(cell: &BondedCell, program: one_constant::Program, within: f64) -> Result<Vec<ExportFile>> {
    let (mut files, expected) = one_constant::files(cell, program, within)?;
    files.push((EXPECTED.into(), expected.into_bytes()));
    Ok(files)
}
