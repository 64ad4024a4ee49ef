//! What the keys of reports are called, and in what unit their numbers are.

use self::Unit::{
    Count, Distance, Energy, Hidden, Modulus, Number, Percent, Perhaps, Phases, Plain, Speed, Spring, Stress, Time,
};

/// How a value is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Unit {
    /// A number without unit, a text, yes or no.
    Number,
    /// A number of things.
    Count,
    /// A share.
    Percent,
    /// Pa.
    Stress,
    /// m.
    Distance,
    /// s.
    Time,
    /// J.
    Energy,
    /// N/m.
    Spring,
    /// N/m⁶.
    Modulus,
    /// m/s.
    Speed,
    /// Phases of a wave (rad), in π.
    Phases,
    /// A number with a unit that takes no prefix.
    Plain(&'static str),
    /// Shown only where it is yes.
    Perhaps,
    /// Said elsewhere, or of no use to readers.
    Hidden,
}

impl Unit {
    /// Of numbers as they are, in brackets.
    pub fn symbol(self) -> String {
        let unit = match self {
            Unit::Percent => "–",
            Unit::Stress => "Pa",
            Unit::Distance => "m",
            Unit::Time => "s",
            Unit::Energy => "J",
            Unit::Spring => "N/m",
            Unit::Modulus => "N/m⁶",
            Unit::Speed => "m/s",
            Unit::Plain(unit) => unit,
            Unit::Number | Unit::Count | Unit::Phases | Unit::Perhaps | Unit::Hidden => return String::new(),
        };
        format!(" ({unit})")
    }
}

/// Ends of paths of keys, their words and units. The longest end that fits counts.
#[rustfmt::skip]
const LABELS: &[(&str, &str, Unit)] = &[
    // Materials and models.
    ("material", "material", Number),
    ("source", "source", Number),
    ("case", "case", Number),
    ("model", "model", Number),
    ("form", "form", Number),
    ("promise", "promise", Number),
    ("density", "density", Plain("kg/m³")),
    ("universal_anisotropy", "anisotropy A^U", Number),
    ("lower_bound", "lower bound of c", Modulus),
    // How a run ended, and what went through what.
    ("outcome.kind", "outcome", Number),
    ("outcome.load_factor", "load factor of the last equilibrium", Number),
    ("outcome.not_reached", "broke before load factor", Number),
    ("outcome.how", "shown by", Number),
    ("outcome.what", "what moves", Number),
    ("outcome.equilibria", "equilibria in that load step", Count),
    ("outcome.broken_bonds", "bonds broken in it", Count),
    ("overlap.depth", "depth", Distance),
    ("overlap.at", "deepest at", Distance),
    ("overlap.time", "at time or load factor", Number),
    ("overlap.between", "between", Number),
    // What was reached.
    ("relative_error", "relative error", Percent),
    ("energy_error", "error of energy, least and largest", Percent),
    ("sum_error", "error of the sum over bonds", Percent),
    ("relaxed_error", "error with free node rotations", Percent),
    ("promised_error", "error of what is promised", Percent),
    ("target_error", "error against the target", Percent),
    ("cauchy_gap", "Cauchy gap", Percent),
    ("nodal_share", "nodal share ‖Z‖/‖C‖", Percent),
    ("outcome", "outcome", Number),
    ("reaches_model_limit", "reaches what the model can at the most", Number),
    ("metric", "closest by", Number),
    ("infeasibility.cause", "cause", Number),
    // Among the warnings.
    ("infeasibility.explanation", "", Hidden),
    ("bonds_infeasibility.explanation", "explanation", Number),
    ("infeasibility.largest_bond_product", "certificate: largest product with a bond", Number),
    ("infeasibility.target_product", "certificate: product with the target", Stress),
    ("infeasibility.distance", "distance from what is reachable", Percent),
    ("infeasibility.in_every_neighbourhood", "out of reach of every neighbourhood", Number),
    ("least_trace.trace", "trace of Z", Stress),
    ("least_trace.bound", "proved to be at least", Stress),
    ("least_trace.steps", "Newton steps", Count),
    ("stable", "stable", Number),
    ("stability.evidence", "which is", Number),
    ("stability.margin", "margin: smallest eigenvalue over ‖C‖", Number),
    ("stability.bound", "proved to be at least", Number),
    ("stability.at", "margin found at k Δ/π", Phases),
    ("smallest_eigenvalue", "smallest eigenvalue of waves", Stress),
    ("smallest_at_phases", "found at k Δ/π", Phases),
    ("sampled_waves", "wave vectors tried", Count),
    ("long_wave_error", "speeds at kΔ = 0.05 against the target’s, within", Percent),
    ("long_wave_order", "order of that error", Number),
    ("long_wave_error_of_reached", "speeds at kΔ = 0.05 against the grid’s own tensor’s, within", Percent),
    ("long_wave_order_of_reached", "order of that error, in theory 2", Number),
    // Bonds.
    ("neighbourhood.shape", "shape", Number),
    ("neighbourhood.semi_axes", "semi-axes (spacings)", Number),
    ("neighbourhood.horizon", "horizon (spacings)", Number),
    ("neighbourhood.spacing", "spacing Δ", Distance),
    ("neighbourhood.influence", "influence function", Number),
    ("neighbourhood.bonds", "bonds", Count),
    ("neighbourhood.directions", "distinct directions", Count),
    ("neighbourhood.rank", "dimension of what they reach", Count),
    ("micromodulus.min", "smallest", Modulus),
    ("micromodulus.max", "largest", Modulus),
    ("micromodulus.mean", "mean", Modulus),
    ("micromodulus.zero", "bonds of micromodulus 0", Count),
    // Lattices on packings.
    ("contact_radius", "contact radius", Number),
    ("contacts", "contacts", Count),
    ("coordination", "bonds per sphere", Number),
    ("packing.number", "spheres", Count),
    ("packing.cell", "cell", Distance),
    ("packing.porosity", "porosity", Number),
    ("packing.radius.least", "smallest radius", Distance),
    ("packing.radius.mean", "mean radius", Distance),
    ("packing.radius.most", "largest radius", Distance),
    ("packing.contact_radius", "", Hidden),
    ("packing.contacts", "", Hidden),
    ("packing.coordination.least", "fewest bonds of a sphere", Count),
    ("packing.coordination.mean", "", Hidden),
    ("packing.coordination.most", "most bonds of a sphere", Count),
    ("packing.coordination_histogram", "", Hidden),
    ("packing.floaters", "spheres without a bond", Count),
    ("packing.fabric", "", Hidden),
    ("packing.fabric_deviation", "deviation of the fabric tensor from isotropy", Percent),
    ("packing.largest_overlap", "largest overlap", Percent),
    ("packing.broken_bonds", "broken bonds", Count),
    ("packing.leavers.number", "spheres that have left the box", Count),
    ("mu", "μ", Number),
    ("en_a", "E_N^a", Stress),
    ("en_b", "E_N^b", Stress),
    ("et_a", "E_T^a", Stress),
    ("et_b", "E_T^b", Stress),
    ("axis", "axis of anisotropy", Number),
    ("distance_from_transverse_isotropy", "distance from transverse isotropy", Percent),
    ("c44.given", "of the material", Stress),
    ("c44.dependent", "of the elliptic interpolation", Stress),
    // Corrections.
    ("correction.form", "form", Number),
    ("correction.converged", "converged", Number),
    ("correction.corrections", "corrections", Count),
    ("correction.tests", "element tests", Count),
    ("correction.history", "error, test by test", Percent),
    ("correction.error", "error", Percent),
    ("correction.tensor_error", "error of the whole tensor", Percent),
    ("correction.out_of_reach", "out of reach", Perhaps),
    ("correction.shortfall", "", Hidden),
    ("correction.smallest_normal", "smallest k_n", Spring),
    ("correction.largest_normal", "largest k_n", Spring),
    ("correction.smallest_tangential", "smallest k_t", Spring),
    ("correction.largest_tangential", "largest k_t", Spring),
    ("correction.at_floor", "bonds at the floor", Count),
    ("correction.nodal.moduli", "Kelvin moduli of Z", Stress),
    ("correction.nodal.positive", "Z is positive", Number),
    ("correction.nodal.bond_share", "share of the bonds that is kept", Percent),
    ("correction.nodal.refused_shares", "shares that were refused", Percent),
    ("correction.nodal.flat_nodes", "nodes whose neighbours lie in a plane", Count),
    // Element tests.
    ("cell.places", "places for nodes", Count),
    ("cell.nodes", "nodes", Count),
    ("cell.missing", "missing", Count),
    ("cell.displaced", "displaced by up to (spacings)", Number),
    ("cell.seed", "seed", Count),
    ("cell.bonds", "bonds", Count),
    ("rotations", "node rotations", Number),
    ("method", "method", Number),
    ("strain", "strain", Percent),
    ("engineering.ex", "E_x", Stress),
    ("engineering.ey", "E_y", Stress),
    ("engineering.ez", "E_z", Stress),
    ("engineering.gyz", "G_yz", Stress),
    ("engineering.gzx", "G_zx", Stress),
    ("engineering.gxy", "G_xy", Stress),
    ("nu_xy", "ν_xy", Number),
    ("nu_xz", "ν_xz", Number),
    ("nu_yx", "ν_yx", Number),
    ("nu_yz", "ν_yz", Number),
    ("nu_zx", "ν_zx", Number),
    ("nu_zy", "ν_zy", Number),
    ("ex_ey", "E_x, E_y", Stress),
    ("gyz_gzx", "G_yz, G_zx", Stress),
    ("nu_xy_nu_yx", "ν_xy, ν_yx", Number),
    ("nu_xz_nu_yz", "ν_xz, ν_yz", Number),
    ("nu_zx_nu_zy", "ν_zx, ν_zy", Number),
    ("dependent_nu_xz", "ν_xz = ν_zx E_x/E_z", Number),
    ("dependent_gxy", "G_xy = E_x/2(1 + ν_xy)", Stress),
    ("certificate.force_balance", "force balance", Number),
    ("certificate.moment_balance", "moment balance", Number),
    ("certificate.asymmetry", "asymmetry", Number),
    ("certificate.energy_consistency", "energy against stress", Number),
    ("certificate.stress_asymmetry", "asymmetry of stress", Number),
    ("certificate.below_sum", "below the sum over bonds by at least", Percent),
    ("certificate.lateral_stress", "lateral stress over axial stress", Number),
    ("mechanism.parts", "parts that hang together", Count),
    ("mechanism.missing_constraints", "constraints that are missing", Count),
    ("mechanism.floaters", "nodes without a bond", Count),
    ("mechanism.apart", "nodes apart from the rest", Count),
    ("mechanism.loose", "nodes that move at no cost", Count),
    ("mechanism.spinning", "nodes that turn at no cost", Count),
    ("iterations", "iterations", Count),
    ("applications", "operator applications", Count),
    ("residual", "residual", Number),
    ("converged", "converged", Number),
    ("negative_curvature", "met a displacement of negative energy", Perhaps),
    // Runs.
    ("nodes", "nodes or spheres", Count),
    ("bonds", "bonds", Count),
    ("steps", "steps", Count),
    ("time", "time reached", Time),
    ("time_step.step", "time step", Time),
    ("time_step.stable", "largest stable one", Time),
    ("equilibrium.equilibria", "equilibria of the last load step", Count),
    ("equilibrium.broken", "bonds broken in it", Count),
    ("equilibrium.report.ending", "ending", Number),
    ("regions.name", "", Hidden),
    ("regions.nodes", "nodes", Count),
    ("regions.relative_error", "stiffness reached to", Percent),
    ("wanted_mean", "fracture energy wanted", Plain("J/m²")),
    ("reached_mean", "fracture energy reached", Plain("J/m²")),
    ("rms_deviation", "its deviation over directions, rms", Percent),
    ("largest_deviation", "its largest deviation", Percent),
    ("largest_at", "along", Number),
    ("ratio_range", "reached over wanted, least and most", Number),
    ("stretch_range", "critical stretch, least and most", Number),
    ("energy.kinetic", "kinetic", Energy),
    ("energy.strain", "strain", Energy),
    ("energy.damping", "damping", Energy),
    ("energy.fracture", "fracture", Energy),
    ("energy.external", "external", Energy),
    ("energy.initial", "initial", Energy),
    ("energy.broken_bonds", "broken bonds", Count),
    ("relative_drift", "drift of the energy", Number),
    ("largest_damage", "largest damage", Number),
    ("seconds", "computed in", Time),
    ("lattice.region", "region", Number),
    ("cell.stress", "stress, xx yy zz yz xz xy", Stress),
    ("cell.strain", "strain, xx yy zz yz xz xy", Percent),
    ("peak.axis", "", Hidden),
    ("peak.differential", "largest differential stress", Stress),
    ("peak.stress", "axial stress then", Stress),
    ("peak.strain", "axial strain then", Percent),
    ("peak.time", "time then", Time),
    ("cracks.length", "length", Distance),
    ("cracks.nodes", "nodes", Count),
    ("cracks.direction", "along", Number),
    ("cracks.speed", "mean speed", Speed),
    ("cracks.largest_speed", "largest speed", Speed),
];

/// Titles of sections, by key.
#[rustfmt::skip]
const TITLES: &[(&str, &str)] = &[
    ("neighbourhood", "Neighbourhood"),
    ("infeasibility", "Why it is out of reach"),
    ("bonds_infeasibility", "Why bonds alone do not reach it; Z takes the rest"),
    ("micromodulus", "Micromoduli c"),
    ("tangential_micromodulus", "Tangential micromoduli c_t"),
    ("least_trace", "The least nodal term"),
    ("solver", "Solver"),
    ("packing", "Packing"),
    ("microplane_moduli", "Microplane moduli E"),
    ("lattice_moduli", "Lattice moduli E′ = E/μ"),
    ("c44", "C44"),
    ("correction", "Correction"),
    ("engineering", "Engineering constants"),
    ("consistency", "Transverse isotropy about z"),
    ("certificate", "What was checked"),
    ("mechanism", "What holds together"),
    ("cell", "Cell"),
    ("time_step", "Time step"),
    ("equilibrium", "Equilibrium"),
    ("regions", "Region"),
    ("energy", "Energy"),
];

/// Words and unit of a key, given by its path.
pub(super) fn label(path: &str) -> Option<(&'static str, Unit)> {
    let fits = |end: &str| {
        path.strip_suffix(end)
            .is_some_and(|rest| rest.is_empty() || rest.ends_with('.') || rest.ends_with('_') && end.contains('.'))
    };
    let found = LABELS.iter().filter(|(end, ..)| fits(end)).max_by_key(|(end, ..)| end.len());
    found.map(|(_, words, unit)| (*words, *unit))
}

/// The title of a section.
pub(super) fn title(key: &str) -> String {
    TITLES.iter().find(|(known, _)| *known == key).map_or_else(|| key.replace('_', " "), |(_, title)| (*title).into())
}
