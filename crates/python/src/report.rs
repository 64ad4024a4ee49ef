//! What every result can do: words, HTML, a dictionary, JSON.

use anisobond_cli::describe;
use anisobond_formats::{Column, FlatTable};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde::Serialize;
use serde_json::Value;

use crate::convert;
use crate::work::wrong;

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

    /// Its numbers as a table, with the columns that tables of sweeps and of calibrations have.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        table_of(py, &self.summary, &FlatTable::of([&self.value]))
    }

    /// The table as a pandas DataFrame.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.call_method0("table")?.call_method0("to_pandas")
    }

    /// The table as a pyarrow Table.
    fn to_arrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.call_method0("table")?.call_method0("to_arrow")
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> convert::Pickled<'py, (String, String, String)> {
        let (py, this) = (slf.py(), slf.get());
        // Others hold more than their report.
        if !slf.get_type().is(py.get_type::<Report>()) {
            let message = format!("a {} cannot be pickled; keep its to_dict()", slf.get_type().name()?);
            return Err(PyTypeError::new_err(message));
        }
        let made = py.import("anisobond._native")?.getattr("_report")?;
        Ok((made, (this.summary.clone(), this.value.to_string(), this.words.clone())))
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

/// A table of the package from columns with the library's types.
pub fn table_of<'py>(py: Python<'py>, title: &str, made: &FlatTable) -> PyResult<Bound<'py, PyAny>> {
    let columns = PyDict::new(py);
    for (name, column) in made.columns() {
        match column {
            Column::Text(texts) => columns.set_item(name, texts)?,
            // Of objects whether all are there or not, so that the type does not depend on the rows.
            Column::Truth(truths) => {
                let objects = py.import("numpy")?.call_method1("array", (PyList::new(py, truths)?, "object"))?;
                columns.set_item(name, objects)?;
            }
            Column::Count(counts) => {
                let n = counts.len();
                columns.set_item(name, convert::shaped(py, counts, &[n])?)?;
            }
            Column::Number(numbers) => {
                let n = numbers.len();
                columns.set_item(name, convert::shaped(py, numbers, &[n])?)?;
            }
        }
    }
    table(py, title, columns)
}

/// A report again, from what its pickle holds.
#[pyfunction]
pub fn _report(summary: String, json: &str, words: String) -> PyResult<Report> {
    let value = serde_json::from_str(json).map_err(|e| wrong(format!("a pickled report: {e}"), "make it anew"))?;
    Ok(Report { summary, value, words })
}

/// A table of the package from the text of a CSV file of numbers.
pub fn table_of_csv<'py>(py: Python<'py>, title: &str, csv: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("anisobond._table")?.getattr("Table")?.call_method1("from_csv", (title, csv))
}
