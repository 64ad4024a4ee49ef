//! `anisobond pack`.

use std::ops::ControlFlow;
use std::path::Path;

use anisobond::lattice::generate::{
    Crystal, Extent, Outcome, Radii, RandomPacking, Share, Target, crystal, random_observed,
};
use anisobond::lattice::{Packing, PackingStatistics};
use anisobond::{Error, Result};
use anisobond_formats::{PackingReading, parse_length, write_packing};
use indicatif::ProgressBar;
use serde_json::json;

use crate::{Ending, args, text};

pub fn run(args: &args::Pack) -> Result<Ending> {
    let Made { packing, report, read } = packing(args)?;
    let statistics = packing.statistics(args.contact_radius.unwrap_or(1.0))?;
    // Where nobody says at which radius bonds will be made: those of the commands that make them.
    let usual = args::USUAL_CONTACT_RADIUS;
    let bonds = args.contact_radius.is_none().then(|| packing.statistics(usual)).transpose()?;
    if let Some(path) = &args.output {
        write_packing(path, &packing)?;
        eprintln!("wrote {}", path.display());
    }
    if args.json {
        let generation = report.as_ref().map(
            |r| json!({"outcome": r.outcome, "message": r.message, "trials": r.trials, "iterations": r.iterations}),
        );
        let bonds = bonds.map(
            |b| json!({"contact_radius": b.contact_radius, "contacts": b.contacts, "coordination": b.coordination}),
        );
        let mut document = json!({ "statistics": statistics, "bonds": bonds, "generation": generation });
        if let Some(read) = &read {
            document["read_as"] = read.read_as.clone().into();
            document["columns"] = json!(read.columns);
            document["notes"] = json!(read.notes);
        }
        text::print_json(&document)?;
    } else {
        let bonds = bonds.map_or(String::new(), |b| {
            format!(
                "bonds at {}      {}, {} per sphere: the contact radius of lattice and element-test unless another is given\n",
                text::number(b.contact_radius),
                b.contacts,
                text::number(b.coordination.mean)
            )
        });
        let read = read.as_ref().map_or(String::new(), read_words);
        text::print(&(read + &describe(&statistics) + &bonds))?;
    }
    match report {
        Some(r) if r.outcome != Outcome::Reached => {
            eprintln!("anisobond: {}", r.message);
            Ok(Ending::NotExact)
        }
        _ => Ok(Ending::Done),
    }
}

/// A packing, how it came about if it is random, and what its file was taken for if it was read.
struct Made {
    packing: Packing,
    report: Option<anisobond::lattice::generate::GenerationReport>,
    read: Option<PackingReading>,
}

impl Made {
    fn crystal(packing: Packing) -> Self {
        Made { packing, report: None, read: None }
    }
}

/// What a file was taken for, in words.
pub fn read_words(read: &PackingReading) -> String {
    text::wrapped("read as           ", &read.read_as) + &text::wrapped("columns           ", &read.columns_in_words())
}

/// The packing that the flags ask for, and how it came about if it is random.
fn packing(args: &args::Pack) -> Result<Made> {
    if let Some(path) = &args.packing {
        let read = args.file.read(path)?;
        return Ok(Made { packing: read.packing.clone(), report: None, read: Some(read) });
    }
    let (radius, _) = text::length(&args.radius, "--radius")?;
    if let Some(kind) = args.crystal {
        let kind = match kind {
            args::CrystalName::Sc => Crystal::Sc,
            args::CrystalName::Bcc => Crystal::Bcc,
            args::CrystalName::Fcc => Crystal::Fcc,
            args::CrystalName::Hcp => Crystal::Hcp,
        };
        let cells: Option<Vec<usize>> = args.cells.split(',').map(|n| n.trim().parse().ok()).collect();
        let Some(cells) = cells.and_then(|cells| <[usize; 3]>::try_from(cells).ok()) else {
            return Err(Error::input(format!("--cells {}", args.cells), "give three whole numbers as 4,4,4"));
        };
        return crystal(kind, radius, cells, args.perturb, args.seed).map(Made::crystal);
    }
    let extent = match (&args.number, &args.cell) {
        (Some(number), _) => Extent::Number(*number),
        (None, Some(cell)) => Extent::Cell(edges(cell)?),
        (None, None) => {
            return Err(Error::input(
                "nothing to pack",
                "give --number N or --cell A,B,C for a random packing, --crystal fcc, or a file to read",
            ));
        }
    };
    let target = match args.coordination {
        Some(coordination) => Target::Coordination(coordination),
        None => Target::Porosity(args.porosity.unwrap_or(RandomPacking::USUAL_POROSITY)),
    };
    let radii = radii(args, radius)?;
    let wanted =
        RandomPacking { extent, radii, target, contact_radius: args.contact_radius.unwrap_or(1.0), seed: args.seed };
    let spinner = ProgressBar::new_spinner();
    spinner.enable_steady_tick(std::time::Duration::from_millis(100));
    let generated = random_observed(&wanted, &mut |p| {
        spinner.set_message(format!(
            "packing {}: {} steps, largest overlap {:.1e}",
            p.trial, p.iterations, p.largest_overlap
        ));
        ControlFlow::Continue(())
    })?;
    spinner.finish_and_clear();
    Ok(Made { packing: generated.packing, report: Some(generated.report), read: None })
}

fn edges(cell: &str) -> Result<[f64; 3]> {
    let lengths: Vec<f64> = cell
        .split(',')
        .map(|edge| edge.trim().parse().or_else(|_| parse_length(edge)))
        .collect::<Result<_>>()
        .map_err(|e| e.at("--cell"))?;
    <[f64; 3]>::try_from(lengths).map_err(|_| {
        Error::input(format!("--cell {cell}"), "give three lengths as '0.1,0.1,0.1' or '10 cm,10 cm,10 cm'")
    })
}

fn radii(args: &args::Pack, radius: f64) -> Result<Radii> {
    if let Some(path) = &args.radii {
        return Ok(Radii::Table { rows: fractions(path)?, share: Share::Number });
    }
    Ok(match (args.fuzz, args.deviation) {
        (Some(fuzz), _) => Radii::Fuzzy { mean: radius, fuzz },
        (None, Some(deviation)) => Radii::log_normal(radius, deviation),
        (None, None) => Radii::Uniform { radius },
    })
}

/// Rows (radius, fraction) of a CSV file, in the form of an influence table.
fn fractions(path: &Path) -> Result<Vec<(f64, f64)>> {
    anisobond_formats::read_pairs(path, "radius and fraction, as 0.001, 0.5")
}

/// The result in words.
pub fn describe(s: &PackingStatistics) -> String {
    let mut out = format!("{} spheres, radius {}", s.number, text::number(s.radius.mean));
    if s.radius.most > s.radius.least {
        out += &format!(" ({} … {})", text::number(s.radius.least), text::number(s.radius.most));
    }
    out += " m\n";
    if let Some([x, y, z]) = s.cell {
        out += &format!("cell              {} × {} × {} m\n", text::number(x), text::number(y), text::number(z));
    }
    if let Some(porosity) = s.porosity {
        out += &format!("porosity          {}\n", text::number(porosity));
    }
    out += &format!("largest overlap   {} of the touching distance\n", text::number(s.largest_overlap));
    out += &format!(
        "contacts at {}     {}, coordination {} ({} … {}), {} spheres with fewer than four\n",
        text::number(s.contact_radius),
        s.contacts,
        text::number(s.coordination.mean),
        s.coordination.least,
        s.coordination.most,
        s.floaters
    );
    out += &format!("fabric            deviation from isotropy {}\n", text::number(s.fabric_deviation));
    for row in &s.fabric {
        out += &format!("  {}\n", row.iter().map(|x| format!("{x:>9.5}")).collect::<String>());
    }
    out
}
