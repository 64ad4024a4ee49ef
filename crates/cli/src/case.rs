//! `anisobond check` and `anisobond new case`.

use anisobond::experiment::RunCost;
use anisobond::{Error, Result};
use anisobond_app::{CaseFile, CasePlan, ConditionPlan, LatticeKind, PackingPlan, starter_case};
use anisobond_formats::write_atomically;
use serde::Serialize;

use crate::{Ending, args, text, waiting};

pub fn check(args: &args::CheckCase) -> Result<Ending> {
    let (document, words) = waiting::said("filling the body, calibrating its bonds, timing a pass over them", || {
        checked(&CaseFile::read(&args.case.case, &args.case.set)?)
    })?;
    if args.json {
        text::print_json(&document)?;
    } else {
        text::print(&words)?;
    }
    Ok(Ending::Done)
}

/// What a case holds and what its run would take, as one JSON object and in words.
///
/// # Errors
/// As [`CaseFile::problem`].
pub fn checked(case: &CaseFile) -> Result<(serde_json::Value, String)> {
    let (plan, cost, words) = match case.lattice() {
        LatticeKind::Grid => {
            let problem = case.problem()?;
            let (cost, warnings) = RunCost::with_warnings(&problem)?;
            let mut plan = case.plan(&problem);
            plan.warnings.extend(warnings);
            (json(&plan)?, cost, describe(&plan, case.description()))
        }
        LatticeKind::Packing => {
            let problem = case.packing_problem()?;
            let plan = case.packing_plan(&problem);
            (json(&plan)?, problem.cost()?, describe_packing(&plan, case.description()))
        }
    };
    Ok((json(&Checked { plan, cost })?, words + &describe_cost(&cost)))
}

fn json(value: &impl Serialize) -> Result<serde_json::Value> {
    anisobond_formats::json_value(value)
}

fn describe_packing(plan: &PackingPlan, description: &str) -> String {
    let n = text::number;
    let axes: Vec<&str> = ["x", "y", "z"].into_iter().zip(plan.periodic).filter(|a| a.1).map(|a| a.0).collect();
    let mut out = plan.name.clone();
    out += &if description.is_empty() { "\n".into() } else { format!(": {description}\n") };
    out += &format!("spheres           {}, mean radius {} m", plan.particles, n(plan.radius));
    out += &if axes.is_empty() { "\n".into() } else { format!(", periodic along {}\n", axes.join(", ")) };
    let breaks = if plan.breaks { "" } else { "; they do not break" };
    let radius = plan.lattice.first().map_or(String::new(), |l| format!(" (contact radius {})", n(l.contact_radius)));
    out += &format!("bonds             {}{radius}{breaks}\n", plan.bonds);
    if plan.lattice.len() > 1 {
        let names: Vec<&str> = plan.lattice.iter().map(|l| l.region.as_str()).collect();
        out += &format!("regions           {}\n", names.join(", "));
    }
    out += &format!("volume, mass      {} m³, {} kg\n", n(plan.volume), n(plan.mass));
    out += &format!("memory            {}\n", memory(plan.memory));
    plan.warnings.iter().for_each(|warning| out += &format!("warning           {warning}\n"));
    out + &describe_conditions(&plan.conditions, &plan.probes, "spheres")
}

/// What a case holds and what its run would take, as one JSON object.
#[derive(Serialize)]
struct Checked<P> {
    #[serde(flatten)]
    plan: P,
    #[serde(flatten)]
    cost: RunCost,
}

fn describe_cost(cost: &RunCost) -> String {
    let n = text::number;
    let steps = match (cost.step_s, cost.stable_step_s) {
        (Some(step), Some(stable)) => format!("{} time steps of {} s (stable: {} s)", cost.steps, n(step), n(stable)),
        _ => format!("{} load steps", cost.steps),
    };
    let seconds = match cost.expected_seconds {
        s if s < 1.0 => "less than a second".into(),
        s if s < 120.0 => format!("about {s:.0} s"),
        s if s < 7200.0 => format!("about {:.0} min", s / 60.0),
        s => format!("about {:.1} h", s / 3600.0),
    };
    let output = if cost.step_s.is_some() { "without output" } else { "where no bond breaks" };
    format!("\nsteps             {steps}\nexpected time     {seconds} on this machine, {output}\n")
}

pub fn new(args: &args::New) -> Result<Ending> {
    let args::NewWhat::Case { name } = &args.what;
    let toml = name.extension().is_some_and(|e| e == "toml");
    let path = if toml { name.clone() } else { std::path::PathBuf::from(format!("{}.toml", name.display())) };
    if path.exists() {
        return Err(Error::input(format!("{} exists", path.display()), "choose another name, or remove it"));
    }
    let stem = path.file_stem().map_or_else(|| "case".into(), |s| s.to_string_lossy());
    write_atomically(&path, starter_case(&stem).as_bytes())?;
    text::print(&format!("wrote {}\nnext: anisobond check {0}\n", path.display()))?;
    Ok(Ending::Done)
}

fn describe(plan: &CasePlan, description: &str) -> String {
    let [i, j, k] = plan.grid;
    let axes: Vec<&str> = ["x", "y", "z"].into_iter().zip(plan.periodic).filter(|a| a.1).map(|a| a.0).collect();
    let mut out = plan.name.clone();
    out += &if description.is_empty() { "\n".into() } else { format!(": {description}\n") };
    out += &format!("grid              {i} × {j} × {k}, spacing {} m", text::number(plan.spacing));
    out += &if axes.is_empty() { "\n".into() } else { format!(", periodic along {}\n", axes.join(", ")) };
    out += &format!("nodes             {}\n", plan.nodes);
    out += &format!("bonds             {} ({} of a node in the bulk)\n", plan.bonds, plan.bonds_per_node);
    out += &format!("memory            {}\n", memory(plan.memory));
    out += &format!("pre-cracks        {}\n", plan.cracks);
    out += &format!("\n  {:24}{:>12}{:>14}{:>14}  {}\n", "region", "nodes", "volume (m³)", "ρ (kg/m³)", "C11 C22 C33");
    for r in &plan.regions {
        let largest = r.normal_stiffness.into_iter().fold(0.0, f64::max);
        let (size, unit) = text::stress_unit(largest);
        let c = r.normal_stiffness.map(|c| text::number(c / size)).join(" ");
        let (volume, density) = (text::number(r.volume), text::number(r.density));
        let breaks = if r.breaks { "" } else { ", bonds do not break" };
        out += &format!("  {:24}{:>12}{volume:>14}{density:>14}  {c} {unit}{breaks}\n", r.name, r.nodes);
    }
    plan.warnings.iter().for_each(|warning| out += &format!("warning           {warning}\n"));
    out + &describe_conditions(&plan.conditions, &plan.probes, "nodes")
}

fn describe_conditions(conditions: &[ConditionPlan], probes: &[(String, usize)], what: &str) -> String {
    let mut out = format!("\n  {:24}{:14}{what:>10}  {}\n", "condition", "kind", "resultant (N)");
    for c in conditions {
        // The rounding of sums that vanish is not shown.
        let rounding = 1e-9 * c.load.unwrap_or(0.0);
        let shown = |x: f64| text::number(if x.abs() < rounding { 0.0 } else { x });
        let total = c.force.map_or_else(|| "–".into(), |f| format!("({})", f.map(shown).join(", ")));
        let sum = c.load.map_or_else(String::new, |l| format!(", magnitudes sum to {}", text::number(l)));
        out += &format!("  {:24}{:14}{:>10}  {total}{sum}\n", c.name, c.kind, c.nodes);
    }
    for (name, nodes) in probes {
        let word = if *nodes == 1 { what.trim_end_matches('s') } else { what };
        out += &format!("  probe {name}: {nodes} {word}\n");
    }
    out
}

fn memory(bytes: u64) -> String {
    let (size, unit) = [(1e9, "GB"), (1e6, "MB")].into_iter().find(|u| bytes as f64 >= u.0).unwrap_or((1e3, "kB"));
    format!("about {:.1} {unit}", bytes as f64 / size)
}
