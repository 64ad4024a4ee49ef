//! What the program says of a tensor and of a calibration, as one JSON document each; the same for command line,
//! Python and library.

use serde::{Deserialize, Serialize};

use anisobond::calibration::{
    Calibration, Cause, Infeasibility, LongWaves, Model, ModelCalibrator, Outcome, Stability, StabilityEvidence,
    WaveEvidence,
};
use anisobond::lattice::Influence;
use anisobond::tensor::{
    AverageModuli, DirectionalExtremes, DirectionalModuli, EnergySymmetry, EngineeringConstants, Material, Metric,
    Stiffness, Symmetry, Wave, WaveExtremes, doubtful_length, mandel_weight, monomial_names,
};
use anisobond::{Error, Result};

/// A 6×6 Voigt matrix in rows, order 11 22 33 23 13 12.
pub type Voigt = [[f64; 6]; 6];

/// Everything that can be said of a tensor without a lattice. Stresses in Pa, compliances in 1/Pa, speeds in m/s.
#[derive(Clone, Debug, Serialize)]
pub struct TensorReport {
    /// Name of the material.
    pub material: String,
    /// Where its numbers come from.
    pub source: String,
    /// Density (kg/m³), if known.
    pub density: Option<f64>,
    /// Voigt stiffness (Pa).
    pub stiffness: Voigt,
    /// Voigt compliance (1/Pa).
    pub compliance: Voigt,
    /// ‖C‖ over all 81 components (Pa).
    pub norm: f64,
    /// Always true: other tensors are refused.
    pub positive_definite: bool,
    /// Kelvin moduli, the eigenvalues (Pa), ascending.
    pub kelvin_moduli: [f64; 6],
    /// Eigentensors as strains (11 22 33 23 13 12, tensor components), one row per Kelvin modulus.
    pub eigentensors: [[f64; 6]; 6],
    /// Voigt, Reuss and Hill averages, universal anisotropy index.
    pub moduli: AverageModuli,
    /// Engineering constants in the given axes.
    pub engineering: EngineeringConstants,
    /// Extremes over all directions.
    pub directional: DirectionalExtremes,
    /// Plane waves; `None` without a density.
    pub waves: Option<WavesReport>,
    /// What central bonds can see.
    pub cauchy: CauchyReport,
    /// Symmetry class and distance to all eight.
    pub symmetry: Symmetry,
    /// The same in the sense of energy.
    pub symmetry_in_energy: Option<EnergySymmetry>,
    /// What is not plausible of the material: units or keys that may be wrong.
    pub warnings: Vec<String>,
}

/// Plane waves along the axes and their extremes.
#[derive(Clone, Debug, Serialize)]
pub struct WavesReport {
    /// The three waves along e₁, slowest first.
    pub x: [Wave; 3],
    /// The three waves along e₂.
    pub y: [Wave; 3],
    /// The three waves along e₃.
    pub z: [Wave; 3],
    /// Extremes over all directions.
    pub extremes: WaveExtremes,
}

/// The part of a tensor that central bonds reach, and the rest.
#[derive(Clone, Debug, Serialize)]
pub struct CauchyReport {
    /// ‖C − S‖/‖C‖, the least error of central bonds.
    pub gap: f64,
    /// The Cauchy part S (Pa).
    pub part: Voigt,
    /// The defect D (Pa): D11 = C44 − C23, D12 = C36 − C45, …
    pub defect: [[f64; 3]; 3],
    /// Whether bonds c ≥ 0 of a fine enough neighbourhood reach S: its Kelvin moduli are not negative.
    pub reachable: bool,
}

impl TensorReport {
    /// Analyse a material; symmetry classes within `tolerance` count as present, or without one within the noise that the
    /// tensor shows.
    ///
    /// # Errors
    /// A stiffness that is not positive definite.
    pub fn new(material: &Material, tolerance: Option<f64>) -> Result<Self> {
        let c = &material.stiffness;
        c.require_positive_definite()?;
        let singular = || Error::input("the stiffness cannot be inverted", "check its components and units");
        let compliance = c.compliance_voigt().ok_or_else(singular)?;
        let (values, vectors) = c.eigen();
        let part = c.cauchy_part();
        let defect = c.cauchy_defect();
        let waves = match material.density {
            None => None,
            Some(density) => Some(WavesReport {
                x: c.waves(&nalgebra::Vector3::x(), density)?,
                y: c.waves(&nalgebra::Vector3::y(), density)?,
                z: c.waves(&nalgebra::Vector3::z(), density)?,
                extremes: c.wave_extremes(density)?,
            }),
        };
        let symmetry = tolerance.map_or_else(|| c.symmetry_by_noise(), |tolerance| c.symmetry(tolerance));
        Ok(TensorReport {
            material: material.name.clone(),
            source: material.source.clone(),
            density: material.density,
            stiffness: c.voigt_rows(),
            compliance: std::array::from_fn(|a| std::array::from_fn(|b| compliance[(a, b)])),
            norm: c.norm(),
            positive_definite: true,
            kelvin_moduli: values.into(),
            eigentensors: std::array::from_fn(|k| std::array::from_fn(|a| vectors[(a, k)] / mandel_weight(a))),
            moduli: c.average_moduli().ok_or_else(singular)?,
            engineering: c.engineering_constants().ok_or_else(singular)?,
            directional: DirectionalModuli::new(c)?.extremes(),
            waves,
            cauchy: CauchyReport {
                gap: c.cauchy_gap(),
                part: part.voigt_rows(),
                defect: std::array::from_fn(|p| std::array::from_fn(|q| defect[(p, q)])),
                reachable: part.eigen().0[0] >= -1e-12 * part.norm(),
            },
            symmetry_in_energy: c.symmetry_in_energy(&symmetry, tolerance),
            symmetry,
            warnings: material.doubts(),
        })
    }
}

/// Central bonds with their evidence.
#[derive(Clone, Debug, Serialize)]
pub struct CalibrationReport {
    /// Name of the material.
    pub material: String,
    /// Where its numbers come from.
    pub source: String,
    /// Density (kg/m³), if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Always "central".
    pub model: Model,
    /// The neighbourhood.
    pub neighbourhood: NeighbourhoodReport,
    /// The wanted tensor (Voigt, Pa).
    pub target: Voigt,
    /// The tensor of the bonds (Voigt, Pa).
    pub reached: Voigt,
    /// ‖target − reached‖/‖target‖ over all 81 components.
    pub relative_error: f64,
    /// Least and largest relative error of the energy of a strain, over all strains; `None` where the target is singular.
    pub energy_error: Option<[f64; 2]>,
    /// The least relative error of central bonds on any neighbourhood.
    pub cauchy_gap: f64,
    /// In which sense they come close to a target out of reach: norm or energy.
    pub metric: Metric,
    /// feasible, infeasible or not-converged.
    pub outcome: Outcome,
    /// Whether the bonds reach what central bonds can at the most, S or S* of the target: no neighbourhood brings this model closer in
    /// its metric. The error is that of the model then, and may be large.
    pub reaches_model_limit: bool,
    /// Why not, with a certificate; `None` when it does.
    pub infeasibility: Option<InfeasibilityReport>,
    /// Universal anisotropy index A^U of the target.
    pub universal_anisotropy: f64,
    /// The lower bound in force (N/m⁶).
    pub lower_bound: f64,
    /// The micromoduli in brief (N/m⁶).
    pub micromodulus: MicromodulusReport,
    /// Waves of the grid.
    #[serde(flatten)]
    pub waves: WavesOfGrid,
    /// The quartic form p: cᵢ = max(lower bound, sᵢ p(nᵢ)), sᵢ = ½ ωᵢ |ξᵢ| ΔV; coefficients in the order of
    /// `monomials`.
    pub dual: [f64; 15],
    /// The monomials of quartic forms, as index quadruples: "1123" is n₁ n₁ n₂ n₃.
    pub monomials: [String; 15],
    /// How the solver ended.
    pub solver: SolverReport,
    /// What is not plausible of the material: units or keys that may be wrong.
    pub warnings: Vec<String>,
}

/// A neighbourhood in brief; lengths in spacings, but for `spacing`.
#[derive(Clone, Debug, Serialize)]
pub struct NeighbourhoodReport {
    /// sphere, cube, cuboid or ellipsoid.
    pub shape: String,
    /// Half its extent along each axis (spacings).
    pub semi_axes: [f64; 3],
    /// Horizon ratio δ/Δ.
    pub horizon: f64,
    /// Grid spacing Δ (m).
    pub spacing: f64,
    /// Name of the influence function.
    pub influence: String,
    /// Rotation or reflection of the grid, in rows.
    pub orientation: [[f64; 3]; 3],
    /// Number of bonds.
    pub bonds: usize,
    /// Number of distinct ± directions.
    pub directions: usize,
    /// Dimension of the reachable tensors (when nothing is missing 15, with tangential bonds 21).
    pub rank: usize,
}

/// Waves of a grid of such bonds.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct WavesOfGrid {
    /// Whether every wave has positive energy; how that is known, `stability` says.
    pub stable: bool,
    /// How it is known, and by what margin.
    pub stability: StabilityEvidence,
    /// Smallest eigenvalue of the dynamical matrix over the zone, D(k)/κ²(k) (Pa); for long waves Christoffel's ρc².
    pub smallest_eigenvalue: f64,
    /// Phases kₐΔ (rad) along the grid's axes where it was found.
    pub smallest_at_phases: [f64; 3],
    /// Wave vectors tried.
    pub sampled_waves: usize,
    /// Largest relative error of a phase speed at |k|Δ = 0.05, against Christoffel's of the wanted tensor.
    pub long_wave_error: f64,
    /// Order of that error in |k|: 2 where the model is exact, 0 where its tensor is another.
    pub long_wave_order: f64,
    /// The same against the tensor that the grid has (with free rotations the relaxed one); `None` where that is not
    /// positive definite.
    pub long_wave_error_of_reached: Option<f64>,
    /// Order of that error, 2 in theory.
    pub long_wave_order_of_reached: Option<f64>,
}

/// Why a target is out of reach.
#[derive(Clone, Debug, Serialize)]
pub struct InfeasibilityReport {
    /// rank, cone or rank-and-cone.
    pub cause: Cause,
    /// In words, with a remedy.
    pub explanation: String,
    /// The quartic form y (order of `monomials`): y(nᵢ) ≤ 0 for every bond, so y·Xᵢ = sᵢ y(nᵢ) ≤ 0, but y·(S − X l) > 0
    /// with y·S = Σ yₖ S_k.
    pub certificate: [f64; 15],
    /// Largest y(nᵢ) over the bonds.
    pub largest_bond_product: f64,
    /// y·(S − X l) (Pa).
    pub target_product: f64,
    /// Distance from the reachable tensors, relative to what is aimed at; both in the metric of the calibration.
    pub distance: f64,
    /// Whether no neighbourhood reaches the target.
    pub in_every_neighbourhood: bool,
}

/// Micromoduli in brief (N/m⁶).
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MicromodulusReport {
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Mean over the bonds.
    pub mean: f64,
    /// Number of bonds of micromodulus 0.
    pub zero: usize,
}

/// Counts and residual of the solver.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SolverReport {
    /// Newton steps (0: the pseudo-inverse was optimal).
    pub iterations: usize,
    /// ‖Xc − S‖/‖S‖, with the closest reachable tensor for S when infeasible.
    pub residual: f64,
    /// Whether it ended where it should: with a residual that is rounding, and no bonds of smaller norm.
    pub converged: bool,
}

/// How a solve of a lattice's equilibrium ended, as results tell it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolveOutcome {
    /// Iterations of the slowest load case.
    pub iterations: usize,
    /// Largest residual of the load cases, relative to that of the right-hand side.
    pub residual: f64,
    /// Whether every load case met the tolerance.
    pub converged: bool,
    /// Whether a direction of negative energy was met.
    pub negative_curvature: bool,
}

impl From<anisobond::solver::SolverReport> for SolveOutcome {
    fn from(r: anisobond::solver::SolverReport) -> Self {
        SolveOutcome {
            iterations: r.iterations,
            residual: r.residual,
            converged: r.converged(),
            negative_curvature: r.negative_curvature(),
        }
    }
}

impl CalibrationReport {
    /// Bring together a material, the neighbourhood it was calibrated on, and the result.
    pub fn new(
        material: &Material,
        neighbourhood: &NeighbourhoodReport,
        r: &Calibration,
        waves: &WaveEvidence,
    ) -> Self {
        CalibrationReport {
            material: material.name.clone(),
            source: material.source.clone(),
            density: material.density,
            model: Model::Central,
            neighbourhood: neighbourhood.clone(),
            target: r.target.voigt_rows(),
            reached: r.reached.voigt_rows(),
            relative_error: r.relative_error,
            energy_error: r.target.energy_error(&r.reached),
            cauchy_gap: r.cauchy_gap,
            metric: r.metric,
            outcome: r.outcome(),
            reaches_model_limit: r.feasible(),
            infeasibility: r.infeasibility.as_ref().map(|i| InfeasibilityReport::new(i, r.lower_bound, r.metric)),
            universal_anisotropy: universal_anisotropy(&r.target),
            lower_bound: r.lower_bound,
            micromodulus: MicromodulusReport::of(&r.micromodulus),
            waves: WavesOfGrid::new(&waves.stability, &waves.target, waves.reached.as_ref()),
            dual: r.dual,
            monomials: monomial_names(),
            solver: SolverReport { iterations: r.iterations, residual: r.residual, converged: r.converged },
            warnings: doubts(material, neighbourhood),
        }
    }
}

/// What is not plausible of a material and of the grid on which it is calibrated.
pub(super) fn doubts(material: &Material, neighbourhood: &NeighbourhoodReport) -> Vec<String> {
    material.doubts().into_iter().chain(doubtful_length("the spacing", neighbourhood.spacing)).collect()
}

/// A^U, NaN where the compliance is singular.
pub(super) fn universal_anisotropy(c: &Stiffness) -> f64 {
    c.average_moduli().map_or(f64::NAN, |m| m.universal_anisotropy)
}

impl MicromodulusReport {
    /// Of a list of micromoduli.
    pub(super) fn of(c: &[f64]) -> Self {
        MicromodulusReport {
            min: c.iter().copied().fold(f64::INFINITY, f64::min),
            max: c.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            mean: c.iter().sum::<f64>() / c.len() as f64,
            zero: c.iter().filter(|&&c| c == 0.0).count(),
        }
    }
}

impl WavesOfGrid {
    pub(super) fn new(weakest: &Stability, target: &LongWaves, reached: Option<&LongWaves>) -> Self {
        WavesOfGrid {
            stable: weakest.stable,
            stability: weakest.brief(),
            smallest_eigenvalue: weakest.smallest_eigenvalue,
            smallest_at_phases: weakest.phases,
            sampled_waves: weakest.samples,
            long_wave_error: target.error,
            long_wave_order: target.order,
            long_wave_error_of_reached: reached.map(|waves| waves.error),
            long_wave_order_of_reached: reached.map(|waves| waves.order),
        }
    }
}

impl NeighbourhoodReport {
    /// Describe a prepared neighbourhood.
    pub fn new(calibrator: &ModelCalibrator) -> Self {
        let neighbourhood = calibrator.neighbourhood();
        let q = neighbourhood.orientation();
        NeighbourhoodReport {
            shape: neighbourhood.shape().name().to_string(),
            semi_axes: neighbourhood.shape().semi_axes(),
            horizon: neighbourhood.horizon(),
            spacing: neighbourhood.spacing(),
            influence: influence_name(neighbourhood.influence()).to_string(),
            orientation: std::array::from_fn(|i| std::array::from_fn(|j| q[(i, j)])),
            bonds: neighbourhood.bonds().len(),
            directions: calibrator.directions(),
            rank: calibrator.rank(),
        }
    }
}

impl InfeasibilityReport {
    pub(super) fn new(i: &Infeasibility, lower_bound: f64, metric: Metric) -> Self {
        let below = if lower_bound > 0.0 { "micromoduli below the lower bound" } else { "negative micromoduli" };
        let aim = match metric {
            Metric::Norm => "the target's Cauchy part",
            Metric::Energy => "the Cauchy tensor closest to the target in energy",
        };
        let span = format!("the bonds of this neighbourhood span too few tensors to express {aim}");
        let what = match i.cause {
            Cause::Rank => span,
            Cause::Cone => format!("{aim} needs {below} on this neighbourhood"),
            Cause::RankAndCone => format!("{span}, and what they span of it needs {below}"),
        };
        let remedy = match (i.in_every_neighbourhood, lower_bound > 0.0) {
            (true, _) => "no neighbourhood of central bonds can: it has a negative Kelvin modulus",
            (false, true) => "lower the bound (a lower bound of `max` finds the largest) or use a larger horizon",
            (false, false) => "use a larger horizon or turn the neighbourhood",
        };
        InfeasibilityReport {
            cause: i.cause,
            explanation: format!("{what}; {remedy}. The bonds given are those of the closest reachable tensor."),
            certificate: i.certificate,
            largest_bond_product: i.largest_bond_product,
            target_product: i.target_product,
            distance: i.distance,
            in_every_neighbourhood: i.in_every_neighbourhood,
        }
    }
}

/// The name of an influence function on the command line.
pub fn influence_name(influence: &Influence) -> &'static str {
    match influence {
        Influence::Constant => "constant",
        Influence::Inverse => "inverse",
        Influence::Hat => "hat",
        Influence::Power => "power",
        Influence::Table(_) => "table",
    }
}
