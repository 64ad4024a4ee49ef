//! What the program advises, as one JSON document.

use serde::Serialize;

use crate::report::Voigt;
use anisobond::Result;
use anisobond::calibration::{Advice, DenseReference, advise};
use anisobond::tensor::Material;

/// Which model suits a material: what holds on every neighbourhood, and what one dense neighbourhood gives.
#[derive(Clone, Debug, Serialize)]
pub struct AdviceReport {
    /// Name of the material.
    pub material: String,
    /// Where its numbers come from.
    pub source: String,
    /// Voigt stiffness (Pa).
    pub stiffness: Voigt,
    /// What the tensor alone says.
    #[serde(flatten)]
    pub advice: Advice,
    /// The models calibrated on a dense neighbourhood.
    pub reference: DenseReference,
    /// What is not plausible of the material: units or keys that may be wrong.
    pub warnings: Vec<String>,
}

/// What the tensor alone says of the models, without any neighbourhood: for rows of tables.
#[derive(Clone, Debug, Serialize)]
pub struct TensorAdvice {
    /// Name of the material.
    pub material: String,
    /// Where its numbers come from.
    pub source: String,
    /// The advice.
    #[serde(flatten)]
    pub advice: Advice,
    /// What is not plausible of the material: units or keys that may be wrong.
    pub warnings: Vec<String>,
}

impl TensorAdvice {
    /// Advise on a material.
    ///
    /// # Errors
    /// A tensor that is not positive definite.
    pub fn new(material: &Material) -> Result<Self> {
        let (material, source, warnings) = (material, material.source.clone(), material.doubts());
        Ok(TensorAdvice { material: material.name.clone(), source, advice: advise(&material.stiffness)?, warnings })
    }
}

impl AdviceReport {
    /// Advise on a material.
    ///
    /// # Errors
    /// A tensor that is not positive definite.
    pub fn new(material: &Material) -> Result<Self> {
        Ok(AdviceReport {
            material: material.name.clone(),
            source: material.source.clone(),
            stiffness: material.stiffness.voigt_rows(),
            advice: advise(&material.stiffness)?,
            reference: DenseReference::of(&material.stiffness)?,
            warnings: material.doubts(),
        })
    }
}
