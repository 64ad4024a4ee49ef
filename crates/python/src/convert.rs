//! Arrays, JSON and words between Python and the library.

use anisobond::tensor::Stiffness;
use anisobond_formats::Dimension;
use nalgebra::{Matrix3, Matrix6, Vector3};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList, PyString};
use serde_json::Value;

use crate::work::{OrRaise, wrong};

/// What a pickle holds: the function that makes a value again, and what it is given.
pub type Pickled<'py, T> = PyResult<(Bound<'py, PyAny>, T)>;

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
    anisobond_formats::json_value(report).map_err(crate::work::raised)
}

/// Anything that NumPy reads as an array of finite numbers; an array of doubles is not copied.
pub fn array<'py>(given: &Bound<'py, PyAny>, what: &str) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let numpy = given.py().import("numpy")?;
    let no_numbers = |_| wrong(format!("{what} is no array of numbers"), "give a NumPy array, or nested lists");
    let plain = numpy.call_method1("asarray", (given,)).map_err(no_numbers)?;
    // NumPy would leave the imaginary part out.
    if numpy.call_method1("iscomplexobj", (&plain,))?.is_truthy()? {
        return Err(wrong(format!("{what} has complex numbers"), "give real ones, as array.real"));
    }
    let made = numpy.call_method1("ascontiguousarray", (plain, "float64")).map_err(no_numbers)?;
    // A number becomes an array of one number by this, as it should where one number will do.
    let made = made.cast_into::<PyArrayDyn<f64>>().map_err(PyErr::from)?.readonly();
    let at = made.as_slice().ok().and_then(|numbers| numbers.iter().position(|x| !x.is_finite()));
    match at {
        None => Ok(made),
        Some(at) => {
            let number = made.as_slice().map_or(f64::NAN, |numbers| numbers[at]);
            let mut rest = at;
            let mut place: Vec<String> = Vec::new();
            for &n in made.shape().iter().rev() {
                place.insert(0, (rest % n).to_string());
                rest /= n;
            }
            Err(wrong(format!("{what}[{}] is {number}", place.join(", ")), "give finite numbers"))
        }
    }
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

/// A quantity: a number in SI units, or a text with a unit.
pub fn quantity(given: &Bound<'_, PyAny>, what: &str, dimension: Dimension) -> PyResult<f64> {
    if let Ok(number) = given.extract::<f64>() {
        return Ok(number);
    }
    match given.extract::<String>() {
        Ok(text) => dimension.parse(&text).map_err(|e| e.at(what)).or_raise(),
        Err(_) => Err(wrong(
            format!("{what} is neither a number nor a text"),
            "give a number in SI units, or a text with its unit, as '2 mm' or '1 MPa'",
        )),
    }
}

/// A length (m).
pub fn length(given: &Bound<'_, PyAny>, what: &str) -> PyResult<f64> {
    quantity(given, what, Dimension::Length)
}

/// A whole number from 0 on.
pub fn count(given: i128, what: &str) -> PyResult<u64> {
    let remedy = "give a whole number from 0 on, below 2⁶⁴";
    u64::try_from(given).map_err(|_| wrong(format!("{what} = {given}"), remedy))
}

/// Three whole numbers: one for all axes, or one for each.
pub fn three_counts(given: &Bound<'_, PyAny>, what: &str) -> PyResult<[usize; 3]> {
    let failed = || wrong(format!("{what} = {given}"), "give one whole number, or three as (8, 8, 6)");
    if let Ok(n) = given.extract::<usize>() {
        return Ok([n; 3]);
    }
    let each: Vec<usize> =
        given.try_iter().and_then(|all| all.map(|n| n?.extract()).collect()).map_err(|_| failed())?;
    each.try_into().map_err(|_| failed())
}

/// Rows of two numbers.
pub fn pairs(given: &Bound<'_, PyAny>, what: &str, remedy: &str) -> PyResult<Vec<(f64, f64)>> {
    let array = array(given, what)?;
    match (array.shape(), array.as_slice()) {
        (&[_, 2], Ok(numbers)) => Ok(numbers.chunks_exact(2).map(|row| (row[0], row[1])).collect()),
        (shape, _) => Err(wrong(format!("{what} has the shape {shape:?}"), remedy)),
    }
}

/// Values of dictionaries and lists as JSON text; NumPy's numbers and arrays will do.
pub fn json_text(given: &Bound<'_, PyAny>, what: &str) -> PyResult<String> {
    given.py().import("anisobond._interop")?.call_method1("json_text", (given, what))?.extract()
}

/// A path: a text or `os.PathLike`.
pub fn path(given: &Bound<'_, PyAny>) -> PyResult<std::path::PathBuf> {
    let text = given.py().import("os")?.getattr("fspath")?.call1((given,));
    let text = text.map_err(|_| wrong("a path is neither a text nor a pathlib.Path", "give the path of a file"))?;
    Ok(text.extract::<String>()?.into())
}

/// Largest ‖Q·Qᵀ − 1‖ of a matrix that is taken for a rotation in few digits.
const ORTHOGONAL: f64 = 1e-6;

/// An orthogonal matrix: 3×3, orthogonal to six digits; a rotation of SciPy; or a text as on the command line
/// (`bunge:10,20,30`, `axis:0,0,1,60`, …).
pub fn orientation(given: &Bound<'_, PyAny>) -> PyResult<Matrix3<f64>> {
    if let Ok(text) = given.extract::<String>() {
        return anisobond_formats::parse_orientation(&text).or_raise();
    }
    let q = match given.getattr("as_matrix") {
        Ok(as_matrix) => matrix3(&as_matrix.call0()?, "a rotation")?,
        Err(_) => matrix3(given, "a rotation")?,
    };
    let error = (q * q.transpose() - Matrix3::identity()).norm();
    if error < 1e-12 {
        return Ok(q);
    }
    // The nearest orthogonal matrix is U·Vᵀ of Q = U·Σ·Vᵀ.
    let parts = q.svd(true, true);
    match (parts.u, parts.v_t) {
        (Some(u), Some(v_t)) if error <= ORTHOGONAL => Ok(u * v_t),
        _ => Err(wrong(
            format!("the rotation matrix is not orthogonal: ‖Q·Qᵀ − 1‖ = {error:.1e}"),
            format!("give Q with Q·Qᵀ = 1, to {ORTHOGONAL:.0e}"),
        )),
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

/// An array that is made at its first use, and kept.
pub fn once<'py, T: numpy::Element>(
    py: Python<'py>,
    kept: &PyOnceLock<Py<PyArrayDyn<T>>>,
    make: impl FnOnce() -> (Vec<T>, Vec<usize>),
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let array = kept.get_or_try_init(py, || {
        let (numbers, shape) = make();
        shaped(py, numbers, &shape).map(Bound::unbind)
    })?;
    Ok(array.bind(py).clone())
}

/// A 6×6 matrix, which cannot be written to.
pub fn matrix6<'py>(py: Python<'py>, m: &Matrix6<f64>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    // Rows first, as NumPy has them.
    shaped(py, m.transpose().as_slice().to_vec(), &[6, 6])
}

/// A 3×3 matrix, which cannot be written to.
pub fn matrix3_array<'py>(py: Python<'py>, m: &Matrix3<f64>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    shaped(py, m.transpose().as_slice().to_vec(), &[3, 3])
}

/// Coordinates of vectors, one after another.
pub fn coordinates<'a>(vectors: impl IntoIterator<Item = &'a Vector3<f64>>) -> Vec<f64> {
    vectors.into_iter().flat_map(|v| [v.x, v.y, v.z]).collect()
}

/// The tensor of rows of a report.
pub fn tensor_of_rows(rows: &[[f64; 6]; 6]) -> PyResult<Stiffness> {
    Stiffness::from_voigt_rows(rows).or_raise()
}
