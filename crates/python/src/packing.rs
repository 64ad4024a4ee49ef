//! `Packing`: spheres in a periodic cell, or free.

use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use anisobond::lattice::generate::{
    Crystal, Extent, Generated, Radii, RandomPacking, Share, Target, crystal, random_observed,
};
use anisobond::lattice::{Packing as Spheres, contacts};
use anisobond_cli::describe;
use anisobond_formats::{PackingColumn, PackingOptions, read_packing_as, write_packing};
use nalgebra::Vector3;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use serde_json::Value;

use crate::convert;
use crate::report::{Report, number, table};
use crate::work::{Beat, OrRaise, background, warned, watched, wrong};

/// Spheres: `centres` (N, 3) and `radii` (N,), or one radius, in m; `cell` has the edges of the periodic cell, or is None.
///
/// >>> Packing([[0, 0, 0], [0.1, 0, 0]], 0.05)
/// <Packing of 2 spheres, radius 0.05 m, not periodic>
#[pyclass(frozen, module = "anisobond")]
pub struct Packing {
    pub spheres: Spheres,
    /// How a random packing came about: outcome, message, trials, iterations, statistics.
    generated: Option<Value>,
    /// What its file was taken for: as a whole, column by column, and what to know of it.
    read_as: Option<(String, Vec<PackingColumn>, Vec<String>)>,
    centres: PyOnceLock<Py<PyArrayDyn<f64>>>,
    radii: PyOnceLock<Py<PyArrayDyn<f64>>>,
    cell: PyOnceLock<Py<PyArrayDyn<f64>>>,
}

impl Packing {
    fn made(spheres: Spheres, generated: Option<Value>) -> Self {
        let (centres, radii, cell) = (PyOnceLock::new(), PyOnceLock::new(), PyOnceLock::new());
        Packing { spheres, generated, read_as: None, centres, radii, cell }
    }

    fn plain(spheres: Spheres) -> Self {
        Packing::made(spheres, None)
    }
}

/// A packing, or the path of one.
pub fn packing(given: &Bound<'_, PyAny>) -> PyResult<Spheres> {
    match given.cast::<Packing>() {
        Ok(packing) => Ok(packing.get().spheres.clone()),
        Err(_) => {
            let path = convert::path(given)?;
            let read = background(given.py(), move || read_packing_as(path, &PackingOptions::default()))?;
            warned(given.py(), &read.notes)?;
            Ok(read.packing)
        }
    }
}

/// Spheres of arrays.
fn spheres_of(
    centres: &Bound<'_, PyAny>,
    radii: &Bound<'_, PyAny>,
    cell: Option<&Bound<'_, PyAny>>,
) -> PyResult<Spheres> {
    let (centres, shape) = convert::vectors(centres, "centres")?;
    if shape.len() != 1 {
        return Err(wrong(format!("centres have {} axes", shape.len() + 1), "give an array of shape (N, 3)"));
    }
    let radii = if radii.extract::<String>().is_ok() {
        vec![convert::length(radii, "radii")?; centres.len()]
    } else {
        let given = convert::array(radii, "radii")?;
        match given.as_slice() {
            Ok([one]) => vec![*one; centres.len()],
            Ok(all) => all.to_vec(),
            Err(_) => return Err(wrong("radii are not contiguous", "copy them")),
        }
    };
    let cell = cell.map(|c| convert::vector(c, "cell")).transpose()?;
    Spheres::new(cell, centres, radii).or_raise()
}

/// Radii of the keywords of `Packing.random`.
fn radii_of(
    radius: Option<f64>,
    fuzz: Option<f64>,
    deviation: Option<f64>,
    radii: Option<&Bound<'_, PyAny>>,
) -> PyResult<Radii> {
    if radius.is_some() && radii.is_some() {
        return Err(wrong("a radius and a table of radii", "give one of them"));
    }
    let radius = radius.unwrap_or(1e-3);
    match (fuzz, deviation, radii) {
        (None, None, None) => Ok(Radii::Uniform { radius }),
        (Some(fuzz), None, None) => Ok(Radii::Fuzzy { mean: radius, fuzz }),
        (None, Some(deviation), None) => Ok(Radii::log_normal(radius, deviation)),
        (None, None, Some(rows)) => {
            let rows = convert::pairs(rows, "radii", "give rows (radius (m), fraction by number)")?;
            Ok(Radii::Table { rows, share: Share::Number })
        }
        _ => Err(wrong("two distributions of radii", "give one of fuzz, deviation and radii")),
    }
}

fn extent_of(number: Option<i128>, cell: Option<&Bound<'_, PyAny>>) -> PyResult<Extent> {
    match (number, cell) {
        (Some(number), None) => Ok(Extent::Number(convert::count(number, "number")? as usize)),
        (None, Some(cell)) => {
            let cell = convert::vector(cell, "cell")?;
            Ok(Extent::Cell([cell.x, cell.y, cell.z]))
        }
        _ => Err(wrong(
            "a random packing needs its number of spheres or its cell",
            "give number=2500, or cell=(0.1, 0.1, 0.1)",
        )),
    }
}

#[pymethods]
impl Packing {
    #[new]
    #[pyo3(signature = (centres, radii, *, cell=None))]
    fn new(centres: &Bound<'_, PyAny>, radii: &Bound<'_, PyAny>, cell: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        Ok(Packing::plain(spheres_of(centres, radii, cell)?))
    }

    /// Read a packing, its format known by what stands in the file: lists and tables of x y z r, LAMMPS dumps and data, VTK.
    /// `length_unit` ("mm") is that of a file that names none, `frame` the time step of a dump [the last], `type_radii` the
    /// radii of the types 1, 2, … of a LAMMPS file without radii ("1 mm,2 mm"). What was taken for what is in `read_as` and
    /// `columns`; what to know beside it, as a unit that nothing names, is a Python warning and in `notes`.
    #[staticmethod]
    #[pyo3(signature = (path, *, length_unit=None, frame=None, type_radii=None))]
    fn read(
        py: Python<'_>,
        path: &Bound<'_, PyAny>,
        length_unit: Option<String>,
        frame: Option<u64>,
        type_radii: Option<&str>,
    ) -> PyResult<Self> {
        let path = convert::path(path)?;
        let mut options = PackingOptions { length_unit, frame, ..PackingOptions::default() };
        if let Some(radii) = type_radii {
            options = options.with_type_radii(radii).or_raise()?;
        }
        let read = background(py, move || read_packing_as(path, &options))?;
        warned(py, &read.notes)?;
        let mut packing = Packing::plain(read.packing);
        packing.read_as = Some((read.read_as, read.columns, read.notes));
        Ok(packing)
    }

    /// What the file was taken for: format, what was taken from it, unit; None where the packing is not of a file.
    #[getter]
    fn read_as(&self) -> Option<String> {
        self.read_as.as_ref().map(|read| read.0.clone())
    }

    /// What every column of the file was taken for, in their order; "nothing" for those that were not.
    #[getter]
    fn columns(&self) -> Option<Vec<(String, String)>> {
        let pair = |c: &PackingColumn| (c.column.clone(), c.taken_for.clone());
        self.read_as.as_ref().map(|read| read.1.iter().map(pair).collect())
    }

    /// What to know of the file: spheres that were wrapped, a unit that nothing names.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.read_as.as_ref().map_or_else(Vec::new, |read| read.2.clone())
    }

    /// A random periodic packing without overlaps, as `anisobond pack`: of a `number` of spheres or in a `cell` (edges, m).
    ///
    /// Lengths are in m, or texts with a unit. `radius` is that of all, the mean with `fuzz` (evenly within ± fuzz), the
    /// median with `deviation` (log-normal); `radii` are rows (radius, fraction by number). The target is a `porosity`
    /// [0.45], or a `coordination` at `contact_radius`, which is also that of the statistics in `generation`. Packings of equal seeds are equal. Whether the target was reached
    /// is in `generation`.
    ///
    /// >>> p = Packing.random(number=100, radius="30 mm", porosity=0.5, seed=1)
    /// >>> len(p), p.centres.shape, p.generation["outcome"]
    /// (100, (100, 3), 'Reached')
    #[staticmethod]
    #[pyo3(signature = (*, number=None, cell=None, radius=None, fuzz=None, deviation=None, radii=None, porosity=None,
                        coordination=None, contact_radius=1.0, seed=0, progress=None))]
    #[allow(clippy::too_many_arguments)] // They are keywords.
    fn random(
        py: Python<'_>,
        number: Option<i128>,
        cell: Option<&Bound<'_, PyAny>>,
        radius: Option<&Bound<'_, PyAny>>,
        fuzz: Option<f64>,
        deviation: Option<f64>,
        radii: Option<&Bound<'_, PyAny>>,
        porosity: Option<f64>,
        coordination: Option<f64>,
        contact_radius: f64,
        seed: i128,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let radius = radius.map(|r| convert::length(r, "radius")).transpose()?;
        let seed = convert::count(seed, "seed")?;
        let target = match (porosity, coordination) {
            (Some(_), Some(_)) => return Err(wrong("a porosity and a coordination", "give one of them")),
            (None, Some(coordination)) => Target::Coordination(coordination),
            (porosity, None) => Target::Porosity(porosity.unwrap_or(RandomPacking::USUAL_POROSITY)),
        };
        let radii = radii_of(radius, fuzz, deviation, radii)?;
        let wanted = RandomPacking { extent: extent_of(number, cell)?, radii, target, contact_radius, seed };
        let made: Generated = watched(py, progress, "packing", |stop, tell| {
            random_observed(&wanted, &mut |p| {
                let message = format!("packing {}: largest overlap {:.1e}", p.trial, p.largest_overlap);
                tell(Beat { steps: [p.iterations as u64, 0], message });
                if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
        })?;
        Ok(Packing::made(made.packing, Some(convert::value_of(&made.report)?)))
    }

    /// A periodic crystal of touching spheres: sc, bcc, fcc or hcp, so many `cells` along each axis, or along x, y, z [4];
    /// each coordinate is moved by up to `perturb` radii.
    ///
    /// >>> Packing.crystal("fcc", radius="1 mm", cells=(2, 2, 2)).statistics(1.01).to_dict()["coordination"]["mean"]
    /// 12.0
    #[staticmethod]
    #[pyo3(signature = (kind, *, radius, cells=None, perturb=0.0, seed=0))]
    fn crystal(
        kind: &str,
        radius: &Bound<'_, PyAny>,
        cells: Option<&Bound<'_, PyAny>>,
        perturb: f64,
        seed: i128,
    ) -> PyResult<Self> {
        let kinds = [("sc", Crystal::Sc), ("bcc", Crystal::Bcc), ("fcc", Crystal::Fcc), ("hcp", Crystal::Hcp)];
        let kind = convert::choice(kind, "crystal", &kinds)?;
        let radius = convert::length(radius, "radius")?;
        let cells = cells.map_or(Ok([4; 3]), |c| convert::three_counts(c, "cells"))?;
        Ok(Packing::plain(crystal(kind, radius, cells, perturb, convert::count(seed, "seed")?).or_raise()?))
    }

    /// Centres (m), (N, 3).
    #[getter]
    fn centres<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        convert::once(py, &self.centres, || (convert::coordinates(self.spheres.centres()), vec![self.spheres.len(), 3]))
    }

    /// Radii (m), (N,).
    #[getter]
    fn radii<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        convert::once(py, &self.radii, || (self.spheres.radii().to_vec(), vec![self.spheres.len()]))
    }

    /// Edges of the periodic cell (m), (3,); None of a packing that is not periodic.
    #[getter]
    fn cell<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        let array = |c: Vector3<f64>| convert::once(py, &self.cell, || (vec![c.x, c.y, c.z], vec![3]));
        self.spheres.cell().map(array).transpose()
    }

    /// Share of the cell that is empty; None of a packing that is not periodic.
    #[getter]
    fn porosity(&self) -> Option<f64> {
        self.spheres.porosity()
    }

    /// How a random packing came about: outcome, message, trials, iterations; else None.
    #[getter]
    fn generation<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.generated.as_ref().map(|g| convert::json(py, g)).transpose()
    }

    /// Whether a random packing is as wanted; None of others.
    #[getter]
    fn reached(&self) -> Option<bool> {
        self.generated.as_ref().map(|g| g["outcome"] == "Reached")
    }

    /// Porosity, coordination, fabric and more at a contact radius, as `anisobond pack FILE`.
    #[pyo3(signature = (contact_radius=1.0))]
    fn statistics(&self, py: Python<'_>, contact_radius: f64) -> PyResult<Report> {
        let statistics = py.detach(|| self.spheres.statistics(contact_radius)).or_raise()?;
        Report::new(self.summary(), &statistics, describe::packing(&statistics))
    }

    /// Contacts at a contact radius as a table: spheres a and b, and the branch from a to b (m).
    #[pyo3(signature = (contact_radius=1.0))]
    fn contacts<'py>(&self, py: Python<'py>, contact_radius: f64) -> PyResult<Bound<'py, PyAny>> {
        let found = py.detach(|| contacts(&self.spheres, contact_radius)).or_raise()?;
        let columns = PyDict::new(py);
        let n = found.len();
        columns.set_item("a", convert::shaped(py, found.iter().map(|c| c.a).collect::<Vec<u32>>(), &[n])?)?;
        columns.set_item("b", convert::shaped(py, found.iter().map(|c| c.b).collect::<Vec<u32>>(), &[n])?)?;
        for (k, name) in ["branch_x", "branch_y", "branch_z"].into_iter().enumerate() {
            let along: Vec<f64> = found.iter().map(|c| c.branch[k]).collect();
            columns.set_item(name, convert::shaped(py, along, &[n])?)?;
        }
        table(py, "contacts", columns)
    }

    /// The spheres as a table.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let columns = PyDict::new(py);
        let n = self.spheres.len();
        for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
            let along: Vec<f64> = self.spheres.centres().iter().map(|c: &Vector3<f64>| c[k]).collect();
            columns.set_item(name, convert::shaped(py, along, &[n])?)?;
        }
        columns.set_item("radius", self.radii(py)?)?;
        table(py, &self.summary(), columns)
    }

    /// The spheres as a pandas DataFrame.
    fn to_pandas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py)?.call_method0("to_pandas")
    }

    /// The spheres as a pyarrow Table.
    fn to_arrow<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py)?.call_method0("to_arrow")
    }

    /// Cell (m), porosity, centres (m), radii (m), and how a random packing came about.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let s = &self.spheres;
        let three = |x: &Vector3<f64>| [x.x, x.y, x.z];
        let centres: Vec<[f64; 3]> = s.centres().iter().map(three).collect();
        convert::json(
            py,
            &serde_json::json!({
                "number": s.len(), "cell": s.cell().as_ref().map(three), "porosity": s.porosity(),
                "generation": self.generated, "centres": centres, "radii": s.radii(),
            }),
        )
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> convert::Pickled<'py, (Array<'py>, Array<'py>, Option<Array<'py>>, Option<String>)> {
        let made = py.import("anisobond._native")?.getattr("_packing")?;
        let generated = self.generated.as_ref().map(Value::to_string);
        Ok((made, (self.centres(py)?, self.radii(py)?, self.cell(py)?, generated)))
    }

    /// Write the packing; the file's ending says the format (.txt, .csv, .vtp, .data).
    fn write(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let (path, spheres) = (convert::path(path)?, self.spheres.clone());
        background(py, move || write_packing(&path, &spheres))
    }

    fn __len__(&self) -> usize {
        self.spheres.len()
    }

    fn __repr__(&self) -> String {
        format!("<Packing of {}>", self.summary())
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.get().table(slf.py())?.call_method0("_repr_html_")
    }
}

/// An array of any shape.
type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// A packing again, from what its pickle holds.
#[pyfunction]
#[pyo3(signature = (centres, radii, cell, generated))]
pub fn _packing(
    centres: &Bound<'_, PyAny>,
    radii: &Bound<'_, PyAny>,
    cell: Option<&Bound<'_, PyAny>>,
    generated: Option<&str>,
) -> PyResult<Packing> {
    let generated = generated.map(serde_json::from_str).transpose();
    let generated = generated.map_err(|e| wrong(format!("a pickled packing: {e}"), "make it anew"))?;
    Ok(Packing::made(spheres_of(centres, radii, cell)?, generated))
}

impl Packing {
    fn summary(&self) -> String {
        let radii = self.spheres.radii();
        let mean = radii.iter().sum::<f64>() / radii.len().max(1) as f64;
        let cell = match self.spheres.porosity() {
            Some(porosity) => format!("porosity {}", number(porosity)),
            None => "not periodic".into(),
        };
        format!("{} spheres, radius {} m, {cell}", radii.len(), number(mean))
    }
}
