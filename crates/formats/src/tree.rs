//! What a TOML or JSON file says, as one tree whose every value knows its line.

use std::collections::HashSet;
use std::path::Path;

use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;
use toml::de::{DeTable, DeValue};

use crate::inputs::read_bytes;
use crate::words::quoted;
use anisobond::{Error, Result, Wording};

/// Deepest nesting of lists and tables that is read.
const DEPTH: usize = 40;

/// A value and where it stands.
#[derive(Clone, Debug)]
pub struct Node {
    /// What it is.
    pub kind: Kind,
    /// Line in its file, from 1; 0 where a flag of the command line gave it.
    pub line: usize,
}

/// What a value is.
#[derive(Clone, Debug)]
pub enum Kind {
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
    /// Values in order.
    List(Vec<Node>),
    /// Entries in order.
    Table(Vec<Entry>),
    /// JSON's null: counts as not given.
    Null,
    /// true or false.
    Truth(bool),
    /// A kind no key expects (date), in words.
    Other(&'static str),
}

/// `key = value`.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The key.
    pub key: String,
    /// Line of the key, from 1; 0 where a flag of the command line gave it.
    pub line: usize,
    /// The value.
    pub value: Node,
}

impl Node {
    /// Wrong input at this value, under the key it was given for.
    pub fn wrong(&self, key: &str, problem: impl Into<String>, remedy: impl Into<Wording>) -> Error {
        Error::input(problem, remedy).at(place(self.line, key))
    }

    /// The entry of a key; `None` where absent or null, or if this is no table.
    pub fn get(&self, key: &str) -> Option<&Entry> {
        self.entries().iter().find(|e| e.key == key)
    }

    /// The entries that are not null; none if this is no table.
    pub fn entries(&self) -> &[Entry] {
        match &self.kind {
            Kind::Table(entries) => entries,
            _ => &[],
        }
    }

    /// The values of a list; `None` if this is no list.
    pub fn list(&self) -> Option<&[Node]> {
        match &self.kind {
            Kind::List(items) => Some(items),
            _ => None,
        }
    }

    /// The text of a text.
    pub fn text(&self, key: &str) -> Result<&str> {
        match &self.kind {
            Kind::Text(text) => Ok(text),
            _ => Err(self.wrong(
                key,
                format!("a text is needed, not {}", self.described()),
                format!("put it in quotes: {key} = \"…\""),
            )),
        }
    }

    /// A finite number without unit.
    pub fn number(&self, key: &str) -> Result<f64> {
        match self.kind {
            Kind::Number(value) if value.is_finite() => Ok(value),
            _ => Err(self.wrong(
                key,
                format!("a finite number is needed, not {}", self.described()),
                "write a plain number, without unit or quotes",
            )),
        }
    }

    /// The value as JSON.
    pub fn json(&self) -> serde_json::Value {
        match &self.kind {
            Kind::Number(value) => serde_json::json!(value),
            Kind::Text(text) => text.as_str().into(),
            Kind::List(items) => items.iter().map(Node::json).collect(),
            Kind::Table(entries) => {
                let pairs = entries.iter().map(|e| (e.key.clone(), e.value.json()));
                serde_json::Value::Object(pairs.collect())
            }
            Kind::Truth(truth) => (*truth).into(),
            Kind::Null | Kind::Other(_) => serde_json::Value::Null,
        }
    }

    /// The value in the words of a message.
    pub fn described(&self) -> String {
        match &self.kind {
            Kind::Number(value) => format!("{value}"),
            Kind::Text(text) => quoted(text),
            Kind::List(items) => format!("a list of {}", items.len()),
            Kind::Table(entries) if entries.is_empty() => "an empty table".into(),
            Kind::Table(_) => "a table".into(),
            Kind::Null => "null".into(),
            Kind::Truth(_) => "a truth value".into(),
            Kind::Other(words) => (*words).into(),
        }
    }
}

/// "line 3, c11"; "--set c11" where a flag gave the value.
pub fn place(line: usize, key: &str) -> String {
    if line == 0 { format!("--set {key}") } else { format!("line {line}, {key}") }
}

/// A file's whole text: UTF-8, its byte order mark removed.
///
/// # Errors
/// A file that cannot be read, or that is not UTF-8 (with the line).
pub fn read_text(path: &Path) -> Result<String> {
    let bytes = read_bytes(path)?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let good = &e.as_bytes()[..e.utf8_error().valid_up_to()];
        let line = 1 + good.iter().filter(|&&b| b == b'\n').count();
        Error::input("the file is not UTF-8 text", "save it as UTF-8, without accents or units in another encoding")
            .at(format!("{}, line {line}", path.display()))
    })?;
    Ok(without_mark(&text).to_string())
}

/// Text without the byte order mark some editors put first.
pub fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

/// Where the lines of a text begin.
pub struct Lines<'t> {
    text: &'t str,
    starts: Vec<usize>,
}

impl<'t> Lines<'t> {
    /// Of a text.
    pub fn new(text: &'t str) -> Self {
        let ends = text.bytes().enumerate().filter(|&(_, b)| b == b'\n');
        Lines { text, starts: std::iter::once(0).chain(ends.map(|(n, _)| n + 1)).collect() }
    }

    /// Line of a byte, from 1.
    pub fn line(&self, byte: usize) -> usize {
        self.starts.partition_point(|&start| start <= byte)
    }

    /// Column of a byte in its line, in characters from 1.
    fn column(&self, byte: usize) -> usize {
        let start = self.starts[self.line(byte) - 1];
        1 + self.text.char_indices().skip_while(|&(n, _)| n < start).take_while(|&(n, _)| n < byte).count()
    }

    /// Line of a piece of this very text.
    pub fn line_of(&self, piece: &str) -> usize {
        self.line((piece.as_ptr() as usize).saturating_sub(self.text.as_ptr() as usize))
    }
}

/// A TOML document as a table.
///
/// # Errors
/// The first syntax error, placed as file:line:column.
pub fn parse_toml(text: &str, file: &str) -> Result<Node> {
    let lines = Lines::new(text);
    let document = DeTable::parse(text).map_err(|e| {
        let at = e.span().map_or(0, |span| span.start).min(text.len());
        let message = e.message().lines().map(str::trim).collect::<Vec<_>>().join(", ");
        Error::input(format!("this is not TOML: {message}"), "correct the file at that place").at(format!(
            "{file}:{}:{}",
            lines.line(at),
            lines.column(at)
        ))
    })?;
    Ok(Node { line: 1, kind: Kind::Table(toml_entries(document.get_ref(), &lines)) })
}

/// Entries of a TOML table in the order of the file.
fn toml_entries(table: &DeTable<'_>, lines: &Lines) -> Vec<Entry> {
    let mut entries: Vec<(usize, Entry)> = table
        .iter()
        .map(|(key, value)| {
            let start = key.span().start;
            let value = toml_node(value.get_ref(), lines.line(value.span().start), lines);
            (start, Entry { key: key.get_ref().to_string(), line: lines.line(start), value })
        })
        .collect();
    entries.sort_by_key(|(start, _)| *start);
    entries.into_iter().map(|(_, entry)| entry).collect()
}

fn toml_node(value: &DeValue<'_>, line: usize, lines: &Lines) -> Node {
    let kind = match value {
        DeValue::String(text) => Kind::Text(text.to_string()),
        DeValue::Integer(n) if n.radix() == 10 => Kind::Number(n.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Integer(n) => {
            Kind::Number(i64::from_str_radix(n.as_str(), n.radix()).map_or(f64::NAN, |value| value as f64))
        }
        DeValue::Float(x) => Kind::Number(x.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(truth) => Kind::Truth(*truth),
        DeValue::Datetime(_) => Kind::Other("a date"),
        DeValue::Array(items) => {
            Kind::List(items.iter().map(|v| toml_node(v.get_ref(), lines.line(v.span().start), lines)).collect())
        }
        DeValue::Table(table) => Kind::Table(toml_entries(table, lines)),
    };
    Node { kind, line }
}

/// A JSON document as a tree.
///
/// # Errors
/// The first syntax error, placed as file:line:column; nesting deeper than 40.
pub(super) fn parse_json(text: &str, file: &str) -> Result<Node> {
    let raw: &RawValue = serde_json::from_str(text).map_err(|e| json_error(file, &e))?;
    json_node(raw.get(), &Lines::new(text)).map_err(|e| e.at(file))
}

/// A syntax error of a whole file.
pub(super) fn json_error(file: &str, e: &serde_json::Error) -> Error {
    Error::input(json_problem(e), JSON_REMEDY).at(format!("{file}:{}:{}", e.line(), e.column()))
}

/// A syntax error of one line of a file.
pub(super) fn json_line_error(line: usize, e: &serde_json::Error) -> Error {
    Error::input(json_problem(e), JSON_REMEDY).at(format!("line {line}, column {}", e.column()))
}

const JSON_REMEDY: &str = "correct the file at that place (JSON has no NaN: write null)";

fn json_problem(e: &serde_json::Error) -> String {
    let message = e.to_string();
    let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(words, _)| words);
    format!("this is not JSON: {message}")
}

/// The tree of one JSON value that is a piece of the text of `lines`.
pub(super) fn json_node(raw: &str, lines: &Lines) -> Result<Node> {
    json_at_depth(raw, lines, 0)
}

fn json_at_depth(raw: &str, lines: &Lines, depth: usize) -> Result<Node> {
    let line = lines.line_of(raw);
    let wrong = |message: &str| Error::input(message, JSON_REMEDY).at(format!("line {line}"));
    if depth > DEPTH {
        return Err(Error::input("lists and tables are nested too deep", format!("nest at most {DEPTH}"))
            .at(format!("line {line}")));
    }
    let unreadable = |e: serde_json::Error| wrong(&format!("this is not JSON: {e}"));
    let kind = match raw.as_bytes().first() {
        Some(b'[') => {
            let items = json_items(raw).map_err(unreadable)?;
            let items = items.into_iter().map(|v| json_at_depth(v.get(), lines, depth + 1));
            Kind::List(items.collect::<Result<_>>()?)
        }
        Some(b'{') => {
            let mut entries: Vec<Entry> = Vec::new();
            let mut seen = HashSet::new();
            for (key, value) in json_pairs(raw).map_err(unreadable)? {
                let value = json_at_depth(value.get(), lines, depth + 1)?;
                if !seen.insert(key.clone()) {
                    return Err(value.wrong(&key, "the key is given twice", "keep one of them"));
                }
                if !matches!(value.kind, Kind::Null) {
                    entries.push(Entry { key, line: value.line, value });
                }
            }
            Kind::Table(entries)
        }
        Some(b'"') => Kind::Text(serde_json::from_str(raw).map_err(unreadable)?),
        Some(b't' | b'f') => Kind::Truth(raw == "true"),
        Some(b'n') => Kind::Null,
        _ => Kind::Number(raw.parse().map_err(|_| wrong(&format!("{} is no number", quoted(raw))))?),
    };
    Ok(Node { kind, line })
}

/// The pieces of a JSON list.
pub(super) fn json_items(raw: &str) -> serde_json::Result<Vec<&RawValue>> {
    serde_json::from_str(raw)
}

/// The keys and pieces of a JSON object, in order, with repetitions.
fn json_pairs(raw: &str) -> serde_json::Result<Vec<(String, &RawValue)>> {
    struct Pairs;
    impl<'de> Visitor<'de> for Pairs {
        type Value = Vec<(String, &'de RawValue)>;
        fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
            f.write_str("an object")
        }
        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Self::Value, A::Error> {
            let mut pairs = Vec::new();
            while let Some(pair) = map.next_entry()? {
                pairs.push(pair);
            }
            Ok(pairs)
        }
    }
    serde_json::Deserializer::from_str(raw).deserialize_map(Pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_languages_know_their_lines() {
        let toml = parse_toml("a = 1\n\nb = [\n  2,\n  0x10]\n[t]\nc = 'x'", "f").unwrap();
        let json =
            parse_json("{\"a\": 1,\n\n\"b\": [\n 2,\n 16],\n\"t\": {\n\"c\": \"x\", \"d\": null}}", "f").unwrap();
        for tree in [toml, json] {
            let b = tree.get("b").unwrap();
            assert_eq!((b.line, b.value.list().unwrap()[1].line), (3, 5));
            assert_eq!(b.value.list().unwrap()[1].number("b").unwrap(), 16.0);
            let t = &tree.get("t").unwrap().value;
            assert_eq!((t.get("c").unwrap().line, t.get("d").is_none()), (7, true));
        }
    }

    #[test]
    fn syntax_errors_are_placed() {
        let toml = parse_toml("a = 1\nb = [1 2]\n", "f.toml").unwrap_err().to_string();
        assert!(toml.starts_with("f.toml:2:6: this is not TOML"), "{toml}");
        let json = parse_json("{\"a\": 1,\n\"b\": [1 2]}", "f.json").unwrap_err().to_string();
        assert!(json.starts_with("f.json:2:9: this is not JSON"), "{json}");
        assert!(parse_json("{\"a\":1,\n\"a\":2}", "f").unwrap_err().to_string().contains("f, line 2, a: the key is"));
        let deep = "[".repeat(100_000) + &"]".repeat(100_000);
        assert!(parse_json(&deep, "f").unwrap_err().to_string().contains("too deep"));
        assert!(parse_toml(&format!("a = {deep}"), "f").is_err());
    }
}
