//! What the models reach on one dense neighbourhood: the advice's bounds, tried.

use serde::Serialize;

use super::advice::Model;
use super::dispersion::StabilityEvidence;
use super::micropolar::Promise;
use super::model::{ModelCalibration, ModelCalibrator, ModelSettings};
use crate::Result;
use crate::lattice::{Influence, Neighbourhood};
use crate::tensor::Stiffness;

/// Horizon of the reference (spacings).
const HORIZON: f64 = 6.0;

/// The models on the reference: a sphere of horizon 6 with the influence δ/|ξ|.
#[derive(Clone, Debug, Serialize)]
pub struct DenseReference {
    /// Horizon (spacings).
    pub horizon: f64,
    /// Number of bonds.
    pub bonds: usize,
    /// Central, micropolar with either promise, hybrid.
    pub models: [ReferenceModel; 4],
}

/// One model on the reference.
#[derive(Clone, Debug, Serialize)]
pub struct ReferenceModel {
    /// The model.
    pub model: Model,
    /// What was chosen: the promise of micropolar, the form of hybrid.
    pub choice: Option<&'static str>,
    /// ‖C − promised tensor‖/‖C‖ (–).
    pub promised_error: f64,
    /// ‖C − tensor of the perfect grid‖/‖C‖ (–), node rotations free.
    pub measured_error: f64,
    /// Whether every wave has positive energy; how that is known, `stability` says.
    pub stable: bool,
    /// How it is known, and by what margin.
    pub stability: StabilityEvidence,
    /// Smallest eigenvalue of the dynamical matrix D(k)/κ²(k) over the zone (Pa).
    pub smallest_eigenvalue: f64,
}

impl DenseReference {
    /// Calibrate every model to a tensor.
    ///
    /// # Errors
    /// A tensor that is not positive definite.
    pub fn of(c: &Stiffness) -> Result<Self> {
        let neighbourhood = Neighbourhood::sphere(HORIZON, 1.0, Influence::Inverse)?;
        let model = |settings| {
            let r = ModelCalibrator::new(&neighbourhood, settings)?.calibrate(c)?;
            Ok(ReferenceModel::new(&r))
        };
        Ok(DenseReference {
            horizon: HORIZON,
            bonds: neighbourhood.bonds().len(),
            models: [
                model(ModelSettings::central())?,
                model(ModelSettings::Micropolar(Promise::Sum))?,
                model(ModelSettings::Micropolar(Promise::FreeRotations))?,
                model(ModelSettings::Hybrid(None))?,
            ],
        })
    }
}

impl ReferenceModel {
    fn new(r: &ModelCalibration) -> Self {
        let (choice, measured_error) = match r {
            ModelCalibration::Central(r, _) => (None, r.relative_error),
            ModelCalibration::Micropolar(r, _) => (Some(r.promise.name()), r.relaxed_error),
            ModelCalibration::Hybrid(r) => (Some(r.form.name()), r.relative_error),
        };
        ReferenceModel {
            model: r.model(),
            choice,
            promised_error: r.promised_error(),
            measured_error,
            stable: r.stability().stable,
            stability: r.stability().brief(),
            smallest_eigenvalue: r.stability().smallest_eigenvalue,
        }
    }
}
