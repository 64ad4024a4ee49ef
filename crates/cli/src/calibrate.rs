//! `anisobond calibrate`.

use anisobond::calibration::{
    HybridForm, LowerBound, ModelCalibration, ModelCalibrator, ModelSettings, Outcome, Promise,
};
use anisobond::lattice::{Neighbourhood, Shape};
use anisobond::tensor::{Material, Metric};
use anisobond::{Error, Result};
use anisobond_app::{Files, ModelReport, NeighbourhoodReport};
use anisobond_formats::{BondModuli, Reading, parse_orientation};

use crate::args::{FormName, MetricName, ModelName, PromiseName};
use crate::{Ending, args, calibration_text, folder, report, table, text};

pub fn run(args: &args::Calibrate) -> Result<Ending> {
    let settings = settings(args)?;
    if let Some(error) = args.require_exact
        && (error.is_nan() || error < 0.0)
    {
        return Err(Error::input(format!("--require-exact={error}"), "give a relative error ≥ 0, as 1e-9"));
    }
    let views = views(&args.cut)?;
    if args.table.row.is_none() && anisobond_formats::is_table(&args.material) {
        let neighbourhood = neighbourhood(&args.neighbourhood)?;
        let calibrator = ModelCalibrator::new(&neighbourhood, settings)?;
        return table::run(args, &if args.prove { calibrator } else { calibrator.without_proof() });
    }
    if args.prove {
        let problem = format!("--prove, but {} is one material", args.material);
        return Err(Error::input(problem, "leave it out: one material's stability is always proved where it can be"));
    }
    if args.jsonl {
        return Err(Error::input(format!("--jsonl, but {} is one material", args.material), "use --json"));
    }
    let Reading { material, read_as, notes } = args.table.find(&args.material)?;
    if !notes.is_empty() {
        eprintln!("note: read as {read_as}");
    }
    let done = Calibrated::new(args, material)?;
    let report = &done.report;
    text::warn(report.warnings());
    if let Some(folder) = &args.output {
        folder::write(folder, &done.files(views)?, args.force)?;
        report::beside(args.report, folder)?;
    }
    if args.json {
        text::print_json(report)?;
    } else {
        text::print(&calibration_text::describe(report))?;
    }
    let promised = done.result.promised_error();
    Ok(match args.require_exact {
        Some(error) if promised.is_nan() || promised > error => {
            eprintln!(
                "anisobond: the {} model promises the target to {} %, not to the required {} %",
                done.result.model().name(),
                text::number(100.0 * promised),
                text::number(100.0 * error)
            );
            Ending::NotExact
        }
        _ if done.result.outcome() == Outcome::NotConverged => {
            eprintln!("anisobond: the calibration did not converge; the bonds are what the solver came to");
            Ending::NotConverged
        }
        _ => Ending::Done,
    })
}

/// The model that the flags describe; flags of another model are refused.
fn settings(args: &args::Calibrate) -> Result<ModelSettings> {
    let only = |flag: &str, model: &str| {
        Error::input(format!("{flag} belongs to {model}"), format!("add --model {model}, or leave it out"))
    };
    match (args.model, args.form, args.promise) {
        (ModelName::Central | ModelName::Micropolar, Some(_), _) => return Err(only("--form", "hybrid")),
        (ModelName::Central | ModelName::Hybrid, _, Some(_)) => return Err(only("--promise", "micropolar")),
        _ => {}
    }
    if let (ModelName::Micropolar | ModelName::Hybrid, Some(bound)) = (args.model, &args.lower_bound) {
        return Err(Error::input(
            format!("--lower-bound {bound} belongs to central bonds"),
            "leave it out: micropolar bonds are ≥ 0, hybrid --form stable has a positive floor of its own",
        ));
    }
    if let (ModelName::Micropolar | ModelName::Hybrid, Some(_)) = (args.model, args.metric) {
        return Err(only("--metric", "central"));
    }
    let metric = match args.metric {
        None | Some(MetricName::Norm) => Metric::Norm,
        Some(MetricName::Energy) => Metric::Energy,
    };
    Ok(match args.model {
        ModelName::Central => ModelSettings::Central(lower_bound(args.lower_bound.as_deref().unwrap_or("0"))?, metric),
        ModelName::Micropolar => ModelSettings::Micropolar(match args.promise {
            None | Some(PromiseName::Sum) => Promise::Sum,
            Some(PromiseName::FreeRotations) => Promise::FreeRotations,
        }),
        ModelName::Hybrid => ModelSettings::Hybrid(args.form.map(|form| match form {
            FormName::Remainder => HybridForm::Remainder,
            FormName::Stable => HybridForm::Stable,
        })),
    })
}

fn lower_bound(text: &str) -> Result<LowerBound> {
    if text.trim() == "max" {
        return Ok(LowerBound::Largest);
    }
    match text.trim().parse::<f64>() {
        Ok(l) if l.is_finite() && l >= 0.0 => Ok(LowerBound::Value(l)),
        _ => Err(Error::input(format!("--lower-bound {text}"), "give a number ≥ 0 (N/m⁶), or max")),
    }
}

/// Shape, horizon (spacings) and spacing (m) that the flags describe.
pub fn shape_and_horizon(args: &args::NeighbourhoodArgs) -> Result<(Shape, f64, f64)> {
    let (spacing, _) = text::length(&args.spacing, "--spacing")?;
    let semi_axes =
        args.semi_axes.as_deref().map(|a| text::vector(a, "--semi-axes").map(|v| [v.x, v.y, v.z])).transpose()?;
    let horizon = match &args.horizon {
        None => None,
        Some(given) => Some(match text::length(given, "--horizon")? {
            (ratio, false) => ratio,
            (length, true) => length / spacing,
        }),
    };
    if semi_axes.is_some() && matches!(args.shape, args::ShapeName::Sphere | args::ShapeName::Cube) {
        return Err(Error::input(
            "--semi-axes given for a sphere or a cube",
            "add --shape cuboid or --shape ellipsoid, or use --horizon alone",
        ));
    }
    let name = match args.shape {
        args::ShapeName::Sphere => "sphere",
        args::ShapeName::Cube => "cube",
        args::ShapeName::Cuboid => "cuboid",
        args::ShapeName::Ellipsoid => "ellipsoid",
    };
    let (shape, horizon) = Shape::named(name, horizon, semi_axes)?;
    Ok((shape, horizon, spacing))
}

/// The neighbourhood that the flags describe.
pub fn neighbourhood(args: &args::NeighbourhoodArgs) -> Result<Neighbourhood> {
    let (shape, horizon, spacing) = shape_and_horizon(args)?;
    let influence = anisobond_formats::find_influence(&args.influence).map_err(|e| e.at("--influence"))?;
    let mut neighbourhood = Neighbourhood::new(shape, horizon, spacing, influence)?;
    for rotation in &args.rotate {
        let q = parse_orientation(rotation).map_err(|e| e.at("--rotate"))?;
        neighbourhood = neighbourhood.rotated(&q)?;
    }
    Ok(neighbourhood)
}

/// The panels of the picture: the whole, and the cuts asked for.
fn views(cuts: &[String]) -> Result<Option<Vec<anisobond_plot::View>>> {
    if cuts.is_empty() {
        return Ok(None);
    }
    let mut views = vec![anisobond_plot::View::whole()];
    for cut in cuts {
        let normal = text::vector(cut, "--cut")?;
        views.push(anisobond_plot::View::cut(normal).map_err(|e| e.at("--cut"))?);
    }
    Ok(Some(views))
}

/// One material, calibrated.
pub struct Calibrated {
    pub material: Material,
    pub neighbourhood: Neighbourhood,
    pub result: ModelCalibration,
    pub report: ModelReport,
}

impl Calibrated {
    /// Calibrate a material as the flags say.
    pub fn new(args: &args::Calibrate, material: Material) -> Result<Self> {
        let neighbourhood = neighbourhood(&args.neighbourhood)?;
        let calibrator = ModelCalibrator::new(&neighbourhood, settings(args)?)?;
        let result = calibrator.calibrate(&material.stiffness)?;
        let report = ModelReport::new(&material, &NeighbourhoodReport::new(&calibrator), &result);
        Ok(Calibrated { material, neighbourhood, result, report })
    }

    /// The bonds as a table.
    pub fn bonds(&self) -> Result<String> {
        anisobond_formats::bonds_csv(&self.neighbourhood, &BondModuli::of(&self.result), &self.material.name)
    }

    /// The files of a folder, made in memory.
    pub fn files(&self, views: Option<Vec<anisobond_plot::View>>) -> Result<Files> {
        anisobond_app::calibration_files(&self.material, &self.neighbourhood, &self.result, &self.report, views)
    }
}
