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

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use crate::write_files;
use anisobond::tensor::{PAIRS, Stiffness};
use anisobond::{Error, Result};

/// A program, or a format, that takes bonds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Engine {
    /// LAMMPS: a data file with bonds (harmonic, or bpm/rotational with tangential stiffness), and an input.
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

/// Where the scripts write the tensor that the engine measures.
const MEASURED: &str = "measured.csv";

/// A file of an export: name and contents.
pub type ExportFile = (String, Vec<u8>);

/// What an export is.
#[derive(Debug)]
pub struct Export {
    /// The files, `expected.csv` with the tensor (Pa, Voigt) that the engine must measure among them.
    pub files: Vec<ExportFile>,
    /// What the engine's own test writes beside them: of an earlier export it is stale.
    pub outputs: Vec<String>,
    /// What moves freely: an engine may wait in vain for rest, or meet a singular matrix.
    pub warning: Option<Error>,
}

impl Export {
    /// Write the files into a folder, which is made if need be; what the engine wrote there of an earlier export is removed.
    /// A folder that holds other results is refused, or with `force` they are removed first.
    ///
    /// # Errors
    /// Other results; what cannot be written or removed.
    pub fn write(&self, folder: &Path, force: bool) -> Result<()> {
        write_files(folder, &self.files, force)?;
        for name in &self.outputs {
            let path = folder.join(name);
            match fs::remove_file(&path) {
                Err(e) if e.kind() != ErrorKind::NotFound => return Err(Error::file("remove", path, e)),
                _ => {}
            }
        }
        Ok(())
    }
}

/// The files of a cell for an engine.
///
/// # Errors
/// What the engine cannot express, with the reason; for Abaqus and CalculiX, a lattice that is a mechanism as a whole.
pub fn export(cell: &BondedCell, engine: Engine) -> Result<Export> {
    if !matches!(engine, Engine::MatrixMarket | Engine::Numpy) {
        refuse_nodal(cell)?;
    }
    let files = match engine {
        Engine::Lammps => lammps::files(cell),
        Engine::Abaqus => truss::files(cell, truss::Element::Truss)?,
        Engine::Calculix => truss::files(cell, truss::Element::Spring)?,
        Engine::Yade => spheres::files(cell, spheres::YADE),
        Engine::Woo => spheres::files(cell, spheres::WOO),
        Engine::Peridigm(within) => return one_constant::export(cell, one_constant::Program::Peridigm, within),
        Engine::PeriLab(within) => return one_constant::export(cell, one_constant::Program::PeriLab, within),
        Engine::MatrixMarket => arrays::matrix_market(cell)?,
        Engine::Numpy => arrays::numpy(cell),
    };
    let (measured, mechanism) = cell.measured()?;
    let (outputs, warning) = match (engine, mechanism) {
        // Their test prescribes stresses: it has no answer where a strain costs nothing.
        (Engine::Abaqus | Engine::Calculix, Some(mechanism)) if measured.engineering_constants().is_none() => {
            return Err(mechanism);
        }
        (Engine::Abaqus | Engine::Calculix, mechanism) => (vec!["element_test.dat".into()], mechanism),
        (Engine::Numpy, _) => (Vec::new(), None),
        (_, mechanism) => (vec![MEASURED.into()], mechanism),
    };
    Ok(Export { files: with_expected(files, &measured), outputs, warning })
}

/// The files with the tensor that the engine must measure.
fn with_expected(mut files: Vec<ExportFile>, measured: &Stiffness) -> Vec<ExportFile> {
    files.push(("expected.csv".into(), voigt_csv(measured).into_bytes()));
    files
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
        "export to matrix-market or numpy, or make bonds of the central or micropolar model, which are all there is",
    ))
}

/// The refusal of tangential bonds.
fn refuse_tangential(cell: &BondedCell, engine: &str, why: &str) -> Result<()> {
    if cell.bonds.iter().all(|b| b.tangential == 0.0) {
        return Ok(());
    }
    Err(Error::input(
        format!("the bonds have tangential stiffness, which {engine} cannot express: {why}"),
        "export bonds of the central model, or to lammps, yade, woo, matrix-market or numpy",
    ))
}
