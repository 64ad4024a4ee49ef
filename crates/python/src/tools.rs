//! The command line, exports, pages, the documents' values, and settings of the process.

use std::ffi::{CString, OsString};
use std::path::PathBuf;

use anisobond::experiment::FieldName;
use anisobond::tensor::Material;
use anisobond_app::{BondedCell, Engine, report_page};
use anisobond_cli::describe;
use anisobond_formats::write_atomically;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::convert;
use crate::work::{background, wrong};

/// Run the program `anisobond` with these words, its name first; the exit code.
#[pyfunction]
pub fn command_line(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| anisobond_cli::main_from(words))
}

/// Threads to use; before the first work, and once in a process.
#[pyfunction]
pub fn set_threads(threads: i128) -> PyResult<()> {
    let threads = convert::count(threads, "threads")? as usize;
    if threads == 0 {
        return Err(wrong("0 threads", "give at least 1"));
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|_| wrong("the threads are at work already", "call set_threads before anything else, once"))
}

/// The built-in materials.
///
/// >>> sorted(builtin_materials())[:3]
/// ['CoTeO4', 'KIO3', 'MoN']
#[pyfunction]
pub fn builtin_materials() -> Vec<&'static str> {
    Material::builtin_names()
}

/// The fields that a run can write, as case files and VTK files name them: a `Table` of `field`, `array` (the name in VTK
/// files), `unit`, `components` and `meaning`.
///
/// >>> table = fields()
/// >>> row = table["field"].index("stress")
/// >>> table["array"][row], table["components"][row]
/// ('stress (Pa)', 'xx yy zz xy yz xz')
#[pyfunction]
pub fn fields(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    let all = FieldName::ALL.map(|field| (field.labelled(), field.about()));
    let columns = PyDict::new(py);
    columns.set_item("field", all.iter().map(|(_, about)| about.key).collect::<Vec<_>>())?;
    columns.set_item("array", all.iter().map(|(array, _)| array.as_str()).collect::<Vec<_>>())?;
    columns.set_item("unit", all.iter().map(|(_, about)| about.unit).collect::<Vec<_>>())?;
    columns.set_item("components", all.iter().map(|(_, about)| about.components.join(" ")).collect::<Vec<_>>())?;
    columns.set_item("meaning", all.iter().map(|(_, about)| about.meaning).collect::<Vec<_>>())?;
    crate::report::table(py, "fields", columns)
}

/// Write calibrated bonds for an engine, with an input that performs the engine's own element test, as `anisobond export`;
/// the paths written.
///
/// `folder` is one that `Calibration.write` or `Lattice.write` wrote; `to` is lammps, abaqus, calculix, yade, woo, peridigm,
/// perilab, matrix-market or numpy; `nodes` are those of a grid's periodic block along each axis. Peridigm and PeriLab have one
/// micromodulus for all bonds: `within` is how far its tensor may be from the calibrated one, as a share. `output` is the
/// folder [FOLDER/ENGINE]; other results there are refused, or replaced with `force`.
#[pyfunction]
#[pyo3(signature = (folder, *, to, nodes=None, within=1e-6, output=None, force=false))]
pub fn export(
    py: Python<'_>,
    folder: &Bound<'_, PyAny>,
    to: &str,
    nodes: Option<&Bound<'_, PyAny>>,
    within: f64,
    output: Option<&Bound<'_, PyAny>>,
    force: bool,
) -> PyResult<Vec<PathBuf>> {
    let engines = [
        ("lammps", Engine::Lammps),
        ("abaqus", Engine::Abaqus),
        ("calculix", Engine::Calculix),
        ("yade", Engine::Yade),
        ("woo", Engine::Woo),
        ("peridigm", Engine::Peridigm(within)),
        ("perilab", Engine::PeriLab(within)),
        ("matrix-market", Engine::MatrixMarket),
        ("numpy", Engine::Numpy),
    ];
    let engine = convert::choice(to, "to", &engines)?;
    let folder = convert::path(folder)?;
    let nodes = nodes.map(|n| convert::three_counts(n, "nodes")).transpose()?;
    let output = output.map_or_else(|| Ok(folder.join(to)), convert::path)?;
    let (files, warning) = background(py, move || {
        let export = anisobond_app::export(&BondedCell::read(&folder, nodes)?, engine)?;
        export.write(&output, force)?;
        Ok((export.files.iter().map(|f| output.join(&f.0)).collect(), export.warning))
    })?;
    if let Some(warning) = warning {
        let text = CString::new(warning.to_string()).unwrap_or_default();
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    Ok(files)
}

/// Write one self-contained HTML page of a folder of results, as `anisobond report`; its path [FOLDER/report.html].
#[pyfunction]
#[pyo3(signature = (folder, output=None))]
pub fn report(py: Python<'_>, folder: &Bound<'_, PyAny>, output: Option<&Bound<'_, PyAny>>) -> PyResult<PathBuf> {
    let folder = convert::path(folder)?;
    // A page elsewhere may be of a run that goes on.
    let beside = output.is_none() && folder.is_dir();
    let output = output.map_or_else(|| Ok(folder.join("report.html")), convert::path)?;
    background(py, move || {
        let _lock = beside.then(|| anisobond_app::FolderLock::alone(&folder)).transpose()?;
        write_atomically(&output, report_page(&folder, "")?)?;
        Ok(output)
    })
}

/// Recompute the printed values of a document, as `anisobond verify`: prakash, smilauer (with its `packing`) or cavity. A
/// `Table` of place, quantity, published, reference, ours, verdict and note.
#[pyfunction]
#[pyo3(signature = (suite, *, packing=None))]
pub fn verify<'py>(py: Python<'py>, suite: String, packing: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
    let packing = packing.map(convert::path).transpose()?;
    let (document, findings) = background(py, move || describe::verify(&suite, packing.as_deref()))?;
    let columns = PyDict::new(py);
    columns.set_item("place", findings.iter().map(|f| f.place).collect::<Vec<_>>())?;
    columns.set_item("quantity", findings.iter().map(|f| f.quantity.as_str()).collect::<Vec<_>>())?;
    columns.set_item("published", findings.iter().map(|f| f.published.as_str()).collect::<Vec<_>>())?;
    let n = [findings.len()];
    columns
        .set_item("reference", convert::shaped(py, findings.iter().map(|f| f.reference).collect::<Vec<f64>>(), &n)?)?;
    columns.set_item("ours", convert::shaped(py, findings.iter().map(|f| f.ours).collect::<Vec<f64>>(), &n)?)?;
    let verdicts = findings.iter().map(|f| convert::value_of(&f.verdict()));
    let verdicts: Vec<String> = verdicts.map(|v| Ok(v?.as_str().unwrap_or("").into())).collect::<PyResult<_>>()?;
    columns.set_item("verdict", verdicts)?;
    columns.set_item("note", findings.iter().map(|f| f.note).collect::<Vec<_>>())?;
    crate::report::table(py, document, columns)
}
