//! A table of x, y, z and r; the cell in a comment.

use std::fmt::Write;

use super::{Spheres, edges, number, words};
use anisobond::lattice::Packing;
use anisobond::{Error, Result};

const COLUMNS: [&str; 4] = ["x", "y", "z", "r"];

pub(super) fn parse(text: &str) -> Result<Packing> {
    let mut spheres = Spheres::default();
    let mut columns: Option<Columns> = None;
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        let done = match (line.strip_prefix('#'), &columns) {
            (Some(comment), _) => comment_of(comment.trim(), &mut spheres),
            _ if line.is_empty() => Ok(()),
            (None, None) => Columns::of(line).map(|found| columns = Some(found)),
            (None, Some(columns)) => columns.row(line).and_then(|row| spheres.push(row)),
        };
        done.map_err(|error| error.at(format!("line {}", index + 1)))?;
    }
    spheres.packing()
}

/// `cell: a b c`; other comments pass.
fn comment_of(comment: &str, spheres: &mut Spheres) -> Result<()> {
    let Some((name, rest)) = comment.split_once(':') else { return Ok(()) };
    if !name.trim().eq_ignore_ascii_case("cell") {
        return Ok(());
    }
    if spheres.cell.is_some() {
        return Err(Error::input("a second cell", "write one comment # cell: a b c"));
    }
    spheres.cell = Some(edges(&words(rest))?);
    Ok(())
}

/// Where the columns are.
struct Columns {
    separator: char,
    width: usize,
    places: [usize; 4],
}

impl Columns {
    fn of(line: &str) -> Result<Self> {
        let separator = [';', '\t'].into_iter().find(|&s| line.contains(s)).unwrap_or(',');
        let unquoted = |name: &str| name.trim().trim_matches('"').to_lowercase();
        let names: Vec<String> = line.split(separator).map(unquoted).collect();
        let mut places = [0; 4];
        for (place, wanted) in places.iter_mut().zip(COLUMNS) {
            let found = names.iter().position(|name| name == wanted || (wanted == "r" && name == "radius"));
            *place = found.ok_or_else(|| {
                Error::input(format!("there is no column \"{wanted}\""), "name the columns x,y,z,r in the first line")
            })?;
        }
        Ok(Columns { separator, width: names.len(), places })
    }

    fn row(&self, line: &str) -> Result<[f64; 4]> {
        let entries: Vec<&str> = line.split(self.separator).map(str::trim).collect();
        if entries.len() != self.width {
            return Err(Error::input(
                format!("{} entries for {} columns", entries.len(), self.width),
                "give one entry per column",
            ));
        }
        let mut row = [0.0; 4];
        for (value, (place, name)) in row.iter_mut().zip(self.places.iter().zip(COLUMNS)) {
            *value = number(entries[*place]).map_err(|error| error.at(format!("column {name}")))?;
        }
        Ok(row)
    }
}

pub(super) fn written(packing: &Packing) -> String {
    let mut text = String::with_capacity(80 * (packing.len() + 4));
    text.push_str("# Spheres: centre and radius (m)\n");
    if let Some(cell) = packing.cell() {
        let _ = writeln!(text, "# cell: {:?} {:?} {:?}", cell.x, cell.y, cell.z);
    }
    let _ = writeln!(text, "{}", COLUMNS.join(","));
    for (x, r) in packing.centres().iter().zip(packing.radii()) {
        let _ = writeln!(text, "{:?},{:?},{:?},{r:?}", x.x, x.y, x.z);
    }
    text
}
