//! A grid cell, a material and a model: bonds calibrated for the perfect grid, put on a cell that may have defects.

use super::corrected::{Correction, CorrectionReport};
use super::element_test::{ElementTest, ElementTestResult, Rotations};
use crate::Result;
use crate::calibration::{Model, ModelCalibration, ModelCalibrator, ModelSettings, Promise, Stability};
use crate::lattice::Neighbourhood;
use crate::operator::{GridCell, Network};
use crate::tensor::Stiffness;

/// A cell of a grid with the bonds of a model.
#[derive(Clone, Debug)]
pub struct GridStudy {
    /// The cell and its defects.
    pub cell: GridCell,
    /// The model.
    pub model: Model,
    /// The wanted tensor (Pa).
    pub target: Stiffness,
    /// What the calibration promises of the perfect grid (Pa): what an element test of it measures.
    pub promised: Stiffness,
    /// Nodes, bonds and nodal term, corrected ones after a correction.
    pub network: Network,
    /// The weakest wave of the perfect grid.
    pub stability: Stability,
    /// How a correction went.
    pub correction: Option<CorrectionReport>,
}

impl GridStudy {
    /// What a model is to promise of a grid whose nodes rotate, or do not: what an element test of it measures.
    pub fn settings(model: Model, rotations: Rotations) -> ModelSettings {
        match (model, rotations) {
            (Model::Central, _) => ModelSettings::central(),
            (Model::Micropolar, Rotations::Free) => ModelSettings::Micropolar(Promise::FreeRotations),
            (Model::Micropolar, Rotations::Blocked) => ModelSettings::Micropolar(Promise::Sum),
            (Model::Hybrid, _) => ModelSettings::Hybrid(None),
        }
    }

    /// The element test of a cell, solved so far that a perfect grid shows what its calibration promises to 10⁻⁸.
    pub fn usual_test(rotations: Rotations) -> ElementTest {
        let mut test = ElementTest { rotations, ..ElementTest::default() };
        test.stopping.tolerance = 1e-11;
        test
    }

    /// Calibrate a model and put it on a cell. With a correction, every bond's moduli (central, micropolar) or the nodal
    /// term (hybrid) are then brought to the target as measured on this very cell, defects included.
    ///
    /// # Errors
    /// A target that is not positive definite; a cell that cannot be made ([`GridCell::network`]); what the correction
    /// refuses.
    pub fn new(
        calibrator: &ModelCalibrator,
        cell: GridCell,
        target: &Stiffness,
        correction: Option<&Correction>,
    ) -> Result<Self> {
        let neighbourhood = calibrator.neighbourhood();
        let calibration = calibrator.calibrate(target)?;
        let (promised, network) = match &calibration {
            ModelCalibration::Central(r, _) => (r.reached, cell.network(neighbourhood, &r.micromodulus, None)?),
            ModelCalibration::Micropolar(r, _) => {
                let promised = if r.promise == Promise::FreeRotations { r.relaxed } else { r.reached };
                (promised, cell.network(neighbourhood, &r.normal, Some(&r.tangential))?)
            }
            ModelCalibration::Hybrid(r) => {
                (r.reached, cell.hybrid_network(neighbourhood, &r.bonds.micromodulus, &r.nodal)?)
            }
        };
        let mut study = GridStudy {
            cell,
            model: calibration.model(),
            target: *target,
            promised,
            network,
            stability: *calibration.stability(),
            correction: None,
        };
        if let Some(correction) = correction {
            study.correct(neighbourhood, correction)?;
        }
        Ok(study)
    }

    /// The element test of the cell.
    ///
    /// # Errors
    /// As [`ElementTest::run`].
    pub fn test(&self, test: &ElementTest) -> Result<ElementTestResult> {
        test.run(&self.network)
    }

    fn correct(&mut self, neighbourhood: &Neighbourhood, correction: &Correction) -> Result<()> {
        let corrected = if self.model == Model::Hybrid {
            correction.hybrid_on(&self.network, &self.target)?
        } else {
            // Unit moduli are micromoduli of 1 N/m⁶; the start are those of the perfect grid.
            let ones = vec![1.0; neighbourhood.bonds().len()];
            let unit = self.cell.network(neighbourhood, &ones, Some(&ones))?;
            let start = self.network.bonds.iter().zip(&unit.bonds);
            let start = start.map(|(bond, unit)| (bond.normal / unit.normal, bond.tangential / unit.tangential));
            correction.general_on(&unit, start.collect(), &self.target, self.model == Model::Micropolar)?
        };
        self.network = corrected.network;
        self.correction = Some(corrected.report);
        Ok(())
    }
}
