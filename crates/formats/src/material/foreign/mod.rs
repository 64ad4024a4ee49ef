//! Stiffnesses in the texts of other programs, known by what stands in them: each with the order and the unit of its format.
//!
//! One file per family of formats; [`FORMATS`] has a line for each. A reader answers `None` where a text is none of its own,
//! and an error where it is and something is wrong or may be read in two ways.

mod cards;
mod comsol;
pub mod figure;
mod grid;
mod lammps;
mod listed;
mod matrix_text;
mod msat;
mod square;
mod thermo_pw;
pub mod thomsen;
mod unit;
mod vasp;

pub(super) use unit::missing as missing_unit;

use super::{Reading, StressUnit};
use crate::tree::Lines;
use anisobond::tensor::{Material, Stiffness};
use anisobond::{Error, Result};

/// Longest text (bytes) in which a matrix is looked for wherever it may stand.
const MOST_SEARCHED: usize = 16 << 20;

/// A text, and what is known beside it.
pub(super) struct Source<'t> {
    pub text: &'t str,
    /// The name of its file, for messages.
    pub place: &'t str,
    /// The unit asked for.
    pub unit: Option<&'t StressUnit>,
}

impl Source<'_> {
    /// Wrong input at a line.
    fn at(&self, line: usize) -> impl Fn(Error) -> Error {
        let place = format!("{}, line {line}", self.place);
        move |e| e.at(&place)
    }

    /// The line of a byte.
    fn line(&self, byte: usize) -> usize {
        Lines::new(self.text).line(byte)
    }
}

/// What a reader found.
pub(super) struct Found {
    pub stiffness: Stiffness,
    /// Empty where the text names nothing.
    pub name: String,
    /// kg/m³.
    pub density: Option<f64>,
    /// Program, what was taken, unit and order.
    pub read_as: String,
}

impl Found {
    fn new(stiffness: Stiffness, read_as: String) -> Self {
        Found { stiffness, name: String::new(), density: None, read_as }
    }
}

type Reader = fn(&Source) -> Option<Result<Found>>;

/// Every format; one that says more of itself stands before one that says less.
const FORMATS: [(&str, Reader); 10] = [
    ("VASP's OUTCAR", vasp::read),
    ("LAMMPS' elastic constants", lammps::read),
    ("cards of Abaqus and CalculiX", cards::abaqus::read),
    ("commands of Ansys", cards::ansys::read),
    ("lists of COMSOL", comsol::read),
    ("Thomsen's parameters", thomsen::read),
    ("rows i j value (MSAT)", msat::read),
    ("thermo_pw's output_el_cons.dat", thermo_pw::read),
    ("a 6×6 matrix, with or without words around it", matrix_text::read),
    ("lines C11 = value", listed::read),
];

/// The material of another program's text; `None` if it is none of the known ones.
pub(super) fn read(source: &Source) -> Option<Result<Reading>> {
    let found = FORMATS.iter().find_map(|(_, read)| read(source))?;
    Some(found.map(|found| Reading {
        material: Material {
            name: found.name,
            stiffness: found.stiffness,
            density: found.density,
            source: String::new(),
        },
        read_as: found.read_as,
        notes: Vec::new(),
    }))
}

/// A text of several materials with the lines of one of them only; `None` where the text has no names of materials.
///
/// # Errors
/// No material of that name, or several.
pub(in super::super) fn of_row(text: &str, row: &str) -> Option<Result<String>> {
    cards::abaqus::only(text, row)
}

/// The formats in words, for messages.
pub(super) fn names() -> String {
    FORMATS.map(|(name, _)| name).join("; ")
}

/// "12 numbers", "1 number".
fn counted(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}
