//! The calibration of a whole table: rows in parallel, failures kept with their rows, finished rows kept on disk.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde::Serialize;
use serde_json::Value;
use serde_json::value::{RawValue, to_raw_value};

use super::journal::Journal;
use super::report::{CalibrationReport, monomial_names};
use super::table::{Row, Table};
use crate::calibration::{Calibrator, LowerBound};
use crate::experiment::batch;
use crate::{Error, Result};

/// What became of a row.
#[derive(Serialize)]
#[serde(untagged)]
enum RowReport<'a> {
    Calibrated {
        id: &'a str,
        line: usize,
        #[serde(flatten)]
        report: Box<CalibrationReport>,
    },
    Failed {
        id: &'a str,
        line: usize,
        material: &'a str,
        error: String,
    },
}

/// The results of a table, one JSON object per finished row.
pub struct TableResults {
    rows: Vec<Option<Box<RawValue>>>,
}

/// Calibrate every row of a table in parallel. Rows found in the journal are not computed again; every other is added to
/// it as it is finished. `each` is called with the number of finished rows. When `stop` turns true the rows under way
/// are finished and the rest is left out.
///
/// # Errors
/// A journal that cannot be written. A row that is wrong is no error: its result says what is.
pub fn calibrate_table(
    table: &Table,
    calibrator: &Calibrator,
    bound: LowerBound,
    mut journal: Option<&mut Journal>,
    stop: &AtomicBool,
    each: impl Fn(usize) + Sync + Send,
) -> Result<TableResults> {
    let settings = format!("{} {bound:?} {:?}", env!("CARGO_PKG_VERSION"), neighbourhood_settings(calibrator));
    let keys: Vec<String> = table.rows.iter().map(|row| key(&settings, row)).collect();
    let mut rows: Vec<Option<Box<RawValue>>> =
        keys.iter().map(|key| journal.as_ref()?.get(key).map(ToOwned::to_owned)).collect();
    let pending: Vec<usize> = (0..rows.len()).filter(|&i| rows[i].is_none()).collect();
    let mut finished = rows.len() - pending.len();
    each(finished);
    batch::run(
        &pending,
        stop,
        |i| to_raw_value(&calibrate_row(&table.rows[i], calibrator, bound)),
        |i, result| {
            let result = result.map_err(|e| Error::file("write", "a row as JSON", e.into()))?;
            if let Some(journal) = &mut journal {
                journal.add(keys[i].clone(), &result)?;
            }
            rows[i] = Some(result);
            finished += 1;
            each(finished);
            Ok(())
        },
    )?;
    Ok(TableResults { rows })
}

/// Everything of a neighbourhood that a result depends on; the bonds follow from it.
fn neighbourhood_settings<'a>(calibrator: &'a Calibrator) -> impl std::fmt::Debug + use<'a> {
    let n = calibrator.neighbourhood();
    (n.shape(), n.horizon(), n.spacing(), n.influence(), n.orientation())
}

fn calibrate_row<'a>(row: &'a Row, calibrator: &Calibrator, bound: LowerBound) -> RowReport<'a> {
    let failed =
        |error: &Error, material| RowReport::Failed { id: &row.id, line: row.line, material, error: error.to_string() };
    match &row.material {
        Err(error) => failed(error, &row.id),
        Ok(material) => match calibrator.calibrate(&material.stiffness, bound) {
            Err(error) => failed(&error, &material.name),
            Ok(r) => RowReport::Calibrated {
                id: &row.id,
                line: row.line,
                report: Box::new(CalibrationReport::new(material, calibrator, &r)),
            },
        },
    }
}

/// What a row's result depends on, as 16 hexadecimal digits (FNV-1a, 64 bits).
fn key(settings: &str, row: &Row) -> String {
    let content = match &row.material {
        Ok(m) => format!("{} {} {:?}", m.name, m.source, m.stiffness),
        Err(error) => error.to_string(),
    };
    let text = format!("{settings}\n{}\n{}\n{content}", row.id, row.line);
    let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    format!("{hash:016x}")
}

impl TableResults {
    /// Results in the table's order; `None` for rows that were not reached.
    pub fn rows(&self) -> impl Iterator<Item = Option<&RawValue>> {
        self.rows.iter().map(|r| r.as_deref())
    }

    /// Number of finished rows.
    pub fn finished(&self) -> usize {
        self.rows.iter().flatten().count()
    }

    /// The finished rows as JSON values, in the table's order.
    pub fn values(&self) -> impl Iterator<Item = Value> {
        // A raw value is valid JSON by construction.
        self.rows.iter().flatten().filter_map(|row| serde_json::from_str(row.get()).ok())
    }

    /// One JSON object per line, in the table's order.
    pub fn json_lines(&self) -> String {
        self.rows.iter().flatten().map(|row| format!("{}\n", row.get())).collect()
    }

    /// A CSV table with a column per number of the JSON objects: `micromodulus.max`, `target.c11` … `target.c66`,
    /// `dual.1111` …; a row that failed has its `id`, `line`, `material` and `error` only.
    ///
    /// # Errors
    /// None in practice: writing to memory does not fail.
    pub fn csv(&self) -> Result<String> {
        let rows: Vec<Vec<(String, String)>> = self.values().map(|v| columns(&v)).collect();
        // The fullest row gives the order, others add what only they have.
        let mut header: Vec<&str> = Vec::new();
        let mut position: HashMap<&str, usize> = HashMap::new();
        let fullest = rows.iter().max_by_key(|row| row.len());
        for (name, _) in fullest.into_iter().chain(&rows).flatten() {
            position.entry(name).or_insert_with(|| {
                header.push(name);
                header.len() - 1
            });
        }
        let failed = |e: std::io::Error| Error::file("write", "the table as CSV", e);
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(&header).map_err(|e| failed(e.into()))?;
        for row in &rows {
            let fields: BTreeMap<usize, &str> = row.iter().map(|(k, v)| (position[k.as_str()], v.as_str())).collect();
            let record = (0..header.len()).map(|i| fields.get(&i).copied().unwrap_or(""));
            writer.write_record(record).map_err(|e| failed(e.into()))?;
        }
        let bytes = writer.into_inner().map_err(|e| failed(e.into_error()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// Write the CSV table, whole or not at all.
    ///
    /// # Errors
    /// A path that cannot be written.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<()> {
        super::write_atomically(path, self.csv()?)
    }
}

/// The numbers of a JSON object under dotted names; the names of monomials stand in the names of quartic coefficients.
fn columns(value: &Value) -> Vec<(String, String)> {
    let mut out = Vec::new();
    if let Value::Object(entries) = value {
        for (key, value) in entries.iter().filter(|(key, _)| *key != "monomials") {
            flatten(key, value, &mut out);
        }
    }
    out
}

fn flatten(name: &str, value: &Value, out: &mut Vec<(String, String)>) {
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
