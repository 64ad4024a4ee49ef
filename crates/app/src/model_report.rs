//! What the program says of a calibration by any of the three models.

use serde::Serialize;

use crate::hybrid_report::HybridReport;
use crate::micropolar_report::MicropolarReport;
use crate::report::{CalibrationReport, NeighbourhoodReport};
use anisobond::calibration::ModelCalibration;
use anisobond::tensor::Material;

/// The report of one of the three models; as JSON, that report.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum ModelReport {
    /// Normal bonds.
    Central(Box<CalibrationReport>),
    /// Normal and tangential bonds.
    Micropolar(Box<MicropolarReport>),
    /// Normal bonds and a nodal term.
    Hybrid(Box<HybridReport>),
}

impl ModelReport {
    /// What is not plausible of the material.
    pub fn warnings(&self) -> &[String] {
        match self {
            ModelReport::Central(r) => &r.warnings,
            ModelReport::Micropolar(r) => &r.warnings,
            ModelReport::Hybrid(r) => &r.warnings,
        }
    }

    /// Bring together a material, the neighbourhood it was calibrated on, and the result.
    pub fn new(material: &Material, neighbourhood: &NeighbourhoodReport, r: &ModelCalibration) -> Self {
        match r {
            ModelCalibration::Central(r, waves) => {
                ModelReport::Central(Box::new(CalibrationReport::new(material, neighbourhood, r, waves)))
            }
            ModelCalibration::Micropolar(r, waves) => {
                ModelReport::Micropolar(Box::new(MicropolarReport::new(material, neighbourhood, r, waves)))
            }
            ModelCalibration::Hybrid(r) => ModelReport::Hybrid(Box::new(HybridReport::new(material, neighbourhood, r))),
        }
    }
}
