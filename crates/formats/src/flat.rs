//! JSON objects as rows of a table: their numbers under dotted names, and such rows as CSV text or as typed columns.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};

use serde_json::Value;

use crate::csv_text::guarded;
use anisobond::tensor::monomial_names;
use anisobond::{Error, Result};

/// Columns' names and the values of one row: texts, numbers and truths.
pub type FlatRow = Vec<(String, Value)>;

/// Rows of (column, value) under a header; a row need not have every column.
pub struct FlatTable {
    header: Vec<String>,
    rows: Vec<FlatRow>,
}

/// The values of one column, a type for each; what a row does not have is `None`, or NaN among numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Texts; numbers among them, where a column has both, as they are written.
    Text(Vec<Option<String>>),
    /// Truths.
    Truth(Vec<Option<bool>>),
    /// Whole numbers, in every row.
    Count(Vec<i64>),
    /// Numbers.
    Number(Vec<f64>),
}

impl FlatTable {
    /// JSON objects as rows: their numbers, texts and truths under dotted names.
    pub fn of<'a>(objects: impl IntoIterator<Item = &'a Value>) -> Self {
        FlatTable::of_rows(objects.into_iter().map(columns).collect())
    }

    /// Rows under the header that they make.
    pub fn of_rows(rows: Vec<FlatRow>) -> Self {
        FlatTable { header: header(&rows), rows }
    }

    /// Rows under a header.
    pub fn new(header: Vec<String>, rows: Vec<FlatRow>) -> Self {
        FlatTable { header, rows }
    }

    /// Names of the columns.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// The rows, each with what it has.
    pub fn rows(&self) -> &[FlatRow] {
        &self.rows
    }

    /// CSV text; what a row does not have is empty.
    ///
    /// # Errors
    /// None in practice: writing to memory does not fail.
    pub fn csv(&self) -> Result<String> {
        csv_of(&self.header, &self.rows)
    }

    /// The columns in order. Their types are those of the values, not of how these look: a text of digits stays a text.
    pub fn columns(&self) -> Vec<(String, Column)> {
        let position: HashMap<&str, usize> = self.header.iter().enumerate().map(|(i, n)| (n.as_str(), i)).collect();
        let mut cells: Vec<Vec<Option<&Value>>> = vec![vec![None; self.rows.len()]; self.header.len()];
        for (i, row) in self.rows.iter().enumerate() {
            for (name, value) in row {
                if let Some(&k) = position.get(name.as_str()) {
                    cells[k][i] = Some(value);
                }
            }
        }
        self.header.iter().cloned().zip(cells.iter().map(|cells| column(cells))).collect()
    }
}

/// A column of the type of its values.
fn column(cells: &[Option<&Value>]) -> Column {
    let filled = || cells.iter().flatten();
    if filled().all(|v| v.is_boolean()) && filled().next().is_some() {
        return Column::Truth(cells.iter().map(|v| v.and_then(Value::as_bool)).collect());
    }
    if !filled().all(|v| v.is_number()) || filled().next().is_none() {
        return Column::Text(cells.iter().map(|v| v.map(|v| text_of(v).into_owned())).collect());
    }
    let whole: Option<Vec<i64>> = cells.iter().map(|v| v.and_then(Value::as_i64)).collect();
    let number = |v: &Option<&Value>| v.and_then(Value::as_f64).unwrap_or(f64::NAN);
    whole.map_or_else(|| Column::Number(cells.iter().map(number).collect()), Column::Count)
}

/// A value as the cell of a CSV table.
pub fn text_of(value: &Value) -> Cow<'_, str> {
    match value {
        Value::String(text) => Cow::Borrowed(text),
        other => Cow::Owned(other.to_string()),
    }
}

/// A value as the cell of a CSV file that spreadsheets may open.
fn cell_of(value: &Value) -> Cow<'_, str> {
    match value {
        Value::String(text) => guarded(text),
        other => Cow::Owned(other.to_string()),
    }
}

/// The numbers of a JSON object under dotted names; the names of monomials stand in the names of quartic coefficients.
pub fn columns(value: &Value) -> FlatRow {
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
        scalar => out.push((name.into(), scalar.clone())),
    }
}

/// The names of all columns: the fullest row gives the order, others add what only they have.
pub fn header(rows: &[FlatRow]) -> Vec<String> {
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
pub fn csv_of(header: &[String], rows: &[FlatRow]) -> Result<String> {
    let failed = |e: std::io::Error| Error::file("write", "the table as CSV", e);
    let position: HashMap<&str, usize> = header.iter().enumerate().map(|(i, name)| (name.as_str(), i)).collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(header.iter().map(|name| guarded(name).into_owned())).map_err(|e| failed(e.into()))?;
    for row in rows {
        let cells = row.iter().filter_map(|(name, value)| Some((*position.get(name.as_str())?, cell_of(value))));
        let fields: BTreeMap<usize, Cow<'_, str>> = cells.collect();
        let record = (0..header.len()).map(|i| fields.get(&i).map_or("", |text| text));
        writer.write_record(record).map_err(|e| failed(e.into()))?;
    }
    let bytes = writer.into_inner().map_err(|e| failed(e.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_the_types_of_values_and_not_of_their_looks() {
        let row = |value: Value| columns(&value);
        let rows = vec![
            row(
                serde_json::json!({"id": "007", "stable": true, "bonds": 18, "error": 1.0, "horizon": 3, "unit": "1e5"}),
            ),
            row(serde_json::json!({"id": "1e5", "horizon": 3.5, "shape": {"name": 1}, "why": "x", "bonds": 6})),
        ];
        let table = FlatTable::of_rows(rows);
        let found: HashMap<String, Column> = table.columns().into_iter().collect();
        let texts = |all: &[Option<&str>]| Column::Text(all.iter().map(|t| t.map(String::from)).collect());
        assert_eq!(found["id"], texts(&[Some("007"), Some("1e5")]));
        assert_eq!(found["unit"], texts(&[Some("1e5"), None]));
        assert_eq!(found["why"], texts(&[None, Some("x")]));
        assert_eq!(found["stable"], Column::Truth(vec![Some(true), None]));
        assert_eq!(found["bonds"], Column::Count(vec![18, 6]));
        assert_eq!(found["horizon"], Column::Number(vec![3.0, 3.5]));
        assert!(matches!(&found["error"], Column::Number(x) if x[0] == 1.0 && x[1].is_nan()));
        assert!(matches!(&found["shape.name"], Column::Number(x) if x[0].is_nan() && x[1] == 1.0));
        assert!(table.csv().unwrap().contains("\n007,"));
    }
}
