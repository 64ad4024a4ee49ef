//! `lattice` and `element_test`: bonds on a packing, and what they measure.

use std::path::PathBuf;
use std::sync::Arc;

use anisobond::calibration::Model;
use anisobond::experiment::element_test::{DynamicTest, ElementTest as Test, Rotations};
use anisobond::experiment::{CorrectionChoice, LatticePlan, LatticeStudy, anisotropy_axis, turned_to_axis};
use anisobond::solver::Watch;
use anisobond::tensor::Material;
use anisobond_app::{ElementTestReport, LatticeReport, lattice_files, write_files};
use anisobond_cli::describe;
use nalgebra::Vector3;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBool, PyDict};

use crate::convert;
use crate::material::material as material_of;
use crate::packing::packing as packing_of;
use crate::report::{Report, number, percent, table};
use crate::stiffness::Stiffness;
use crate::work::{background, iterated, warned, wrong};

/// Models of a lattice or a cell by their names.
pub const MODELS: [(&str, Model); 3] =
    [("central", Model::Central), ("micropolar", Model::Micropolar), ("hybrid", Model::Hybrid)];

/// Node rotations by their names.
pub const ROTATIONS: [(&str, Rotations); 2] = [("free", Rotations::Free), ("blocked", Rotations::Blocked)];

/// What is asked of a lattice.
struct Wish {
    material: Material,
    packing: anisobond::lattice::Packing,
    axis: Option<Vector3<f64>>,
    contact_radius: f64,
    model: Model,
    correct: Option<CorrectionChoice>,
}

impl Wish {
    /// The bonds; where they are corrected, by this test.
    fn study(self, test: &Test) -> anisobond::Result<(Material, LatticeStudy)> {
        let mut material = self.material;
        if let Some(axis) = self.axis {
            material.stiffness = turned_to_axis(&material.stiffness, &axis)?;
        }
        let axis = anisotropy_axis(&material.stiffness);
        let plan = LatticePlan::new(self.model, self.correct, test.clone());
        let study = LatticeStudy::planned(self.packing, &material.stiffness, &axis, self.contact_radius, &plan)?;
        Ok((material, study))
    }
}

/// An axis: three numbers, or words as "strike-dip:270,25".
fn axis_of(given: &Bound<'_, PyAny>) -> PyResult<Vector3<f64>> {
    match given.extract::<String>() {
        Ok(_) => Ok(convert::orientation(given)? * Vector3::z()),
        Err(_) => convert::vector(given, "axis"),
    }
}

/// A correction: False, True (general), "general" or "elliptic".
pub fn correction_of(given: Option<&Bound<'_, PyAny>>) -> PyResult<Option<CorrectionChoice>> {
    let Some(given) = given else { return Ok(None) };
    if let Ok(asked) = given.cast::<PyBool>() {
        return Ok(asked.is_true().then_some(CorrectionChoice::General));
    }
    let choices = [("general", CorrectionChoice::General), ("elliptic", CorrectionChoice::Elliptic)];
    let word = given.extract::<String>().map_err(|_| wrong("correct is no word", "use True, general or elliptic"))?;
    convert::choice(&word, "correct", &choices).map(Some)
}

/// The usual element test under a watch.
fn test_under(watch: &Arc<Watch>, rotations: Rotations) -> Test {
    Test { rotations, watch: watch.clone(), ..Test::default() }
}

/// A packing with the stiffnesses of its bonds; made by `lattice`.
#[pyclass(frozen, extends = Report, module = "anisobond")]
pub struct Lattice {
    made: Arc<(Material, LatticeStudy, LatticeReport)>,
    normal: Py<PyArrayDyn<f64>>,
    tangential: Py<PyArrayDyn<f64>>,
    pairs: PyOnceLock<Py<PyArrayDyn<u32>>>,
    branches: PyOnceLock<Py<PyArrayDyn<f64>>>,
}

impl Lattice {
    fn study(&self) -> &LatticeStudy {
        &self.made.1
    }
}

#[pymethods]
impl Lattice {
    /// The tensor asked of the lattice: the material's.
    #[getter]
    fn prescribed(&self) -> Stiffness {
        Stiffness::named(self.study().prescribed, format!("{} prescribed", self.made.0.name))
    }

    /// The sum over bonds at uniform strain: an upper bound of what is measured.
    #[getter]
    fn summed(&self) -> Stiffness {
        Stiffness::named(self.study().summed(), format!("{} summed", self.made.0.name))
    }

    /// μ = (N π̂/3V)·mean(r′ r²), what ties lattice moduli to microplane moduli.
    #[getter]
    fn mu(&self) -> f64 {
        self.study().stiffness.mu
    }

    /// Normal stiffness k_n of every contact (N/m), (N,).
    #[getter]
    fn normal(&self, py: Python<'_>) -> Py<PyArrayDyn<f64>> {
        self.normal.clone_ref(py)
    }

    /// Tangential stiffness k_t of every contact (N/m), (N,).
    #[getter]
    fn tangential(&self, py: Python<'_>) -> Py<PyArrayDyn<f64>> {
        self.tangential.clone_ref(py)
    }

    /// Spheres a and b of every contact, (N, 2).
    #[getter]
    fn pairs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<u32>>> {
        let contacts = &self.study().lattice.contacts;
        convert::once(py, &self.pairs, || (contacts.iter().flat_map(|c| [c.a, c.b]).collect(), vec![contacts.len(), 2]))
    }

    /// Branch vector from a to b of every contact (m), (N, 3).
    #[getter]
    fn branches<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let contacts = &self.study().lattice.contacts;
        convert::once(py, &self.branches, || {
            (convert::coordinates(contacts.iter().map(|c| &c.branch)), vec![contacts.len(), 3])
        })
    }

    /// The bonds as a table: spheres, branch (m), k_n and k_t (N/m).
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let contacts = &self.study().lattice.contacts;
        let n = contacts.len();
        let columns = PyDict::new(py);
        columns.set_item("a", convert::shaped(py, contacts.iter().map(|c| c.a).collect::<Vec<u32>>(), &[n])?)?;
        columns.set_item("b", convert::shaped(py, contacts.iter().map(|c| c.b).collect::<Vec<u32>>(), &[n])?)?;
        for (k, name) in ["branch_x", "branch_y", "branch_z"].into_iter().enumerate() {
            let along: Vec<f64> = contacts.iter().map(|c| c.branch[k]).collect();
            columns.set_item(name, convert::shaped(py, along, &[n])?)?;
        }
        columns.set_item("k_n", &self.normal)?;
        columns.set_item("k_t", &self.tangential)?;
        table(py, &format!("bonds of {}", self.made.0.name), columns)
    }

    /// The bonds as a pandas DataFrame.
    fn to_pandas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py)?.call_method0("to_pandas")
    }

    /// The bonds as a pyarrow Table.
    fn to_arrow<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py)?.call_method0("to_arrow")
    }

    /// Write report, bonds, packing, VTK file and pictures into a folder, as `anisobond lattice -o`; the paths written. Other
    /// results there are refused, or replaced with `force`.
    #[pyo3(signature = (folder, *, force=false))]
    fn write(&self, py: Python<'_>, folder: &Bound<'_, PyAny>, force: bool) -> PyResult<Vec<PathBuf>> {
        let (folder, made) = (convert::path(folder)?, self.made.clone());
        background(py, move || {
            let files = lattice_files(&made.0, &made.1, &made.2)?;
            write_files(&folder, &files, force)?;
            Ok(files.iter().map(|f| folder.join(f.0)).collect())
        })
    }
}

/// Assign orientation-dependent stiffnesses to the bonds of a packing (a `Packing` or a file), as `anisobond lattice`.
///
/// Bonds are where |x₁ − x₂| ≤ contact_radius (r₁ + r₂). `axis` turns the material until its anisotropy axis lies along it:
/// three numbers, or "strike-dip:270,25". `model` is central, micropolar or hybrid. `correct` (True or "general", or
/// "elliptic") corrects the bonds by their own element test until the measured tensor is the target. `progress` is True, a
/// callable (done, total, message), or tqdm: iterations of these tests, of which no total is known.
///
/// >>> rock = Stiffness.of(symmetry="transversely-isotropic", unit="MPa", c11=130, c33=55, c13=28, c12=40, c44=32.25, name="rock")
/// >>> bonds = lattice(Packing.random(number=200, radius="30 mm", porosity=0.48, seed=1), rock, contact_radius=1.8)
/// >>> bonds.normal.shape == bonds.tangential.shape == (len(bonds.pairs),)
/// True
#[pyfunction]
#[pyo3(signature = (packing, material, *, contact_radius=1.8, axis=None, model="micropolar", correct=None,
                    progress=None))]
#[allow(clippy::too_many_arguments)] // They are keywords.
pub fn lattice<'py>(
    py: Python<'py>,
    packing: &Bound<'py, PyAny>,
    material: &Bound<'py, PyAny>,
    contact_radius: f64,
    axis: Option<&Bound<'py, PyAny>>,
    model: &str,
    correct: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, Lattice>> {
    let wish = Wish {
        material: material_of(material)?,
        packing: packing_of(packing)?,
        axis: axis.map(axis_of).transpose()?,
        contact_radius,
        model: convert::choice(model, "model", &MODELS)?,
        correct: correction_of(correct)?,
    };
    let made = iterated(py, progress, "lattice", move |watch| {
        let (material, study) = wish.study(&test_under(watch, Rotations::Free))?;
        let report = LatticeReport::new(&material, &study)?;
        Ok((material, study, report))
    })?;
    let (_, study, report) = &made;
    warned(py, &report.warnings)?;
    let summary = format!(
        "{}: {} spheres, {} bonds, contact radius {}",
        report.material,
        report.packing.number,
        report.contacts,
        number(report.contact_radius)
    );
    let base = Report::new(summary, report, describe::lattice(report))?;
    let n = study.lattice.contacts.len();
    let normal = convert::shaped(py, study.stiffness.normal.clone(), &[n])?.unbind();
    let tangential = convert::shaped(py, study.stiffness.tangential.clone(), &[n])?.unbind();
    let (pairs, branches) = (PyOnceLock::new(), PyOnceLock::new());
    let lattice = Lattice { made: Arc::new(made), normal, tangential, pairs, branches };
    Bound::new(py, PyClassInitializer::from(base).add_subclass(lattice))
}

/// What an element test of a packing's lattice measured; made by `element_test`.
#[pyclass(frozen, extends = Report, module = "anisobond")]
pub struct ElementTest {
    report: ElementTestReport,
}

#[pymethods]
impl ElementTest {
    /// The measured tensor.
    #[getter]
    fn measured(&self) -> PyResult<Stiffness> {
        let name = format!("{} measured", self.report.lattice.material);
        Ok(Stiffness::named(convert::tensor_of_rows(&self.report.measured)?, name))
    }

    /// The tensor asked of the lattice.
    #[getter]
    fn prescribed(&self) -> PyResult<Stiffness> {
        let name = format!("{} prescribed", self.report.lattice.material);
        Ok(Stiffness::named(convert::tensor_of_rows(&self.report.lattice.prescribed)?, name))
    }

    /// The sum over bonds at uniform strain.
    #[getter]
    fn summed(&self) -> PyResult<Stiffness> {
        let name = format!("{} summed", self.report.lattice.material);
        Ok(Stiffness::named(convert::tensor_of_rows(&self.report.lattice.lattice)?, name))
    }

    /// ‖prescribed − measured‖/‖prescribed‖.
    #[getter]
    fn error(&self) -> f64 {
        self.report.relative_error
    }

    /// Engineering constants as measured (Pa and –); None of a singular stiffness.
    #[getter]
    fn engineering<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.report.engineering.map(|e| convert::json(py, &convert::value_of(&e)?)).transpose()
    }

    /// Whether the solver converged; else the values are not final.
    #[getter]
    fn converged(&self) -> bool {
        self.report.solver.converged
    }
}

/// Measure the stiffness of a packing's lattice, as `anisobond element-test`. For cells of a grid see `grid_test`.
///
/// `method` is static (small strain, periodic homogenisation) or dynamic (servo-controlled to the logarithmic `strain`
/// [-0.01]); `rotations` of the nodes are free or blocked. Other keywords as `lattice`; `progress` counts iterations of the
/// solver, or steps of the dynamic test.
///
/// >>> p = Packing.crystal("fcc", radius="1 mm", cells=(2, 2, 2))
/// >>> test = element_test(p, {"engineering": {"e": "10 GPa", "nu": 0.2}, "class": "isotropic"}, contact_radius=1.2)
/// >>> test.measured.symmetry(), test.converged
/// ('cubic', True)
#[pyfunction]
#[pyo3(signature = (packing, material, *, contact_radius=1.8, axis=None, model="micropolar", correct=None,
                    rotations="free", method="static", strain=None, progress=None))]
#[allow(clippy::too_many_arguments)] // They are keywords.
pub fn element_test<'py>(
    py: Python<'py>,
    packing: &Bound<'py, PyAny>,
    material: &Bound<'py, PyAny>,
    contact_radius: f64,
    axis: Option<&Bound<'py, PyAny>>,
    model: &str,
    correct: Option<&Bound<'py, PyAny>>,
    rotations: &str,
    method: &str,
    strain: Option<f64>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, ElementTest>> {
    let rotations = convert::choice(rotations, "rotations", &ROTATIONS)?;
    let dynamic = convert::choice(method, "method", &[("static", false), ("dynamic", true)])?;
    if strain.is_some() && !dynamic {
        return Err(wrong("strain belongs to the dynamic method", "add method=\"dynamic\", or leave it out"));
    }
    let strain = strain.unwrap_or(DynamicTest::default().strain);
    let wish = Wish {
        material: material_of(material)?,
        packing: packing_of(packing)?,
        axis: axis.map(axis_of).transpose()?,
        contact_radius,
        model: convert::choice(model, "model", &MODELS)?,
        correct: correction_of(correct)?,
    };
    let report = iterated(py, progress, "element test", move |watch| {
        let test = test_under(watch, rotations);
        let (material, study) = wish.study(&test)?;
        if dynamic {
            let test = DynamicTest { rotations, strain, watch: watch.clone(), ..DynamicTest::default() };
            return ElementTestReport::of_dynamic(&material, &study, &test.run(&study.network())?);
        }
        ElementTestReport::of_static(&material, &study, &test.run(&study.network())?)
    })?;
    warned(py, &report.lattice.warnings)?;
    let summary =
        format!("{}: measured is {} from prescribed", report.lattice.material, percent(report.relative_error));
    let base = Report::new(summary, &report, describe::element_test(&report))?;
    Bound::new(py, PyClassInitializer::from(base).add_subclass(ElementTest { report }))
}
