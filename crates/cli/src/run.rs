//! `anisobond run`.

use anisobond::Result;
use anisobond_app::CaseFile;
use anisobond_app::run::{PackingSummary, RunOptions, RunProgress, RunSummary, run_case};
use indicatif::{ProgressBar, ProgressStyle};

use crate::{Ending, args, interrupt, report, text};

pub fn run(args: &args::Run) -> Result<Ending> {
    let case = CaseFile::read(&args.case.case, &args.case.set)?;
    let folder = args.output.clone().unwrap_or_else(|| case.name().into());
    let options = RunOptions { folder: &folder, resume: args.resume, force: args.force, stop: interrupt::flag() };
    let bar = ProgressBar::new(0);
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} steps, {msg}, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let summary = run_case(&case, &options, |p| show(&bar, p));
    bar.finish_and_clear();
    let summary = summary?;
    for warning in &summary.warnings {
        eprintln!("warning: {warning}");
    }
    report::beside(args.report, &folder)?;
    if args.json {
        // What is not finite is among the warnings.
        text::print_json(&serde_json::json!(summary))?;
    } else {
        text::print(&describe(&summary, &folder.display().to_string()))?;
    }
    Ok(Ending::Done)
}

fn show(bar: &ProgressBar, p: &RunProgress) {
    bar.set_length(p.steps[1]);
    bar.set_position(p.steps[0]);
    bar.set_message(p.words());
}

/// The result in words.
pub fn describe(s: &RunSummary, folder: &str) -> String {
    let n = text::number;
    let what = if s.packing.is_some() { "spheres" } else { "nodes" };
    let mut out = format!("{}: {} {what}, {} bonds\n", s.case, s.nodes, s.bonds);
    out += &s.outcome.words().map_or_else(String::new, |words| format!("outcome           {words}\n"));
    if let Some(step) = &s.time_step {
        out += &format!(
            "motion            {} steps of {} s (stable {} s) to {} s\n",
            s.steps,
            n(step.step),
            n(step.stable),
            n(s.time)
        );
    }
    if let Some(e) = &s.equilibrium {
        out += &format!(
            "equilibrium       {} load steps; the last in {} iterations, {} operator applications, residual {:.1e}\n",
            s.steps, e.report.iterations, e.report.applications, e.report.residual
        );
    }
    if let Some(packing) = &s.packing {
        out += &describe_packing(packing);
    }
    for r in &s.regions {
        out += &format!("  {:16}{} nodes, stiffness reached to {:.1e}", r.name, r.nodes, r.relative_error);
        if let Some(f) = &r.fracture {
            out += &format!(
                ", fracture energy {} J/m² wanted, {} reached (deviation {:.2} % rms)",
                n(f.wanted_mean),
                n(f.reached_mean),
                100.0 * f.rms_deviation
            );
        }
        out += "\n";
    }
    let e = &s.energy;
    out += &format!(
        "energy (J)        kinetic {}, strain {}, damping {}, fracture {}, external {}; drift {:.1e}\n",
        n(e.kinetic),
        n(e.strain),
        n(e.damping),
        n(e.fracture),
        n(e.external),
        s.relative_drift
    );
    if e.broken_bonds > 0 {
        out += &format!("broken bonds      {}, largest damage {:.3}\n", e.broken_bonds, s.largest_damage);
    }
    for c in &s.cracks {
        out += &format!("crack             {} m long, {} nodes", n(c.length), c.nodes);
        if let (Some(speed), Some(largest)) = (c.speed, c.largest_speed) {
            out += &format!(", {} m/s (largest {} m/s)", n(speed), n(largest));
        }
        let [x, y, z] = c.direction;
        out += &format!(", along ({x:.3}, {y:.3}, {z:.3})\n");
        for (tip, (parent, angle)) in c.tips.iter().filter_map(|tip| tip.branch.map(|branch| (tip, branch))) {
            let [x, y, _] = tip.start.map(n);
            out += &format!(
                "  a branch         of tip {parent}, from ({x}, {y}) m on, {angle:.0}° to it, {} m long\n",
                n(tip.length)
            );
        }
    }
    out += &format!("{:.1} s; results in {folder}\n", s.seconds);
    out
}

fn describe_packing(p: &PackingSummary) -> String {
    let n = text::number;
    let mut out = String::new();
    if let Some(lattice) = p.lattice.first() {
        let (radius, coordination) = (n(lattice.contact_radius), n(lattice.coordination));
        out += &format!("lattice           contact radius {radius}, {coordination} bonds per sphere\n");
        for region in &p.lattice {
            let error = text::energy_error(region.energy_error);
            let name = if p.lattice.len() > 1 { format!("{}: ", region.region) } else { String::new() };
            out += &if error.is_empty() { error } else { format!("                  {name}{error}") };
        }
    }
    if let Some(cell) = &p.cell {
        let row = |values: &[f64; 6], unit: f64| values.map(|x| n(x / unit)).join(" ");
        let (unit, name) = text::stress_unit(cell.stress.iter().fold(0.0, |m: f64, x| m.max(x.abs())));
        out += &format!("stress ({name})      {} (xx yy zz yz xz xy)\n", row(&cell.stress, unit));
        out += &format!("strain (%)        {}\n", row(&cell.strain, 0.01));
    }
    if let Some(peak) = &p.peak {
        let (unit, name) = text::stress_unit(peak.differential);
        let axis = ["x", "y", "z"][peak.axis];
        let (differential, strain) = (n(peak.differential / unit), n(100.0 * peak.strain));
        out +=
            &format!("peak              {differential} {name} differential along {axis}, at a strain of {strain} %\n");
    }
    out
}
