//! What the program says of a hybrid model, as one JSON document.

use serde::Serialize;

use crate::report::{
    InfeasibilityReport, MicromodulusReport, NeighbourhoodReport, SolverReport, Voigt, WavesOfGrid, doubts,
    universal_anisotropy,
};
use anisobond::calibration::{HybridCalibration, HybridForm, Model, Outcome, TraceEvidence};
use anisobond::tensor::Material;
use anisobond::tensor::monomial_names;

/// A hybrid model (bonds and nodal term) with its evidence.
#[derive(Clone, Debug, Serialize)]
pub struct HybridReport {
    /// Name of the material.
    pub material: String,
    /// Where its numbers come from.
    pub source: String,
    /// Density (kg/m³), if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Always "hybrid".
    pub model: Model,
    /// remainder or stable.
    pub form: HybridForm,
    /// The neighbourhood.
    pub neighbourhood: NeighbourhoodReport,
    /// The wanted tensor (Voigt, Pa).
    pub target: Voigt,
    /// The tensor of bonds and nodal term (Voigt, Pa).
    pub reached: Voigt,
    /// ‖target − reached‖/‖target‖ over all 81 components.
    pub relative_error: f64,
    /// Least and largest relative error of the energy of a strain, over all strains; `None` where the target is singular.
    pub energy_error: Option<[f64; 2]>,
    /// The tensor of the bonds alone (Voigt, Pa).
    pub reached_by_bonds: Voigt,
    /// The nodal term Z (Voigt, Pa): energy density ½ ε̄:Z:ε̄ of a node's average strain.
    pub nodal_term: Voigt,
    /// ‖Z‖/‖C‖ (–).
    pub nodal_share: f64,
    /// The least relative error of central bonds on any neighbourhood.
    pub cauchy_gap: f64,
    /// feasible or not-converged.
    pub outcome: Outcome,
    /// Whether bonds and nodal term together reach the target, which is what they can at the most.
    pub reaches_model_limit: bool,
    /// Always `None`: there is no positive definite tensor out of reach.
    pub infeasibility: Option<InfeasibilityReport>,
    /// Why the bonds alone do not reach the Cauchy part of what they are to carry; `None` when they do.
    pub bonds_infeasibility: Option<InfeasibilityReport>,
    /// Universal anisotropy index A^U of the target.
    pub universal_anisotropy: f64,
    /// The lower bound of the micromoduli in force (N/m⁶).
    pub lower_bound: f64,
    /// The micromoduli in brief (N/m⁶).
    pub micromodulus: MicromodulusReport,
    /// Waves of the grid.
    #[serde(flatten)]
    pub waves: WavesOfGrid,
    /// Evidence that tr Z is the least; `None` in the form `remainder` or where Z = 0.
    pub least_trace: Option<TraceEvidence>,
    /// The quartic form p of the bonds, cᵢ = max(lower bound, sᵢ p(nᵢ)); coefficients in the order of `monomials`.
    pub dual: [f64; 15],
    /// The monomials of quartic forms, as index quadruples.
    pub monomials: [String; 15],
    /// How the solver of the bonds ended.
    pub solver: SolverReport,
    /// What is not plausible of the material: units or keys that may be wrong.
    pub warnings: Vec<String>,
}

impl HybridReport {
    /// Bring together a material, the neighbourhood it was calibrated on, and the result.
    pub fn new(material: &Material, neighbourhood: &NeighbourhoodReport, r: &HybridCalibration) -> Self {
        let bonds = &r.bonds;
        HybridReport {
            material: material.name.clone(),
            source: material.source.clone(),
            density: material.density,
            model: Model::Hybrid,
            form: r.form,
            neighbourhood: neighbourhood.clone(),
            target: r.target.voigt_rows(),
            reached: r.reached.voigt_rows(),
            relative_error: r.relative_error,
            energy_error: r.target.energy_error(&r.reached),
            reached_by_bonds: bonds.reached.voigt_rows(),
            nodal_term: r.nodal.voigt_rows(),
            nodal_share: r.nodal.norm() / r.target.norm(),
            cauchy_gap: r.target.cauchy_gap(),
            outcome: r.outcome(),
            reaches_model_limit: r.feasible(),
            infeasibility: None,
            bonds_infeasibility: bonds
                .infeasibility
                .as_ref()
                .map(|i| InfeasibilityReport::new(i, bonds.lower_bound, bonds.metric)),
            universal_anisotropy: universal_anisotropy(&r.target),
            lower_bound: bonds.lower_bound,
            micromodulus: MicromodulusReport::of(&bonds.micromodulus),
            waves: WavesOfGrid::new(&r.stability, &r.long_waves, Some(&r.long_waves)),
            least_trace: r.least_trace,
            dual: bonds.dual,
            monomials: monomial_names(),
            solver: SolverReport { iterations: bonds.iterations, residual: bonds.residual, converged: bonds.converged },
            warnings: doubts(material, neighbourhood),
        }
    }
}
