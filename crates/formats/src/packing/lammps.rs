//! LAMMPS data files of atom style sphere.

use std::fmt::Write;

use nalgebra::Vector3;

use super::{Spheres, number};
use crate::words::quoted;
use anisobond::lattice::Packing;
use anisobond::{Error, Result};

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

/// An atom: its identifier, and x, y, z, r.
type Atom = (u64, [f64; 4]);

/// What has been read so far.
#[derive(Default)]
struct Reading {
    free: bool,
    atoms_announced: Option<usize>,
    bounds: [Option<(f64, f64)>; 3],
    /// The section whose lines are read: `Atoms` or one that is skipped.
    in_atoms: Option<bool>,
    atoms: Vec<Atom>,
}

/// Atoms are sorted by their identifiers, as LAMMPS writes them in any order.
pub(super) fn parse(text: &str) -> Result<Packing> {
    let mut reading = Reading { free: text.lines().next().unwrap_or("").contains(FREE), ..Reading::default() };
    // The first line is a title, whatever it says.
    for (index, line) in text.lines().enumerate().skip(1) {
        let content = line.split('#').next().unwrap_or("");
        let words: Vec<&str> = content.split_whitespace().collect();
        if !words.is_empty() {
            reading.line(&words, line).map_err(|error| error.at(format!("line {}", index + 1)))?;
        }
    }
    reading.packing()
}

impl Reading {
    fn line(&mut self, words: &[&str], line: &str) -> Result<()> {
        if words[0].starts_with(|c: char| c.is_ascii_alphabetic()) && words[0].parse::<f64>().is_err() {
            return self.section(words[0], line);
        }
        match self.in_atoms {
            Some(true) => {
                self.atoms.push(atom(words)?);
                Ok(())
            }
            Some(false) => Ok(()),
            None => self.header(words),
        }
    }

    /// `Atoms # sphere`, `Velocities`, …
    fn section(&mut self, name: &str, line: &str) -> Result<()> {
        self.in_atoms = Some(name == "Atoms");
        let style = line.split_once('#').map(|(_, style)| style.trim());
        match style {
            Some(style) if name == "Atoms" && style != "sphere" => Err(Error::input(
                format!("the atom style is {}", quoted(style)),
                "write the data with atom_style sphere (id type diameter density x y z)",
            )),
            _ => Ok(()),
        }
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
            _ => {}
        }
        Ok(())
    }

    fn packing(mut self) -> Result<Packing> {
        let announced = self.atoms_announced.unwrap_or(self.atoms.len());
        if announced != self.atoms.len() {
            return Err(Error::input(
                format!("{announced} atoms are announced, {} listed", self.atoms.len()),
                "check whether the file is complete and the section is named Atoms",
            ));
        }
        self.atoms.sort_by_key(|atom| atom.0);
        if let Some(twice) = self.atoms.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err(Error::input(format!("atom {} is listed twice", twice[0].0), "number the atoms from 1"));
        }
        let (low, cell) = self.cell()?;
        let mut spheres = Spheres { cell, ..Spheres::default() };
        for (id, [x, y, z, r]) in self.atoms {
            spheres.push([x - low.x, y - low.y, z - low.z, r]).map_err(|error| error.at(format!("atom {id}")))?;
        }
        spheres.packing()
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
        Ok((low, Some(Vector3::new(x.1, y.1, z.1) - low)))
    }
}

fn refuse_tilt(tilt: [f64; 3]) -> Result<()> {
    if tilt == [0.0; 3] {
        return Ok(());
    }
    Err(Error::input("the box is tilted", "use a rectangular box (change_box … ortho)"))
}

/// `id type diameter density x y z`, then perhaps image numbers.
fn atom(words: &[&str]) -> Result<Atom> {
    let [id, _, diameter, _, x, y, z, ref images @ ..] = *words else {
        return Err(Error::input(
            format!("{} entries of an atom", words.len()),
            "write id type diameter density x y z",
        ));
    };
    if !matches!(images.len(), 0 | 3) {
        return Err(Error::input(
            format!("{} entries of an atom", words.len()),
            "write id type diameter density x y z, and three image numbers or none",
        ));
    }
    let id = id
        .parse()
        .map_err(|_| Error::input(format!("{} is not the number of an atom", quoted(id)), "write a whole number"))?;
    Ok((id, [number(x)?, number(y)?, number(z)?, 0.5 * number(diameter)?]))
}
