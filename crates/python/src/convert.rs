//! Arrays, JSON and words between Python and the library.

use anisobond::tensor::Stiffness;
use nalgebra::{Matrix3, Matrix6, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString};
use serde_json::Value;

use crate::work::{OrRaise, wrong};

/// A JSON value as Python's own: dict, list, str, float, int, bool, None.
pub fn json<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Null => py.None().into_bound(py),
        Value::Bool(b) => b.into_pyobject(py)?.to_owned().into_any(),
        Value::Number(n) => match n.as_i64() {
            Some(i) => i.into_pyobject(py)?.into_any(),
            None => n.as_f64().unwrap_or(f64::NAN).into_pyobject(py)?.into_any(),
        },
        Value::String(s) => PyString::new(py, s).into_any(),
        Value::Array(items) => {
            let list = PyList::empty(py);
            items.iter().try_for_each(|item| list.append(json(py, item)?))?;
            list.into_any()
        }
        Value::Object(map) => {
            let dict = PyDict::new(py);
            map.iter().try_for_each(|(key, item)| dict.set_item(key, json(py, item)?))?;
            dict.into_any()
        }
    })
}

/// A serialisable result as a JSON value.
pub fn value_of(report: &impl serde::Serialize) -> PyResult<Value> {
    serde_json::to_value(report).map_err(|e| wrong(format!("a result cannot be written as JSON: {e}"), ""))
}

/// Anything that NumPy reads as an array of numbers; an array of doubles is not copied.
pub fn array<'py>(given: &Bound<'py, PyAny>, what: &str) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let numpy = given.py().import("numpy")?;
    let made = numpy.getattr("ascontiguousarray")?.call1((given, "float64"));
    let made =
        made.map_err(|_| wrong(format!("{what} is no array of numbers"), "give a NumPy array, or nested lists"))?;
    Ok(made.cast_into::<PyArrayDyn<f64>>().map_err(PyErr::from)?.readonly())
}

/// Numbers of an array of a known shape.
fn exactly<const N: usize>(given: &Bound<'_, PyAny>, shape: &[usize], what: &str) -> PyResult<[f64; N]> {
    let array = array(given, what)?;
    let seen = array.shape().to_vec();
    let numbers = array.as_slice().ok().filter(|_| seen == shape).and_then(|s| <[f64; N]>::try_from(s).ok());
    numbers.ok_or_else(|| wrong(format!("{what} has the shape {seen:?}"), format!("give an array of shape {shape:?}")))
}

/// Three numbers.
pub fn vector(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Vector3<f64>> {
    exactly::<3>(given, &[3], what).map(Vector3::from)
}

/// A 3×3 matrix.
pub fn matrix3(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Matrix3<f64>> {
    exactly::<9>(given, &[3, 3], what).map(|m| Matrix3::from_row_slice(&m))
}

/// Vectors of an array (…, 3), and the shape before the last axis.
pub fn vectors(given: &Bound<'_, PyAny>, what: &str) -> PyResult<(Vec<Vector3<f64>>, Vec<usize>)> {
    let array = array(given, what)?;
    let shape = array.shape().to_vec();
    match (array.as_slice(), shape.split_last()) {
        (Ok(numbers), Some((3, before))) => {
            Ok((numbers.chunks_exact(3).map(Vector3::from_column_slice).collect(), before.to_vec()))
        }
        _ => Err(wrong(format!("{what} has the shape {shape:?}"), "give vectors as an array (…, 3)")),
    }
}

/// A length (m): a number, or a text with a unit.
pub fn length(given: &Bound<'_, PyAny>, what: &str) -> PyResult<f64> {
    if let Ok(number) = given.extract::<f64>() {
        return Ok(number);
    }
    match given.extract::<String>() {
        Ok(text) => anisobond::io::parse_length(&text).map_err(|e| e.at(what)).or_raise(),
        Err(_) => Err(wrong(format!("{what} is neither a number nor a text"), "give metres, or a text as '2 mm'")),
    }
}

/// A path: a text or `os.PathLike`.
pub fn path(given: &Bound<'_, PyAny>) -> PyResult<std::path::PathBuf> {
    let text = given.py().import("os")?.getattr("fspath")?.call1((given,));
    let text = text.map_err(|_| wrong("a path is neither a text nor a pathlib.Path", "give the path of a file"))?;
    Ok(text.extract::<String>()?.into())
}

/// An orthogonal matrix: 3×3, or a text as on the command line (`bunge:10,20,30`, `axis:0,0,1,60`, …).
pub fn orientation(given: &Bound<'_, PyAny>) -> PyResult<Matrix3<f64>> {
    match given.extract::<String>() {
        Ok(text) => anisobond::io::parse_orientation(&text).or_raise(),
        Err(_) => matrix3(given, "an orientation"),
    }
}

/// One of some words.
pub fn choice<T: Copy>(given: &str, what: &str, known: &[(&str, T)]) -> PyResult<T> {
    known.iter().find(|(name, _)| *name == given).map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|k| k.0).collect();
        wrong(format!("{what} = {given:?}"), format!("use {}", names.join(", ")))
    })
}

/// Numbers moved into an array of a shape, which cannot be written to: it belongs to a result.
pub fn shaped<'py, T: numpy::Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let array = PyArray1::from_vec(py, numbers).reshape(shape)?;
    array.call_method("setflags", (false,), None)?;
    Ok(array)
}

/// A 6×6 matrix.
pub fn matrix6<'py>(py: Python<'py>, m: &Matrix6<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    // Rows first, as NumPy has them.
    PyArray1::from_slice(py, m.transpose().as_slice()).reshape([6, 6])
}

/// A 3×3 matrix.
pub fn matrix3_array<'py>(py: Python<'py>, m: &Matrix3<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, m.transpose().as_slice()).reshape([3, 3])
}

/// Coordinates of vectors, one after another.
pub fn coordinates<'a>(vectors: impl IntoIterator<Item = &'a Vector3<f64>>) -> Vec<f64> {
    vectors.into_iter().flat_map(|v| [v.x, v.y, v.z]).collect()
}

/// The tensor of rows of a report.
pub fn tensor_of_rows(rows: &[[f64; 6]; 6]) -> PyResult<Stiffness> {
    Stiffness::from_voigt(&Matrix6::from_fn(|a, b| rows[a][b])).or_raise()
}
