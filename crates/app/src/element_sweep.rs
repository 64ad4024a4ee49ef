//! Element tests over a table of parameters: what a job means, and its figure.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::{Matrix6, Vector3};
use serde_json::Value as Json;

use crate::lattice_report::ElementTestReport;
use crate::refuse_other_kind;
use crate::sweep::{Job, JobLog, Options, ParameterTable, Progress, Shard, Store, Summary, Value, run_sweep};
use anisobond::calibration::{Model, TransverseConstants, axis_of_strike_and_dip};
use anisobond::experiment::element_test::{DynamicTest, ElementTest, Rotations};
use anisobond::experiment::{CorrectionChoice, LatticePlan, LatticeStudy, anisotropy_axis, turned_to_axis};
use anisobond::lattice::Packing;
use anisobond::solver::Watch;
use anisobond::tensor::{Material, Metric, Stiffness};
use anisobond::{Error, Result};
use anisobond_formats::inputs::{Inputs, recorded};
use anisobond_formats::{
    PackingOptions, find_material, json_value, parse_angle, parse_stress, parse_vector, read_packing_as,
};
use anisobond_plot::{Chart, StiffnessRow, stiffness_chart};

/// The parameters of an element test's job.
///
/// `packing` (a file; required), with `length_unit`, `frame` and `type_radii` where it leaves them open; `contact_radius` (required); `material` (a name or a file) or `c11`, `c33`, `c13`, `c12` with
/// units; `strike` and `dip` (degrees) or `axis` ("x,y,z"); `rotations` (free, blocked); `method` (static, dynamic) and
/// `strain` (of a dynamic test); `model` (central, micropolar, hybrid), `correct` (general, elliptic, no) and `metric` (norm, energy; of central bonds).
#[rustfmt::skip]
pub const PARAMETERS: [&str; 19] = [
    "packing", "contact_radius", "material", "c11", "c33", "c13", "c12", "axis", "strike", "dip", "rotations", "method",
    "strain", "model", "correct", "metric", "length_unit", "frame", "type_radii",
];

/// The files that the jobs of a table need, read once.
pub struct ElementSweep {
    packings: HashMap<String, Packing>,
    materials: HashMap<String, Material>,
    /// What each name of a packing or a material was read from.
    read: HashMap<String, Inputs>,
}

impl ElementSweep {
    /// Read the packings and materials of a table; relative paths start at the table's folder.
    ///
    /// # Errors
    /// A parameter that is unknown, missing or of the wrong kind; a file that cannot be read.
    pub fn new(table: &ParameterTable) -> Result<Self> {
        table.check_names(&PARAMETERS)?;
        let folder = Path::new(table.file()).parent().unwrap_or(Path::new("")).to_path_buf();
        let mut sweep = ElementSweep { packings: HashMap::new(), materials: HashMap::new(), read: HashMap::new() };
        for job in table.jobs() {
            let placed = |e: Error| e.at(format!("{}, {}", table.file(), job.place));
            let (key, options) = spheres(job).map_err(placed)?;
            if !sweep.packings.contains_key(&key) {
                let path = from(&folder, required_text(job, "packing").map_err(placed)?);
                let (found, read) = recorded(|| read_packing_as(path, &options));
                sweep.packings.insert(key.clone(), found.map_err(placed)?.packing);
                sweep.read.insert(key, read);
            }
            if let Some(name) = job.get("material").and_then(Value::text)
                && !sweep.materials.contains_key(name)
            {
                let path = from(&folder, name);
                let found = if path.exists() { path.display().to_string() } else { name.to_string() };
                let (material, read) = recorded(|| find_material(&found, None, None));
                sweep.materials.insert(name.into(), material.map_err(placed)?);
                sweep.read.insert(name.into(), read);
            }
            // Everything else of the job, before the first one is begun.
            sweep.material(job).map_err(placed)?;
            number(job, "contact_radius")?.ok_or_else(|| placed(missing("contact_radius")))?;
            rotations(job).map_err(placed)?;
            dynamic_strain(job).map_err(placed)?;
            metric(job).map_err(placed)?;
            correction(job).map_err(placed)?;
        }
        Ok(sweep)
    }

    /// One job: the element test of its lattice, as the JSON of [`ElementTestReport`].
    ///
    /// # Errors
    /// A lattice that cannot be made or is a mechanism, moduli that are not admissible; [`Error::Interrupted`] where the
    /// watch stops it.
    pub fn job(&self, job: &Job, log: &mut JobLog, watch: &Arc<Watch>) -> Result<Json> {
        let material = self.material(job)?;
        let axis = anisotropy_axis(&material.stiffness);
        let contact_radius = number(job, "contact_radius")?.ok_or_else(|| missing("contact_radius"))?;
        let packing = self.packings.get(&spheres(job)?.0).ok_or_else(|| missing("packing"))?;
        // The sweep runs its jobs side by side; each on one thread.
        let rotations = rotations(job)?;
        let test = ElementTest { rotations, threads: false, watch: watch.clone(), ..ElementTest::default() };
        let plan =
            LatticePlan { metric: metric(job)?, ..LatticePlan::new(model(job)?, correction(job)?, test.clone()) };
        let study = LatticeStudy::planned(packing.clone(), &material.stiffness, &axis, contact_radius, &plan)?;
        log.line(format_args!("{} contacts, μ = {}", study.lattice.contacts.len(), study.stiffness.mu));
        let report = match dynamic_strain(job)? {
            None => ElementTestReport::of_static(&material, &study, &test.run(&study.network())?)?,
            Some(strain) => {
                let test = DynamicTest { rotations, strain, watch: watch.clone(), ..DynamicTest::default() };
                ElementTestReport::of_dynamic(&material, &study, &test.run(&study.network())?)?
            }
        };
        log.line(format_args!("{} iterations, residual {:.1e}", report.solver.iterations, report.solver.residual));
        json_value(&report)
    }

    /// The files that a job's parameters name, by content.
    pub fn inputs(&self, job: &Job) -> Inputs {
        let packing = spheres(job).ok().and_then(|(key, _)| self.read.get(&key));
        let material = job.get("material").and_then(Value::text).and_then(|name| self.read.get(name));
        packing.into_iter().chain(material).fold(Inputs::default(), Inputs::with)
    }

    /// The material, turned to the job's axis.
    fn material(&self, job: &Job) -> Result<Material> {
        let mut material = self.unturned(job)?;
        if let Some(axis) = axis(job)? {
            material.stiffness = turned_to_axis(&material.stiffness, &axis)?;
        }
        Ok(material)
    }

    fn unturned(&self, job: &Job) -> Result<Material> {
        if let Some(name) = job.get("material").and_then(Value::text) {
            return self.materials.get(name).cloned().ok_or_else(|| missing("material"));
        }
        let constant = |name: &str| match job.get(name) {
            Some(Value::Text(text)) => parse_stress(text).map_err(|e| e.at(name)),
            Some(Value::Number(x)) => {
                Err(Error::input(format!("{name} = {x} has no unit"), format!("write {name} = \"{x} MPa\"")))
            }
            None => Err(Error::input(
                format!("{name} is missing"),
                "give material, or all of c11, c33, c13 and c12 with units",
            )),
        };
        let constants = TransverseConstants {
            c11: constant("c11")?,
            c33: constant("c33")?,
            c13: constant("c13")?,
            c12: constant("c12")?,
        };
        let stiffness = constants.stiffness(&Vector3::z());
        stiffness.require_positive_definite()?;
        Ok(Material { name: "c11 c33 c13 c12".into(), stiffness, density: None, source: String::new() })
    }
}

/// Runs the jobs of a table, or of its shard, that the store in a folder (`results.sqlite`) does not have yet. When `stop`
/// turns true the jobs under way end, too, and are not finished. Jobs are known by what their packings and materials hold: one
/// whose files have changed is done anew, and [`Store::notes`] names them.
///
/// # Errors
/// A store of another table, a folder of other results; files that cannot be written.
pub fn sweep_into(
    folder: &Path,
    table: &ParameterTable,
    sweep: &ElementSweep,
    shard: Option<Shard>,
    retry: bool,
    stop: &Arc<AtomicBool>,
    observe: impl Fn(Progress) + Sync + Send,
) -> Result<(Store, Summary)> {
    refuse_other_kind(folder, "a sweep")?;
    let settings = serde_json::json!({ "experiment": "element-test" });
    let store = Store::open_with(store_in(folder, shard), table, shard, &settings, |job| sweep.inputs(job))?;
    let options = Options { retry, logs: folder.join("logs") };
    let job = |job: &Job, log: &mut JobLog| sweep.job(job, log, &Watch::stopped_by(stop.clone()));
    let summary = run_sweep(table, &store, &options, stop, job, observe)?;
    Ok((store, summary))
}

/// Path of the store of a sweep, or of one of its shards, in a folder.
pub fn store_in(folder: &Path, shard: Option<Shard>) -> PathBuf {
    let whole = folder.join("results.sqlite");
    shard.map_or_else(|| whole.clone(), |shard| shard.store(&whole))
}

/// Writes a store's table beside it as CSV and, of a whole sweep over contact radii, its chart; the names of the files.
///
/// # Errors
/// A store that cannot be read, files that cannot be written.
pub fn write_sweep(folder: &Path, store: &Store, of_shard: bool) -> Result<Vec<String>> {
    let csv = store.path().with_extension("csv");
    store.write_csv(&csv)?;
    let mut wrote = vec![csv.file_name().unwrap_or_default().to_string_lossy().into_owned()];
    if !of_shard && let Some(chart) = contact_radius_chart(store)? {
        chart.write(folder.join("stiffness.svg"))?;
        chart.write(folder.join("stiffness.png"))?;
        wrote.extend(["stiffness.svg", "stiffness.png", "stiffness.csv"].map(String::from));
    }
    Ok(wrote)
}

/// The document's figure of a finished sweep over contact radii: prescribed, summed and measured stiffness; `None` where
/// other parameters vary too, or fewer than two jobs are done.
///
/// # Errors
/// A store that cannot be read.
pub fn contact_radius_chart(store: &Store) -> Result<Option<Chart>> {
    let mut rows = Vec::new();
    let mut common: Option<Json> = None;
    for record in store.records()? {
        let Some(result) = record.result else { continue };
        let mut others = record.parameters.clone();
        if let Some(map) = others.as_object_mut() {
            map.remove("contact_radius");
        }
        if common.get_or_insert_with(|| others.clone()) != &others {
            return Ok(None);
        }
        let tensor = |key: &str| tensor(&result[key]);
        if let (Some(contact_radius), Some(prescribed), Some(lattice), Some(measured)) =
            (record.parameters["contact_radius"].as_f64(), tensor("prescribed"), tensor("lattice"), tensor("measured"))
        {
            rows.push(StiffnessRow { contact_radius, prescribed, lattice, measured });
        }
    }
    if rows.len() < 2 {
        return Ok(None);
    }
    let components = [(1, 1), (3, 3), (1, 3), (1, 2), (4, 4), (6, 6)];
    let title = "Stiffness against contact radius";
    stiffness_chart(title, "prescribed, summed over the lattice, measured by element tests", &rows, &components)
        .map(Some)
}

/// A tensor from the rows of a report.
fn tensor(rows: &Json) -> Option<Stiffness> {
    let mut voigt = Matrix6::zeros();
    for a in 0..6 {
        for b in 0..6 {
            voigt[(a, b)] = rows.get(a)?.get(b)?.as_f64()?;
        }
    }
    Stiffness::from_voigt(&voigt).ok()
}

fn from(folder: &Path, path: &str) -> PathBuf {
    folder.join(path)
}

fn missing(name: &str) -> Error {
    Error::input(format!("{name} is missing"), format!("give {name} in the table"))
}

fn required_text<'j>(job: &'j Job, name: &str) -> Result<&'j str> {
    job.get(name).and_then(Value::text).ok_or_else(|| missing(name))
}

/// A number, if the job has the parameter.
fn number(job: &Job, name: &str) -> Result<Option<f64>> {
    match job.get(name) {
        None => Ok(None),
        Some(Value::Number(x)) => Ok(Some(*x)),
        Some(Value::Text(text)) => Err(Error::input(format!("{name} = {text:?}"), "give a number").at(&job.place)),
    }
}

fn model(job: &Job) -> Result<Model> {
    match job.get("model").and_then(Value::text) {
        None | Some("micropolar") => Ok(Model::Micropolar),
        Some("central") => Ok(Model::Central),
        Some("hybrid") => Ok(Model::Hybrid),
        Some(other) => Err(Error::input(format!("model = {other:?}"), "use central, micropolar or hybrid")),
    }
}

/// What is said of a job's spheres, and how their file is read.
fn spheres(job: &Job) -> Result<(String, PackingOptions)> {
    let word = |name: &str| job.get(name).map_or(String::new(), Value::to_string);
    let key = ["packing", "length_unit", "frame", "type_radii"].map(word).join("\n");
    required_text(job, "packing")?;
    let frame = number(job, "frame")?.map(|frame| match frame {
        frame if frame >= 0.0 && frame.fract() == 0.0 && frame < 9e15 => Ok(frame as u64),
        frame => Err(Error::input(format!("frame = {frame}"), "give a time step of the dump, as 5000")),
    });
    let length_unit = job.get("length_unit").map(Value::to_string);
    let options = PackingOptions { length_unit, frame: frame.transpose()?, ..PackingOptions::default() };
    match job.get("type_radii") {
        None => Ok((key, options)),
        Some(radii) => Ok((key, options.with_type_radii(&radii.to_string()).map_err(|e| e.at("type_radii"))?)),
    }
}

/// In which sense central bonds come close; refused for what else would not feel it.
fn metric(job: &Job) -> Result<Metric> {
    let metric = match job.get("metric").map(|value| value.text().and_then(Metric::named)) {
        None => return model(job).map(|_| Metric::Norm),
        Some(Some(metric)) => metric,
        Some(None) => return Err(Error::input("metric is none that is known", "use norm or energy")),
    };
    match (metric, model(job)?, correction(job)?) {
        (Metric::Norm, ..) | (_, Model::Central, None) => Ok(metric),
        _ => Err(Error::input(
            "metric = \"energy\" is for central bonds without correction",
            "give model = \"central\" and no correction, or leave it out",
        )),
    }
}

fn correction(job: &Job) -> Result<Option<CorrectionChoice>> {
    match job.get("correct").and_then(Value::text) {
        None | Some("no") => Ok(None),
        Some("elliptic") => Ok(Some(CorrectionChoice::Elliptic)),
        Some("general") => Ok(Some(CorrectionChoice::General)),
        Some(other) => Err(Error::input(format!("correct = {other:?}"), "use general, elliptic or no")),
    }
}

fn rotations(job: &Job) -> Result<Rotations> {
    match job.get("rotations").and_then(Value::text) {
        None | Some("free") => Ok(Rotations::Free),
        Some("blocked") => Ok(Rotations::Blocked),
        Some(other) => Err(Error::input(format!("rotations = {other:?}"), "use free or blocked")),
    }
}

/// The strain of a dynamic test; `None` for a static one.
fn dynamic_strain(job: &Job) -> Result<Option<f64>> {
    let strain = number(job, "strain")?;
    match (job.get("method").and_then(Value::text), strain) {
        (None | Some("static"), None) => Ok(None),
        (None | Some("static"), Some(_)) => {
            Err(Error::input("strain is given for a static test", "leave it out, or give method = dynamic"))
        }
        (Some("dynamic"), strain) => Ok(Some(strain.unwrap_or(DynamicTest::default().strain))),
        (Some(other), _) => Err(Error::input(format!("method = {other:?}"), "use static or dynamic")),
    }
}

/// Where the material's anisotropy axis shall lie, if the job says so.
fn axis(job: &Job) -> Result<Option<Vector3<f64>>> {
    let angle = |name: &str| match job.get(name) {
        None => Ok(None),
        Some(Value::Number(degrees)) => Ok(Some(degrees.to_radians())),
        Some(Value::Text(text)) => parse_angle(text).map(Some).map_err(|e| e.at(name)),
    };
    match (angle("strike")?, angle("dip")?, job.get("axis")) {
        (None, None, None) => Ok(None),
        (Some(strike), Some(dip), None) => axis_of_strike_and_dip(strike, dip).map(Some),
        (None, None, Some(axis)) => parse_vector(&axis.to_string()).map(Some).map_err(|e| e.at("axis")),
        _ => Err(Error::input("strike, dip and axis do not go together", "give strike and dip, or axis")),
    }
}
