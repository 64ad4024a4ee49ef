//! `Case`, `run` and `open_run`: problems as data, run into a folder.

use std::path::{Path, PathBuf};

use anisobond::Error;
use anisobond_app::run::{RunOptions, RunProgress, RunSummary, run_case};
use anisobond_app::{CaseFile, starter_case};
use anisobond_cli::describe;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::convert;
use crate::report::{Report, table_of_csv};
use crate::work::{Beat, OrRaise, raised, warned, watched, wrong};

/// A problem as data: the path of a case file (TOML; docs/cases.md), or its text; `set` replaces values, as `--set`:
/// {"grid.spacing": "0.5 mm", "condition.0.pressure": "2 MPa"}. Paths in a text are relative to the working folder.
///
/// >>> case = Case(Case.starter("bar"), set={"grid.spacing": "10 mm"})
/// >>> case.name, case.check().to_dict()["nodes"] > 0
/// ('bar', True)
#[pyclass(frozen, module = "anisobond")]
pub struct Case {
    file: CaseFile,
    /// The path or the text, and what was set in it: what the case is made of.
    given: String,
    set: Vec<(String, String)>,
}

/// Overrides in the form of the command line.
fn overrides(set: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, String)>> {
    let Some(set) = set else { return Ok(Vec::new()) };
    set.iter()
        .map(|(key, value)| {
            let key: String = key.extract()?;
            // Texts stay as they are; numbers, truths and lists are the same in JSON and TOML.
            let value = value.extract::<String>().or_else(|_| convert::json_text(&value, &key))?;
            Ok((key, value))
        })
        .collect()
}

impl Case {
    fn of(case: &Bound<'_, PyAny>, set: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let set = overrides(set)?;
        let sets: Vec<String> = set.iter().map(|(key, value)| format!("{key}={value}")).collect();
        if let Ok(text) = case.extract::<String>()
            && text.contains('\n')
        {
            let file = CaseFile::parse(&text, "case.toml", &sets).or_raise()?;
            return Ok(Case { file, given: text, set });
        }
        let path = convert::path(case)?;
        let file = CaseFile::read(&path, &sets).or_raise()?;
        Ok(Case { file, given: path.to_string_lossy().into_owned(), set })
    }
}

#[pymethods]
impl Case {
    #[new]
    #[pyo3(signature = (case, *, set=None))]
    fn new(case: &Bound<'_, PyAny>, set: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        Case::of(case, set)
    }

    /// The text of a commented case that runs as it is, as `anisobond new case`.
    #[staticmethod]
    fn starter(name: &str) -> String {
        starter_case(name)
    }

    /// Name of the case.
    #[getter]
    fn name(&self) -> &str {
        self.file.name()
    }

    /// What the file says about itself.
    #[getter]
    fn description(&self) -> &str {
        self.file.description()
    }

    /// What the case holds and what its run would take, as `anisobond check`.
    fn check(&self, py: Python<'_>) -> PyResult<Report> {
        let (numbers, words) = py.detach(|| describe::case(&self.file)).or_raise()?;
        Report::new(self.file.name(), &numbers, words)
    }

    /// Name, description, the file or the text, and what is set in it.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let source = if self.given.contains('\n') { "text" } else { "file" };
        let set: serde_json::Map<String, serde_json::Value> =
            self.set.iter().map(|(key, value)| (key.clone(), value.as_str().into())).collect();
        let mut numbers = serde_json::json!({"name": self.name(), "description": self.description(), "set": set});
        numbers[source] = self.given.as_str().into();
        convert::json(py, &numbers)
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((String,), Bound<'py, PyDict>)> {
        let (keywords, set) = (PyDict::new(py), PyDict::new(py));
        self.set.iter().try_for_each(|(key, value)| set.set_item(key, value))?;
        keywords.set_item("set", set)?;
        Ok(((self.given.clone(),), keywords))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        py.import("anisobond._html")?.getattr("report")?.call1(("Case", this.name(), this.to_dict(py)?))
    }

    fn __repr__(&self) -> String {
        let description = self.file.description();
        let more = if description.is_empty() { String::new() } else { format!(": {description}") };
        format!("<Case {}{more}>", self.file.name())
    }
}

/// A finished run; made by `run`, or found by `open_run`.
#[pyclass(frozen, extends = Report, module = "anisobond")]
pub struct Run {
    folder: PathBuf,
}

#[pymethods]
impl Run {
    /// Folder of the results.
    #[getter]
    fn folder(&self) -> &PathBuf {
        &self.folder
    }

    /// Every file of the run: probes, frames, pictures, summary.
    #[getter]
    fn files(&self) -> PyResult<Vec<PathBuf>> {
        let mut files = Vec::new();
        collect(&self.folder, &mut files).or_raise()?;
        files.sort();
        Ok(files)
    }

    /// Energies and probes over time (or load), a column each, units in their names.
    fn probes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.csv(py, "probes.csv")
    }

    /// Tips of cracks over time; None where there is no crack.
    fn cracks<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.folder.join("crack.csv").is_file().then(|| self.csv(py, "crack.csv")).transpose()
    }

    /// The probes, as `probes()`; what `to_pandas()` and `to_arrow()` take.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.probes(py)
    }
}

impl Run {
    fn csv<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let path = self.folder.join(name);
        let text = std::fs::read_to_string(&path).map_err(|e| raised(Error::file("read", &path, e)))?;
        table_of_csv(py, name.trim_end_matches(".csv"), &text)
    }
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> anisobond::Result<()> {
    let entries = std::fs::read_dir(folder).map_err(|e| Error::file("read", folder, e))?;
    for entry in entries {
        let path = entry.map_err(|e| Error::file("read", folder, e))?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}

fn beat(p: &RunProgress) -> Beat {
    Beat { steps: p.steps, message: p.words() }
}

/// Run a case into a folder, as `anisobond run`: a `Case`, the path of a case file, or its text.
///
/// `output` is the folder [the case's name]; results in it are refused, or replaced with `force`. Ctrl-C keeps a checkpoint and raises `Interrupted`; with `resume` the same call
/// goes on, to the same bits. `progress` is True, a callable (done, total, message), or tqdm. Warnings are Python warnings.
#[pyfunction]
#[pyo3(signature = (case, output=None, *, set=None, resume=false, force=false, progress=None))]
#[allow(clippy::too_many_arguments)] // They are keywords.
pub fn run<'py>(
    py: Python<'py>,
    case: &Bound<'py, PyAny>,
    output: Option<&Bound<'py, PyAny>>,
    set: Option<&Bound<'py, PyDict>>,
    resume: bool,
    force: bool,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, Run>> {
    let made;
    let case = match case.cast::<Case>() {
        Ok(_) if set.is_some_and(|s| !s.is_empty()) => {
            return Err(wrong("set is given with a Case", "give it to Case, which reads the file"));
        }
        Ok(case) => case.get(),
        Err(_) => {
            made = Case::of(case, set)?;
            &made
        }
    };
    let folder = output.map_or_else(|| Ok(case.file.name().into()), convert::path)?;
    let summary = watched(py, progress, "steps", |stop, tell| {
        let options = RunOptions { folder: &folder, resume, force, stop };
        run_case(&case.file, &options, |p| tell(beat(p)))
    })?;
    warned(py, &summary.warnings)?;
    // What is not finite is among the warnings.
    made_run(py, &summary, &serde_json::json!(summary), folder)
}

/// A run of its summary; its numbers are given apart, as the summary's file has them.
fn made_run<'py>(
    py: Python<'py>,
    summary: &RunSummary,
    numbers: &impl serde::Serialize,
    folder: PathBuf,
) -> PyResult<Bound<'py, Run>> {
    let title = format!("{}: {} nodes, {} bonds, {} steps", summary.case, summary.nodes, summary.bonds, summary.steps);
    let words = describe::run(summary, &folder.display().to_string());
    let base = Report::new(title, numbers, words)?;
    Bound::new(py, PyClassInitializer::from(base).add_subclass(Run { folder }))
}

/// The run of a folder that `run` or `anisobond run` wrote.
#[pyfunction]
pub fn open_run<'py>(py: Python<'py>, folder: &Bound<'py, PyAny>) -> PyResult<Bound<'py, Run>> {
    let folder = convert::path(folder)?;
    let path = folder.join("summary.json");
    let text = std::fs::read_to_string(&path).map_err(|e| raised(Error::file("read", &path, e)))?;
    let damaged = |e| wrong(format!("{}: {e}", path.display()), "give the folder of a finished run");
    let numbers: serde_json::Value = serde_json::from_str(&text).map_err(damaged)?;
    let summary: RunSummary = serde_json::from_str(&text).map_err(damaged)?;
    made_run(py, &summary, &numbers, folder)
}
