//! JSON objects as rows of a table: their numbers under dotted names, and the CSV text of such rows.

use std::collections::{BTreeMap, HashMap};

use serde_json::Value;

use super::report::monomial_names;
use crate::{Error, Result};

/// Columns' names and the values of one row.
pub(super) type FlatRow = Vec<(String, String)>;

/// The numbers of a JSON object under dotted names; the names of monomials stand in the names of quartic coefficients.
pub(super) fn columns(value: &Value) -> FlatRow {
    let mut out = Vec::new();
    if let Value::Object(entries) = value {
        for (key, value) in entries.iter().filter(|(key, _)| *key != "monomials") {
            flatten(key, value, &mut out);
        }
    }
    out
}

fn flatten(name: &str, value: &Value, out: &mut FlatRow) {
    match value {
        Value::Null => {}
        Value::String(text) => out.push((name.into(), text.clone())),
        Value::Object(entries) => entries.iter().for_each(|(key, value)| flatten(&format!("{name}.{key}"), value, out)),
        Value::Array(rows) if rows.len() == 6 && rows.iter().all(Value::is_array) => {
            for a in 0..6 {
                (a..6).for_each(|b| flatten(&format!("{name}.c{}{}", a + 1, b + 1), &rows[a][b], out));
            }
        }
        Value::Array(entries) if entries.len() == 15 => {
            let names = monomial_names();
            entries.iter().zip(names).for_each(|(value, key)| flatten(&format!("{name}.{key}"), value, out));
        }
        Value::Array(entries) => {
            entries.iter().enumerate().for_each(|(i, value)| flatten(&format!("{name}.{}", i + 1), value, out));
        }
        number => out.push((name.into(), number.to_string())),
    }
}

/// The names of all columns: the fullest row gives the order, others add what only they have.
pub(super) fn header(rows: &[FlatRow]) -> Vec<String> {
    let mut header: Vec<String> = Vec::new();
    let mut known = std::collections::HashSet::new();
    let fullest = rows.iter().max_by_key(|row| row.len());
    for (name, _) in fullest.into_iter().chain(rows).flatten() {
        if known.insert(name) {
            header.push(name.clone());
        }
    }
    header
}

/// CSV text of rows of (column, value) under a header; what a row does not have is empty.
///
/// # Errors
/// None in practice: writing to memory does not fail.
pub(super) fn csv_of(header: &[String], rows: &[FlatRow]) -> Result<String> {
    let failed = |e: std::io::Error| Error::file("write", "the table as CSV", e);
    let position: HashMap<&str, usize> = header.iter().enumerate().map(|(i, name)| (name.as_str(), i)).collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(header).map_err(|e| failed(e.into()))?;
    for row in rows {
        let place = |(name, value): &'_ (String, String)| Some((*position.get(name.as_str())?, value.clone()));
        let fields: BTreeMap<usize, String> = row.iter().filter_map(place).collect();
        let record = (0..header.len()).map(|i| fields.get(&i).map_or("", String::as_str));
        writer.write_record(record).map_err(|e| failed(e.into()))?;
    }
    let bytes = writer.into_inner().map_err(|e| failed(e.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
