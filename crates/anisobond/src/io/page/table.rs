//! Tables of a folder: CSV files with comments.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use crate::io::tree::read_text;
use crate::{Error, Result};

/// Rows of a table that the page shows.
const MOST_ROWS: usize = 2000;

/// Points of a line in a chart; longer ones are thinned.
const MOST_POINTS: usize = 2000;

/// A table as the page shows it.
#[derive(Serialize)]
pub(super) struct TablePart {
    title: &'static str,
    columns: Vec<String>,
    rows: Vec<Vec<Value>>,
    all: usize,
}

/// Names of columns and rows of numbers or texts.
pub(super) struct Columns {
    pub names: Vec<String>,
    pub rows: Vec<Vec<Value>>,
}

impl Columns {
    /// The table of a file, if it is there.
    pub fn read(path: &Path) -> Result<Option<Self>> {
        if !path.is_file() {
            return Ok(None);
        }
        Self::parse(&read_text(path)?).map(Some).map_err(|e| e.at(path.display()))
    }

    /// A table from its text; lines that begin with # are comments.
    pub fn parse(text: &str) -> Result<Self> {
        let wrong = |e: csv::Error| Error::input(e.to_string(), "write the folder again");
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).flexible(true).from_reader(text.as_bytes());
        let names = reader.headers().map_err(wrong)?.iter().map(String::from).collect();
        let value = |word: &str| word.parse::<f64>().map_or_else(|_| word.into(), |x| serde_json::json!(x));
        let row = |row: csv::Result<csv::StringRecord>| Ok(row.map_err(wrong)?.iter().map(value).collect());
        let rows = reader.records().map(row).collect::<Result<_>>()?;
        Ok(Columns { names, rows })
    }

    /// Place of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    pub fn number(&self, row: usize, column: usize) -> Option<f64> {
        self.rows[row].get(column).and_then(Value::as_f64)
    }

    /// A column over another in the rows that are wanted, where both are numbers; thinned.
    pub fn points(&self, x: usize, y: usize, wanted: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
        let pair = |r: usize| Some([self.number(r, x)?, self.number(r, y)?]);
        let points: Vec<[f64; 2]> = (0..self.rows.len()).filter(|&r| wanted(r)).filter_map(pair).collect();
        let (step, last) = (points.len().div_ceil(MOST_POINTS).max(1), points.len().saturating_sub(1));
        let kept = points.into_iter().enumerate().filter(|(n, _)| n % step == 0 || *n == last);
        kept.map(|(_, point)| point).collect()
    }

    /// What the page shows of it.
    pub fn part(self, title: &'static str) -> TablePart {
        let all = self.rows.len();
        TablePart { title, columns: self.names, rows: self.rows.into_iter().take(MOST_ROWS).collect(), all }
    }
}
