//! The calibration of a whole table: rows in parallel, failures kept with their rows, finished rows kept on disk.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;
use serde::Serialize;
use serde_json::Value;
use serde_json::value::{RawValue, to_raw_value};

use super::flat::{FlatTable, columns};
use super::journal::Journal;
use super::model_report::ModelReport;
use super::report::NeighbourhoodReport;
use super::table::{Row, Table};
use crate::calibration::ModelCalibrator;
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
        report: ModelReport,
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
    calibrator: &ModelCalibrator,
    mut journal: Option<&mut Journal>,
    stop: &AtomicBool,
    each: impl Fn(usize) + Sync + Send,
) -> Result<TableResults> {
    let model = calibrator.settings();
    let (version, proof) = (env!("CARGO_PKG_VERSION"), calibrator.proof());
    let settings = format!("{version} {model:?} {proof:?} {:?}", neighbourhood_settings(calibrator));
    let neighbourhood = NeighbourhoodReport::new(calibrator);
    let keys: Vec<String> = table.rows.iter().map(|row| key(&settings, row)).collect();
    let mut rows: Vec<Option<Box<RawValue>>> =
        keys.iter().map(|key| journal.as_ref()?.get(key).map(ToOwned::to_owned)).collect();
    let pending: Vec<usize> = (0..rows.len()).filter(|&i| rows[i].is_none()).collect();
    let mut finished = rows.len() - pending.len();
    each(finished);
    batch::run(
        &pending,
        stop,
        |i| to_raw_value(&calibrate_row(&table.rows[i], calibrator, &neighbourhood)),
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
fn neighbourhood_settings<'a>(calibrator: &'a ModelCalibrator) -> impl std::fmt::Debug + use<'a> {
    let n = calibrator.neighbourhood();
    (n.shape(), n.horizon(), n.spacing(), n.influence(), n.orientation())
}

fn calibrate_row<'a>(row: &'a Row, calibrator: &ModelCalibrator, neighbourhood: &NeighbourhoodReport) -> RowReport<'a> {
    let failed =
        |error: &Error, material| RowReport::Failed { id: &row.id, line: row.line, material, error: error.to_string() };
    match &row.material {
        Err(error) => failed(error, &row.id),
        Ok(material) => match calibrator.calibrate(&material.stiffness) {
            Err(error) => failed(&error, &material.name),
            Ok(r) => RowReport::Calibrated {
                id: &row.id,
                line: row.line,
                report: ModelReport::new(material, neighbourhood, &r),
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

    /// A table with a column per number of the JSON objects: `micromodulus.max`, `target.c11` … `target.c66`,
    /// `dual.1111` …; a row that failed has its `id`, `line`, `material` and `error` only.
    pub fn table(&self) -> FlatTable {
        // A raw value is valid JSON by construction.
        let flat = |row: &RawValue| serde_json::from_str(row.get()).ok().map(|value| columns(&value));
        FlatTable::of_rows(self.rows.par_iter().filter_map(|row| flat(row.as_deref()?)).collect())
    }

    /// Write the table as CSV, whole or not at all.
    ///
    /// # Errors
    /// A path that cannot be written.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<()> {
        super::write_atomically(path, self.table().csv()?)
    }
}
