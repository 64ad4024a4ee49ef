//! LAMMPS data files of the atom styles sphere, bpm/sphere and, with radii of the types given beside them, atomic, bond and
//! molecular.

use std::fmt::Write;

use nalgebra::Vector3;

use super::dump::{lengths_of_style, of_type};
use super::found::{Found, Lengths};
use super::numbers::number;
use super::{PackingColumn, PackingOptions, Source};
use crate::words::quoted;
use anisobond::lattice::Packing;
use anisobond::{Error, Result, Wording};

/// In the first line of a file whose box is no periodic cell; the words of LAMMPS's own command.
const FREE: &str = "boundary f f f";

/// Density written where a packing has none (kg/m³).
const DENSITY: f64 = 1.0;

const BOUNDS: [&str; 3] = ["xlo", "ylo", "zlo"];

pub(super) fn written(packing: &Packing) -> String {
    let mut file = String::with_capacity(100 * packing.len() + 500);
    let boundary = if packing.cell().is_some() { "boundary p p p" } else { FREE };
    let _ = writeln!(file, "Packing of spheres by anisobond, SI units, {boundary}\n");
    let _ = writeln!(file, "{} atoms\n1 atom types\n", packing.len());
    let (low, high) = bounds(packing);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let _ = writeln!(file, "{:?} {:?} {name}lo {name}hi", low[axis], high[axis]);
    }
    file.push_str("\nAtoms # sphere\n\n");
    for (i, (x, r)) in packing.centres().iter().zip(packing.radii()).enumerate() {
        let _ = writeln!(file, "{} 1 {:?} {DENSITY:?} {:?} {:?} {:?}", i + 1, 2.0 * r, x.x, x.y, x.z);
    }
    file
}

/// The cell, or the box around the spheres of a free packing.
fn bounds(packing: &Packing) -> (Vector3<f64>, Vector3<f64>) {
    if let Some(cell) = packing.cell() {
        return (Vector3::zeros(), cell);
    }
    let spheres = || packing.centres().iter().zip(packing.radii());
    let low = spheres().fold(Vector3::repeat(f64::INFINITY), |low, (x, r)| low.inf(&x.add_scalar(-r)));
    let high = spheres().fold(Vector3::repeat(f64::NEG_INFINITY), |high, (x, r)| high.sup(&x.add_scalar(*r)));
    (low, high)
}

/// An atom style: its name, and the columns of its atoms.
struct Style {
    name: &'static str,
    columns: &'static [&'static str],
}

const STYLES: [Style; 5] = [
    Style { name: "sphere", columns: &["id", "type", "diameter", "density", "x", "y", "z"] },
    Style { name: "bpm/sphere", columns: &["id", "molecule", "type", "diameter", "density", "x", "y", "z"] },
    Style { name: "atomic", columns: &["id", "type", "x", "y", "z"] },
    Style { name: "bond", columns: &["id", "molecule", "type", "x", "y", "z"] },
    Style { name: "molecular", columns: &["id", "molecule", "type", "x", "y", "z"] },
];

impl Style {
    fn at(&self, column: &str) -> Option<usize> {
        self.columns.iter().position(|name| *name == column)
    }

    /// The style that a file names, or sphere for atoms that have its number of entries.
    fn of(named: Option<&str>, entries: usize) -> Result<&'static Self> {
        let known = STYLES.iter().map(|style| style.name).collect::<Vec<_>>().join(", ");
        let Some(named) = named else {
            return match entries {
                7 | 10 => Ok(&STYLES[0]),
                _ => Err(Error::input(
                    format!("{entries} entries of an atom, and no atom style is named"),
                    "write id type diameter density x y z, or name the style, as Atoms # bpm/sphere",
                )),
            };
        };
        STYLES.iter().find(|style| style.name == named).ok_or_else(|| {
            let remedy = match named.starts_with("hybrid") {
                true => "write the data with one style, as atom_style sphere: a hybrid's columns are not told apart"
                    .to_string(),
                false => {
                    format!("write the data with atom_style sphere (id type diameter density x y z); known are {known}")
                }
            };
            Error::input(format!("the atom style is {}", quoted(named)), remedy)
        })
    }

    fn said(&self) -> Vec<PackingColumn> {
        let radius = if self.at("diameter").is_some() { "" } else { "type" };
        let taken = |name: &str| match name {
            "x" | "y" | "z" | "diameter" => name.to_string(),
            "type" if radius == "type" => "type, for its radius".into(),
            _ => super::columns::NOTHING.into(),
        };
        self.columns.iter().map(|name| PackingColumn { column: (*name).into(), taken_for: taken(name) }).collect()
    }
}

/// An atom: its identifier, its line, and x, y, z, r.
type Atom = (u64, usize, [f64; 4]);

/// What has been read so far.
struct Reading<'o> {
    options: &'o PackingOptions,
    free: bool,
    atoms_announced: Option<usize>,
    bounds: [Option<(f64, f64)>; 3],
    /// The section whose lines are read: `Atoms` or one that is skipped.
    in_atoms: Option<bool>,
    named_style: Option<String>,
    style: Option<&'static Style>,
    atoms: Vec<Atom>,
}

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    let mut counts = source.text().lines().skip(1).take(200).map(|line| line.split('#').next().unwrap_or(""));
    let of_atoms = |line: &str| matches!(line.split_whitespace().collect::<Vec<_>>()[..], [count, "atoms"] if count.parse::<u64>().is_ok());
    let section = || source.text().lines().skip(1).any(|line| line.split_whitespace().next() == Some("Atoms"));
    (counts.any(of_atoms) || section()).then(|| data(source.text(), source.options))
}

/// Atoms are sorted by their identifiers, as LAMMPS writes them in any order.
fn data(text: &str, options: &PackingOptions) -> Result<Found> {
    let title = text.lines().next().unwrap_or("");
    let mut reading = Reading {
        options,
        free: title.contains(FREE),
        atoms_announced: None,
        bounds: [None; 3],
        in_atoms: None,
        named_style: None,
        style: None,
        atoms: Vec::new(),
    };
    // The first line is a title, whatever it says.
    for (index, line) in text.lines().enumerate().skip(1) {
        let content = line.split('#').next().unwrap_or("");
        let words: Vec<&str> = content.split_whitespace().collect();
        if !words.is_empty() {
            reading.line(&words, line, index + 1).map_err(|error| error.at(format!("line {}", index + 1)))?;
        }
    }
    reading.found(lengths(title))
}

/// The unit that a title names: "units = si", or "SI units".
fn lengths(title: &str) -> Lengths {
    match title.split_once("units = ") {
        Some((_, style)) => lengths_of_style(style.trim().trim_end_matches(',')),
        None if title.contains("SI units") => lengths_of_style("si"),
        None => Lengths::Open,
    }
}

impl Reading<'_> {
    fn line(&mut self, words: &[&str], line: &str, number_of_line: usize) -> Result<()> {
        if words[0].starts_with(|c: char| c.is_ascii_alphabetic()) && words[0].parse::<f64>().is_err() {
            return self.section(words[0], line);
        }
        match self.in_atoms {
            Some(true) => self.atom(words, number_of_line),
            Some(false) => Ok(()),
            None => self.header(words),
        }
    }

    /// `Atoms # sphere`, `Velocities`, …
    fn section(&mut self, name: &str, line: &str) -> Result<()> {
        self.in_atoms = Some(name == "Atoms");
        if name == "Atoms" {
            self.named_style =
                line.split_once('#').map(|(_, style)| style.trim().to_string()).filter(|s| !s.is_empty());
            self.style = self.named_style.as_deref().map(|named| Style::of(Some(named), 0)).transpose()?;
        }
        Ok(())
    }

    /// `2556 atoms`, `0 1 xlo xhi`; other counts pass.
    fn header(&mut self, words: &[&str]) -> Result<()> {
        match *words {
            [count, "atoms"] => {
                let count = count.parse().map_err(|_| {
                    Error::input(format!("{} is not a number of atoms", quoted(count)), "write a whole number")
                })?;
                self.atoms_announced = Some(count);
            }
            [low, high, low_name, _] => {
                if let Some(axis) = BOUNDS.iter().position(|name| *name == low_name) {
                    self.bounds[axis] = Some((number(low)?, number(high)?));
                }
            }
            [xy, xz, yz, "xy", "xz", "yz"] => refuse_tilt([number(xy)?, number(xz)?, number(yz)?])?,
            [.., "avec" | "bvec" | "cvec"] => {
                return Err(Error::input("the box is a general triclinic one", "use a rectangular box (xlo xhi …)"));
            }
            _ => {}
        }
        Ok(())
    }

    /// The columns of the style, then perhaps image numbers.
    fn atom(&mut self, words: &[&str], line: usize) -> Result<()> {
        let style = match self.style {
            Some(style) => style,
            None => *self.style.insert(Style::of(None, words.len())?),
        };
        let columns = style.columns;
        if words.len() != columns.len() && words.len() != columns.len() + 3 {
            return Err(Error::input(
                format!("{} entries of an atom", words.len()),
                format!("write {}, and three image numbers or none", columns.join(" ")),
            ));
        }
        let id = words[0].parse().map_err(|_| {
            Error::input(format!("{} is not the number of an atom", quoted(words[0])), "write a whole number")
        })?;
        let word = |column: &str| style.at(column).map_or("", |at| words[at]);
        let radius = match style.at("diameter") {
            Some(at) => 0.5 * number(words[at])?,
            None if self.options.type_radii.is_empty() => {
                return Err(Error::input(
                    format!("atoms of the style {} have no diameter", style.name),
                    Wording::from("write the data with atom_style sphere, or give the radii of the types with ")
                        .choice("type_radii", "1 mm,2 mm"),
                ));
            }
            None => of_type(word("type"), self.options)?,
        };
        self.atoms.push((id, line, [number(word("x"))?, number(word("y"))?, number(word("z"))?, radius]));
        Ok(())
    }

    fn found(mut self, lengths: Lengths) -> Result<Found> {
        let announced = self.atoms_announced.unwrap_or(self.atoms.len());
        if announced != self.atoms.len() {
            return Err(Error::input(
                format!("{announced} atoms are announced, {} listed", self.atoms.len()),
                "check whether the file is complete and the section is named Atoms",
            ));
        }
        self.atoms.sort_by_key(|atom| atom.0);
        if let Some(twice) = self.atoms.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let error = Error::input(format!("atom {} is listed twice", twice[0].0), "number the atoms from 1");
            return Err(error.at(format!("line {}", twice[1].1)));
        }
        let (low, cell) = self.cell()?;
        let style = self.style.unwrap_or(&STYLES[0]);
        let named = if self.named_style.is_some() { "" } else { ", as seven numbers of an atom are mostly meant" };
        let own_radii = style.at("diameter").is_none();
        let of_types = if own_radii { ", radii by type, as given" } else { "" };
        let boundary = if cell.is_some() { "the box taken as the periodic cell" } else { "box that is not periodic" };
        let format = format!("LAMMPS data, atom style {}{named}{of_types}, {boundary}", style.name);
        let mut found = Found::new(format, lengths);
        (found.cell, found.corner, found.columns) = (cell, low, style.said());
        (found.types, found.own_radii) = (own_radii, own_radii);
        self.atoms.into_iter().for_each(|(_, line, sphere)| found.push(line, sphere));
        Ok(found)
    }

    /// The box's lower corner, and its edges if it is periodic.
    fn cell(&self) -> Result<(Vector3<f64>, Option<Vector3<f64>>)> {
        if self.free {
            return Ok((Vector3::zeros(), None));
        }
        let [Some(x), Some(y), Some(z)] = self.bounds else {
            return Err(Error::input(
                "the bounds of the box are missing",
                "write lines such as 0 1 xlo xhi before Atoms",
            ));
        };
        let low = Vector3::new(x.0, y.0, z.0);
        let edges = Vector3::new(x.1, y.1, z.1) - low;
        if edges.min() <= 0.0 {
            let problem = format!("the box is {} × {} × {}", edges.x, edges.y, edges.z);
            return Err(Error::input(problem, "give bounds of which the second is the larger"));
        }
        Ok((low, Some(edges)))
    }
}

fn refuse_tilt(tilt: [f64; 3]) -> Result<()> {
    if tilt == [0.0; 3] {
        return Ok(());
    }
    Err(Error::input(
        "the box is tilted (triclinic), and the cell of a packing is rectangular",
        "use an orthogonal box (change_box all ortho, where the tilt is zero)",
    ))
}
