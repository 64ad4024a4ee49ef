//! `grid_test`: the element test of a cell of a grid.

use anisobond::calibration::ModelCalibrator;
use anisobond::experiment::element_test::ElementTest;
use anisobond::experiment::{Correction, CorrectionChoice, GridStudy};
use anisobond::operator::GridCell;
use anisobond_app::GridTestReport;
use anisobond_cli::describe;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::convert;
use crate::lattice::{MODELS, ROTATIONS, correction_of};
use crate::material::material as material_of;
use crate::neighbourhood::{Neighbourhood, chosen};
use crate::report::{Report, percent};
use crate::stiffness::Stiffness;
use crate::work::{OrRaise, iterated, raised, warned, wrong};

/// What an element test of a grid cell measured; made by `grid_test`.
#[pyclass(frozen, extends = Report, module = "anisobond")]
pub struct GridTest {
    report: GridTestReport,
}

impl GridTest {
    fn tensor(&self, rows: &[[f64; 6]; 6], what: &str) -> PyResult<Stiffness> {
        Ok(Stiffness::named(convert::tensor_of_rows(rows)?, format!("{} {what}", self.report.material)))
    }
}

#[pymethods]
impl GridTest {
    /// The wanted tensor.
    #[getter]
    fn target(&self) -> PyResult<Stiffness> {
        self.tensor(&self.report.target, "target")
    }

    /// What the calibration promises of the perfect grid.
    #[getter]
    fn promised(&self) -> PyResult<Stiffness> {
        self.tensor(&self.report.promised, "promised")
    }

    /// The measured tensor.
    #[getter]
    fn measured(&self) -> PyResult<Stiffness> {
        self.tensor(&self.report.measured, "measured")
    }

    /// The sum over bonds at uniform strain.
    #[getter]
    fn summed(&self) -> PyResult<Stiffness> {
        self.tensor(&self.report.summed, "summed")
    }

    /// ‖promised − measured‖/‖promised‖.
    #[getter]
    fn error(&self) -> f64 {
        self.report.relative_error
    }

    /// Whether the solver converged; else the values are not final.
    #[getter]
    fn converged(&self) -> bool {
        self.report.solver.converged
    }

    /// ‖target − measured‖/‖target‖.
    #[getter]
    fn target_error(&self) -> f64 {
        self.report.target_error
    }

    /// Whether no displacement of negative energy was met and the grid's waves are stable.
    #[getter]
    fn stable(&self) -> bool {
        self.report.stable
    }

    /// How that is known: proved, or sampled by the displacements of the test.
    #[getter]
    fn evidence(&self) -> &'static str {
        self.report.stability.evidence.name()
    }
}

/// The cell that the keywords describe.
fn cell_of(
    nodes: [usize; 3],
    missing: f64,
    displaced: f64,
    voids: Option<&Bound<'_, PyAny>>,
    seed: u64,
) -> PyResult<GridCell> {
    let mut cell = GridCell { nodes, missing: Vec::new(), displacement: displaced, seed };
    if missing != 0.0 {
        cell = cell.with_missing(missing).map_err(|e| raised(e.at("missing")))?;
    }
    let Some(voids) = voids else { return Ok(cell) };
    let middle = nodes.map(|n| 0.5 * (n as f64 - 1.0));
    let all: Vec<([f64; 3], f64)> = match voids.extract::<f64>() {
        Ok(radius) => vec![(middle, radius)],
        Err(_) => {
            let rows = convert::array(voids, "voids")?;
            let each = |row: &[f64]| ([row[0], row[1], row[2]], row[3]);
            match (rows.shape(), rows.as_slice()) {
                (&[_, 4], Ok(numbers)) => numbers.chunks_exact(4).map(each).collect(),
                _ => {
                    let remedy = "give a radius, or rows (x, y, z, radius), in spacings";
                    return Err(wrong("voids are no rows of four numbers", remedy));
                }
            }
        }
    };
    for (centre, radius) in all {
        cell = cell.with_void(centre, radius).map_err(|e| raised(e.at("voids")))?;
    }
    Ok(cell)
}

/// Measure the stiffness of a periodic cell of a grid, perfect or with defects, as `anisobond element-test --grid`.
///
/// `nodes` is one number or three. `missing` is the share of nodes left out, `displaced` the largest displacement of a node
/// along each axis (spacings), `voids` a radius (spacings) of a void in the middle, or rows (x, y, z, radius). `correct`
/// brings the measured tensor to the target. The bonds are those of a `Neighbourhood`, or of its keywords. `progress` is
/// True, a callable (done, total, message), or tqdm: iterations of the solver, of which no total is known.
///
/// >>> test = grid_test("KIO3", 5, model="hybrid", horizon=2)
/// >>> test.error < 1e-8 and test.target_error < 1e-8
/// True
#[pyfunction]
#[pyo3(signature = (material, nodes, neighbourhood=None, *, model="central", correct=None, rotations="free", missing=0.0,
                    displaced=0.0, voids=None, seed=0, progress=None, **keywords))]
#[allow(clippy::too_many_arguments)] // They are keywords.
pub fn grid_test<'py>(
    py: Python<'py>,
    material: &Bound<'py, PyAny>,
    nodes: &Bound<'py, PyAny>,
    neighbourhood: Option<&Bound<'py, Neighbourhood>>,
    model: &str,
    correct: Option<&Bound<'py, PyAny>>,
    rotations: &str,
    missing: f64,
    displaced: f64,
    voids: Option<&Bound<'py, PyAny>>,
    seed: i128,
    progress: Option<&Bound<'py, PyAny>>,
    keywords: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, GridTest>> {
    let rotations = convert::choice(rotations, "rotations", &ROTATIONS)?;
    let correct = correction_of(correct)?;
    if correct == Some(CorrectionChoice::Elliptic) {
        return Err(wrong("the elliptic correction of a grid", "use correct=True, which corrects every direction"));
    }
    let material = material_of(material)?;
    let grid = chosen(py, "grid_test", neighbourhood, keywords)?.get().grid.clone();
    let settings = GridStudy::settings(convert::choice(model, "model", &MODELS)?, rotations);
    let cell =
        cell_of(convert::three_counts(nodes, "nodes")?, missing, displaced, voids, convert::count(seed, "seed")?)?;
    // Refused here, before a thread is begun for it.
    material.stiffness.require_positive_definite().or_raise()?;
    let report = iterated(py, progress, "grid test", move |watch| {
        let test = ElementTest { watch: watch.clone(), ..GridStudy::usual_test(rotations) };
        let correction = correct.map(|_| Correction { test: test.clone(), ..Correction::default() });
        let calibrator = ModelCalibrator::new(&grid, settings)?;
        let study = GridStudy::new(&calibrator, cell, &material.stiffness, correction.as_ref())?;
        let result = study.test(&test)?;
        Ok(GridTestReport::new(&material, &calibrator, &study, &result))
    })?;
    warned(py, &report.warnings)?;
    let [i, j, k] = report.cell.places;
    let summary = format!(
        "{}: {i} × {j} × {k} nodes, measured is {} from promised",
        report.material,
        percent(report.relative_error)
    );
    let base = Report::new(summary, &report, describe::grid_test(&report))?;
    Bound::new(py, PyClassInitializer::from(base).add_subclass(GridTest { report }))
}
