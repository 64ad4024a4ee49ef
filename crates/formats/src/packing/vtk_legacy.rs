//! Legacy VTK files (`# vtk DataFile`), in text or binary: points of POLYDATA or UNSTRUCTURED_GRID with their point data.

use super::Source;
use super::found::{Found, unit_in_words};
use super::numbers::{edges, number};
use super::vtk_arrays::{Arrays, numbers, width};
use crate::words::quoted;
use anisobond::{Error, Result};

/// Data sets whose points may be spheres.
const SETS: [&str; 2] = ["POLYDATA", "UNSTRUCTURED_GRID"];

/// Most names of arrays that are kept, for messages.
const MOST_ARRAYS: usize = 256;

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    source.bytes.trim_ascii_start().starts_with(b"# vtk DataFile").then(|| file(source.bytes))
}

/// Bytes that are read from their start on.
struct Cursor<'f> {
    bytes: &'f [u8],
    at: usize,
    binary: bool,
}

impl<'f> Cursor<'f> {
    /// The next line, without its end.
    fn line(&mut self) -> Option<String> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let end = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        self.at += (end + 1).min(rest.len());
        Some(String::from_utf8_lossy(&rest[..end]).trim().to_string())
    }

    /// The next word of a text.
    fn word(&mut self) -> Option<&'f str> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let end = rest[start..].iter().position(u8::is_ascii_whitespace).map_or(rest.len(), |n| start + n);
        self.at += end;
        std::str::from_utf8(&rest[start..end]).ok()
    }

    /// As many numbers of a kind.
    fn numbers(&mut self, count: usize, kind: &str) -> Result<Vec<f64>> {
        let cut = || Error::input("the numbers end before all are there", "is the file cut off?");
        if self.binary {
            let bytes =
                count.checked_mul(width(kind)?).and_then(|size| self.bytes.get(self.at..self.at.checked_add(size)?));
            let bytes = bytes.ok_or_else(cut)?;
            self.at += bytes.len();
            return numbers(bytes, kind, true);
        }
        // Numbers take at least two bytes each.
        if count > self.bytes.len() {
            return Err(cut());
        }
        (0..count).map(|_| self.word().ok_or_else(cut).and_then(number)).collect()
    }
}

fn file(bytes: &[u8]) -> Result<Found> {
    let mut cursor = Cursor { bytes, at: 0, binary: false };
    cursor.line();
    let title = cursor.line().unwrap_or_default();
    let way = cursor.line().unwrap_or_default().to_uppercase();
    cursor.binary = match way.as_str() {
        "ASCII" => false,
        "BINARY" => true,
        _ => {
            return Err(Error::input(
                format!("{} is neither ASCII nor BINARY", quoted(&way)),
                "write the third line of a VTK file",
            )
            .at("line 3"));
        }
    };
    let mut arrays = Arrays { unit: unit_in_words(&title), ..Arrays::default() };
    let (mut set, mut points, mut of_points) = (String::new(), 0usize, false);
    loop {
        let begins = cursor.at;
        let Some(line) = cursor.line() else { break };
        let words: Vec<&str> = line.split_whitespace().collect();
        let at = |e: Error| e.at(format!("{} at byte {begins}", words.first().unwrap_or(&"")));
        let count = |n: usize| words.get(n).and_then(|word| word.parse::<usize>().ok()).unwrap_or(0);
        let word = |n: usize| words.get(n).copied().unwrap_or("");
        match word(0).to_uppercase().as_str() {
            "DATASET" => {
                set = word(1).to_uppercase();
                if !SETS.contains(&set.as_str()) {
                    return Err(Error::input(
                        format!("the data set is {}", quoted(&set)),
                        "save the spheres as POLYDATA or UNSTRUCTURED_GRID",
                    ));
                }
            }
            "POINTS" => {
                points = count(1);
                let numbers = points.checked_mul(3).map(|n| cursor.numbers(n, &word(2).to_lowercase()));
                arrays.points = numbers
                    .unwrap_or_else(|| Err(Error::input("too many points", "is the file damaged?")))
                    .map_err(at)?;
            }
            "POINT_DATA" => of_points = true,
            "CELL_DATA" => of_points = false,
            "SCALARS" => {
                let each = words.get(3).and_then(|n| n.parse::<usize>().ok()).unwrap_or(1);
                let before = cursor.at;
                if !cursor.line().is_some_and(|line| line.to_uppercase().starts_with("LOOKUP_TABLE")) {
                    cursor.at = before;
                }
                let total = if of_points { points.saturating_mul(each) } else { continue };
                let values = cursor.numbers(total, &word(2).to_lowercase()).map_err(at)?;
                keep(&mut arrays, word(1), values);
            }
            "VECTORS" | "NORMALS" if of_points => {
                let values = cursor.numbers(points.saturating_mul(3), &word(2).to_lowercase()).map_err(at)?;
                keep(&mut arrays, word(1), values);
            }
            "FIELD" => field(&mut cursor, &mut arrays, count(2), of_points).map_err(at)?,
            _ => {}
        }
    }
    let way = if cursor.binary { "binary" } else { "text" };
    arrays.found(&format!("legacy VTK, {set} in {way}"))
}

/// Arrays of a `FIELD`: of the points, or of the file, where `cell` may be.
fn field(cursor: &mut Cursor, arrays: &mut Arrays, count: usize, of_points: bool) -> Result<()> {
    for _ in 0..count {
        let line = loop {
            match cursor.line() {
                None => {
                    return Err(Error::input("the arrays of FIELD end before all are there", "is the file cut off?"));
                }
                Some(line) if line.is_empty() => {}
                // What newer files say of an array before.
                Some(line) if line.starts_with("METADATA") => {
                    while cursor.line().is_some_and(|line| !line.is_empty()) {}
                }
                Some(line) => break line,
            }
        };
        let words: Vec<&str> = line.split_whitespace().collect();
        let [name, each, tuples, kind] = words[..] else {
            return Err(Error::input(
                format!("{} is no array of FIELD", quoted(&line)),
                "write name, components, tuples and type",
            ));
        };
        let total = each.parse::<usize>().ok().zip(tuples.parse::<usize>().ok()).and_then(|(a, b)| a.checked_mul(b));
        let total = total
            .ok_or_else(|| Error::input(format!("{} is no array of FIELD", quoted(&line)), "write whole numbers"))?;
        let values = cursor.numbers(total, &kind.to_lowercase())?;
        if of_points {
            keep(arrays, name, values);
        } else if name == "cell" {
            let words: Vec<String> = values.iter().map(|x| format!("{x:?}")).collect();
            arrays.cell = Some(edges(&words.iter().map(String::as_str).collect::<Vec<_>>())?);
        }
    }
    Ok(())
}

fn keep(arrays: &mut Arrays, name: &str, values: Vec<f64>) {
    if arrays.data.len() < MOST_ARRAYS {
        // Blanks in names are written as %20.
        arrays.data.push((name.replace("%20", " "), values));
    }
}
