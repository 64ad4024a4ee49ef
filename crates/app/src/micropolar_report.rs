//! What the program says of normal and tangential bonds, as one JSON document.

use serde::Serialize;

use crate::report::{
    MicromodulusReport, NeighbourhoodReport, SolverReport, Voigt, WavesOfGrid, doubts, universal_anisotropy,
};
use anisobond::calibration::{
    Cause, MicropolarCalibration, MicropolarInfeasibility, Model, Outcome, Promise, WaveEvidence,
};
use anisobond::tensor::Material;

/// Normal and tangential bonds with their evidence.
#[derive(Clone, Debug, Serialize)]
pub struct MicropolarReport {
    /// Name of the material.
    pub material: String,
    /// Where its numbers come from.
    pub source: String,
    /// Density (kg/m³), if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Always "micropolar".
    pub model: Model,
    /// sum or free-rotations: which tensor was brought onto the target.
    pub promise: Promise,
    /// The neighbourhood.
    pub neighbourhood: NeighbourhoodReport,
    /// The wanted tensor (Voigt, Pa).
    pub target: Voigt,
    /// The promised tensor (Voigt, Pa): `sum` or `relaxed`.
    pub reached: Voigt,
    /// ‖target − reached‖/‖target‖ over all 81 components.
    pub relative_error: f64,
    /// Least and largest relative error of the energy of a strain, over all strains; `None` where the target is singular.
    pub energy_error: Option<[f64; 2]>,
    /// The sum over bonds at uniform strain, nodes not turning (Voigt, Pa).
    pub sum: Voigt,
    /// ‖target − sum‖/‖target‖.
    pub sum_error: f64,
    /// What an element test of the perfect grid measures, node rotations free (Voigt, Pa).
    pub relaxed: Voigt,
    /// ‖target − relaxed‖/‖target‖.
    pub relaxed_error: f64,
    /// The least relative error of central bonds on any neighbourhood.
    pub cauchy_gap: f64,
    /// feasible, infeasible or not-converged.
    pub outcome: Outcome,
    /// Whether normal and tangential bonds ≥ 0 reach the target itself, which is what they can at the most.
    pub reaches_model_limit: bool,
    /// Why not, with a certificate; `None` when they do.
    pub infeasibility: Option<MicropolarInfeasibilityReport>,
    /// Universal anisotropy index A^U of the target.
    pub universal_anisotropy: f64,
    /// The normal micromoduli in brief (N/m⁶).
    pub micromodulus: MicromodulusReport,
    /// The tangential micromoduli in brief (N/m⁶).
    pub tangential_micromodulus: MicromodulusReport,
    /// Waves of the grid, node rotations free and without inertia.
    #[serde(flatten)]
    pub waves: WavesOfGrid,
    /// The tensor Y (Kelvin-Mandel matrix, N/m¹⁰): c_n = max(0, s N:Y), c_t = max(0, s T:Y).
    pub dual: [[f64; 6]; 6],
    /// How the solver ended.
    pub solver: SolverReport,
    /// What is not plausible of the material: units or keys that may be wrong.
    pub warnings: Vec<String>,
}

/// Why a tensor is out of reach of normal and tangential bonds.
#[derive(Clone, Debug, Serialize)]
pub struct MicropolarInfeasibilityReport {
    /// In words, with a remedy.
    pub explanation: String,
    /// Cause, certificate and distance.
    #[serde(flatten)]
    pub evidence: MicropolarInfeasibility,
}

impl MicropolarReport {
    /// Bring together a material, the neighbourhood it was calibrated on, and the result.
    pub fn new(
        material: &Material,
        neighbourhood: &NeighbourhoodReport,
        r: &MicropolarCalibration,
        waves: &WaveEvidence,
    ) -> Self {
        let promised = match r.promise {
            Promise::Sum => &r.reached,
            Promise::FreeRotations => &r.relaxed,
        };
        MicropolarReport {
            material: material.name.clone(),
            source: material.source.clone(),
            density: material.density,
            model: Model::Micropolar,
            promise: r.promise,
            neighbourhood: neighbourhood.clone(),
            target: r.target.voigt_rows(),
            reached: promised.voigt_rows(),
            relative_error: r.promised_error(),
            energy_error: r.target.energy_error(promised),
            sum: r.reached.voigt_rows(),
            sum_error: r.relative_error,
            relaxed: r.relaxed.voigt_rows(),
            relaxed_error: r.relaxed_error,
            cauchy_gap: r.cauchy_gap,
            outcome: r.outcome(),
            reaches_model_limit: r.feasible(),
            infeasibility: r.infeasibility.as_ref().map(|i| MicropolarInfeasibilityReport::new(i, r.promise)),
            universal_anisotropy: universal_anisotropy(&r.target),
            micromodulus: MicromodulusReport::of(&r.normal),
            tangential_micromodulus: MicromodulusReport::of(&r.tangential),
            waves: WavesOfGrid::new(&waves.stability, &waves.target, waves.reached.as_ref()),
            dual: std::array::from_fn(|a| std::array::from_fn(|b| r.dual[(a, b)])),
            solver: SolverReport { iterations: r.iterations, residual: r.residual, converged: r.converged },
            warnings: doubts(material, neighbourhood),
        }
    }
}

impl MicropolarInfeasibilityReport {
    fn new(i: &MicropolarInfeasibility, promise: Promise) -> Self {
        const SPAN: &str = "the bonds of this neighbourhood span too few tensors to express the target";
        let what = match i.cause {
            Cause::Rank => SPAN.to_string(),
            Cause::Cone => "the target needs negative normal or tangential micromoduli".to_string(),
            Cause::RankAndCone => format!("{SPAN}, and what they span of it needs negative micromoduli"),
        };
        let remedy = match i.in_every_neighbourhood {
            true => {
                "no neighbourhood of normal and tangential bonds can: an eigenvalue of the Cauchy defect is above half of \
                 its trace; the hybrid model reaches it"
            }
            false => "a larger horizon may do, the hybrid model does",
        };
        let given = match promise {
            Promise::Sum => "The bonds given are those of the closest reachable tensor.",
            Promise::FreeRotations => {
                "The bonds given are the nearest that were found; the certificate holds while the nodes turn as they do \
                 with these."
            }
        };
        MicropolarInfeasibilityReport { explanation: format!("{what}; {remedy}. {given}"), evidence: i.clone() }
    }
}
