//! `Neighbourhood`: which grid points are bonded, and how much each bond counts.

use std::sync::Arc;

use anisobond::lattice::{Influence, Neighbourhood as Grid, Shape};
use nalgebra::Matrix3;
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;

use crate::convert;
use crate::report::{number, table};
use crate::work::{OrRaise, background, wrong};

/// The bonds of a node of a regular grid.
///
/// `horizon` δ is in grid spacings, or a length as "6 mm"; `shape` is sphere, cube, cuboid or ellipsoid, the latter two
/// with `semi_axes` in spacings; `influence` is constant, inverse, hat, power, a CSV file, or rows (r/δ, ω); `spacing` Δ is
/// in m, or a text with a unit; `rotate` turns or mirrors the bonds: a 3×3 matrix, words as "bunge:10,20,30", or a list of
/// these, applied in order.
///
/// >>> grid = Neighbourhood(horizon=3, spacing="2 mm")
/// >>> grid, grid.offsets.shape
/// (<Neighbourhood of 122 bonds: sphere, horizon 3 Δ, Δ = 0.002 m, influence inverse>, (122, 3))
#[pyclass(frozen, module = "anisobond")]
pub struct Neighbourhood {
    pub grid: Arc<Grid>,
    offsets: PyOnceLock<Py<PyArrayDyn<i32>>>,
    vectors: PyOnceLock<Py<PyArrayDyn<f64>>>,
    influence: PyOnceLock<Py<PyArrayDyn<f64>>>,
}

/// Keywords of a neighbourhood, for messages.
const KEYWORDS: [&str; 6] = ["horizon", "shape", "semi_axes", "influence", "spacing", "rotate"];

/// A horizon in spacings, from a number of spacings or a length.
fn horizon_of(given: &Bound<'_, PyAny>, spacing: f64) -> PyResult<f64> {
    match given.extract::<String>() {
        Ok(text) if text.trim().parse::<f64>().is_err() => {
            Ok(anisobond_formats::parse_length(&text).map_err(|e| e.at("horizon")).or_raise()? / spacing)
        }
        Ok(text) => Ok(text.trim().parse().unwrap_or(f64::NAN)),
        Err(_) => {
            given.extract().map_err(|_| wrong("the horizon is no number", "give spacings, or a length as '6 mm'"))
        }
    }
}

fn influence_of(given: &Bound<'_, PyAny>) -> PyResult<Influence> {
    if given.extract::<String>().is_ok() || given.hasattr("__fspath__")? {
        let path = convert::path(given)?;
        return anisobond_formats::find_influence(&path.to_string_lossy()).map_err(|e| e.at("influence")).or_raise();
    }
    let rows = convert::pairs(given, "influence", "give constant, inverse, hat, power, a CSV file, or rows (r/δ, ω)")?;
    Influence::table(rows).or_raise()
}

/// One orientation, or a list of them.
fn orientations(given: &Bound<'_, PyAny>) -> PyResult<Vec<Matrix3<f64>>> {
    let matrix = || convert::array(given, "rotate").is_ok_and(|a| a.ndim() == 2);
    if given.extract::<String>().is_ok() || given.hasattr("as_matrix")? || matrix() {
        return Ok(vec![convert::orientation(given)?]);
    }
    let all = given.try_iter().map_err(|_| {
        wrong("rotate is no rotation", "give a 3×3 matrix, words as \"bunge:10,20,30\", or a list of these")
    })?;
    all.map(|one| convert::orientation(&one?)).collect()
}

#[pymethods]
impl Neighbourhood {
    #[new]
    #[pyo3(signature = (*, horizon=None, shape="sphere", semi_axes=None, influence=None, spacing=None, rotate=None))]
    fn new(
        py: Python<'_>,
        horizon: Option<&Bound<'_, PyAny>>,
        shape: &str,
        semi_axes: Option<&Bound<'_, PyAny>>,
        influence: Option<&Bound<'_, PyAny>>,
        spacing: Option<&Bound<'_, PyAny>>,
        rotate: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let spacing = spacing.map_or(Ok(1.0), |s| convert::length(s, "spacing"))?;
        let horizon = horizon.map(|h| horizon_of(h, spacing)).transpose()?;
        let semi_axes = semi_axes.map(|a| convert::vector(a, "semi_axes")).transpose()?;
        let (shape, horizon) = Shape::named(shape, horizon, semi_axes.map(|a| [a.x, a.y, a.z])).or_raise()?;
        let influence = influence.map_or(Ok(Influence::Inverse), influence_of)?;
        let turns = rotate.map_or(Ok(Vec::new()), orientations)?;
        let grid = background(py, move || {
            let grid = Grid::new(shape, horizon, spacing, influence)?;
            turns.iter().try_fold(grid, |grid, q| grid.rotated(q))
        })?;
        let (offsets, vectors, influence) = (PyOnceLock::new(), PyOnceLock::new(), PyOnceLock::new());
        Ok(Neighbourhood { grid: Arc::new(grid), offsets, vectors, influence })
    }

    /// Shape: sphere, cube, cuboid or ellipsoid.
    #[getter]
    fn shape(&self) -> &'static str {
        self.grid.shape().name()
    }

    /// Horizon ratio m = δ/Δ.
    #[getter]
    fn horizon(&self) -> f64 {
        self.grid.horizon()
    }

    /// Grid spacing Δ (m).
    #[getter]
    fn spacing(&self) -> f64 {
        self.grid.spacing()
    }

    /// Grid offsets of the neighbours, (N, 3).
    #[getter]
    fn offsets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<i32>>> {
        convert::once(py, &self.offsets, || {
            (self.grid.bonds().iter().flat_map(|b| b.offset).collect(), vec![self.grid.bonds().len(), 3])
        })
    }

    /// Bond vectors ξ (m), (N, 3).
    #[getter]
    fn vectors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        convert::once(py, &self.vectors, || {
            (convert::coordinates(self.grid.bonds().iter().map(|b| &b.xi)), vec![self.grid.bonds().len(), 3])
        })
    }

    /// Influence ω of every bond, (N,).
    #[getter]
    fn influence<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        convert::once(py, &self.influence, || {
            (self.grid.bonds().iter().map(|b| b.influence).collect(), vec![self.grid.bonds().len()])
        })
    }

    /// Offsets, vectors (m) and influence as a table.
    fn table<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        let columns = PyDict::new(py);
        let of = |array: &Bound<'py, PyAny>, k: usize| array.get_item((pyo3::types::PySlice::full(py), k));
        let (offsets, vectors) = (this.offsets(py)?.into_any(), this.vectors(py)?.into_any());
        for (k, name) in ["i", "j", "k"].into_iter().enumerate() {
            columns.set_item(name, of(&offsets, k)?)?;
        }
        for (k, name) in ["xi_x", "xi_y", "xi_z"].into_iter().enumerate() {
            columns.set_item(name, of(&vectors, k)?)?;
        }
        columns.set_item("influence", this.influence(py)?)?;
        table(py, &this.summary(), columns)
    }

    /// The table as a pandas DataFrame.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Neighbourhood::table(slf)?.call_method0("to_pandas")
    }

    /// The table as a pyarrow Table.
    fn to_arrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Neighbourhood::table(slf)?.call_method0("to_arrow")
    }

    /// Shape, horizon, spacing (m), influence, orientation, and the bonds: offsets, vectors (m) and influences.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let g = &self.grid;
        let q = g.orientation();
        let rows: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| q[(i, j)]));
        let each = |bond: &anisobond::lattice::Bond| -> (serde_json::Value, serde_json::Value, f64) {
            let xi: [f64; 3] = bond.xi.into();
            (serde_json::json!(bond.offset), serde_json::json!(xi), bond.influence)
        };
        let (mut offsets, mut vectors, mut influences) = (Vec::new(), Vec::new(), Vec::new());
        for (offset, vector, influence) in g.bonds().iter().map(each) {
            offsets.push(offset);
            vectors.push(vector);
            influences.push(influence);
        }
        convert::json(
            py,
            &serde_json::json!({
                "shape": g.shape().name(), "horizon": g.horizon(), "spacing": g.spacing(),
                "influence": anisobond_app::report::influence_name(g.influence()), "orientation": rows,
                "bonds": {"offsets": offsets, "vectors": vectors, "influence": influences},
            }),
        )
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((), Bound<'py, PyDict>)> {
        let (g, keywords) = (&self.grid, PyDict::new(py));
        keywords.set_item("shape", g.shape().name())?;
        keywords.set_item("horizon", g.horizon())?;
        keywords.set_item("spacing", g.spacing())?;
        if let Shape::Cuboid { semi_axes } | Shape::Ellipsoid { semi_axes } = g.shape() {
            keywords.set_item("semi_axes", semi_axes)?;
        }
        match g.influence() {
            Influence::Table(rows) => keywords.set_item("influence", rows.clone())?,
            named => keywords.set_item("influence", anisobond_app::report::influence_name(named))?,
        }
        if *g.orientation() != Matrix3::identity() {
            keywords.set_item("rotate", convert::matrix3_array(py, g.orientation())?)?;
        }
        Ok(((), keywords))
    }

    fn __len__(&self) -> usize {
        self.grid.bonds().len()
    }

    fn __repr__(&self) -> String {
        format!("<Neighbourhood of {}>", self.summary())
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Neighbourhood::table(slf)?.call_method0("_repr_html_")
    }
}

impl Neighbourhood {
    fn summary(&self) -> String {
        let g = &self.grid;
        format!(
            "{} bonds: {}, horizon {} Δ, Δ = {} m, influence {}",
            g.bonds().len(),
            g.shape().name(),
            number(g.horizon()),
            number(g.spacing()),
            anisobond_app::report::influence_name(g.influence())
        )
    }
}

/// The neighbourhood that a function was given: an object, or the keywords of [`Neighbourhood`].
pub fn chosen(
    py: Python<'_>,
    function: &str,
    given: Option<&Bound<'_, Neighbourhood>>,
    keywords: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<Neighbourhood>> {
    match (given, keywords.filter(|k| !k.is_empty())) {
        (Some(_), Some(keywords)) => Err(wrong(
            format!("a neighbourhood and also {}", keywords.keys().repr()?),
            "give one Neighbourhood, or horizon, shape, semi_axes, influence, spacing and rotate",
        )),
        (Some(given), None) => Ok(given.clone().unbind()),
        (None, keywords) => {
            for keyword in keywords.into_iter().flat_map(|k| k.keys()) {
                let keyword: String = keyword.extract()?;
                if !KEYWORDS.contains(&keyword.as_str()) {
                    let suggest = py.import("anisobond._interop")?.getattr("suggestion")?;
                    let remedy: String = suggest.call1((function, &keyword, KEYWORDS))?.extract()?;
                    let message = format!("{function}() has no keyword {keyword}; {remedy}");
                    return Err(PyTypeError::new_err(message));
                }
            }
            let made = py.get_type::<Neighbourhood>().call((), keywords)?;
            Ok(made.cast_into::<Neighbourhood>().map_err(PyErr::from)?.unbind())
        }
    }
}
