//! What the program says of the element test of a grid cell, as one JSON document.

use serde::Serialize;

use crate::lattice_report::Engineering;
use crate::report::{NeighbourhoodReport, SolveOutcome, Voigt};
use anisobond::calibration::{Evidence, Model, ModelCalibrator};
use anisobond::experiment::element_test::{Certificate, ElementTestResult, Mechanism, Rotations};
use anisobond::experiment::{CorrectionReport, GridStudy};
use anisobond::tensor::Material;

/// A grid cell and its defects.
#[derive(Clone, Debug, Serialize)]
pub struct CellReport {
    /// Places for nodes along each axis of the grid.
    pub places: [usize; 3],
    /// Nodes that are there.
    pub nodes: usize,
    /// Places that are empty.
    pub missing: usize,
    /// Largest displacement of a node along each axis (spacings).
    pub displaced: f64,
    /// Seed of displacements and missing nodes.
    pub seed: u64,
    /// Bonds, each once.
    pub bonds: usize,
}

/// How the stability of a cell is known.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct CellStability {
    /// proved or sampled.
    pub evidence: Evidence,
    /// Smallest eigenvalue of the perfect grid's waves, relative to ‖C‖ (–); `None` after a correction.
    pub margin: Option<f64>,
}

/// The element test of a grid cell. Stresses in Pa.
#[derive(Clone, Debug, Serialize)]
pub struct GridTestReport {
    /// Name of the material.
    pub material: String,
    /// Where its numbers come from.
    pub source: String,
    /// Density (kg/m³), if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// central, micropolar or hybrid.
    pub model: Model,
    /// The neighbourhood.
    pub neighbourhood: NeighbourhoodReport,
    /// The cell.
    pub cell: CellReport,
    /// The wanted tensor (Voigt, Pa).
    pub target: Voigt,
    /// What the calibration promises of the perfect grid (Voigt, Pa).
    pub promised: Voigt,
    /// What the cell has (Voigt, Pa).
    pub measured: Voigt,
    /// The sum over bonds and nodes at uniform strain (Voigt, Pa): an upper bound.
    pub summed: Voigt,
    /// ‖target − promised‖/‖target‖.
    pub promised_error: f64,
    /// ‖promised − measured‖/‖promised‖: rounding on a perfect grid without correction.
    pub relative_error: f64,
    /// ‖target − measured‖/‖target‖.
    pub target_error: f64,
    /// Least and largest relative error of the energy of a strain, measured against the target; `None` where that is singular.
    pub energy_error: Option<[f64; 2]>,
    /// What to look at.
    pub warnings: Vec<String>,
    /// Engineering constants of the measured tensor; `None` if it is singular.
    pub engineering: Option<Engineering>,
    /// The nodal term Z (Voigt, Pa) of the hybrid model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodal_term: Option<Voigt>,
    /// Whether the cell was tested to the end without meeting a displacement of negative energy and, where the perfect
    /// grid's waves were sampled, these are all positive.
    pub stable: bool,
    /// How that is known: proved where no displacement can have negative energy, for bonds and nodal term are ≥ 0, and the
    /// perfect grid's waves, where it has been looked at, are proved positive; of a cell without defects the latter is enough.
    /// What is not stable is proved by the displacement met. Else sampled: by the displacements of the test.
    pub stability: CellStability,
    /// Smallest eigenvalue of the perfect grid's dynamical matrix over the zone, D(k)/κ²(k) (Pa); `None` after a
    /// correction.
    pub smallest_eigenvalue: Option<f64>,
    /// How the correction went, if one was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correction: Option<CorrectionReport>,
    /// Whether nodes rotated.
    pub rotations: Rotations,
    /// What of the answer was checked, independently.
    pub certificate: Certificate,
    /// Nodes that move at no cost.
    pub mechanism: Mechanism,
    /// How the solver ended.
    pub solver: SolveOutcome,
}

impl GridTestReport {
    /// Describe the test of a cell.
    pub fn new(material: &Material, calibrator: &ModelCalibrator, study: &GridStudy, r: &ElementTestResult) -> Self {
        let cell = &study.cell;
        let nodes = study.network.nodes.len();
        let waves = study.correction.is_none().then_some(&study.stability);
        let stable = r.solver.converged() && !r.solver.negative_curvature() && waves.is_none_or(|s| s.stable);
        let proved_waves = waves.is_some_and(|s| s.evidence == Evidence::Proved);
        let perfect = nodes == cell.len() && cell.displacement == 0.0;
        let proved = match stable {
            true => {
                (perfect && proved_waves) || (study.network.is_never_negative() && (waves.is_none() || proved_waves))
            }
            false => r.solver.negative_curvature() || waves.is_some_and(|s| !s.stable),
        };
        GridTestReport {
            material: material.name.clone(),
            source: material.source.clone(),
            density: material.density,
            model: study.model,
            neighbourhood: NeighbourhoodReport::new(calibrator),
            cell: CellReport {
                places: cell.nodes,
                nodes,
                missing: cell.len() - nodes,
                displaced: cell.displacement,
                seed: cell.seed,
                bonds: study.network.bonds.len(),
            },
            target: study.target.voigt_rows(),
            promised: study.promised.voigt_rows(),
            measured: r.measured.voigt_rows(),
            summed: r.summed.voigt_rows(),
            promised_error: study.target.relative_error(&study.promised),
            relative_error: study.promised.relative_error(&r.measured),
            target_error: study.target.relative_error(&r.measured),
            energy_error: study.target.energy_error(&r.measured),
            warnings: study
                .target
                .miss(&r.measured)
                .map(|miss| format!("the cell is not the material: {miss}"))
                .into_iter()
                .chain(material.doubts())
                .collect(),
            engineering: r.engineering.map(Engineering::from),
            nodal_term: study.network.nodal.as_ref().map(|term| term.stiffness.voigt_rows()),
            stable,
            stability: CellStability {
                evidence: if proved { Evidence::Proved } else { Evidence::Sampled },
                margin: waves.map(|s| s.margin()),
            },
            smallest_eigenvalue: waves.map(|s| s.smallest_eigenvalue),
            correction: study.correction.clone(),
            rotations: r.rotations,
            certificate: r.certificate,
            mechanism: r.mechanism.clone(),
            solver: r.solver.into(),
        }
    }
}
