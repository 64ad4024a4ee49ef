//! `sweep`: element tests over a table of parameters.

use std::path::PathBuf;

use anisobond_app::element_sweep::{ElementSweep, sweep_into, write_sweep};
use anisobond_app::sweep::ParameterTable;
use anisobond_app::{FolderLock, remove_results};
use anisobond_formats::FlatTable;
use pyo3::prelude::*;
use serde_json::json;

use crate::convert;
use crate::report::{Report, table_of};
use crate::work::{Beat, OrRaise, watched};

/// A finished sweep; made by `sweep`.
#[pyclass(frozen, extends = Report, module = "anisobond")]
pub struct Sweep {
    // Its table, not the store: an open store keeps others out.
    table: FlatTable,
    folder: PathBuf,
    files: Vec<String>,
    failed: Vec<(String, String)>,
}

#[pymethods]
impl Sweep {
    /// Folder of the store, its CSV, logs and charts.
    #[getter]
    fn folder(&self) -> &PathBuf {
        &self.folder
    }

    /// Files written at the end: the CSV, and charts where there are any.
    #[getter]
    fn files(&self) -> Vec<PathBuf> {
        self.files.iter().map(|f| self.folder.join(f)).collect()
    }

    /// Title and message of every job that failed.
    #[getter]
    fn failed(&self) -> Vec<(String, String)> {
        self.failed.clone()
    }

    /// A row per job: its parameters and every number of its result.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        table_of(py, "sweep", &self.table)
    }
}

/// Run an element test for every job of a parameter table and keep the results as they come, as `anisobond sweep`.
///
/// `table` is the path of a table (TOML, CSV, XLS, XLSX), or the text of a TOML table. Interrupted, the same call goes on
/// where it was; `retry` tries failed jobs again. `progress` is True, a callable (done, total, message), or tqdm.
#[pyfunction]
#[pyo3(signature = (table, output, *, retry=false, force=false, progress=None))]
pub fn sweep<'py>(
    py: Python<'py>,
    table: &Bound<'py, PyAny>,
    output: &Bound<'py, PyAny>,
    retry: bool,
    force: bool,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, Sweep>> {
    let folder = convert::path(output)?;
    let table = match table.extract::<String>() {
        Ok(text) if text.contains('\n') => ParameterTable::parse(&text, "table.toml").or_raise()?,
        _ => ParameterTable::read(convert::path(table)?).or_raise()?,
    };
    let jobs = ElementSweep::new(&table).or_raise()?;
    let (store, summary, files) = watched(py, progress, "jobs", |stop, tell| {
        let _lock = FolderLock::alone(&folder)?;
        if force {
            remove_results(&folder)?;
        }
        let (store, summary) = sweep_into(&folder, &table, &jobs, None, retry, stop, |p| {
            let message = p.last.map_or_else(String::new, |(title, _)| title);
            tell(Beat { steps: [(p.counts.done + p.counts.failed) as u64, p.counts.all as u64], message });
        })?;
        summary.require_finished(&store)?;
        let files = write_sweep(&folder, &store, false)?;
        Ok((store, summary, files))
    })?;
    let warnings = py.import("warnings")?;
    for note in store.notes() {
        warnings.call_method1("warn", (note,))?;
    }
    let counts = store.counts().or_raise()?;
    let records = store.records().or_raise()?;
    let jobs: Vec<_> = records
        .iter()
        .map(|r| json!({"title": r.title, "parameters": r.parameters, "result": r.result, "error": r.message}))
        .collect();
    let numbers = json!({"jobs": counts.all, "done": counts.done, "failed": counts.failed, "results": jobs});
    let words = format!("{} of {} jobs done, {} failed\n", counts.done, counts.all, counts.failed);
    let base = Report::new(words.trim_end(), &numbers, words.clone())?;
    let sweep = Sweep { table: store.table().or_raise()?, folder, files, failed: summary.failed };
    Bound::new(py, PyClassInitializer::from(base).add_subclass(sweep))
}
