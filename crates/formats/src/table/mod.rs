//! Tables of many materials: CSV with a header, JSON lists, JSON Lines.
//!
//! A broken row carries its own error and the others go on; what is wrong with the whole file (no rows, missing columns,
//! not UTF-8) is one error.

mod columns;
mod heading;

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::io::Read;
use std::path::Path;

use serde_json::value::RawValue;

use self::columns::Columns;
use self::heading::{Heading, names_constants};
use crate::material::components::component_of;
use crate::material::foreign::figure::figures;
use crate::material::foreign::thomsen::parameter;
use crate::material::record::{id_of, reading_of_record};
use crate::material::shapes::{begins_as_json, rows as rows_of};
use crate::material::{Reading, StressUnit};
use crate::tree::{
    Lines, Node, json_error, json_items, json_line_error, json_node, parse_json, read_text, without_mark,
};
use crate::words::{enumeration, quoted};
use anisobond::tensor::Material;
use anisobond::{Error, Result};

/// The materials of a table, in its order.
#[derive(Debug)]
pub struct Table {
    /// One entry per row, also for rows that are wrong.
    pub rows: Vec<Row>,
}

impl Table {
    /// Identifiers of several rows, each with its lines, in words; none where every row has its own.
    pub fn repeated(&self) -> Vec<String> {
        let mut lines: HashMap<&str, Vec<usize>> = HashMap::new();
        self.rows.iter().for_each(|row| lines.entry(&row.id).or_default().push(row.line));
        let mut said = HashSet::new();
        let several = self.rows.iter().map(|row| row.id.as_str()).filter(|id| lines[id].len() > 1 && said.insert(*id));
        let words = |id: &str| {
            let all = &lines[id];
            let mut shown: Vec<String> = all.iter().take(8).map(usize::to_string).collect();
            if all.len() > shown.len() {
                shown.push("…".into());
            }
            format!("{} rows are called {id}, in lines {}", all.len(), enumeration(&shown))
        };
        several.map(words).collect()
    }
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
    /// What the row was taken for; empty if it is wrong.
    pub read_as: String,
    /// What was made of numbers that are not what they should be to the last digit; empty where nothing was.
    pub notes: Vec<String>,
}

impl Row {
    fn new(id: String, line: usize, reading: Result<Reading>) -> Self {
        match reading {
            Ok(Reading { material, read_as, notes }) => Row { id, line, material: Ok(material), read_as, notes },
            Err(e) => Row { id, line, material: Err(e), read_as: String::new(), notes: Vec::new() },
        }
    }

    /// The material with what it was taken for.
    ///
    /// # Errors
    /// What is wrong with the row.
    pub fn reading(self) -> Result<Reading> {
        self.material.map(|material| Reading { material, read_as: self.read_as, notes: self.notes })
    }
}

/// Whether a file is a table of materials rather than one material: a list or an object of many in JSON, JSON Lines, or
/// lines with a header that names components. A `.csv`, `.tsv`, `.jsonl` or `.ndjson` is one, but for a bare matrix. A file
/// that cannot be read is no table.
pub fn is_table(path: impl AsRef<Path>) -> bool {
    let path = path.as_ref();
    let Ok(start) = start_of(path) else {
        return matches!(Format::of_name(path), Some(Format::Csv | Format::JsonLines));
    };
    match Format::of_name(path) {
        Some(Format::JsonLines) => true,
        Some(Format::Csv) => has_words(&start) || start.trim().is_empty(),
        Some(Format::Json) => is_json_table(path, &start),
        None if start.trim_start().starts_with(['[', '{']) && begins_as_json(&start) => is_json_table(path, &start),
        None => names_components(&start),
    }
}

/// Whether a text is a table of materials rather than one material, by what stands in it.
pub fn is_table_text(text: &str) -> bool {
    let text = without_mark(text);
    match text.trim_start().chars().next() {
        Some('{' | '[') if begins_as_json(text) => match parse_json(text, "") {
            Ok(root) => {
                rows_of(&root).is_some()
                    || root
                        .list()
                        .is_some_and(|list| !list.is_empty() && list.iter().all(|item| !item.entries().is_empty()))
            }
            Err(_) => is_json_lines(text),
        },
        _ => names_components(text),
    }
}

/// The first letters of a file.
fn start_of(path: &Path) -> std::io::Result<String> {
    let mut start = Vec::new();
    std::fs::File::open(path)?.take(1 << 16).read_to_end(&mut start)?;
    Ok(without_mark(&String::from_utf8_lossy(&start)).to_string())
}

/// The first line that is neither empty nor a comment.
fn header_of(text: &str) -> &str {
    text.lines()
        .find(|line| !line.trim().is_empty() && !line.starts_with('#') && !line.starts_with("sep="))
        .unwrap_or("")
}

/// Whether the first line has more than numbers.
fn has_words(text: &str) -> bool {
    figures(header_of(text)).is_none()
}

/// Whether the first line is a header of a table of materials.
fn names_components(text: &str) -> bool {
    let header = header_of(text);
    if header.contains(['=', ':']) || !header.contains([',', ';', '\t']) {
        return false;
    }
    let names: Vec<Heading> = header.split(delimiter(text) as char).map(|text| Heading::of(text.trim())).collect();
    let count = |known: &dyn Fn(&str) -> bool| names.iter().filter(|h| known(&h.name)).count();
    let of_components = count(&|name| component_of(name).is_some()) >= 2;
    of_components || count(&|name| parameter(name).is_some()) >= 4 || names_constants(&names)
}

fn is_json_table(path: &Path, start: &str) -> bool {
    let start = start.trim_start();
    let mut inside = start.chars().skip(1).filter(|c| !c.is_whitespace());
    match (start.chars().next(), inside.next()) {
        (Some('['), Some(c)) => !(c == '[' || c == '-' || c.is_ascii_digit()),
        (Some('['), None) => true,
        (Some('{'), _) => match read_text(path) {
            Ok(text) => match parse_json(&text, "") {
                Ok(root) => rows_of(&root).is_some(),
                Err(_) => is_json_lines(&text),
            },
            Err(_) => false,
        },
        _ => false,
    }
}

/// Whether a text is one JSON object per line.
fn is_json_lines(text: &str) -> bool {
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let object = |line: &str| line.trim_start().starts_with('{') && serde_json::from_str::<&RawValue>(line).is_ok();
    lines.next().is_some_and(object) && lines.next().is_some_and(|line| line.trim_start().starts_with('{'))
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
    let unit = unit.map(StressUnit::named).transpose().map_err(|e| e.at("unit"))?;
    let rows = match Format::of_name(Path::new(place)).unwrap_or_else(|| Format::of_text(text)) {
        Format::Csv => csv_rows(text, place, unit.as_ref()),
        Format::Json if is_json_lines(text) => Ok(json_line_rows(text, place, unit.as_ref())),
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
            Some(b'{') if serde_json::from_str::<&RawValue>(text).is_ok() => Format::Json,
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
        Some(b'{') => {
            let root = json_node(root.get(), &lines).map_err(|e| e.at(place))?;
            if let Some(rows) = rows_of(&root) {
                return Ok(rows
                    .into_iter()
                    .enumerate()
                    .map(|(n, (id, node))| keyed_row(n, id, node, unit, place))
                    .collect());
            }
            return Ok(vec![json_row(0, root.line, Ok(root), unit, place)]);
        }
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
    Row::new(id, line, node.and_then(|node| reading_of_record(&node, unit)).map_err(|e| e.at(place)))
}

/// The row of an object that has an identifier for it; its own counts more, but for the numbers that pandas gives.
fn keyed_row(n: usize, key: Option<String>, node: Node, unit: Option<&StressUnit>, place: &str) -> Row {
    let line = node.line;
    let id = id_of(&node).or(key.clone()).unwrap_or_else(|| (n + 1).to_string());
    let mut reading = reading_of_record(&node, unit).map_err(|e| e.at(place));
    if let (Ok(reading), Some(key)) = (&mut reading, key)
        && reading.material.name.is_empty()
    {
        reading.material.name = key;
    }
    Row::new(id, line, reading)
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
    let text = &*without_separator(text);
    let mut reader = csv_reader(text);
    let lines = Lines::new(text);
    let comma = has_decimal_commas(text);
    let mut columns: Option<Columns> = None;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record
            .map_err(|e| Error::input(format!("the table cannot be read: {e}"), "save it as CSV in UTF-8").at(place))?;
        let line = record.position().map_or(0, |p| first_line(text, &lines, p.byte() as usize));
        match &columns {
            None => {
                columns = Some(Columns::of(&record, unit, comma).map_err(|e| e.at(format!("{place}, line {line}")))?)
            }
            Some(columns) => rows.push(columns.row(&record, rows.len() + 1, line, place)),
        }
    }
    Ok(rows)
}

/// A text whose spreadsheet's line "sep=;" is a comment: it says nothing that the header does not say.
pub fn without_separator(text: &str) -> Cow<'_, str> {
    if text.starts_with("sep=") { Cow::Owned(format!("#{}", &text[1..])) } else { Cow::Borrowed(text) }
}

/// Whether commas are decimal marks in a CSV text, for something else parts its fields.
pub fn has_decimal_commas(text: &str) -> bool {
    delimiter(text) != b','
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
    let header = header_of(text);
    let count = |d: &u8| header.bytes().filter(|b| b == d).count();
    // The last of equals: the comma.
    [b'\t', b';', b','].into_iter().max_by_key(count).unwrap_or(b',')
}
