//! Tables of many materials: CSV with a header, JSON lists, JSON Lines.
//!
//! A broken row carries its own error and the others go on; what is wrong with the whole file (no rows, missing columns,
//! not UTF-8) is one error.

use std::collections::{HashMap, HashSet};
use std::io::Read;
use std::path::Path;

use nalgebra::Matrix6;
use serde_json::value::RawValue;

use crate::csv_text::unguarded;
use crate::material::components::{Component, component_of, name, names};
use crate::material::foreign::figure::{Figure, figures, plain_number};
use crate::material::foreign::thomsen::{NAMES as THOMSEN, dimension, parameter, stiffness as thomsen};
use crate::material::keys::nearly;
use crate::material::matrix::refuse_reordered;
use crate::material::record::{id_of, reading_of_record};
use crate::material::shapes::{begins_as_json, rows as rows_of};
use crate::material::{Habits, Reading, StressUnit, check_claim, material_of, parse_class, positive_density};
use crate::orientation::parse_orientation;
use crate::tree::{
    Entry, Kind, Lines, Node, json_error, json_items, json_line_error, json_node, parse_json, read_text, without_mark,
};
use crate::units::{Dimension, split};
use crate::words::{enumeration, nearest, quoted};
use anisobond::tensor::{Material, Stiffness, SymmetryClass};
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
}

impl Row {
    fn new(id: String, line: usize, reading: Result<Reading>) -> Self {
        match reading {
            Ok(Reading { material, read_as }) => Row { id, line, material: Ok(material), read_as },
            Err(e) => Row { id, line, material: Err(e), read_as: String::new() },
        }
    }

    /// The material with what it was taken for.
    ///
    /// # Errors
    /// What is wrong with the row.
    pub fn reading(self) -> Result<Reading> {
        self.material.map(|material| Reading { material, read_as: self.read_as })
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
    count(&|name| component_of(name).is_some()) >= 2 || count(&|name| parameter(name).is_some()) >= 4
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
    // A spreadsheet's line "sep=;" says nothing that the header does not say.
    let marked = text.starts_with("sep=").then(|| format!("#{}", &text[1..]));
    let text = marked.as_deref().unwrap_or(text);
    let mut reader = csv_reader(text);
    let lines = Lines::new(text);
    let comma = delimiter(text) != b',';
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
    /// Thomsen's parameters in the order of their names, if these are given instead of components.
    thomsen: Option<Vec<Column>>,
    /// Whether a comma is a decimal mark.
    comma: bool,
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
    fn of(header: &csv::StringRecord, unit: Option<&StressUnit>, comma: bool) -> Result<Self> {
        let headings: Vec<Heading> = header.iter().map(Heading::of).collect();
        let mut seen = HashSet::new();
        if let Some(twice) = headings.iter().find(|h| !h.name.is_empty() && !seen.insert(h.name.as_str())) {
            let heading = quoted(twice.text);
            return Err(Error::input(format!("column {heading} is there twice"), "keep one of them"));
        }
        let thomsen = thomsen_columns(&headings)?;
        if thomsen.is_none() {
            refuse_missing(&headings)?;
        }
        refuse_second_form(&headings)?;
        refuse_near(&headings)?;
        let find = |name: &str| headings.iter().position(|h| h.name == name);
        let first = |names: &[&str]| names.iter().find_map(|name| find(name));
        let component = |(at, h): (usize, &Heading)| {
            Some(component_of(&h.name)?)
                .map(|c| Ok((c, Column { at, unit: stress_unit(h, unit)?, heading: h.text.into() })))
        };
        let components: Vec<_> = headings.iter().enumerate().filter_map(component).collect::<Result<_>>()?;
        refuse_half_named(&components, unit, first(&["unit", "units"]))?;
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
            density: match thomsen {
                Some(_) => None,
                None => find("density").map(|at| density_column(at, &headings[at])).transpose()?,
            },
            thomsen,
            comma,
        })
    }

    /// The row of a record.
    fn row(&self, record: &csv::StringRecord, number: usize, line: usize, place: &str) -> Row {
        let text = |at: Option<usize>| at.and_then(|at| record.get(at)).filter(|text| !text.is_empty()).map(unguarded);
        let id = text(self.id).map_or_else(|| number.to_string(), str::to_string);
        let name = text(self.name).unwrap_or(&id).to_string();
        let reading = self.reading(record, name).map_err(|e| e.at(format!("{place}, line {line}")));
        Row::new(id, line, reading)
    }

    fn reading(&self, record: &csv::StringRecord, name: String) -> Result<Reading> {
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
        let claimed = text(self.class).map(parse_class).transpose().map_err(|e| e.at("column class"))?;
        let (own, what) = match &self.thomsen {
            Some(columns) => (self.of_thomsen(record, columns)?, "Thomsen's parameters".to_string()),
            None => self.own(record, &bare, claimed)?,
        };
        check_claim(&own, claimed).map_err(|e| e.at("column class"))?;
        let turned = text(self.orientation).map(|text| parse_orientation(text).map(|q| own.rotated(&q)));
        let stiffness = turned.transpose().map_err(|e| e.at("column orientation"))?.unwrap_or(own);
        stiffness.require_positive_definite()?;
        let density = match &self.density {
            Some(column) if record.get(column.at).is_some_and(|text| !text.is_empty()) => {
                let value = column.value(record, Dimension::Density, 1.0, self.comma)?;
                Some(positive_density(value).map_err(|e| e.at(&column.heading))?)
            }
            _ => match &self.thomsen {
                Some(columns) => Some(columns[2].value(record, Dimension::Density, 1.0, self.comma)?),
                None => None,
            },
        };
        let source = text(self.source).or(text(self.id)).unwrap_or("").to_string();
        Ok(Reading {
            material: Material { name, stiffness, density, source },
            read_as: format!("row of a table, {what}"),
        })
    }

    /// The stiffness of the components of a row: all 21, or as many as its class or orthotropy needs.
    fn own(
        &self,
        record: &csv::StringRecord,
        bare: &StressUnit,
        class: Option<SymmetryClass>,
    ) -> Result<(Stiffness, String)> {
        let filled = |column: &Column| record.get(column.at).is_some_and(|text| !text.is_empty());
        let all = self.components.len() == 21 && (class.is_none() || self.components.iter().all(|(_, c)| filled(c)));
        let value = |column: &Column| column.value(record, Dimension::Stress, bare.size, self.comma);
        let headed = self.components.iter().any(|(_, c)| c.unit.is_some());
        let unit = if headed { "units as the header has them".to_string() } else { bare.name.clone() };
        if all {
            let mut voigt = Matrix6::zeros();
            for ((a, b), column) in &self.components {
                let value = value(column)?;
                voigt[(*a, *b)] = value;
                voigt[(*b, *a)] = value;
            }
            return Ok((Stiffness::from_voigt(&voigt)?, format!("c11 … c66, {unit}, order 11 22 33 23 13 12")));
        }
        let mut entries = Vec::new();
        for (component, column) in self.components.iter().filter(|(_, column)| filled(column)) {
            let kind = Kind::Number(value(column)? / bare.size);
            entries.push(Entry { key: name(*component), line: 0, value: Node { kind, line: 0 } });
        }
        if let Some(class) = class {
            let value = Node { kind: Kind::Text(class.name().into()), line: 0 };
            entries.push(Entry { key: "class".into(), line: 0, value });
        }
        let habits = Habits { unit: Some(bare.clone()), ..Habits::default() };
        let count = entries.len() - usize::from(class.is_some());
        let table = Node { kind: Kind::Table(entries), line: 0 };
        let stiffness = material_of(&table, &habits).map_err(of_row)?.stiffness;
        let of_class = class.map_or(", others zero".into(), |class| format!(", class {}", class.name()));
        Ok((stiffness, format!("{count} constants by name{of_class}, {unit}, order 11 22 33 23 13 12")))
    }

    fn of_thomsen(&self, record: &csv::StringRecord, columns: &[Column]) -> Result<Stiffness> {
        let mut values = [0.0; 6];
        for (n, (value, column)) in values.iter_mut().zip(columns).enumerate() {
            *value = match dimension(n) {
                Some(dimension) => column.value(record, dimension, 1.0, self.comma)?,
                None => column.plain(record, self.comma)?,
            };
        }
        thomsen(values)
    }

    /// The unit of a row's bare stresses: its own, else the one asked for, else GPa.
    fn unit_of(&self, own: Option<&str>) -> Result<StressUnit> {
        let Some(name) = own else {
            return Ok(self.asked.clone().unwrap_or_else(StressUnit::giga_pascal));
        };
        let size = Dimension::Stress.unit(name).map_err(|e| e.at("column unit"))?;
        let headed =
            self.components.iter().find_map(|(_, c)| c.unit.filter(|u| *u != size).map(|_| c.heading.as_str()));
        let asked = self.asked.as_ref().filter(|unit| unit.size != size).map(|unit| unit.name.as_str());
        match headed.or(asked) {
            None => Ok(StressUnit { name: name.trim().into(), size }),
            Some(other) => {
                let problem = format!("the row's unit {} contradicts {}", quoted(name), quoted(other));
                Err(Error::input(problem, "name the unit once, in one place").at("column unit"))
            }
        }
    }
}

impl Column {
    /// The field in SI: a bare number in the column's unit, else in one of size `bare`; or a number with its own.
    fn value(&self, record: &csv::StringRecord, what: Dimension, bare: f64, comma: bool) -> Result<f64> {
        let text = record.get(self.at).unwrap_or("");
        let pointed = if comma { text.replace(',', ".") } else { text.to_string() };
        let plain = plain_number(&pointed);
        let value = match Figure::of(&plain) {
            Some(figure) => what.bounded(figure.value * self.unit.unwrap_or(bare), text),
            None => split(&plain).and_then(|(number, unit)| match unit {
                "" => Ok(number * self.unit.unwrap_or(bare)),
                _ => what.parse(&plain),
            }),
        };
        value.map_err(|e| e.at(format!("column {}", self.heading)))
    }

    /// A number without unit.
    fn plain(&self, record: &csv::StringRecord, comma: bool) -> Result<f64> {
        let text = record.get(self.at).unwrap_or("");
        number(text, comma).ok_or_else(|| {
            Error::input(format!("{} is not a finite number", quoted(text)), "write a plain number")
                .at(format!("column {}", self.heading))
        })
    }
}

/// A bare number, its decimal mark a comma where that parts no columns.
fn number(text: &str, comma: bool) -> Option<f64> {
    let text = if comma { text.replace(',', ".") } else { text.to_string() };
    Figure::of(&text).map(|figure| figure.value)
}

/// An error of a row's components: a row has no lines of its own.
fn of_row(e: Error) -> Error {
    match e {
        Error::Failure { kind, problem, remedy, .. } => Error::Failure { kind, place: String::new(), problem, remedy },
        other => other,
    }
}

/// Refuses a header without all of c11 … c66, but where a class says what the others are, or the nine of orthotropy are all.
fn refuse_missing(headings: &[Heading]) -> Result<()> {
    let has = |name: &str| headings.iter().any(|h| h.name == name);
    let missing: Vec<String> = names().into_iter().filter(|c| !has(c)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let unused: Vec<&str> =
        headings.iter().map(|h| h.text).filter(|text| component_of(&Heading::of(text).name).is_none()).collect();
    let unknown = unused.iter().copied().filter(|text| Heading::of(text).name.starts_with('c') && !has_meaning(text));
    let near = missing.iter().find_map(|c| Some((c, nearest(c, unknown.clone())?)));
    let given = 21 - missing.len();
    let nine = ["c11", "c22", "c33", "c12", "c13", "c23", "c44", "c55", "c66"];
    let enough = (has("class") && given >= 2) || (given == 9 && nine.iter().all(|c| has(c)));
    if enough && near.is_none() {
        return Ok(());
    }
    let remedy = match near {
        Some((c, column)) => format!("is {} meant as {c}?", quoted(column)),
        None => {
            let unused: Vec<String> = unused.iter().take(8).map(|text| quoted(text)).collect();
            format!(
                "name all of c11 … c66 in the first line, or those that a column class needs; other columns there: {}",
                unused.join(", ")
            )
        }
    };
    let word = if missing.len() == 1 { "column" } else { "columns" };
    Err(Error::input(format!("{word} {} missing", enumeration(&missing)), remedy))
}

/// Whether a heading is one that tables have for something else than components.
fn has_meaning(text: &str) -> bool {
    ["class", "compliance", "comment"].contains(&Heading::of(text).name.as_str())
}

/// The columns of Thomsen's parameters, if there are any of speeds and no components.
fn thomsen_columns(headings: &[Heading]) -> Result<Option<Vec<Column>>> {
    let find = |n: usize| headings.iter().position(|h| parameter(&h.name) == Some(n));
    if headings.iter().any(|h| component_of(&h.name).is_some()) || find(0).is_none() || find(1).is_none() {
        return Ok(None);
    }
    let column = |n: usize| {
        let Some(at) = find(n) else {
            let problem = format!("column {} missing of Thomsen's parameters", THOMSEN[n][0]);
            return Err(Error::input(problem, "give Vp, Vs, density, epsilon, delta and gamma"));
        };
        let heading = &headings[at];
        let unit = match (dimension(n), heading.unit) {
            (Some(dimension), Some(unit)) => {
                Some(dimension.unit(unit).map_err(|e| e.at(format!("column {}", heading.text)))?)
            }
            (Some(dimension), None) => {
                let remedy = format!("name it in the header, as {} ({})", heading.text, dimension.usual());
                return Err(Error::input(format!("column {} has no unit", quoted(heading.text)), remedy));
            }
            (None, _) => None,
        };
        Ok(Column { at, unit, heading: heading.text.to_string() })
    };
    (0..6).map(column).collect::<Result<_>>().map(Some)
}

/// Refuses a table of few constants of which some name a unit that is not the usual one, and some none.
fn refuse_half_named(
    components: &[(Component, Column)],
    asked: Option<&StressUnit>,
    column: Option<usize>,
) -> Result<()> {
    let odd = components.iter().find(|(_, c)| c.unit.is_some_and(|unit| unit != StressUnit::giga_pascal().size));
    let bare = components.iter().find(|(_, c)| c.unit.is_none());
    match (odd, bare) {
        (Some((_, odd)), Some((_, bare))) if components.len() < 21 && asked.is_none() && column.is_none() => {
            let (odd, bare) = (quoted(&odd.heading), quoted(&bare.heading));
            let problem = format!("{bare} may have the unit of {odd}, or GPa as tables have where none is named");
            Err(Error::input(problem, "name the unit in every heading, or in a column unit"))
        }
        _ => Ok(()),
    }
}

/// Refuses a column whose name is nearly one that counts.
fn refuse_near(headings: &[Heading]) -> Result<()> {
    match headings.iter().find_map(|h| Some((h, nearly(&h.name)?))) {
        None => Ok(()),
        Some((h, known)) => Err(Error::input(
            format!("unknown column {}", quoted(h.text)),
            format!("did you mean {known}? Rename or remove it"),
        )),
    }
}

/// Refuses a column that would give the stiffness, or turn it, in a way that tables do not have.
fn refuse_second_form(headings: &[Heading]) -> Result<()> {
    let second = ["stiffness", "compliance", "engineering", "axis", "elastic_tensor"];
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
