//! Packings in files: known by what stands in them when they are read, by the ending of their name when they are written.
//!
//! One file per format; `FORMATS` has a line for each. A reader answers `None` where a file is none of its own, and an error where
//! it is and something is wrong or may be read in two ways. Every number is written so that it reads back to the same bits.

mod columns;
mod data;
mod dump;
mod found;
mod list;
mod numbers;
mod pfc;
mod table;
mod vtk_arrays;
mod vtk_legacy;
mod vtk_xml;

use std::path::Path;

use serde::Serialize;

use self::found::Found;
use crate::inputs::read_bytes;
use crate::tree::without_mark;
use crate::units::Dimension;
use crate::words::{quoted, suggestion};
use crate::write_atomically;
use anisobond::lattice::Packing;
use anisobond::{Error, Result};

/// What is known beside a file of spheres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PackingOptions {
    /// Unit of the lengths of a file that names none, as "mm".
    pub length_unit: Option<String>,
    /// Time step of a LAMMPS dump that is read, instead of the last.
    pub frame: Option<u64>,
    /// Radii (m) of the types 1, 2, … of a LAMMPS file that gives none for its atoms; empty: none is known.
    pub type_radii: Vec<f64>,
}

impl PackingOptions {
    /// With the radii of types in words, as "1 mm,2 mm": of type 1, of type 2.
    ///
    /// # Errors
    /// Anything but positive lengths with units.
    pub fn with_type_radii(mut self, words: &str) -> Result<Self> {
        let radius = |word: &str| match Dimension::Length.parse(word)? {
            radius if radius > 0.0 => Ok(radius),
            _ => Err(Error::input(format!("{} is not positive", quoted(word)), "give radii as 1 mm,2 mm")),
        };
        self.type_radii = words.split(',').map(radius).collect::<Result<_>>()?;
        Ok(self)
    }
}

/// A packing, and what its file was taken for.
#[derive(Clone, Debug, PartialEq)]
pub struct PackingReading {
    /// The spheres (m); centres are in the cell, if there is one.
    pub packing: Packing,
    /// Format, what was taken from it, and the unit of lengths.
    pub read_as: String,
    /// Every column or array of the file in its order, and what it was taken for.
    pub columns: Vec<PackingColumn>,
    /// What a reader should know: spheres that were wrapped, a unit that nothing names.
    pub notes: Vec<String>,
    /// Whether lengths were taken to be in m though neither the file, a program's custom nor the options name a unit.
    pub unit_assumed: bool,
}

/// A column or an array of a file of spheres.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PackingColumn {
    /// Its heading, or "column 4".
    pub column: String,
    /// "x", "diameter (mm)", …; "nothing" for one that is not taken.
    pub taken_for: String,
}

impl PackingReading {
    /// The columns in one line: "x as x, d as diameter; not taken: vx".
    pub fn columns_in_words(&self) -> String {
        let (left, taken): (Vec<_>, Vec<_>) = self.columns.iter().partition(|c| c.taken_for == columns::NOTHING);
        let taken: Vec<String> = taken.iter().map(|c| format!("{} as {}", c.column, c.taken_for)).collect();
        let left: Vec<&str> = left.iter().map(|c| c.column.as_str()).collect();
        let left = if left.is_empty() { String::new() } else { format!("; not taken: {}", left.join(", ")) };
        format!("{}{left}", taken.join(", "))
    }
}

/// A file's bytes, its text if it is one, and what is known beside it.
struct Source<'f> {
    bytes: &'f [u8],
    text: std::result::Result<&'f str, std::str::Utf8Error>,
    options: &'f PackingOptions,
}

impl Source<'_> {
    /// The text of a file that is one; none has no lines.
    fn text(&self) -> &str {
        self.text.unwrap_or("")
    }
}

type Reader = fn(&Source) -> Option<Result<Found>>;

/// Every format; one that says more of itself stands before one that says less.
const FORMATS: [(&str, Reader); 7] = [
    ("VTK XML, PolyData or UnstructuredGrid (.vtp, .vtu)", vtk_xml::read),
    ("legacy VTK (.vtk)", vtk_legacy::read),
    ("LAMMPS dumps", dump::read),
    ("LAMMPS data", data::read),
    ("PFC's commands that make balls", pfc::read),
    ("tables with headings such as x,y,z,radius", table::read),
    ("lists of x y z r (Yade, Woo)", list::read),
];

/// How a packing is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PackingFormat {
    /// A first line `##PERIODIC:: a b c` with the edges of the cell (none for a free packing), then `x y z r` per sphere (.txt).
    Text,
    /// A header x,y,z,r; the cell in a comment `# cell: a b c` (.csv).
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
            Error::input(format!("packings are not written to files that end in {}", quoted(&ending)), remedy)
                .at(path.display())
        })
    }
}

/// Reads a packing of any format that names its unit or has one by custom; see [`read_packing_as`].
///
/// # Errors
/// As [`read_packing_as`].
pub fn read_packing(path: impl AsRef<Path>) -> Result<Packing> {
    read_packing_as(path, &PackingOptions::default()).map(|reading| reading.packing)
}

/// Reads a packing, its format known by what stands in the file; centres are wrapped into the cell.
///
/// # Errors
/// A file that cannot be read, or what [`parse_packing`] refuses, with the file's name.
pub fn read_packing_as(path: impl AsRef<Path>, options: &PackingOptions) -> Result<PackingReading> {
    let path = path.as_ref();
    parse_packing(&read_bytes(path)?, options).map_err(|error| error.at(path.display()))
}

/// A packing from the bytes of a file.
///
/// # Errors
/// A file of no known format; numbers that are not finite, radii that are not positive, two spheres at one place, no sphere, with
/// the line; columns that may be read in two ways; lengths without a unit that would be absurd in metres; options for something
/// that the file has not.
pub fn parse_packing(bytes: &[u8], options: &PackingOptions) -> Result<PackingReading> {
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(Error::input("the file is empty", "write the cell in the first line, then x y z r per sphere"));
    }
    let source = Source { bytes, text: std::str::from_utf8(bytes).map(without_mark), options };
    match FORMATS.iter().find_map(|(_, read)| read(&source)) {
        Some(found) => found?.reading(options),
        None => Err(unknown(&source)),
    }
}

/// Why a file is of no format.
fn unknown(source: &Source) -> Error {
    if let Err(e) = source.text {
        let line = 1 + source.bytes[..e.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        return Error::input(
            "the file is not UTF-8 text",
            "save it as UTF-8, without accents or units in another encoding",
        )
        .at(format!("line {line}"));
    }
    Error::input("no spheres are found in the file", format!("known are {}", FORMATS.map(|(name, _)| name).join("; ")))
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
        PackingFormat::Text => list::written(packing),
        PackingFormat::Csv => table::written(packing),
        PackingFormat::Vtp => vtk_xml::written(packing),
        PackingFormat::Lammps => data::written(packing),
    }
}
