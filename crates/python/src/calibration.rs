//! `calibrate` and `advise`.

use std::path::PathBuf;
use std::sync::Arc;

use anisobond::calibration::{
    HybridForm, LowerBound, Model, ModelCalibration, ModelCalibrator, ModelSettings, Outcome, Promise,
};
use anisobond::tensor::{Material, Metric};
use anisobond_app::{AdviceReport, ModelReport, NeighbourhoodReport, calibration_files, write_files};
use anisobond_cli::describe;
use anisobond_formats::{BondModuli, BondTable};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList};

use crate::convert;
use crate::material::material as material_of;
use crate::neighbourhood::{Neighbourhood, chosen};
use crate::report::{Report, number, percent, table};
use crate::stiffness::Stiffness;
use crate::work::{NotExact, background, warned, wrong};

/// What a calibration found.
struct Found {
    material: Material,
    result: ModelCalibration,
    report: ModelReport,
    bonds: BondTable,
}

/// Calibrated bonds with their evidence; made by `calibrate`.
#[pyclass(frozen, extends = Report, module = "anisobond")]
pub struct Calibration {
    found: Arc<Found>,
    neighbourhood: Py<Neighbourhood>,
    /// The keywords that it was made with.
    given: Py<PyDict>,
    micromodulus: Py<PyArrayDyn<f64>>,
    tangential: Option<Py<PyArrayDyn<f64>>>,
}

impl Found {
    fn tensors(&self) -> (anisobond::tensor::Stiffness, anisobond::tensor::Stiffness) {
        match &self.result {
            ModelCalibration::Central(r, _) => (r.target, r.reached),
            ModelCalibration::Micropolar(r, _) if r.promise == Promise::FreeRotations => (r.target, r.relaxed),
            ModelCalibration::Micropolar(r, _) => (r.target, r.reached),
            ModelCalibration::Hybrid(r) => (r.target, r.reached),
        }
    }

    fn stable(&self) -> String {
        let stability = self.result.stability();
        if stability.stable { format!("stable ({})", stability.evidence.name()) } else { "not stable".into() }
    }
}

#[pymethods]
impl Calibration {
    /// Model: central, micropolar or hybrid.
    #[getter]
    fn model(&self) -> &'static str {
        self.found.result.model().name()
    }

    /// The neighbourhood whose bonds these are.
    #[getter]
    fn neighbourhood(&self, py: Python<'_>) -> Py<Neighbourhood> {
        self.neighbourhood.clone_ref(py)
    }

    /// The wanted tensor.
    #[getter]
    fn target(&self) -> Stiffness {
        Stiffness { material: self.found.material.clone() }
    }

    /// The tensor that the model promises: with free node rotations where that was asked for, else the sum over bonds.
    #[getter]
    fn reached(&self) -> Stiffness {
        Stiffness::named(self.found.tensors().1, format!("{} reached", self.found.material.name))
    }

    /// ‖target − reached‖/‖target‖.
    #[getter]
    fn error(&self) -> f64 {
        self.found.result.promised_error()
    }

    /// Whether non-negative bonds (and the nodal term) reach what the model can express of the target: no neighbourhood would bring
    /// this model closer in its metric. The error may be large all the same.
    #[getter]
    fn reaches_model_limit(&self) -> bool {
        self.found.result.feasible()
    }

    /// feasible, infeasible, or not converged: the bonds are then what the solver came to.
    #[getter]
    fn outcome(&self) -> &'static str {
        self.found.result.outcome().name()
    }

    /// Whether every wave of the grid has positive energy; how that is known, `stability` says.
    #[getter]
    fn stable(&self) -> bool {
        self.found.result.stability().stable
    }

    /// How it is known whether the grid is stable: `evidence` (proved, or sampled: no wave that was tried says otherwise),
    /// `margin` (the smallest eigenvalue found, relative to ‖C‖), `bound` (what it is proved to be at least everywhere in
    /// the Brillouin zone, or None) and `at` (the phases kₐΔ of the margin).
    #[getter]
    fn stability<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let brief = self.found.result.stability().brief();
        let out = PyDict::new(py);
        out.set_item("evidence", brief.evidence.name())?;
        out.set_item("margin", brief.margin)?;
        out.set_item("bound", brief.bound)?;
        out.set_item("at", brief.at)?;
        Ok(out)
    }

    /// Where the target is infeasible: why, and the certificate that proves it; else None.
    #[getter]
    fn certificate<'py>(slf: &Bound<'py, Self>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let numbers = slf.call_method0("to_dict")?.cast_into::<PyDict>().map_err(PyErr::from)?;
        for key in ["infeasibility", "bonds_infeasibility"] {
            if let Some(found) = numbers.get_item(key)?.filter(|f| !f.is_none()) {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// Micromodulus c of every bond, or normal one c_n (N/m⁶), (N,), in the neighbourhood's order.
    #[getter]
    fn micromodulus(&self, py: Python<'_>) -> Py<PyArrayDyn<f64>> {
        self.micromodulus.clone_ref(py)
    }

    /// Tangential micromodulus c_t of every bond (N/m⁶), (N,); None of other models than micropolar.
    #[getter]
    fn tangential(&self, py: Python<'_>) -> Option<Py<PyArrayDyn<f64>>> {
        self.tangential.as_ref().map(|t| t.clone_ref(py))
    }

    /// The nodal term Z, Voigt (Pa); None of other models than hybrid. It need not be positive.
    #[getter]
    fn nodal_term<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        self.found.result.nodal().map(|z| convert::matrix6(py, &z.voigt())).transpose()
    }

    /// Grid offsets of the neighbours, (N, 3).
    #[getter]
    fn offsets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.neighbourhood.bind(py).getattr("offsets")
    }

    /// Bond vectors ξ (m), (N, 3).
    #[getter]
    fn vectors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.neighbourhood.bind(py).getattr("vectors")
    }

    /// The bonds as a table, with the columns of bonds.csv.
    fn table<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        let bonds = &this.found.bonds;
        let columns = PyDict::new(py);
        let n = bonds.len();
        for (k, name) in ["i", "j", "k"].into_iter().enumerate() {
            columns
                .set_item(name, convert::shaped(py, bonds.offset.iter().map(|o| o[k]).collect::<Vec<i32>>(), &[n])?)?;
        }
        for (k, name) in ["xi_x", "xi_y", "xi_z"].into_iter().enumerate() {
            columns.set_item(name, convert::shaped(py, bonds.xi.iter().map(|x| x[k]).collect::<Vec<f64>>(), &[n])?)?;
        }
        columns.set_item("length", convert::shaped(py, bonds.length.clone(), &[n])?)?;
        columns.set_item("influence", convert::shaped(py, bonds.influence.clone(), &[n])?)?;
        columns.set_item("micromodulus", &this.micromodulus)?;
        columns.set_item("k_n", convert::shaped(py, bonds.spring_stiffness.clone(), &[n])?)?;
        if let (Some(tangential), Some(array)) = (&bonds.tangential, &this.tangential) {
            columns.set_item("tangential_micromodulus", array)?;
            columns.set_item("k_t", convert::shaped(py, tangential.spring_stiffness.clone(), &[n])?)?;
        }
        table(py, &format!("bonds of {}", this.found.material.name), columns)
    }

    /// A pickle holds what was asked, which is calibrated again: the bits are the same.
    fn __reduce__<'py>(&self, py: Python<'py>) -> convert::Pickled<'py, (Stiffness, Py<Neighbourhood>)> {
        let calibrate = py.import("anisobond._native")?.getattr("calibrate")?;
        let again = py.import("functools")?.getattr("partial")?.call((calibrate,), Some(self.given.bind(py)))?;
        Ok((again, (self.target(), self.neighbourhood.clone_ref(py))))
    }

    /// Write report, bonds, VTK file and pictures into a folder, as `anisobond calibrate -o`; the paths written. Other results
    /// there are refused, or replaced with `force`.
    #[pyo3(signature = (folder, *, force=false))]
    fn write(slf: &Bound<'_, Self>, folder: &Bound<'_, PyAny>, force: bool) -> PyResult<Vec<PathBuf>> {
        let (folder, py) = (convert::path(folder)?, slf.py());
        let (found, grid) = (slf.get().found.clone(), slf.get().neighbourhood.get().grid.clone());
        background(py, move || {
            let files = calibration_files(&found.material, &grid, &found.result, &found.report, None)?;
            write_files(&folder, &files, force)?;
            Ok(files.iter().map(|f| folder.join(f.0)).collect())
        })
    }
}

/// The model that keywords describe; keywords of another model are refused.
pub fn settings(
    model: &str,
    form: Option<&str>,
    promise: Option<&str>,
    lower_bound: Option<&Bound<'_, PyAny>>,
    metric: Option<&str>,
) -> PyResult<ModelSettings> {
    let models = [("central", Model::Central), ("micropolar", Model::Micropolar), ("hybrid", Model::Hybrid)];
    let model = convert::choice(model, "model", &models)?;
    let only = |keyword: &str, model: &str| {
        Err(wrong(format!("{keyword} belongs to {model}"), format!("add model={model:?}, or leave it out")))
    };
    if let (Model::Micropolar | Model::Hybrid, Some(_)) = (model, metric) {
        return only("metric", "central");
    }
    let metrics = [("norm", Metric::Norm), ("energy", Metric::Energy)];
    let metric = convert::choice(metric.unwrap_or("norm"), "metric", &metrics)?;
    match (model, form, promise, lower_bound) {
        (Model::Central | Model::Micropolar, Some(_), _, _) => only("form", "hybrid"),
        (Model::Central | Model::Hybrid, _, Some(_), _) => only("promise", "micropolar"),
        (Model::Micropolar | Model::Hybrid, _, _, Some(_)) => only("lower_bound", "central"),
        (Model::Central, _, _, bound) => {
            Ok(ModelSettings::Central(bound.map_or(Ok(LowerBound::Value(0.0)), bound_of)?, metric))
        }
        (Model::Micropolar, _, promise, _) => {
            let promises = [("sum", Promise::Sum), ("free-rotations", Promise::FreeRotations)];
            Ok(ModelSettings::Micropolar(convert::choice(promise.unwrap_or("sum"), "promise", &promises)?))
        }
        (Model::Hybrid, form, _, _) => {
            let forms = [("remainder", HybridForm::Remainder), ("stable", HybridForm::Stable)];
            Ok(ModelSettings::Hybrid(form.map(|f| convert::choice(f, "form", &forms)).transpose()?))
        }
    }
}

fn bound_of(given: &Bound<'_, PyAny>) -> PyResult<LowerBound> {
    match given.extract::<f64>() {
        Ok(l) if l.is_finite() && l >= 0.0 => Ok(LowerBound::Value(l)),
        _ if given.extract::<String>().is_ok_and(|s| s == "max") => Ok(LowerBound::Largest),
        _ => Err(wrong(format!("lower_bound = {given}"), "give a number ≥ 0 (N/m⁶), or \"max\"")),
    }
}

/// Calibrate the bonds of a regular grid to a material: least-norm non-negative micromoduli with their evidence, as
/// `anisobond calibrate`.
///
/// `model` is central, micropolar (normal and tangential bonds, node rotations free; `promise` sum or free-rotations) or
/// hybrid (normal bonds and a nodal term; `form` remainder or stable). `lower_bound` (N/m⁶, or "max") is of the central
/// model, and so is `metric`: norm, or energy, by which soft directions count as much as stiff ones. With `require_exact`, a relative error above it (True: 1e-9) raises `NotExact`. The bonds are those of a `Neighbourhood`, or
/// of its keywords: horizon, shape, semi_axes, influence, spacing, rotate.
///
/// A target out of reach is no error: the closest bonds are returned, with the certificate.
///
/// >>> bonds = calibrate("KIO3", horizon=3, spacing="2 mm")
/// >>> bonds
/// <Calibration of KIO3: central, 122 bonds, error 3.18728 %, the least of the model, stable (proved)>
/// >>> bonds.micromodulus.shape, bonds.reached.cauchy_gap < 1e-12
/// ((122,), True)
/// >>> calibrate("Te2W", horizon=3, model="hybrid").error < 1e-12
/// True
#[pyfunction]
#[pyo3(signature = (material, neighbourhood=None, *, model="central", form=None, promise=None, lower_bound=None,
                    metric=None, require_exact=None, **keywords))]
#[allow(clippy::too_many_arguments)] // They are keywords.
pub fn calibrate<'py>(
    py: Python<'py>,
    material: &Bound<'py, PyAny>,
    neighbourhood: Option<&Bound<'py, Neighbourhood>>,
    model: &str,
    form: Option<&str>,
    promise: Option<&str>,
    lower_bound: Option<&Bound<'py, PyAny>>,
    metric: Option<&str>,
    require_exact: Option<&Bound<'py, PyAny>>,
    keywords: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, Calibration>> {
    let settings = settings(model, form, promise, lower_bound, metric)?;
    let require_exact = require_exact.map_or(Ok(None), required)?;
    let given = PyDict::new(py);
    given.set_item("model", model)?;
    given.set_item("form", form)?;
    given.set_item("promise", promise)?;
    given.set_item("lower_bound", lower_bound)?;
    given.set_item("metric", metric)?;
    let material = material_of(material)?;
    let neighbourhood = chosen(py, "calibrate", neighbourhood, keywords)?;
    let grid = neighbourhood.get().grid.clone();
    let found = background(py, move || {
        let calibrator = ModelCalibrator::new(&grid, settings)?;
        let result = calibrator.calibrate(&material.stiffness)?;
        let report = ModelReport::new(&material, &NeighbourhoodReport::new(&calibrator), &result);
        let bonds = BondTable::new(&grid, &BondModuli::of(&result))?;
        Ok(Found { material, result, report, bonds })
    })?;
    warned(py, found.report.warnings())?;
    let made = calibration(py, found, neighbourhood, given.unbind())?;
    let promised = made.get().error();
    if let Some(required) = require_exact.filter(|e| promised.is_nan() || promised > *e) {
        let error = NotExact::new_err(format!(
            "the {} model promises the target to {} %, not to the required {} %",
            made.get().model(),
            number(100.0 * promised),
            number(100.0 * required)
        ));
        error.value(py).setattr("calibration", made)?;
        return Err(error);
    }
    Ok(made)
}

/// The relative error that is required: a number, True for what rounding leaves, False for none.
fn required(given: &Bound<'_, PyAny>) -> PyResult<Option<f64>> {
    if let Ok(asked) = given.cast::<PyBool>() {
        return Ok(asked.is_true().then_some(1e-9));
    }
    match given.extract::<f64>() {
        Ok(error) if error >= 0.0 => Ok(Some(error)),
        _ => Err(wrong(format!("require_exact = {given}"), "give True, or a relative error ≥ 0, as 1e-9")),
    }
}

fn calibration(
    py: Python<'_>,
    found: Found,
    neighbourhood: Py<Neighbourhood>,
    given: Py<PyDict>,
) -> PyResult<Bound<'_, Calibration>> {
    let n = found.bonds.len();
    let summary = format!(
        "{}: {}, {n} bonds, error {}, {}, {}",
        found.material.name,
        found.result.model().name(),
        percent(found.result.promised_error()),
        match found.result.outcome() {
            Outcome::Feasible => "the least of the model",
            Outcome::Infeasible => "short of the model's least",
            Outcome::NotConverged => "not converged",
        },
        found.stable()
    );
    let report = Report::new(summary, &found.report, describe::calibration(&found.report))?;
    let micromodulus = convert::shaped(py, found.result.normal().to_vec(), &[n])?.unbind();
    let tangential = found.result.tangential();
    let tangential = tangential.map(|t| convert::shaped(py, t.to_vec(), &[n])).transpose()?.map(Bound::unbind);
    let calibration = Calibration { found: Arc::new(found), neighbourhood, given, micromodulus, tangential };
    Bound::new(py, PyClassInitializer::from(report).add_subclass(calibration))
}

/// Which model a tensor needs; made by `advise`.
#[pyclass(frozen, extends = Report, module = "anisobond")]
pub struct Advice {
    recommended: &'static str,
    reason: String,
}

#[pymethods]
impl Advice {
    /// The model to take: central, micropolar or hybrid.
    #[getter]
    fn recommended(&self) -> &'static str {
        self.recommended
    }

    /// Why.
    #[getter]
    fn reason(&self) -> &str {
        &self.reason
    }

    /// What each model promises and measures on a reference grid, as a table.
    fn table<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let numbers = slf.call_method0("to_dict")?;
        let models = numbers.get_item("reference")?.get_item("models")?.cast_into::<PyList>().map_err(PyErr::from)?;
        slf.py().import("anisobond._table")?.getattr("Table")?.call_method1("from_records", ("models", models))
    }
}

/// Say which model a tensor needs: what each reaches, how stable it is and what it costs, as `anisobond advise`.
///
/// >>> advise("Te2W").recommended
/// 'hybrid'
#[pyfunction]
#[pyo3(signature = (material))]
pub fn advise<'py>(py: Python<'py>, material: &Bound<'py, PyAny>) -> PyResult<Bound<'py, Advice>> {
    let material = material_of(material)?;
    let report = background(py, move || AdviceReport::new(&material))?;
    let (recommended, reason) = (report.advice.recommended.name(), report.advice.reason.clone());
    let summary = format!("{}: {recommended}", report.material);
    let base = Report::new(summary, &report, describe::advice(&report))?;
    Bound::new(py, PyClassInitializer::from(base).add_subclass(Advice { recommended, reason }))
}
