//! Tables of spheres with headings: CSV with commas, semicolons or tabs, or blanks between; the heading in the first line or in a
//! comment (`# x y z r`, Yade's `#format x_y_z_r`). The cell in a comment `# cell: a b c` or `##PERIODIC:: a b c`.

use std::fmt::Write;

use nalgebra::Vector3;

use super::Source;
use super::columns::Columns;
use super::found::{Found, Lengths, unit_in_words};
use super::list::{PERIODIC, second_cell};
use super::numbers::{edges, with_comma, words};
use anisobond::lattice::Packing;
use anisobond::{Error, Result};

/// Most lines of words that may stand before the headings.
const MOST_TITLES: usize = 20;

/// What lines of words around the rows say.
#[derive(Default)]
pub(super) struct Preface {
    pub cell: Option<Vector3<f64>>,
    /// Whether the cell is in a `##PERIODIC::` line.
    pub periodic: bool,
    unit: Option<(String, f64)>,
    yade: bool,
}

impl Preface {
    /// Hears a line, which may stand above the first row; whether it was a comment.
    pub fn hear(&mut self, line: &str, above: bool) -> Result<bool> {
        let Some(comment) = comment(line) else { return Ok(false) };
        let cell = match (line.strip_prefix(PERIODIC), comment.split_once(':')) {
            (Some(cell), _) if !above => return Err(second_cell(cell)),
            (Some(cell), _) => {
                self.periodic = true;
                Some(cell)
            }
            (None, Some((name, cell))) if name.trim().eq_ignore_ascii_case("cell") => Some(cell),
            _ => None,
        };
        if let Some(cell) = cell {
            if self.cell.is_some() {
                return Err(second_cell(cell));
            }
            let numbers = cell.split(['(', '[']).next().unwrap_or("");
            self.cell = Some(edges(&words(numbers))?);
        }
        self.yade |= comment.starts_with("format ");
        if above && self.unit.is_none() {
            self.unit = unit_in_words(comment);
        }
        Ok(true)
    }

    /// The unit that a comment names, else a program's.
    pub fn lengths(&self, otherwise: Lengths) -> Lengths {
        match &self.unit {
            Some((name, size)) => Lengths::Named(name.clone(), *size),
            None if self.yade => Lengths::Custom("Yade"),
            None => otherwise,
        }
    }
}

/// The words of a comment.
fn comment(line: &str) -> Option<&str> {
    ["#", "%", "//", "!"]
        .iter()
        .find_map(|mark| line.strip_prefix(mark))
        .map(|rest| rest.trim_start_matches('#').trim())
}

/// What parts the fields of a row.
#[derive(Clone, Copy, PartialEq)]
enum Apart {
    By(char),
    Blanks,
}

impl Apart {
    fn of(line: &str) -> Self {
        ['\t', ';', ','].into_iter().find(|mark| line.contains(*mark)).map_or(Apart::Blanks, Apart::By)
    }

    /// The fields of a line, without quotes.
    fn fields(self, line: &str) -> Vec<String> {
        let Apart::By(mark) = self else {
            return words(line.split('#').next().unwrap_or("")).into_iter().map(String::from).collect();
        };
        let (mut all, mut quoted) = (vec![String::new()], false);
        for c in line.chars() {
            match c {
                '"' => quoted = !quoted,
                c if c == mark && !quoted => all.push(String::new()),
                c => all.last_mut().into_iter().for_each(|field| field.push(c)),
            }
        }
        all.into_iter().map(|field| field.trim().to_string()).collect()
    }

    /// The headings of a line: a unit in brackets belongs to the word before.
    fn headings(self, line: &str) -> Vec<String> {
        let fields = match self {
            Apart::By(_) => return self.fields(line),
            Apart::Blanks => line.split_whitespace(),
        };
        let mut all: Vec<String> = Vec::new();
        for word in fields {
            match all.last_mut() {
                Some(before) if word.starts_with(['(', '[']) => *before = format!("{before} {word}"),
                _ => all.push(word.to_string()),
            }
        }
        all
    }
}

/// The headings of a table, and what parts its rows.
struct Layout {
    /// Line of the headings, from 1; those of a comment are among the lines above.
    line: usize,
    headings: Vec<String>,
    apart: Apart,
}

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    let layout = layout(source.text())?;
    Some(layout.and_then(|layout| spheres(source.text(), &layout)))
}

/// `None` where no line has headings of spheres.
fn layout(text: &str) -> Option<Result<Layout>> {
    let (mut titles, mut above): (usize, Option<Layout>) = (0, None);
    for (n, line) in text.lines().map(str::trim).enumerate() {
        if line.is_empty() || line.starts_with("sep=") || line.starts_with(PERIODIC) {
            continue;
        }
        if let Some(comment) = comment(line) {
            let headings = headings_of(comment);
            if Columns::are_in(&headings) {
                above = Some(Layout { line: n + 1, headings, apart: Apart::Blanks });
            }
            continue;
        }
        let apart = Apart::of(line);
        let fields = apart.headings(line);
        let numbers = words(line.split('#').next().unwrap_or(""));
        if numbers.iter().all(|word| with_comma(word).is_ok()) {
            // A line of three numbers may be the cell; words about columns are a heading where they are as many.
            if numbers.len() == 3 {
                continue;
            }
            return above.filter(|layout| layout.headings.len() == numbers.len()).map(Ok);
        }
        if Columns::are_in(&fields) {
            return Some(Ok(Layout { line: n + 1, headings: fields, apart }));
        }
        let some = fields.iter().filter(|field| super::columns::Role::of(field).is_some()).count();
        if some > 1 && matches!(apart, Apart::By(_)) {
            return Some(Columns::of(&fields).map_err(|e| e.at(format!("line {}", n + 1))).map(|_| Layout {
                line: n + 1,
                headings: fields,
                apart,
            }));
        }
        titles += 1;
        if titles > MOST_TITLES {
            break;
        }
    }
    None
}

/// The names that a comment may give to columns; one unit in brackets is that of all.
fn headings_of(comment: &str) -> Vec<String> {
    if let Some(names) = comment.strip_prefix("format ") {
        return names.trim().split('_').map(String::from).collect();
    }
    let one = comment.matches(['(', '[']).count() == 1;
    let names = if one { comment.split(['(', '[']).next().unwrap_or("") } else { comment };
    Apart::of(names).headings(names)
}

fn spheres(text: &str, layout: &Layout) -> Result<Found> {
    let columns = Columns::of(&layout.headings).map_err(|e| e.at(format!("line {}", layout.line)))?;
    let mut preface = Preface::default();
    let (mut spheres, mut commas): (Vec<(usize, [f64; 4])>, bool) = (Vec::new(), false);
    for (n, line) in text.lines().map(str::trim).enumerate() {
        let heard = |e: Error| e.at(format!("line {}", n + 1));
        let above = spheres.is_empty();
        if line.is_empty() || preface.hear(line, above).map_err(heard)? || n < layout.line {
            continue;
        }
        let fields = layout.apart.fields(line);
        if fields.len() == 3 && above && preface.cell.is_none() && layout.apart == Apart::Blanks {
            let cell: Vec<&str> = fields.iter().map(String::as_str).collect();
            preface.cell = Some(edges(&cell).map_err(heard)?);
            continue;
        }
        if fields.len() != layout.headings.len() {
            let problem = format!("{} entries for {} columns", fields.len(), layout.headings.len());
            return Err(heard(Error::input(problem, "give one entry per column")));
        }
        commas |= layout.apart != Apart::By(',') && columns.centre.iter().any(|c| fields[c.at].contains(','));
        spheres.push((n + 1, columns.sphere(|at| with_comma(&fields[at])).map_err(heard)?));
    }
    let units = columns.units();
    let scale = columns.centre[0].unit.as_ref().map_or(1.0, |unit| unit.1);
    let words = if commas { "table with headings, decimal commas" } else { "table with headings" };
    let lengths = Lengths::of_headings(units, preface.lengths(Lengths::Open));
    let mut found = Found::new(words, lengths);
    found.cell = preface.cell.map(|edges| edges * scale);
    found.columns = columns.said();
    spheres.into_iter().for_each(|(line, sphere)| found.push(line, sphere));
    Ok(found)
}

pub(super) fn written(packing: &Packing) -> String {
    let mut text = String::with_capacity(80 * (packing.len() + 4));
    text.push_str("# Spheres: centre and radius (m)\n");
    if let Some(cell) = packing.cell() {
        let _ = writeln!(text, "# cell: {:?} {:?} {:?}", cell.x, cell.y, cell.z);
    }
    text.push_str("x,y,z,r\n");
    for (x, r) in packing.centres().iter().zip(packing.radii()) {
        let _ = writeln!(text, "{:?},{:?},{:?},{r:?}", x.x, x.y, x.z);
    }
    text
}
