//! What every result can do: words, HTML, a dictionary, JSON.

use anisobond_cli::describe;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;
use serde_json::Value;

use crate::convert;

/// A result: `print` it for the words of the command line, `to_dict()` for its numbers (SI units), as `--json` has them.
#[pyclass(subclass, frozen, module = "anisobond")]
pub struct Report {
    summary: String,
    value: Value,
    words: String,
}

impl Report {
    /// A report of numbers, with one line that sums it up and the words of the command line.
    pub fn new(summary: impl Into<String>, report: &impl Serialize, words: String) -> PyResult<Self> {
        Ok(Report { summary: summary.into(), value: convert::value_of(report)?, words })
    }
}

#[pymethods]
impl Report {
    /// Its numbers as dict, list, float, str: the same as `--json` on the command line.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        convert::json(py, &self.value)
    }

    /// Its numbers as one JSON document.
    fn to_json(&self) -> String {
        format!("{:#}", self.value)
    }

    fn __str__(&self) -> &str {
        self.words.trim_end()
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        Ok(format!("<{} of {}>", slf.get_type().name()?, slf.get().summary))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        let numbers = convert::json(py, &this.value)?;
        py.import("anisobond._html")?.getattr("report")?.call1((slf.get_type().name()?, &this.summary, numbers))
    }
}

/// A number as the command line prints it.
pub fn number(x: f64) -> String {
    describe::number(x)
}

/// A share in per cent, rounding left out.
pub fn percent(x: f64) -> String {
    if x < 1e-14 { "0 %".into() } else { format!("{} %", number(100.0 * x)) }
}

/// A table of the package from columns in order.
pub fn table<'py>(py: Python<'py>, title: &str, columns: Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
    py.import("anisobond._table")?.getattr("Table")?.call1((title, columns))
}

/// A table of the package from the text of a CSV file.
pub fn table_of_csv<'py>(py: Python<'py>, title: &str, csv: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("anisobond._table")?.getattr("Table")?.call_method1("from_csv", (title, csv))
}
