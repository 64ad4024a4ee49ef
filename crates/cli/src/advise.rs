//! `anisobond advise`.

use anisobond::Result;
use anisobond_app::AdviceReport;
use anisobond_app::advice_report::TensorAdvice;
use anisobond_formats::{Reading, json_value};
use serde_json::Value;

use crate::{Ending, args, rows, text};

pub fn run(args: &args::Advise) -> Result<Ending> {
    if rows::asked(&args.material, &args.table) {
        return rows::run(&args.material, &args.table, args.json, TensorAdvice::new, brief);
    }
    let Reading { material, read_as, .. } = args.table.find(&args.material)?;
    let report = AdviceReport::new(&material)?;
    text::warn(&report.warnings);
    if args.json {
        let mut document = json_value(&report)?;
        document["read_as"] = read_as.into();
        text::print_json(&document)?;
    } else {
        text::print(&describe(&report))?;
    }
    Ok(Ending::Done)
}

/// One row of a table in words.
fn brief(row: &Value) -> String {
    let gap = row["cauchy_gap"].as_f64().unwrap_or(f64::NAN);
    let of = |n: usize| row["models"][n]["least_error"].as_f64().unwrap_or(f64::NAN);
    format!(
        "{:12} Cauchy gap {:>10} %, central at least {:>10} %, micropolar at least {:>10} %",
        row["recommended"].as_str().unwrap_or(""),
        text::percent(gap),
        text::percent(of(0)),
        text::percent(of(1))
    )
}

/// The result in words.
pub fn describe(r: &AdviceReport) -> String {
    let a = &r.advice;
    let (unit, name) = text::stress_unit(text::largest(&r.stiffness));
    let stress = |x: f64| text::number(x / unit);
    let mut out = text::heading(&r.material, &r.source);
    out += "\n\n";
    out += &text::wrapped("recommended      ", &format!("{}: {}", a.recommended.name(), a.reason));
    out += &format!("\nCauchy gap       {} %\n", text::percent(a.cauchy_gap));
    let [x, y, z] = a.defect_eigenvalues.map(stress);
    out += &format!(
        "Cauchy defect    eigenvalues {x}, {y}, {z} {name}; triangle test {}\n",
        if a.triangle_test { "passed" } else { "failed" }
    );
    out += &format!(
        "Cauchy part      smallest Kelvin modulus {} {name}: central bonds ≥ 0 {}\n",
        stress(a.cauchy_part_smallest),
        if a.cauchy_part_positive { "reach it" } else { "do not reach it" }
    );
    out += &format!("Poisson (Hill)   {}\n", text::number(a.poisson));
    for m in &a.models {
        out += &format!("\n{}\n", m.model.name());
        out += &text::wrapped("  reach      ", &m.explanation);
        out += &text::wrapped("  stability  ", &m.stability);
        out += &format!(
            "  cost       {} numbers per node, about {} flops per bond\n",
            m.unknowns_per_node, m.flops_per_bond
        );
    }
    let d = &r.reference;
    out += &format!("\ntried on a sphere of horizon {} Δ, {} bonds, influence inverse:\n", d.horizon, d.bonds);
    out += "  model                      promised error   measured error   smallest eigenvalue\n";
    for m in &d.models {
        let model = format!("{} {}", m.model.name(), m.choice.unwrap_or(""));
        out += &format!(
            "  {model:25} {:>14} % {:>14} %   {} {name}{}\n",
            text::percent(m.promised_error),
            text::percent(m.measured_error),
            stress(m.smallest_eigenvalue),
            if m.stable { format!(" ({})", m.stability.evidence.name()) } else { " (not stable)".into() }
        );
    }
    out
}
