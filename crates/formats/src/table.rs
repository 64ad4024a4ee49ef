//! Tables of many materials: CSV with a header, JSON lists, JSON Lines.
//!
//! A broken row carries its own error and the others go on; what is wrong with the whole file (no rows, missing columns,
//! not UTF-8) is one error.

use std::collections::HashSet;
use std::io::Read;
use std::path::Path;

use nalgebra::Matrix6;
use serde_json::value::RawValue;

use crate::csv_text::unguarded;
use crate::material::components::{Component, component_of, name, names};
use crate::material::matrix::refuse_reordered;
use crate::material::record::{id_of, material_of_record};
use crate::material::{StressUnit, check_claim, parse_class, positive_density};
use crate::orientation::parse_orientation;
use crate::tree::{Lines, Node, json_error, json_items, json_line_error, json_node, read_text, without_mark};
use crate::units::{Dimension, split};
use crate::words::{enumeration, nearest, quoted};
use anisobond::tensor::{Material, Stiffness};
use anisobond::{Error, Result};

/// The materials of a table, in its order.
#[derive(Debug)]
pub struct Table {
    /// One entry per row, also for rows that are wrong.
    pub rows: Vec<Row>,
}

/// One row of a table.
#[derive(Debug)]
pub struct Row {
    /// What the row calls itself (material_id, id, name or formula), else its number from 1. Not checked for repetitions.
    pub id: String,
    /// Line in the file, from 1.
    pub line: usize,
    /// The material, or what is wrong with this row (placed with file, line and column name).
    pub material: Result<Material>,
}

/// Whether a file is a table of materials rather than one material: `.csv`, `.tsv`, `.jsonl`, `.ndjson`, or `.json` that
/// begins with a list. A file that cannot be read is no table.
pub fn is_table(path: impl AsRef<Path>) -> bool {
    let path = path.as_ref();
    match Format::of_name(path) {
        Some(Format::Json) => begins_with_list(path).unwrap_or(false),
        Some(_) => true,
        None => false,
    }
}

fn begins_with_list(path: &Path) -> std::io::Result<bool> {
    let mut start = Vec::new();
    std::fs::File::open(path)?.take(4096).read_to_end(&mut start)?;
    let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&start);
    Ok(start.iter().find(|b| !b.is_ascii_whitespace()) == Some(&b'['))
}

/// Reads a table of materials. See [`parse_table`].
///
/// # Errors
/// A file that cannot be read or is not UTF-8, or what [`parse_table`] refuses as a whole.
pub fn read_table(path: impl AsRef<Path>, unit: Option<&str>) -> Result<Table> {
    let path = path.as_ref();
    parse_table(&read_text(path)?, &path.display().to_string(), unit)
}

/// A table from the text of a file; `place` names the file in messages, and its ending says the format (else the first
/// letter does).
///
/// - CSV (comma, semicolon or tab; lines that begin with # are left out): columns c11 … c66 (all 21; any letter case and
///   order; c21 is c12), one of `material_id`, `id`, `name`, `formula` if wanted, `density`. A unit stands in the header:
///   `c11 (MPa)`, `density (g/cm3)`; a density needs one; or in a column `unit`, a unit of stress for each row. `class` is
///   checked, `orientation` ("bunge:10,20,30") turns the row's material, `source` is kept. Other columns pass, but those of
///   another form of the stiffness.
/// - JSON list or JSON Lines: objects of the Materials Project (`elastic_tensor`, with `ieee_format` or `raw`;
///   `elasticity.elastic_tensor`) or with the keys of a material file. `density` is in g/cm³ if a bare number.
///
/// `unit` is that of numbers for which the file names none; without, they are in **GPa** (the Materials Project's).
///
/// # Errors
/// As a whole: an unknown `unit`, or one that contradicts the header; no rows; missing or repeated columns, or those of a second
/// form of the stiffness; a syntax error.
/// Everything else is the error of its row.
pub fn parse_table(text: &str, place: &str, unit: Option<&str>) -> Result<Table> {
    let text = without_mark(text);
    let unit = match unit {
        Some(name) => {
            Some(StressUnit { name: name.trim().into(), size: Dimension::Stress.unit(name).map_err(|e| e.at("unit"))? })
        }
        None => None,
    };
    let rows = match Format::of_name(Path::new(place)).unwrap_or_else(|| Format::of_text(text)) {
        Format::Csv => csv_rows(text, place, unit.as_ref()),
        Format::Json => json_rows(text, place, unit.as_ref()),
        Format::JsonLines => Ok(json_line_rows(text, place, unit.as_ref())),
    }?;
    if rows.is_empty() {
        return Err(Error::input("the table has no rows", "add a line for each material").at(place));
    }
    Ok(Table { rows })
}

#[derive(Clone, Copy)]
enum Format {
    Csv,
    Json,
    JsonLines,
}

impl Format {
    fn of_name(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "csv" | "tsv" => Some(Format::Csv),
            "json" => Some(Format::Json),
            "jsonl" | "ndjson" => Some(Format::JsonLines),
            _ => None,
        }
    }

    fn of_text(text: &str) -> Self {
        match text.trim_start().as_bytes().first() {
            Some(b'[') => Format::Json,
            Some(b'{') => Format::JsonLines,
            _ => Format::Csv,
        }
    }
}

/// Rows of a JSON list; a single object is a list of one.
fn json_rows(text: &str, place: &str, unit: Option<&StressUnit>) -> Result<Vec<Row>> {
    let lines = Lines::new(text);
    let root: &RawValue = serde_json::from_str(text).map_err(|e| json_error(place, &e))?;
    let items = match root.get().as_bytes().first() {
        Some(b'[') => json_items(root.get()).map_err(|e| json_error(place, &e))?,
        Some(b'{') => vec![root],
        _ => {
            return Err(Error::input(
                format!("a list of materials is needed, not {}", quoted(root.get())),
                "write [ { \"material_id\": …, \"elastic_tensor\": … }, … ]",
            )
            .at(place));
        }
    };
    let row = |(n, item): (usize, &&RawValue)| {
        json_row(n, lines.line_of(item.get()), json_node(item.get(), &lines), unit, place)
    };
    Ok(items.iter().enumerate().map(row).collect())
}

/// Rows of JSON Lines: a line that is no JSON is a broken row.
fn json_line_rows(text: &str, place: &str, unit: Option<&StressUnit>) -> Vec<Row> {
    let lines = Lines::new(text);
    let node = |n: usize, line: &str| {
        let raw: &RawValue = serde_json::from_str(line).map_err(|e| json_line_error(n + 1, &e))?;
        // A slice of this very text, so that its place in it is known.
        let start = line.find(raw.get()).unwrap_or(0);
        json_node(&line[start..start + raw.get().len()], &lines)
    };
    let filled = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    filled.enumerate().map(|(row, (n, line))| json_row(row, n + 1, node(n, line), unit, place)).collect()
}

fn json_row(n: usize, line: usize, node: Result<Node>, unit: Option<&StressUnit>, place: &str) -> Row {
    let id = node.as_ref().ok().and_then(id_of).unwrap_or_else(|| (n + 1).to_string());
    let material = node.and_then(|node| material_of_record(&node, unit)).map_err(|e| e.at(place));
    Row { id, line, material }
}

/// A reader of a user's CSV text: any of the usual delimiters, `#` comments, rows of any length.
pub fn csv_reader(text: &str) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new()
        .delimiter(delimiter(text))
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .flexible(true)
        .has_headers(false)
        .from_reader(text.as_bytes())
}

/// Rows of a CSV file.
fn csv_rows(text: &str, place: &str, unit: Option<&StressUnit>) -> Result<Vec<Row>> {
    let mut reader = csv_reader(text);
    let lines = Lines::new(text);
    let mut columns: Option<Columns> = None;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record
            .map_err(|e| Error::input(format!("the table cannot be read: {e}"), "save it as CSV in UTF-8").at(place))?;
        let line = record.position().map_or(0, |p| first_line(text, &lines, p.byte() as usize));
        match &columns {
            None => columns = Some(Columns::of(&record, unit).map_err(|e| e.at(format!("{place}, line {line}")))?),
            Some(columns) => rows.push(columns.row(&record, rows.len() + 1, line, place)),
        }
    }
    Ok(rows)
}

/// Line of the record that begins at a byte or after the empty and comment lines there.
pub fn first_line(text: &str, lines: &Lines, byte: usize) -> usize {
    let mut at = byte.min(text.len());
    for line in text.as_bytes()[at..].split_inclusive(|&b| b == b'\n') {
        if !line.starts_with(b"#") && !line.iter().all(|b| matches!(b, b'\n' | b'\r')) {
            break;
        }
        at += line.len();
    }
    lines.line(at)
}

/// Comma, semicolon or tab: whichever the header has most of.
fn delimiter(text: &str) -> u8 {
    let header = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or("");
    let count = |d: &u8| header.bytes().filter(|b| b == d).count();
    // The last of equals: the comma.
    [b'\t', b';', b','].into_iter().max_by_key(count).unwrap_or(b',')
}

/// Where a CSV table has what.
struct Columns {
    width: usize,
    id: Option<usize>,
    name: Option<usize>,
    unit: Option<usize>,
    /// The unit asked for beside the file.
    asked: Option<StressUnit>,
    order: Option<usize>,
    class: Option<usize>,
    orientation: Option<usize>,
    source: Option<usize>,
    /// (column, unit in Pa) of c11 … c66, and the heading for messages.
    components: Vec<(Component, Column)>,
    density: Option<Column>,
}

struct Column {
    at: usize,
    /// Size of a bare number in SI, where the heading names it.
    unit: Option<f64>,
    heading: String,
}

/// A heading: "C11 (GPa)" is c11 with the unit GPa.
struct Heading<'h> {
    text: &'h str,
    name: String,
    unit: Option<&'h str>,
}

impl<'h> Heading<'h> {
    fn of(text: &'h str) -> Self {
        let (name, unit) = match text.split_once(['(', '[']) {
            Some((name, unit)) => (name, Some(unit.trim_end().trim_end_matches([')', ']']).trim())),
            None => (text, None),
        };
        let mut name = name.trim().to_lowercase().replace([' ', '-'], "_");
        if let Some(component) = component_of(&name) {
            name = self::name(component);
        }
        Heading { text, name, unit: unit.filter(|unit| !unit.is_empty()) }
    }
}

impl Columns {
    /// The columns of a header.
    fn of(header: &csv::StringRecord, unit: Option<&StressUnit>) -> Result<Self> {
        let headings: Vec<Heading> = header.iter().map(Heading::of).collect();
        let mut seen = HashSet::new();
        if let Some(twice) = headings.iter().find(|h| !h.name.is_empty() && !seen.insert(h.name.as_str())) {
            let heading = quoted(twice.text);
            return Err(Error::input(format!("column {heading} is there twice"), "keep one of them"));
        }
        refuse_missing(&headings)?;
        refuse_second_form(&headings)?;
        let find = |name: &str| headings.iter().position(|h| h.name == name);
        let first = |names: &[&str]| names.iter().find_map(|name| find(name));
        let component = |(at, h): (usize, &Heading)| {
            Some(component_of(&h.name)?)
                .map(|c| Ok((c, Column { at, unit: stress_unit(h, unit)?, heading: h.text.into() })))
        };
        let components: Vec<_> = headings.iter().enumerate().filter_map(component).collect::<Result<_>>()?;
        Ok(Columns {
            width: headings.len(),
            id: first(&["material_id", "id", "name", "formula", "formula_pretty"]),
            name: first(&["name", "formula_pretty", "formula", "material_id", "id"]),
            unit: first(&["unit", "units"]),
            asked: unit.cloned(),
            order: find("order"),
            class: find("class"),
            orientation: find("orientation"),
            source: find("source"),
            components,
            density: find("density").map(|at| density_column(at, &headings[at])).transpose()?,
        })
    }

    /// The row of a record.
    fn row(&self, record: &csv::StringRecord, number: usize, line: usize, place: &str) -> Row {
        let text = |at: Option<usize>| at.and_then(|at| record.get(at)).filter(|text| !text.is_empty()).map(unguarded);
        let id = text(self.id).map_or_else(|| number.to_string(), str::to_string);
        let name = text(self.name).unwrap_or(&id).to_string();
        let material = self.material(record, name).map_err(|e| e.at(format!("{place}, line {line}")));
        Row { id, line, material }
    }

    fn material(&self, record: &csv::StringRecord, name: String) -> Result<Material> {
        if record.len() != self.width {
            return Err(Error::input(
                format!("the row has {} fields, the header {}", record.len(), self.width),
                "give every column one field; put quotes around a text with a comma",
            ));
        }
        let text = |at: Option<usize>| at.and_then(|at| record.get(at)).filter(|text| !text.is_empty());
        let bare = self.unit_of(text(self.unit))?;
        if let Some(order) = text(self.order) {
            refuse_reordered(order).map_err(|e| e.at("column order"))?;
        }
        let mut voigt = Matrix6::zeros();
        for ((a, b), column) in &self.components {
            let value = column.value(record, Dimension::Stress, bare)?;
            voigt[(*a, *b)] = value;
            voigt[(*b, *a)] = value;
        }
        let own = Stiffness::from_voigt(&voigt)?;
        let claimed = text(self.class).map(parse_class).transpose().map_err(|e| e.at("column class"))?;
        check_claim(&own, claimed).map_err(|e| e.at("column class"))?;
        let turned = text(self.orientation).map(|text| parse_orientation(text).map(|q| own.rotated(&q)));
        let stiffness = turned.transpose().map_err(|e| e.at("column orientation"))?.unwrap_or(own);
        stiffness.require_positive_definite()?;
        let density = match &self.density {
            Some(column) if record.get(column.at).is_some_and(|text| !text.is_empty()) => {
                let value = column.value(record, Dimension::Density, 1.0)?;
                Some(positive_density(value).map_err(|e| e.at(&column.heading))?)
            }
            _ => None,
        };
        let source = text(self.source).or(text(self.id)).unwrap_or("").to_string();
        Ok(Material { name, stiffness, density, source })
    }

    /// The unit (Pa) of a row's bare stresses: its own, else the one asked for, else GPa.
    fn unit_of(&self, own: Option<&str>) -> Result<f64> {
        let Some(name) = own else {
            return Ok(self.asked.as_ref().map_or(StressUnit::giga_pascal().size, |unit| unit.size));
        };
        let size = Dimension::Stress.unit(name).map_err(|e| e.at("column unit"))?;
        let headed =
            self.components.iter().find_map(|(_, c)| c.unit.filter(|u| *u != size).map(|_| c.heading.as_str()));
        let asked = self.asked.as_ref().filter(|unit| unit.size != size).map(|unit| unit.name.as_str());
        match headed.or(asked) {
            None => Ok(size),
            Some(other) => {
                let problem = format!("the row's unit {} contradicts {}", quoted(name), quoted(other));
                Err(Error::input(problem, "name the unit once, in one place").at("column unit"))
            }
        }
    }
}

impl Column {
    /// The field in SI: a bare number in the column's unit, else in one of size `bare`; or a number with its own.
    fn value(&self, record: &csv::StringRecord, what: Dimension, bare: f64) -> Result<f64> {
        let text = record.get(self.at).unwrap_or("");
        let value = split(text).and_then(|(number, unit)| match unit {
            "" => Ok(number * self.unit.unwrap_or(bare)),
            _ => what.parse(text),
        });
        value.map_err(|e| e.at(format!("column {}", self.heading)))
    }
}

/// Refuses a header without all of c11 … c66.
fn refuse_missing(headings: &[Heading]) -> Result<()> {
    let missing: Vec<String> = names().into_iter().filter(|c| !headings.iter().any(|h| h.name == *c)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let unused: Vec<&str> =
        headings.iter().map(|h| h.text).filter(|text| component_of(&Heading::of(text).name).is_none()).collect();
    let near = missing.iter().find_map(|c| Some((c, nearest(c, unused.iter().copied())?)));
    let remedy = match near {
        Some((c, column)) => format!("is {} meant as {c}?", quoted(column)),
        None => {
            let unused: Vec<String> = unused.iter().take(8).map(|text| quoted(text)).collect();
            format!("name all of c11 … c66 in the first line; other columns there: {}", unused.join(", "))
        }
    };
    let word = if missing.len() == 1 { "column" } else { "columns" };
    Err(Error::input(format!("{word} {} missing", enumeration(&missing)), remedy))
}

/// Refuses a column that would give the stiffness, or turn it, in a way that tables do not have.
fn refuse_second_form(headings: &[Heading]) -> Result<()> {
    let second = ["stiffness", "compliance", "engineering", "axis"];
    match headings.iter().find(|h| second.contains(&h.name.as_str())) {
        None => Ok(()),
        Some(h) => Err(Error::input(
            format!("column {} is not read beside c11 … c66", quoted(h.text)),
            "remove or rename it; orientation (as \"bunge:10,20,30\") turns a row's material",
        )),
    }
}

/// Unit (Pa) that the heading of a column of stresses names.
fn stress_unit(heading: &Heading, asked: Option<&StressUnit>) -> Result<Option<f64>> {
    let own =
        heading.unit.map(|name| Dimension::Stress.unit(name).map_err(|e| e.at(format!("column {}", heading.text))));
    match (own.transpose()?, asked) {
        (Some(own), Some(asked)) if own != asked.size => Err(Error::input(
            format!("column {} contradicts the unit {} asked for", quoted(heading.text), asked.name),
            "leave the unit out: the header names it",
        )),
        (own, _) => Ok(own),
    }
}

fn density_column(at: usize, heading: &Heading) -> Result<Column> {
    let Some(name) = heading.unit else {
        return Err(Error::input("column density has no unit", "name it in the header, as density (g/cm3)"));
    };
    let unit = Dimension::Density.unit(name).map_err(|e| e.at(format!("column {}", heading.text)))?;
    Ok(Column { at, unit: Some(unit), heading: heading.text.to_string() })
}
