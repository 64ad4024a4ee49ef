//! `calibrate_table`.

use anisobond::calibration::ModelCalibrator;
use anisobond_formats::write_atomically;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::calibration::settings;
use crate::convert;
use crate::neighbourhood::{Neighbourhood, chosen};
use crate::report::table_of;
use crate::work::{Beat, OrRaise, watched};

/// Calibrate every row of a table of materials (CSV, JSON list, JSON Lines), as `anisobond calibrate TABLE`: a `Table` with a
/// row for each, `error` saying why one failed. Its columns have the types of what they hold, whatever it looks like: texts,
/// truths (None where a row failed), counts, numbers.
///
/// With a folder `output` finished rows are kept, and the same call goes on where it was stopped; rows whose inputs changed are
/// computed anew, with a warning. Other results there are refused, or replaced with `force`. `unit` is that of a table
/// that names none. `prove` asks for a proof of every row's stability over the whole Brillouin zone; without it a row whose bonds'
/// signs are not proof enough says `sampled`. `progress` is True, a callable (done, total, message), or tqdm. Other keywords as `calibrate`.
#[pyfunction]
#[pyo3(signature = (table, neighbourhood=None, *, model="central", form=None, promise=None, lower_bound=None, metric=None, unit=None,
                    output=None, force=false, progress=None, prove=false, **keywords))]
#[allow(clippy::too_many_arguments)] // They are keywords.
pub fn calibrate_table<'py>(
    py: Python<'py>,
    table: &Bound<'py, PyAny>,
    neighbourhood: Option<&Bound<'py, Neighbourhood>>,
    model: &str,
    form: Option<&str>,
    promise: Option<&str>,
    lower_bound: Option<&Bound<'py, PyAny>>,
    metric: Option<&str>,
    unit: Option<&str>,
    output: Option<&Bound<'py, PyAny>>,
    force: bool,
    progress: Option<&Bound<'py, PyAny>>,
    prove: bool,
    keywords: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let settings = settings(model, form, promise, lower_bound, metric)?;
    let path = convert::path(table)?;
    let grid = chosen(py, "calibrate_table", neighbourhood, keywords)?.get().grid.clone();
    let rows = py.detach(|| anisobond_formats::read_table(&path, unit)).or_raise()?;
    let output = output.map(convert::path).transpose()?;
    let found = watched(py, progress, "rows", |stop, tell| {
        let calibrator = ModelCalibrator::new(&grid, settings)?;
        let calibrator = if prove { calibrator } else { calibrator.without_proof() };
        let _lock = output.as_ref().map(anisobond_app::FolderLock::alone).transpose()?;
        let mut journal = output.as_ref().map(|folder| anisobond_app::table_journal(folder, force)).transpose()?;
        let all = rows.rows.len();
        let each = |done: usize| tell(Beat { steps: [done as u64, all as u64], message: String::new() });
        let results = anisobond_app::calibrate_table(&rows, &calibrator, journal.as_mut(), stop, each)?;
        if results.finished() < all {
            let rest = match &output {
                Some(folder) => format!("they are kept in {}; run the same again to go on", folder.display()),
                None => "they are lost; with a folder for the output finished rows are kept".into(),
            };
            let message = format!("{} of {all} rows are done; {rest}", results.finished());
            return Err(anisobond::Error::Interrupted { message: message.into() });
        }
        let made = results.table();
        if let Some(folder) = &output {
            write_atomically(folder.join("calibrations.csv"), made.csv()?)?;
        }
        Ok((made, results.notes().to_vec()))
    })?;
    let (found, notes) = found;
    let warnings = py.import("warnings")?;
    for note in notes {
        warnings.call_method1("warn", (note,))?;
    }
    table_of(py, &format!("calibrations of {}", path.display()), &found)
}
