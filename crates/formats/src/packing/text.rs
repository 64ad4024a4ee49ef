//! `##PERIODIC:: a b c`, then `x y z r` per sphere.

use std::fmt::Write;

use nalgebra::Vector3;

use super::{Spheres, edges, number, words};
use anisobond::lattice::Packing;
use anisobond::{Error, Result};

const PERIODIC: &str = "##PERIODIC::";

pub(super) fn parse(text: &str) -> Result<Packing> {
    let mut spheres = Spheres::default();
    for (index, line) in text.lines().enumerate() {
        line_of(line.trim(), &mut spheres).map_err(|error| error.at(format!("line {}", index + 1)))?;
    }
    spheres.packing()
}

fn line_of(line: &str, spheres: &mut Spheres) -> Result<()> {
    if let Some(cell) = line.strip_prefix(PERIODIC) {
        return set_cell(&words(cell), spheres);
    }
    let numbers = words(line.split('#').next().unwrap_or(""));
    match numbers[..] {
        [] => Ok(()),
        [_, _, _] if spheres.cell.is_none() && spheres.radii.is_empty() => set_cell(&numbers, spheres),
        [x, y, z, r] => spheres.push([number(x)?, number(y)?, number(z)?, number(r)?]),
        _ => Err(Error::input(
            format!("{} numbers where x y z r are expected", numbers.len()),
            "write one sphere per line: its centre and its radius (m)",
        )),
    }
}

fn set_cell(words: &[&str], spheres: &mut Spheres) -> Result<()> {
    if spheres.cell.is_some() || !spheres.radii.is_empty() {
        return Err(Error::input("a second or late cell", "write the cell once, in the first line"));
    }
    let cell: Vector3<f64> = edges(words)?;
    spheres.cell = Some(cell);
    Ok(())
}

pub(super) fn written(packing: &Packing) -> String {
    let mut text = String::with_capacity(80 * (packing.len() + 1));
    if let Some(cell) = packing.cell() {
        let _ = writeln!(text, "{PERIODIC} {:?} {:?} {:?}", cell.x, cell.y, cell.z);
    }
    for (x, r) in packing.centres().iter().zip(packing.radii()) {
        let _ = writeln!(text, "{:?} {:?} {:?} {r:?}", x.x, x.y, x.z);
    }
    text
}
