//! The calibration of a whole table: rows in parallel, failures kept with their rows, finished rows kept on disk.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;
use serde::Serialize;
use serde_json::Value;
use serde_json::value::{RawValue, to_raw_value};

use crate::claim::{refuse_other_kind, remove_results};
use crate::journal::Journal;
use crate::model_report::ModelReport;
use crate::report::NeighbourhoodReport;
use anisobond::calibration::ModelCalibrator;
use anisobond::experiment::batch;
use anisobond::{Error, Result};
use anisobond_formats::flat::{FlatTable, columns};
use anisobond_formats::inputs::{Inputs, checksum};
use anisobond_formats::json::refuse_non_finite;
use anisobond_formats::table::{Row, Table};

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
        /// Of the error, for programs.
        kind: &'static str,
    },
}

/// The results of a table, one JSON object per finished row.
pub struct TableResults {
    rows: Vec<Option<Box<RawValue>>>,
    notes: Vec<String>,
}

/// The journal of a table's calibrations in a folder, whose lock the caller holds. With `force` all results there are removed
/// first.
///
/// # Errors
/// A folder with other results; a journal that cannot be read or written.
pub fn table_journal(folder: &Path, force: bool) -> Result<Journal> {
    if force {
        remove_results(folder)?;
    }
    refuse_other_kind(folder, "the calibrations of a table")?;
    Journal::open(folder.join("journal.jsonl"))
}

/// Calibrate every row of a table in parallel. Rows found in the journal are not computed again; every other is added to
/// it as it is finished. A row is known by its content and the settings; one that has changed is computed anew, and
/// [`TableResults::notes`] says what changed. `each` is called with the number of finished rows. When `stop` turns true the
/// rows under way are finished and the rest is left out.
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
    let inputs = settings(calibrator);
    let neighbourhood = NeighbourhoodReport::new(calibrator);
    let keys: Vec<String> = table.rows.iter().map(|row| key(&inputs, row)).collect();
    let mut notes = Vec::new();
    if let Some(journal) = &mut journal {
        let rows: String = table.rows.iter().map(|row| key(&Inputs::default(), row)).collect();
        let changed = journal.computed_from(&inputs.and("the table", rows.as_bytes()))?;
        let known = keys.iter().filter(|key| journal.get(key).is_some()).count();
        let anew = keys.len() - known;
        notes
            .extend(changed.map(|what| format!("{what} since the journal was written: {anew} rows are computed anew")));
        if journal.damaged() > 0 {
            notes
                .push(format!("{} lines of the journal are damaged: their rows are computed again", journal.damaged()));
        }
    }
    let mut rows: Vec<Option<Box<RawValue>>> =
        keys.iter().map(|key| journal.as_ref()?.get(key).map(ToOwned::to_owned)).collect();
    let pending: Vec<usize> = (0..rows.len()).filter(|&i| rows[i].is_none()).collect();
    let mut finished = rows.len() - pending.len();
    each(finished);
    batch::run(
        &pending,
        stop,
        |i| raw_row(&table.rows[i], calibrator, &neighbourhood),
        |i, result| {
            let result = result?;
            if let Some(journal) = &mut journal {
                journal.add(keys[i].clone(), &result)?;
            }
            rows[i] = Some(result);
            finished += 1;
            each(finished);
            Ok(())
        },
    )?;
    Ok(TableResults { rows, notes })
}

/// Everything that a result depends on besides its row; the bonds follow from it.
fn settings(calibrator: &ModelCalibrator) -> Inputs {
    let n = calibrator.neighbourhood();
    let settings = [
        ("the model", format!("{:?}", calibrator.settings())),
        ("the proof of stability", format!("{:?}", calibrator.proof())),
        ("the shape", n.shape().name().into()),
        ("the horizon", format!("{:?} {:?}", n.horizon(), n.shape().semi_axes())),
        ("the spacing", format!("{:?}", n.spacing())),
        ("the influence function", format!("{:?}", n.influence())),
        ("the rotation", format!("{:?}", n.orientation())),
    ];
    settings
        .into_iter()
        .fold(Inputs::of_program(), |all, (name, value)| all.and(name, format!("{name} {value}").as_bytes()))
}

/// A row's report as JSON; a report that JSON cannot hold is a failure of its row.
fn raw_row(row: &Row, calibrator: &ModelCalibrator, neighbourhood: &NeighbourhoodReport) -> Result<Box<RawValue>> {
    let report = calibrate_row(row, calibrator, neighbourhood);
    let report = refuse_non_finite(&report).map_or_else(|e| RowReport::failed(row, &row.id, &e), |()| report);
    to_raw_value(&report).map_err(|e| Error::file("write", "a row as JSON", e.into()))
}

fn calibrate_row<'a>(row: &'a Row, calibrator: &ModelCalibrator, neighbourhood: &NeighbourhoodReport) -> RowReport<'a> {
    match &row.material {
        Err(error) => RowReport::failed(row, &row.id, error),
        Ok(material) => match calibrator.calibrate(&material.stiffness) {
            Err(error) => RowReport::failed(row, &material.name, &error),
            Ok(r) => RowReport::Calibrated {
                id: &row.id,
                line: row.line,
                report: ModelReport::new(material, neighbourhood, &r),
            },
        },
    }
}

/// What a row's result depends on, as one checksum.
fn key(settings: &Inputs, row: &Row) -> String {
    let content = match &row.material {
        Ok(m) => format!("{m:?}"),
        Err(error) => error.to_string(),
    };
    let line = row.line.to_string();
    checksum([settings.digest().as_bytes(), row.id.as_bytes(), line.as_bytes(), content.as_bytes()])
}

impl<'a> RowReport<'a> {
    fn failed(row: &'a Row, material: &'a str, error: &Error) -> Self {
        let (error, kind) = (error.to_string(), error.kind().name());
        RowReport::Failed { id: &row.id, line: row.line, material, error, kind }
    }
}

impl TableResults {
    /// Results in the table's order; `None` for rows that were not reached.
    pub fn rows(&self) -> impl Iterator<Item = Option<&RawValue>> {
        self.rows.iter().map(|r| r.as_deref())
    }

    /// What a user should know of the journal: inputs that changed, lines that were damaged.
    pub fn notes(&self) -> &[String] {
        &self.notes
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
    /// `dual.1111` …; a row that failed has its `id`, `line`, `material`, `error` and its `kind` only.
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
        anisobond_formats::write_atomically(path, self.table().csv()?)
    }
}
