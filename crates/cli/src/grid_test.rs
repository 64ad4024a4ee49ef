//! `anisobond element-test --grid`: the element test of a cell of a grid.

use anisobond::calibration::{Evidence, Model, ModelCalibrator};
use anisobond::experiment::element_test::{ElementTest, Rotations};
use anisobond::experiment::{Correction, GridStudy};
use anisobond::operator::GridCell;
use anisobond::{Error, Result};
use anisobond_app::GridTestReport;

use crate::lattice::{components, describe_correction, directional, model, model_name};
use crate::waiting::watched;
use crate::{Ending, args, calibrate, folder, report, text};

pub fn run(args: &args::ElementTest, rotations: Rotations) -> Result<Ending> {
    if args.method == args::MethodName::Dynamic {
        return Err(Error::input("--method dynamic with --grid", "give a packing, or leave out --method"));
    }
    if args.bonds.correct == Some(args::CorrectName::Elliptic) {
        return Err(Error::input("--correct elliptic with --grid", "use --correct, which corrects every direction"));
    }
    let material = args.bonds.table.find(&args.material)?.material;
    let neighbourhood = calibrate::neighbourhood(&args.neighbourhood)?;
    let test = GridStudy::usual_test(rotations);
    let model = model(args.bonds.model, Model::Central);
    let cell = cell(&args.grid)?;
    let calibrator = ModelCalibrator::new(&neighbourhood, GridStudy::settings(model, rotations))?;
    let (study, result) = watched(|watch| {
        let test = ElementTest { watch: watch.clone(), ..test };
        let correction = args.bonds.correct.map(|_| Correction { test: test.clone(), ..Correction::default() });
        let study = GridStudy::new(&calibrator, cell, &material.stiffness, correction.as_ref())?;
        let result = study.test(&test)?;
        Ok((study, result))
    })?;
    let report = GridTestReport::new(&material, &calibrator, &study, &result);
    if let Some(folder) = &args.output {
        let [i, j, k] = report.cell.places;
        let tensors = [("promised", &study.promised), ("measured", &result.measured)];
        let mut files = vec![
            ("element-test.json", anisobond_formats::json_file(&report)?),
            ("bonds.csv", anisobond_formats::network_bonds_csv(&study.network, &material.name).into_bytes()),
        ];
        files.extend(directional(&material, &format!("{i} × {j} × {k} nodes, {}", model_name(model)), &tensors)?);
        folder::write(folder, &files, args.force)?;
        report::beside(args.report, folder)?;
    }
    if args.json {
        text::print_json(&report)?;
    } else {
        text::print(&describe(&report))?;
    }
    if !report.solver.converged {
        eprintln!("anisobond: the solver did not converge (residual {:.1e})", report.solver.residual);
    }
    Ok(Ending::Done)
}

/// Nodes along each axis, from one number or three.
pub fn nodes(flag: &str, given: &str) -> Result<[usize; 3]> {
    let numbers: Option<Vec<usize>> = given.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[n]) => Ok([n; 3]),
        Some(&[i, j, k]) => Ok([i, j, k]),
        _ => Err(Error::input(format!("{flag} {given}"), "give one number of nodes, or three as 8,8,6")),
    }
}

/// The cell that the flags describe.
fn cell(args: &args::GridArgs) -> Result<GridCell> {
    let nodes = nodes("--grid", args.grid.as_deref().unwrap_or_default())?;
    let displacement = args.displaced.unwrap_or(0.0);
    let mut cell = GridCell { nodes, missing: Vec::new(), displacement, seed: args.seed.unwrap_or(0) };
    if let Some(share) = args.missing {
        cell = cell.with_missing(share).map_err(|e| e.at("--missing"))?;
    }
    for void in &args.void {
        let numbers: Option<Vec<f64>> = void.split(',').map(|x| x.trim().parse().ok()).collect();
        let (centre, radius) = match numbers.as_deref() {
            Some(&[radius]) => (nodes.map(|n| 0.5 * (n as f64 - 1.0)), radius),
            Some(&[x, y, z, radius]) => ([x, y, z], radius),
            _ => return Err(Error::input(format!("--void {void}"), "give a radius, or x,y,z,radius, in spacings")),
        };
        cell = cell.with_void(centre, radius).map_err(|e| e.at("--void"))?;
    }
    Ok(cell)
}

/// An element test of a grid cell.
pub fn describe(r: &GridTestReport) -> String {
    let [i, j, k] = r.cell.places;
    let n = &r.neighbourhood;
    let mut out = format!("{} on a cell of {i} × {j} × {k} places, model {}\n", r.material, model_name(r.model));
    out += &format!(
        "{} nodes, {} missing, displaced by up to {} Δ; {} bonds, {} of {} horizon {} Δ per node\n",
        r.cell.nodes,
        r.cell.missing,
        text::number(r.cell.displaced),
        r.cell.bonds,
        n.bonds,
        n.shape,
        text::number(n.horizon)
    );
    if let Some(correction) = &r.correction {
        out += &describe_correction(correction);
    }
    out += &components(&[
        ("target", &r.target),
        ("promised", &r.promised),
        ("measured", &r.measured),
        ("summed", &r.summed),
    ]);
    let percent = |x: f64| if x < 1e-14 { "0".into() } else { text::number(100.0 * x) };
    out += &format!(
        "\nmeasured is {} % away from promised, {} % from the target; promised is {} % from the target\n",
        percent(r.relative_error),
        percent(r.target_error),
        percent(r.promised_error)
    );
    out += &text::energy_error(r.energy_error);
    r.warnings.iter().for_each(|w| out += &format!("warning: {w}\n"));
    let stability = match (r.stable, r.stability.evidence) {
        (true, Evidence::Proved) => "stable, proved",
        (true, Evidence::Sampled) => "stable as sampled, not proved: no displacement of negative energy was met",
        (false, Evidence::Proved) => "not stable",
        (false, Evidence::Sampled) => "stability not known: the test was not solved to the end",
    };
    out += stability;
    out += &r
        .smallest_eigenvalue
        .map_or("\n".into(), |e| format!("; weakest wave of the perfect grid {} Pa\n", text::number(e)));
    out += &format!(
        "static, rotations {}; force balance {:.1e}, asymmetry {:.1e}, energy against stress {:.1e}\n",
        if r.rotations == Rotations::Free { "free" } else { "blocked" },
        r.certificate.force_balance,
        r.certificate.asymmetry,
        r.certificate.energy_consistency
    );
    out += &format!("{} iterations, residual {:.1e}\n", r.solver.iterations, r.solver.residual);
    out
}
