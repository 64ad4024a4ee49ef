//! What the program says of a hybrid model, as one JSON document.

use serde::Serialize;

use super::report::{CalibrationReport, InfeasibilityReport, MicromodulusReport, NeighbourhoodReport, Voigt};
use crate::calibration::{HybridCalibration, HybridCalibrator, HybridForm, TraceEvidence};
use crate::tensor::Material;

/// A hybrid model (bonds and nodal term) with its evidence.
#[derive(Clone, Debug, Serialize)]
pub struct HybridReport {
    /// Name of the material.
    pub material: String,
    /// Where its numbers come from.
    pub source: String,
    /// Always "hybrid".
    pub model: &'static str,
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
    /// The tensor of the bonds alone (Voigt, Pa).
    pub reached_by_bonds: Voigt,
    /// The nodal term Z (Voigt, Pa): energy density ½ ε̄:Z:ε̄ of a node's average strain.
    pub nodal_term: Voigt,
    /// ‖Z‖/‖C‖ (–).
    pub nodal_share: f64,
    /// The least relative error of central bonds on any neighbourhood.
    pub cauchy_gap: f64,
    /// Why the bonds alone do not reach their part of the tensor; `None` when they do.
    pub infeasibility: Option<InfeasibilityReport>,
    /// The lower bound of the micromoduli in force (N/m⁶).
    pub lower_bound: f64,
    /// The micromoduli in brief (N/m⁶).
    pub micromodulus: MicromodulusReport,
    /// Whether every sampled wave has positive energy.
    pub stable: bool,
    /// Smallest eigenvalue of the dynamical matrix over the zone, D(k)/κ²(k) (Pa); for long waves Christoffel's ρc².
    pub smallest_eigenvalue: f64,
    /// Phases kₐΔ (rad) along the grid's axes where it was found.
    pub smallest_at_phases: [f64; 3],
    /// Wave vectors tried.
    pub sampled_waves: usize,
    /// Largest relative error of a phase speed at |k|Δ = 0.05, against Christoffel's.
    pub long_wave_error: f64,
    /// Order of that error in |k|.
    pub long_wave_order: f64,
    /// Evidence that tr Z is the least; `None` in the form `remainder` or where Z = 0.
    pub least_trace: Option<TraceEvidence>,
}

impl HybridReport {
    /// Bring together a material, the neighbourhood it was calibrated on, and the result.
    pub fn new(material: &Material, calibrator: &HybridCalibrator, r: &HybridCalibration) -> Self {
        let bonds = CalibrationReport::new(material, calibrator.calibrator(), &r.bonds);
        HybridReport {
            material: bonds.material,
            source: bonds.source,
            model: "hybrid",
            form: r.form,
            neighbourhood: bonds.neighbourhood,
            target: r.target.voigt_rows(),
            reached: r.reached.voigt_rows(),
            relative_error: r.relative_error,
            reached_by_bonds: bonds.reached,
            nodal_term: r.nodal.voigt_rows(),
            nodal_share: r.nodal.norm() / r.target.norm(),
            cauchy_gap: r.target.cauchy_gap(),
            infeasibility: bonds.infeasibility,
            lower_bound: bonds.lower_bound,
            micromodulus: bonds.micromodulus,
            stable: r.stability.stable,
            smallest_eigenvalue: r.stability.smallest_eigenvalue,
            smallest_at_phases: r.stability.phases,
            sampled_waves: r.stability.samples,
            long_wave_error: r.long_waves.error,
            long_wave_order: r.long_waves.order,
            least_trace: r.least_trace,
        }
    }
}
