//! The shapes in which JSON holds one tensor or many materials.

use std::collections::HashMap;

use super::matrix::full;
use super::record::{is_record, names_a_tensor};
use crate::tree::{Entry, Kind, Node};

/// Whether a text begins as JSON does, and not as a TOML table's heading.
pub fn begins_as_json(text: &str) -> bool {
    let text = text.trim_start();
    let inner = text.trim_start_matches(|c: char| c == '[' || c.is_whitespace());
    text.starts_with('{')
        || (text.starts_with('[')
            && inner.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.' | '{' | ']')))
}

/// Whether a node holds all 3×3×3×3 components.
pub(super) fn is_full(node: &Node) -> bool {
    full(node).is_some()
}

/// Whether a node is a list of the components of one tensor: 6×6, a triangle, 21, 36 or 3×3×3×3 numbers.
pub fn is_tensor(node: &Node) -> bool {
    let Some(items) = node.list() else { return false };
    let plain = |node: &Node| matches!(node.kind, Kind::Number(_) | Kind::Text(_));
    let rows: Option<Vec<usize>> =
        items.iter().map(|row| row.list().filter(|row| row.iter().all(plain)).map(<[Node]>::len)).collect();
    let of_rows = rows.is_some_and(|rows| matches!(rows[..], [6, 6, 6, 6, 6, 6] | [6, 5, 4, 3, 2, 1]));
    is_full(node) || of_rows || (matches!(items.len(), 21 | 36) && items.iter().all(plain))
}

/// The largest number in a list of lists.
pub(super) fn largest(node: &Node) -> f64 {
    match &node.kind {
        Kind::Number(value) => value.abs(),
        Kind::List(items) => items.iter().map(largest).fold(0.0, f64::max),
        _ => 0.0,
    }
}

/// A table with one entry.
pub(super) fn with_key(key: &str, value: &Node) -> Node {
    let entry = Entry { key: key.into(), line: value.line, value: value.clone() };
    Node { kind: Kind::Table(vec![entry]), line: value.line }
}

/// The materials of an object that holds many, each with the identifier that the object has for it; `None` if it is one
/// material. By identifier, by column (pandas: `{"elastic_tensor": {"0": …}}`, `{"elastic_tensor": [ … ]}` or `{"columns":
/// …, "data": …}`), or a list under one key.
pub fn rows(root: &Node) -> Option<Vec<(Option<String>, Node)>> {
    let entries = root.entries();
    if entries.is_empty() {
        return None;
    }
    split(root).or_else(|| listed(root)).or_else(|| by_column(root)).or_else(|| by_identifier(root))
}

/// `{"columns": [ … ], "index": [ … ], "data": [[ … ], … ]}`.
fn split(root: &Node) -> Option<Vec<(Option<String>, Node)>> {
    let list = |key: &str| root.get(key).and_then(|entry| entry.value.list());
    let names: Option<Vec<String>> =
        list("columns")?.iter().map(|name| name.text("").ok().map(str::to_string)).collect();
    let names = names?;
    let index = list("index");
    let rows = list("data")?.iter().enumerate().map(|(n, row)| {
        let values = row.list().filter(|row| row.len() == names.len())?;
        let pairs = names.iter().zip(values).filter(|(_, value)| !matches!(value.kind, Kind::Null));
        let entries = pairs.map(|(key, value)| Entry { key: key.clone(), line: value.line, value: value.clone() });
        let id = index.and_then(|index| index.get(n)).map(Node::described).map(|id| id.trim_matches('"').to_string());
        Some((id, Node { kind: Kind::Table(entries.collect()), line: row.line }))
    });
    rows.collect()
}

/// `{"data": [ {…}, {…} ], …}`, as a database's interface answers.
fn listed(root: &Node) -> Option<Vec<(Option<String>, Node)>> {
    if is_record(root) {
        return None;
    }
    let names = ["data", "response", "results", "materials", "records", "docs"];
    let items = names.iter().find_map(|name| root.get(name))?.value.list()?;
    let all = !items.is_empty() && items.iter().all(|item| matches!(item.kind, Kind::Table(_)));
    all.then(|| items.iter().map(|item| (None, item.clone())).collect())
}

/// Columns by name, each a table of values by row or a list of them.
fn by_column(root: &Node) -> Option<Vec<(Option<String>, Node)>> {
    let tensors = root.entries().iter().find(|entry| names_a_tensor(&entry.key))?;
    let keys: Vec<String> = match &tensors.value.kind {
        Kind::Table(rows) if rows.iter().all(|row| !names_a_tensor(&row.key) && !is_setting(&row.key)) => {
            rows.iter().map(|row| row.key.clone()).collect()
        }
        Kind::List(rows) if !is_tensor(&tensors.value) && holds_columns(root, rows.len()) => {
            (0..rows.len()).map(|n| n.to_string()).collect()
        }
        _ => return None,
    };
    if keys.is_empty() {
        return None;
    }
    let columns: Vec<(&str, Column)> = root.entries().iter().map(|e| (e.key.as_str(), Column::of(&e.value))).collect();
    let row = |(n, key): (usize, &String)| {
        let cells = columns.iter().filter_map(|(name, column)| {
            let value = column.value(n, key).filter(|value| !matches!(value.kind, Kind::Null))?;
            Some(Entry { key: (*name).into(), line: value.line, value: value.clone() })
        });
        let cells: Vec<Entry> = cells.collect();
        let line = cells.first().map_or(root.line, |cell| cell.line);
        (Some(key.clone()), Node { kind: Kind::Table(cells), line })
    };
    Some(keys.iter().enumerate().map(row).collect())
}

/// A column: values by row's key, or in order.
enum Column<'n> {
    Keyed(HashMap<&'n str, &'n Node>),
    Listed(&'n [Node]),
}

impl<'n> Column<'n> {
    fn of(node: &'n Node) -> Self {
        match node.list() {
            Some(rows) => Column::Listed(rows),
            None => Column::Keyed(node.entries().iter().map(|row| (row.key.as_str(), &row.value)).collect()),
        }
    }

    fn value(&self, n: usize, key: &str) -> Option<&'n Node> {
        match self {
            Column::Keyed(rows) => rows.get(key).copied(),
            Column::Listed(rows) => rows.get(n),
        }
    }
}

fn is_setting(key: &str) -> bool {
    ["ieee_format", "raw", "raw_et_tensor", "input_array", "@class", "unit", "order"].contains(&key)
}

/// Whether every column is a list of so many.
fn holds_columns(root: &Node, rows: usize) -> bool {
    rows > 0 && root.entries().iter().all(|column| column.value.list().is_some_and(|list| list.len() == rows))
}

/// `{"mp-1": {…}, "mp-2": {…}}`, or matrices by identifier.
fn by_identifier(root: &Node) -> Option<Vec<(Option<String>, Node)>> {
    let entries = root.entries();
    if is_record(root) || entries.iter().any(|entry| super::is_known(&entry.key)) {
        return None;
    }
    let holds =
        |node: &Node| is_tensor(node) || is_record(node) || node.entries().iter().any(|e| super::is_known(&e.key));
    let table = |entry: &Entry| matches!(entry.value.kind, Kind::Table(_)) || is_tensor(&entry.value);
    if !entries.iter().all(table) || !entries.iter().any(|entry| holds(&entry.value)) {
        return None;
    }
    let row = |entry: &Entry| {
        let mut row = match entry.value.list() {
            Some(_) => with_key("elastic_tensor", &entry.value),
            None => entry.value.clone(),
        };
        let has_own = ["material_id", "jid", "id"].iter().any(|key| row.get(key).is_some());
        if let Kind::Table(entries) = &mut row.kind
            && !has_own
        {
            let value = Node { kind: Kind::Text(entry.key.clone()), line: entry.line };
            entries.push(Entry { key: "material_id".into(), line: entry.line, value });
        }
        (Some(entry.key.clone()), row)
    };
    Some(entries.iter().map(row).collect())
}
