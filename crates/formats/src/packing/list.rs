//! Lists of numbers without headings: x y z r per line, as Yade and Woo write them, or a number of the sphere before.

use std::fmt::Write;

use super::columns::{NOTHING, said};
use super::found::{Found, Lengths};
use super::numbers::{edges, with_comma, words};
use super::table::Preface;
use super::{PackingColumn, Source};
use crate::words::quoted;
use anisobond::lattice::Packing;
use anisobond::{Error, Result};

/// Before the edges of the cell.
pub(super) const PERIODIC: &str = "##PERIODIC::";

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    let text = source.text();
    let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'))?;
    let numbers = words(first.split('#').next().unwrap_or(""));
    let begins = numbers.len() > 2 && numbers.iter().take(2).all(|word| with_comma(word).is_ok());
    begins.then(|| spheres(text))
}

/// The rows of a list, all as wide as the first.
#[derive(Default)]
struct Rows {
    width: usize,
    numbers: Vec<f64>,
    lines: Vec<usize>,
    /// Whether the first of each is written as a whole number.
    whole: bool,
    commas: bool,
}

impl Rows {
    fn push(&mut self, words: &[&str], line: usize) -> Result<()> {
        if self.lines.is_empty() {
            self.whole = true;
            self.width = words.len();
        }
        if !(4..=5).contains(&words.len()) || words.len() != self.width {
            let problem = format!("{} numbers where x y z r are expected", words.len());
            return Err(Error::input(
                problem,
                "write one sphere per line: its centre and its radius; or name the columns in the first line",
            ));
        }
        self.whole &= words[0].bytes().all(|b| b.is_ascii_digit());
        self.commas |= words.iter().any(|word| word.contains(','));
        for word in words {
            self.numbers.push(with_comma(word)?);
        }
        self.lines.push(line);
        Ok(())
    }

    fn rows(&self) -> impl Iterator<Item = (usize, &[f64])> {
        self.lines.iter().copied().zip(self.numbers.chunks_exact(self.width.max(1)))
    }

    /// Whether the first numbers are 0, 1, 2, … or 1, 2, 3, …
    fn counts(&self) -> bool {
        let start = self.numbers.first().copied().unwrap_or(f64::NAN);
        let counted = |(n, (_, row)): (usize, (usize, &[f64]))| row[0] == start + n as f64;
        self.whole && (start == 0.0 || start == 1.0) && self.lines.len() > 3 && self.rows().enumerate().all(counted)
    }

    /// Where x, y, z and r stand.
    fn begins(&self) -> Result<usize> {
        let heading = "write the heading as the first line, as # x y z r or # id x y z r";
        match (self.width, self.counts()) {
            (4, true) => Err(Error::input(
                "the first numbers count the lines: this may be x y z r, or number x y z without a radius",
                heading,
            )),
            (5, true) => Ok(1),
            (5, false) => Err(Error::input(
                "five numbers per line may be x y z r and one more, or a number before x y z r",
                heading,
            )),
            _ => Ok(0),
        }
    }
}

fn spheres(text: &str) -> Result<Found> {
    let (mut rows, mut preface) = (Rows::default(), Preface::default());
    for (n, line) in text.lines().enumerate() {
        let line = line.trim();
        let heard = |e: Error| e.at(format!("line {}", n + 1));
        if preface.hear(line, rows.lines.is_empty()).map_err(heard)? {
            continue;
        }
        let content = words(line.split('#').next().unwrap_or(""));
        match content[..] {
            [] => {}
            [_, _, _] if rows.lines.is_empty() && preface.cell.is_none() => {
                preface.cell = Some(edges(&content).map_err(heard)?);
            }
            _ => rows.push(&content, n + 1).map_err(heard)?,
        }
    }
    let begins = rows.begins()?;
    let own = if preface.periodic { Lengths::Custom("Woo and Yade") } else { Lengths::Open };
    let cell = if preface.periodic { ", the cell in ##PERIODIC::" } else { "" };
    let commas = if rows.commas { ", decimal commas" } else { "" };
    let mut found = Found::new(format!("list of x y z r{cell}{commas}"), preface.lengths(own));
    found.cell = preface.cell;
    let headings: Vec<String> = (1..=rows.width).map(|n| format!("column {n}")).collect();
    let taken = |at: usize| Some(["x", "y", "z", "r"].get(at.checked_sub(begins)?)?.to_string());
    found.columns = said(&headings, taken);
    if begins == 1 {
        found.columns[0] =
            PackingColumn { column: "column 1".into(), taken_for: format!("{NOTHING}: it counts the lines") };
    }
    found.columns.iter_mut().filter(|c| c.taken_for == "r").for_each(|c| c.taken_for = "radius".into());
    for (line, row) in rows.rows() {
        found.push(line, [row[begins], row[begins + 1], row[begins + 2], row[begins + 3]]);
    }
    Ok(found)
}

/// Wrong input at the cell of a `##PERIODIC::` line.
pub(super) fn second_cell(line: &str) -> Error {
    Error::input(format!("a second or late cell {}", quoted(line)), "write the cell once, in the first line")
}

pub(super) fn written(packing: &Packing) -> String {
    let mut text = String::with_capacity(80 * (packing.len() + 1));
    match packing.cell() {
        Some(cell) => {
            let _ = writeln!(text, "{PERIODIC} {:?} {:?} {:?}", cell.x, cell.y, cell.z);
        }
        None => text.push_str("# x y z r (m)\n"),
    }
    for (x, r) in packing.centres().iter().zip(packing.radii()) {
        let _ = writeln!(text, "{:?} {:?} {:?} {r:?}", x.x, x.y, x.z);
    }
    text
}
