//! Tables of a folder: CSV files with comments.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::charts::axis;
use super::labels::{label, title};
use super::sweeps::measured;
use crate::element_sweep::PARAMETERS;
use anisobond::{Error, Result};
use anisobond_formats::csv_text::unguarded;
use anisobond_formats::tree::read_text;

/// Rows of a table that the page shows.
const MOST_ROWS: usize = 2000;

/// Points of a line in a chart; longer ones are thinned.
const MOST_POINTS: usize = 2000;

/// A table with more columns is shown without those that say the same in every row.
const WIDE: usize = 14;

/// A table as the page shows it.
#[derive(Serialize)]
pub(super) struct TablePart {
    title: &'static str,
    columns: Vec<String>,
    rows: Vec<Vec<Value>>,
    all: usize,
    /// Columns that are left out.
    without: usize,
}

/// Titles of columns of tables of bonds.
const BONDS: [(&str, &str); 16] = [
    ("xi_x", "ξ_x (m)"),
    ("xi_y", "ξ_y (m)"),
    ("xi_z", "ξ_z (m)"),
    ("branch_x", "branch x (m)"),
    ("branch_y", "branch y (m)"),
    ("branch_z", "branch z (m)"),
    ("length", "length (m)"),
    ("influence", "influence ω (–)"),
    ("micromodulus", "c (N/m⁶)"),
    ("tangential_micromodulus", "c_t (N/m⁶)"),
    ("k_n", "k_n (N/m)"),
    ("k_t", "k_t (N/m)"),
    ("a", "node a"),
    ("b", "node b"),
    ("id", "id"),
    ("state", "state"),
];

/// Columns that are of no use to readers.
const HIDDEN: [&str; 5] = ["packing.coordination_histogram.", "packing.fabric.", "certificate.", "title", "id"];

/// The title of a column: words and a unit.
fn column_title(name: &str) -> String {
    if let Some((_, words)) = BONDS.iter().find(|(known, _)| *known == name) {
        return (*words).into();
    }
    let Some((of, component)) = name.split_once('.') else {
        return label(name).map_or_else(|| axis(name), |(words, unit)| format!("{words}{}", unit.symbol()));
    };
    let tensor = component.strip_prefix('c').filter(|digits| digits.len() == 2 && digits.parse::<u8>().is_ok());
    match (tensor, label(name)) {
        (Some(digits), _) => format!("{} C{digits} (Pa)", of.replace('_', " ")),
        (None, Some((words, unit))) if of == "result" => format!("{words}{}", unit.symbol()),
        (None, Some((words, unit))) => format!("{}: {words}{}", title(of), unit.symbol()),
        (None, None) => format!("{}: {}", title(of), component.replace(['_', '.'], " ")),
    }
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
        let names = reader.headers().map_err(wrong)?.iter().map(|name| unguarded(name).to_string()).collect();
        let value = |word: &str| match word.parse::<f64>() {
            Ok(x) if x.is_finite() => serde_json::json!(x),
            _ => unguarded(word).into(),
        };
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

    /// Whether a column does not say the same in every row.
    fn differs(&self, column: usize) -> bool {
        self.rows.iter().any(|row| row.get(column) != self.rows[0].get(column))
    }

    /// What the page shows of it: what was measured first.
    pub fn part(self, title: &'static str) -> TablePart {
        let (all, wide) = (self.rows.len(), self.names.len() > WIDE);
        let useful = |c: &usize| {
            let hidden = HIDDEN.iter().any(|start| self.names[*c].starts_with(start));
            !wide || !hidden && (all < 2 || self.differs(*c))
        };
        let mut columns: Vec<usize> = (0..self.names.len()).filter(useful).collect();
        if wide {
            columns.sort_by_key(|c| match self.names[*c].as_str() {
                own if own == "state" || PARAMETERS.contains(&own) => 0,
                own => measured().position(|name| name == own).map_or(usize::MAX, |n| 1 + n),
            });
        }
        let row = |row: &Vec<Value>| columns.iter().map(|c| row.get(*c).cloned().unwrap_or(Value::Null)).collect();
        TablePart {
            title,
            columns: columns.iter().map(|c| column_title(&self.names[*c])).collect(),
            rows: self.rows.iter().take(MOST_ROWS).map(row).collect(),
            all,
            without: self.names.len() - columns.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_words_and_units() {
        let cases = [
            ("time_s", "time (s)"),
            ("end_ux_m", "end ux (m)"),
            ("xi_x", "ξ_x (m)"),
            ("measured.c11", "measured C11 (Pa)"),
            ("engineering.ex", "Engineering constants: E_x (Pa)"),
            ("relative_error", "relative error (–)"),
            ("packing.radius.mean", "Packing: mean radius (m)"),
            ("result.model", "model"),
        ];
        cases.into_iter().for_each(|(name, words)| assert_eq!(column_title(name), words));
    }

    #[test]
    fn wide_tables_show_what_varies_and_what_was_measured_first() {
        let names: Vec<String> = (0..14).map(|n| format!("packing.x{n}")).collect();
        let row = |id: &str, r: f64| {
            format!("{id},{},{r},{r},done\n", names.iter().map(|_| "1").collect::<Vec<_>>().join(","))
        };
        let text = format!("id,{},mu,contact_radius,state\n{}{}", names.join(","), row("a", 1.5), row("b", 1.7));
        let part = Columns::parse(&text).unwrap().part("Results");
        assert_eq!((part.columns, part.without, part.all), (vec!["contact radius".into(), "μ".into()], 16, 2));
        assert_eq!(part.rows[1], [serde_json::json!(1.7), serde_json::json!(1.7)]);
    }
}
