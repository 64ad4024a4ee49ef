//! `anisobond calibrate`.

use std::path::Path;

use anisobond::calibration::{Calibration, Calibrator, LowerBound};
use anisobond::io::{self, CalibrationReport, parse_orientation, picture};
use anisobond::lattice::{Influence, Neighbourhood, Shape};
use anisobond::tensor::Material;
use anisobond::{Error, Result};

use crate::{Ending, args, folder, table, text};

pub fn run(args: &args::Calibrate) -> Result<Ending> {
    let bound = lower_bound(&args.lower_bound)?;
    if let Some(error) = args.require_exact
        && (error.is_nan() || error < 0.0)
    {
        return Err(Error::input(format!("--require-exact={error}"), "give a relative error ≥ 0, as 1e-9"));
    }
    let views = views(&args.cut)?;
    if args.table.row.is_none() && io::is_table(&args.material) {
        let neighbourhood = neighbourhood(&args.neighbourhood)?;
        return table::run(args, &Calibrator::new(&neighbourhood), bound);
    }
    if args.jsonl {
        return Err(Error::input(format!("--jsonl, but {} is one material", args.material), "use --json"));
    }
    let material = io::find_material(&args.material, args.table.row.as_deref(), args.table.unit.as_deref())?;
    let neighbourhood = neighbourhood(&args.neighbourhood)?;
    let calibrator = Calibrator::new(&neighbourhood);
    let r = calibrator.calibrate(&material.stiffness, bound)?;
    let report = CalibrationReport::new(&material, &calibrator, &r);
    if let Some(folder) = &args.output {
        write_folder(folder, &material, &neighbourhood, &r, &report, views)?;
    }
    if args.json {
        text::print_json(&report)?;
    } else {
        text::print(&describe(&report))?;
    }
    Ok(match args.require_exact {
        Some(error) if !r.exact(error) => {
            eprintln!(
                "anisobond: the bonds reach the target to {} %, not to the required {} %",
                text::number(100.0 * r.relative_error),
                text::number(100.0 * error)
            );
            Ending::NotExact
        }
        _ => Ending::Done,
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

/// The neighbourhood that the flags describe.
pub fn neighbourhood(args: &args::NeighbourhoodArgs) -> Result<Neighbourhood> {
    let (spacing, _) = text::length(&args.spacing, "--spacing")?;
    let semi_axes =
        args.semi_axes.as_deref().map(|a| text::vector(a, "--semi-axes").map(|v| [v.x, v.y, v.z])).transpose()?;
    let horizon = match &args.horizon {
        None => semi_axes.map_or(6.0, |a| a.into_iter().fold(0.0, f64::max)),
        Some(given) => match text::length(given, "--horizon")? {
            (ratio, false) => ratio,
            (length, true) => length / spacing,
        },
    };
    let axes = semi_axes.unwrap_or([4.0 / 6.0 * horizon, 5.0 / 6.0 * horizon, horizon]);
    let shape = match args.shape {
        args::ShapeName::Cuboid => Shape::Cuboid { semi_axes: axes },
        args::ShapeName::Ellipsoid => Shape::Ellipsoid { semi_axes: axes },
        _ if semi_axes.is_some() => {
            return Err(Error::input(
                "--semi-axes given for a sphere or a cube",
                "add --shape cuboid or --shape ellipsoid, or use --horizon alone",
            ));
        }
        args::ShapeName::Cube => Shape::Cube { semi_edge: horizon },
        args::ShapeName::Sphere => Shape::Sphere { radius: horizon },
    };
    let mut neighbourhood = Neighbourhood::new(shape, horizon, spacing, influence(&args.influence)?)?;
    for rotation in &args.rotate {
        let q = parse_orientation(rotation).map_err(|e| e.at("--rotate"))?;
        neighbourhood = neighbourhood.rotated(&q)?;
    }
    Ok(neighbourhood)
}

fn influence(name: &str) -> Result<Influence> {
    Ok(match name {
        "constant" => Influence::Constant,
        "inverse" => Influence::Inverse,
        "hat" => Influence::Hat,
        "power" => Influence::Power,
        file if Path::new(file).is_file() => io::read_influence(file)?,
        other => {
            return Err(Error::input(
                format!("--influence {other}: neither a known function nor a file"),
                "use constant, inverse, hat, power, or a CSV file of r/δ, ω",
            ));
        }
    })
}

/// The panels of the picture: the whole, and the cuts asked for.
fn views(cuts: &[String]) -> Result<Option<Vec<picture::View>>> {
    if cuts.is_empty() {
        return Ok(None);
    }
    let mut views = vec![picture::View::whole()];
    for cut in cuts {
        let normal = text::vector(cut, "--cut")?;
        views.push(picture::View::cut(normal).map_err(|e| e.at("--cut"))?);
    }
    Ok(Some(views))
}

/// Everything is made in memory before the first file is written.
fn write_folder(
    folder: &Path,
    material: &Material,
    neighbourhood: &Neighbourhood,
    r: &Calibration,
    report: &CalibrationReport,
    views: Option<Vec<picture::View>>,
) -> Result<()> {
    let c = &r.micromodulus;
    let mut options = picture::NeighbourhoodPicture::of(&material.name);
    if let Some(views) = views {
        options.views = views;
    }
    let scene = picture::neighbourhood_scene(neighbourhood, c, &options)?;
    let files: [(&str, Vec<u8>); 5] = [
        ("calibration.json", folder::json(report, folder)?),
        ("bonds.csv", io::bonds_csv(neighbourhood, c, &material.name)?.into_bytes()),
        ("neighbourhood.vtp", io::neighbourhood_vtp(neighbourhood, c)?.into_bytes()),
        ("neighbourhood.svg", scene.svg().into_bytes()),
        ("neighbourhood.png", scene.png(PICTURE_WIDTH)?),
    ];
    folder::write(folder, &files)
}

/// Width of the PNG picture (pixels).
const PICTURE_WIDTH: u32 = 1800;

fn describe(r: &CalibrationReport) -> String {
    let n = &r.neighbourhood;
    let (unit, name) = text::stress_unit(text::largest(&r.target));
    let mut out = r.material.clone();
    if !r.source.is_empty() {
        out += &format!(" ({})", r.source);
    }
    let [a, b, c] = n.semi_axes.map(text::number);
    let shape = match n.shape.as_str() {
        "sphere" | "cube" => n.shape.clone(),
        other => format!("{other} {a} × {b} × {c}"),
    };
    out += &format!(
        "\n{} bonds: {shape}, horizon {} Δ, Δ = {} m, influence {}\n",
        n.bonds,
        text::number(n.horizon),
        text::number(n.spacing),
        n.influence
    );
    out += &format!("\n  {:61} {}\n", format!("target ({name})"), format_args!("reached ({name})"));
    for (target, reached) in text::matrix_rows(&r.target, unit).iter().zip(text::matrix_rows(&r.reached, unit)) {
        out += &format!("{target}  {reached}\n");
    }
    let percent = |x: f64| if x < 1e-14 { "0".into() } else { text::number(100.0 * x) };
    out += &format!(
        "\nrelative error   {} %  (Cauchy gap {} %: the least that central bonds can reach)\n",
        percent(r.relative_error),
        percent(r.cauchy_gap)
    );
    match &r.infeasibility {
        None => out += "feasible         yes\n",
        Some(i) => {
            out += &format!("feasible         no: {}\n", i.explanation);
            out += &format!(
                "certificate      y(n) ≤ {:.1e} on every bond, y·S = {} {name}, distance {} % of the Cauchy part\n",
                i.largest_bond_product,
                text::number(i.target_product / unit),
                percent(i.distance)
            );
        }
    }
    out += &format!("anisotropy A^U   {}\n", text::number(r.universal_anisotropy));
    let m = &r.micromodulus;
    out += &format!(
        "micromodulus c   {} … {} N/m⁶, mean {}, {} of {} bonds zero\n",
        text::number(m.min),
        text::number(m.max),
        text::number(m.mean),
        m.zero,
        n.bonds
    );
    if r.lower_bound > 0.0 {
        out += &format!("lower bound      {} N/m⁶\n", text::number(r.lower_bound));
    }
    out += &format!("solver           {} Newton steps, residual {:.1e}\n", r.solver.iterations, r.solver.residual);
    out
}
