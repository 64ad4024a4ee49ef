//! Packings in files: text, CSV, VTK and LAMMPS data. Lengths are in metres in all of them.
//!
//! Every number is written so that it reads back to the same bits.

mod csv;
mod lammps;
mod text;
mod vtp;

use std::path::Path;

use nalgebra::Vector3;

use crate::tree::{read_text, without_mark};
use crate::words::{quoted, suggestion};
use crate::write_atomically;
use anisobond::lattice::Packing;
use anisobond::{Error, Result};

/// How a packing stands in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PackingFormat {
    /// A first line `##PERIODIC:: a b c` with the edges of the cell (or just `a b c`; none for a free packing), then
    /// `x y z r` per sphere, separated by blanks, commas or semicolons; `#` begins a comment (.txt).
    Text,
    /// A header with x, y, z and r (or radius) in any order, other columns pass; the cell in a comment `# cell: a b c`
    /// (.csv).
    Csv,
    /// VTK XML PolyData in text with the point data `radius` and the field data `cell` (.vtp).
    Vtp,
    /// LAMMPS data of atom style sphere: `id type diameter density x y z`; the box is the cell, unless the first line
    /// contains `boundary f f f` (.data, .lmp).
    Lammps,
}

/// Endings of file names and what they mean.
const ENDINGS: [(&str, PackingFormat); 5] = [
    ("txt", PackingFormat::Text),
    ("csv", PackingFormat::Csv),
    ("vtp", PackingFormat::Vtp),
    ("data", PackingFormat::Lammps),
    ("lmp", PackingFormat::Lammps),
];

impl PackingFormat {
    /// The format that a file's ending means.
    ///
    /// # Errors
    /// No ending or an unknown one.
    pub fn of_name(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        ENDINGS.iter().find(|(name, _)| *name == ending).map(|&(_, format)| format).ok_or_else(|| {
            let remedy = suggestion(&ending, &ENDINGS.map(|(name, _)| name));
            Error::input(format!("packings are not kept in files that end in {}", quoted(&ending)), remedy)
                .at(path.display())
        })
    }
}

/// Reads a packing, in the format that the file's ending means; centres are wrapped into the cell.
///
/// # Errors
/// A file that cannot be read, an unknown ending, or what [`parse_packing`] refuses, with the file's name.
pub fn read_packing(path: impl AsRef<Path>) -> Result<Packing> {
    let path = path.as_ref();
    let format = PackingFormat::of_name(path)?;
    parse_packing(&read_text(path)?, format).map_err(|error| error.at(path.display()))
}

/// A packing from the text of a file.
///
/// # Errors
/// Text that is not of the format, numbers that are not finite, radii that are not positive, no sphere; with the line.
pub fn parse_packing(text: &str, format: PackingFormat) -> Result<Packing> {
    let text = without_mark(text);
    if text.trim().is_empty() {
        return Err(Error::input("the file is empty", "write the cell in the first line, then x y z r per sphere"));
    }
    match format {
        PackingFormat::Text => text::parse(text),
        PackingFormat::Csv => csv::parse(text),
        PackingFormat::Vtp => vtp::parse(text),
        PackingFormat::Lammps => lammps::parse(text),
    }
}

/// Writes a packing in the format that the file's ending means, whole or not at all.
///
/// # Errors
/// An unknown ending; a file that cannot be written.
pub fn write_packing(path: impl AsRef<Path>, packing: &Packing) -> Result<()> {
    let format = PackingFormat::of_name(&path)?;
    write_atomically(path, packing_text(packing, format))
}

/// The text of a packing's file.
pub fn packing_text(packing: &Packing, format: PackingFormat) -> String {
    match format {
        PackingFormat::Text => text::written(packing),
        PackingFormat::Csv => csv::written(packing),
        PackingFormat::Vtp => vtp::written(packing),
        PackingFormat::Lammps => lammps::written(packing),
    }
}

/// Spheres as they are read.
#[derive(Default)]
struct Spheres {
    cell: Option<Vector3<f64>>,
    centres: Vec<Vector3<f64>>,
    radii: Vec<f64>,
}

impl Spheres {
    fn push(&mut self, [x, y, z, radius]: [f64; 4]) -> Result<()> {
        if radius <= 0.0 {
            return Err(Error::input(
                format!("sphere {} has radius {radius} m", self.radii.len() + 1),
                "give positive radii, or leave the sphere out",
            ));
        }
        self.centres.push(Vector3::new(x, y, z));
        self.radii.push(radius);
        Ok(())
    }

    fn packing(self) -> Result<Packing> {
        Packing::new(self.cell, self.centres, self.radii)
    }
}

/// A finite number.
fn number(word: &str) -> Result<f64> {
    match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(Error::input(format!("{} is not a finite number", quoted(word)), "write a plain number such as 0.03")),
    }
}

/// The edges of a cell.
fn edges(words: &[&str]) -> Result<Vector3<f64>> {
    let [a, b, c] = words else {
        return Err(Error::input(
            format!("the cell has {} numbers", words.len()),
            "give the three edges of a rectangular cell",
        ));
    };
    let edges = Vector3::new(number(a)?, number(b)?, number(c)?);
    if edges.min() > 0.0 {
        return Ok(edges);
    }
    Err(Error::input(format!("the cell's edges are {a} {b} {c} m"), "give three positive lengths"))
}

/// Words between blanks, commas and semicolons.
fn words(line: &str) -> Vec<&str> {
    line.split([' ', '\t', ',', ';']).map(str::trim).filter(|word| !word.is_empty()).collect()
}
