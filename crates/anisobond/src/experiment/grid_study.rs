//! A grid cell, a material and a model: bonds calibrated for the perfect grid, put on a cell that may have defects.

use super::corrected::{Correction, CorrectionReport};
use super::element_test::{ElementTest, ElementTestResult, Rotations};
use crate::Result;
use crate::calibration::{
    Calibrator, Dispersion, HybridCalibrator, LowerBound, MicropolarCalibrator, Model, Promise, Stability,
};
use crate::lattice::Neighbourhood;
use crate::operator::{GridCell, Network};
use crate::tensor::Stiffness;

/// A tangential micromodulus of this share of the largest normal one is zero.
const ROUNDING: f64 = 1e-12;

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
    /// The weakest wave of the perfect grid; `None` for the micropolar model.
    pub stability: Option<Stability>,
    /// How a correction went.
    pub correction: Option<CorrectionReport>,
}

impl GridStudy {
    /// Calibrate a model on a neighbourhood and put it on a cell. The micropolar model is calibrated for what its nodes
    /// do: rotate ([`Promise::FreeRotations`]) or not. With a correction, every bond's moduli (central, micropolar) or
    /// the nodal term (hybrid) are then brought to the target as measured on this very cell, defects included.
    ///
    /// # Errors
    /// A target that is not positive definite; a cell that cannot be made ([`GridCell::network`]); what the correction
    /// refuses.
    pub fn new(
        neighbourhood: &Neighbourhood,
        cell: GridCell,
        target: &Stiffness,
        model: Model,
        rotations: Rotations,
        correction: Option<&Correction>,
    ) -> Result<Self> {
        let none = Stiffness::isotropic(0.0, 0.0);
        let (promised, network, stability) = match model {
            Model::Central => {
                let r = Calibrator::new(neighbourhood).calibrate(target, LowerBound::Value(0.0))?;
                let stability = Dispersion::new(neighbourhood, &r.micromodulus, &none)?.stability();
                (r.reached, cell.network(neighbourhood, &r.micromodulus, None)?, Some(stability))
            }
            Model::Micropolar => {
                let free = rotations == Rotations::Free;
                let promise = if free { Promise::FreeRotations } else { Promise::Sum };
                let r = MicropolarCalibrator::new(neighbourhood).calibrate(target, promise)?;
                // Where normal bonds are enough, rounding leaves tangential ones behind that would hold rotations by
                // next to nothing.
                let rounding = ROUNDING * r.normal.iter().copied().fold(0.0, f64::max);
                let tangential: Vec<f64> = r.tangential.iter().map(|&c| if c > rounding { c } else { 0.0 }).collect();
                let network = cell.network(neighbourhood, &r.normal, Some(&tangential))?;
                (if free { r.relaxed } else { r.reached }, network, None)
            }
            Model::Hybrid => {
                let r = HybridCalibrator::new(neighbourhood)?.calibrate(target)?;
                let network = cell.hybrid_network(neighbourhood, &r.bonds.micromodulus, &r.nodal)?;
                (r.reached, network, Some(r.stability))
            }
        };
        let mut study = GridStudy { cell, model, target: *target, promised, network, stability, correction: None };
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
