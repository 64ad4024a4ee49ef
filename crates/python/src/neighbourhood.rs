//! `Neighbourhood`: which grid points are bonded, and how much each bond counts.

use std::sync::Arc;

use anisobond::lattice::{Influence, Neighbourhood as Grid, Shape};
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::convert;
use crate::report::{number, table};
use crate::work::{OrRaise, wrong};

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
}

/// A horizon in spacings, from a number of spacings or a length.
fn horizon_of(given: &Bound<'_, PyAny>, spacing: f64) -> PyResult<f64> {
    match given.extract::<String>() {
        Ok(text) if text.trim().parse::<f64>().is_err() => {
            Ok(anisobond::io::parse_length(&text).map_err(|e| e.at("horizon")).or_raise()? / spacing)
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
        return anisobond::io::find_influence(&path.to_string_lossy()).map_err(|e| e.at("influence")).or_raise();
    }
    let rows: Vec<(f64, f64)> = given
        .extract()
        .map_err(|_| wrong("the influence is neither a name nor rows of two numbers", "give rows (r/δ, ω)"))?;
    Influence::table(rows).or_raise()
}

/// Rotations of one orientation or of a list of them.
fn rotated(mut grid: Grid, given: &Bound<'_, PyAny>) -> PyResult<Grid> {
    let matrix = || convert::array(given, "rotate").is_ok_and(|a| a.ndim() == 2);
    if given.extract::<String>().is_ok() || matrix() {
        return grid.rotated(&convert::orientation(given)?).or_raise();
    }
    for one in given.try_iter()? {
        grid = grid.rotated(&convert::orientation(&one?)?).or_raise()?;
    }
    Ok(grid)
}

#[pymethods]
impl Neighbourhood {
    #[new]
    #[pyo3(signature = (*, horizon=None, shape="sphere", semi_axes=None, influence=None, spacing=None, rotate=None))]
    fn new(
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
        let grid = Grid::new(shape, horizon, spacing, influence).or_raise()?;
        let grid = rotate.map_or(Ok(grid.clone()), |r| rotated(grid, r))?;
        Ok(Neighbourhood { grid: Arc::new(grid) })
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
        let offsets = self.grid.bonds().iter().flat_map(|b| b.offset).collect();
        convert::shaped(py, offsets, &[self.grid.bonds().len(), 3])
    }

    /// Bond vectors ξ (m), (N, 3).
    #[getter]
    fn vectors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let xi = convert::coordinates(self.grid.bonds().iter().map(|b| &b.xi));
        convert::shaped(py, xi, &[self.grid.bonds().len(), 3])
    }

    /// Influence ω of every bond, (N,).
    #[getter]
    fn influence<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let weights = self.grid.bonds().iter().map(|b| b.influence).collect();
        convert::shaped(py, weights, &[self.grid.bonds().len()])
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
        table(py, &this.__repr__(), columns)
    }

    fn __len__(&self) -> usize {
        self.grid.bonds().len()
    }

    fn __repr__(&self) -> String {
        let g = &self.grid;
        format!(
            "<Neighbourhood of {} bonds: {}, horizon {} Δ, Δ = {} m, influence {}>",
            g.bonds().len(),
            g.shape().name(),
            number(g.horizon()),
            number(g.spacing()),
            anisobond::io::report::influence_name(g.influence())
        )
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Neighbourhood::table(slf)?.call_method0("_repr_html_")
    }
}

/// A neighbourhood from what a function was given: an object, or the keywords of [`Neighbourhood`].
pub fn chosen(
    py: Python<'_>,
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
            let made = py.get_type::<Neighbourhood>().call((), keywords)?;
            Ok(made.cast_into::<Neighbourhood>().map_err(PyErr::from)?.unbind())
        }
    }
}
