//! The calibration of one material, in words and numbers.

use anisobond::calibration::{Evidence, Outcome};
use anisobond::tensor::Metric;
use anisobond_app::report::{
    CalibrationReport, InfeasibilityReport, MicromodulusReport, NeighbourhoodReport, SolverReport, Voigt, WavesOfGrid,
};
use anisobond_app::{HybridReport, MicropolarReport, ModelReport};

use crate::text;

/// Any of the three models.
pub fn describe(report: &ModelReport) -> String {
    match report {
        ModelReport::Central(r) => central(r),
        ModelReport::Micropolar(r) => micropolar(r),
        ModelReport::Hybrid(r) => hybrid(r),
    }
}

fn central(r: &CalibrationReport) -> String {
    let (unit, name) = text::stress_unit(text::largest(&r.target));
    let mut out = text::heading(&r.material, &r.source) + &neighbourhood(&r.neighbourhood);
    out += &side_by_side(("target", &r.target), ("reached", &r.reached));
    if r.metric == Metric::Energy {
        out += "\nclosest in the sense of energy\n";
    }
    out += &format!(
        "\nrelative error   {} %  (Cauchy gap {} %: the least that central bonds can reach)\n",
        text::percent(r.relative_error),
        text::percent(r.cauchy_gap)
    );
    out += &text::energy_error(r.energy_error);
    out += &limit(r.outcome, r.infeasibility.as_ref(), (unit, name));
    out += &format!("anisotropy A^U   {}\n", text::number(r.universal_anisotropy));
    out += &micromodulus("micromodulus c ", &r.micromodulus, r.neighbourhood.bonds);
    if r.lower_bound > 0.0 {
        out += &format!("lower bound      {} N/m⁶\n", text::number(r.lower_bound));
    }
    out += &waves(&r.waves, (unit, name));
    out += &solver(&r.solver);
    out
}

fn micropolar(r: &MicropolarReport) -> String {
    let (unit, name) = text::stress_unit(text::largest(&r.target));
    let mut out = text::heading(&r.material, &r.source) + &neighbourhood(&r.neighbourhood);
    out += &format!("micropolar model: normal and tangential bonds, promise {}\n", r.promise.name());
    out += &side_by_side(("target", &r.target), ("reached", &r.reached));
    out += &format!(
        "\nrelative error   {} % promised: {} % by the sum over bonds, {} % with free node rotations\n",
        text::percent(r.relative_error),
        text::percent(r.sum_error),
        text::percent(r.relaxed_error)
    );
    out += &text::energy_error(r.energy_error);
    out += &format!("Cauchy gap       {} %: the least without tangential bonds\n", text::percent(r.cauchy_gap));
    match &r.infeasibility {
        None => out += reached(r.outcome),
        Some(i) => {
            out += &format!("limit of model   not reached: {}\n", i.explanation);
            out += &format!(
                "certificate      N:Y, T:Y ≤ {:.1e} on every bond, Y:C = {} {name}, distance {} % of the aim\n",
                i.evidence.largest_bond_product,
                text::number(i.evidence.target_product / unit),
                text::percent(i.evidence.distance)
            );
        }
    }
    out += &format!("anisotropy A^U   {}\n", text::number(r.universal_anisotropy));
    out += &micromodulus("normal c_n     ", &r.micromodulus, r.neighbourhood.bonds);
    out += &micromodulus("tangential c_t ", &r.tangential_micromodulus, r.neighbourhood.bonds);
    out += &waves(&r.waves, (unit, name));
    out += &solver(&r.solver);
    out
}

fn hybrid(r: &HybridReport) -> String {
    let (unit, name) = text::stress_unit(text::largest(&r.target));
    let mut out = text::heading(&r.material, &r.source) + &neighbourhood(&r.neighbourhood);
    out += &format!("hybrid model: bonds and a nodal term Z, form {}\n", r.form.name());
    out += &side_by_side(("target", &r.target), ("reached", &r.reached));
    out += &side_by_side(("of it by bonds", &r.reached_by_bonds), ("nodal term Z", &r.nodal_term));
    out += &format!(
        "\nrelative error   {} %  (Cauchy gap {} %: the least without a nodal term)\n",
        text::percent(r.relative_error),
        text::percent(r.cauchy_gap)
    );
    out += &format!("nodal share      ‖Z‖/‖C‖ = {} %\n", text::percent(r.nodal_share));
    if let Some(e) = &r.least_trace {
        let (trace, bound) = (text::number(e.trace / unit), text::number(e.bound / unit));
        out += &format!("trace of Z       {trace} {name}, proved ≥ {bound} {name}; {} Newton steps\n", e.steps);
    }
    if let Some(i) = &r.bonds_infeasibility {
        out += &format!("bonds alone      {} Z takes the rest.\n", i.explanation);
    }
    out += &format!("anisotropy A^U   {}\n", text::number(r.universal_anisotropy));
    out += &micromodulus("micromodulus c ", &r.micromodulus, r.neighbourhood.bonds);
    if r.lower_bound > 0.0 {
        out += &format!("floor of c       {} N/m⁶\n", text::number(r.lower_bound));
    }
    out += &waves(&r.waves, (unit, name));
    out += &solver(&r.solver);
    out
}

fn neighbourhood(n: &NeighbourhoodReport) -> String {
    let [a, b, c] = n.semi_axes.map(text::number);
    let shape = match n.shape.as_str() {
        "sphere" | "cube" => n.shape.clone(),
        other => format!("{other} {a} × {b} × {c}"),
    };
    format!(
        "\n{} bonds: {shape}, horizon {} Δ, Δ = {} m, influence {}\n",
        n.bonds,
        text::number(n.horizon),
        text::number(n.spacing),
        n.influence
    )
}

/// Two matrices in the unit that suits the first.
fn side_by_side((left, a): (&str, &Voigt), (right, b): (&str, &Voigt)) -> String {
    let (unit, name) = text::stress_unit(text::largest(a));
    let mut out = format!("\n  {:61} {}\n", format!("{left} ({name})"), format_args!("{right} ({name})"));
    for (a, b) in text::matrix_rows(a, unit).iter().zip(text::matrix_rows(b, unit)) {
        out += &format!("{a}  {b}\n");
    }
    out
}

/// The line of a target without evidence against it.
fn reached(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::NotConverged => {
            "limit of model   not known: the solver did not converge; the bonds are what it came to\n"
        }
        _ => "limit of model   reached: no neighbourhood brings such bonds closer\n",
    }
}

/// How the solver ended.
fn solver(s: &SolverReport) -> String {
    let ended = if s.converged { "" } else { "; NOT CONVERGED: the bonds are what it came to" };
    format!("solver           {} steps, residual {:.1e}{ended}\n", s.iterations, s.residual)
}

fn limit(outcome: Outcome, infeasibility: Option<&InfeasibilityReport>, (unit, name): (f64, &str)) -> String {
    let Some(i) = infeasibility else { return reached(outcome).into() };
    format!(
        "limit of model   not reached: {}\ncertificate      y(n) ≤ {:.1e} on every bond, y·S = {} {name}, distance {} % of the aim\n",
        i.explanation,
        i.largest_bond_product,
        text::number(i.target_product / unit),
        text::percent(i.distance)
    )
}

fn micromodulus(title: &str, m: &MicromodulusReport, bonds: usize) -> String {
    format!(
        "{title}  {} … {} N/m⁶, mean {}, {} of {bonds} bonds zero\n",
        text::number(m.min),
        text::number(m.max),
        text::number(m.mean),
        m.zero
    )
}

fn waves(w: &WavesOfGrid, (unit, name): (f64, &str)) -> String {
    let phases = w.smallest_at_phases.map(|p| text::number((p / std::f64::consts::PI * 1e4).round() / 1e4));
    let stability = match (w.stable, w.stability.evidence) {
        (true, Evidence::Proved) => "yes, proved",
        (true, Evidence::Sampled) => "yes as sampled, not proved",
        (false, _) => "no",
    };
    let everywhere = w.stability.bound.map_or(String::new(), |b| format!(", above {b:.1e} ‖C‖ everywhere"));
    let mut out = format!(
        "stable           {stability}: smallest eigenvalue {} {name} = {:.3e} ‖C‖ at k = ({}) π/Δ, {} wave vectors \
         tried{everywhere}\n",
        text::number(w.smallest_eigenvalue / unit),
        w.stability.margin,
        phases.join(", "),
        w.sampled_waves
    );
    out +=
        &format!("long waves       speeds at kΔ = 0.05 within {} % of the target's", text::percent(w.long_wave_error));
    if let (Some(error), Some(order)) = (w.long_wave_error_of_reached, w.long_wave_order_of_reached) {
        out += &format!(", {} % of the grid's own tensor's (order {order:.2})", text::percent(error));
    }
    out + "\n"
}
