//! The three models of a grid behind one door: settings, a neighbourhood prepared for them, and what comes out.

use super::advice::Model;
use super::calibrator::{Calibration, Calibrator, LowerBound, Outcome};
use super::dispersion::{Dispersion, LongWaves, Stability};
use super::hybrid::{HybridCalibration, HybridCalibrator, HybridForm};
use super::micropolar::{MicropolarCalibration, MicropolarCalibrator, Promise};
use crate::Result;
use crate::lattice::Neighbourhood;
use crate::tensor::{Metric, Stiffness};

/// A model with what can be chosen of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModelSettings {
    /// Normal bonds, with a lower bound of their micromoduli, and in which sense they come close to a target out of reach.
    Central(LowerBound, Metric),
    /// Normal and tangential bonds; which tensor they promise.
    Micropolar(Promise),
    /// Normal bonds and a nodal term; `None` for the form that is exact and stable.
    Hybrid(Option<HybridForm>),
}

impl ModelSettings {
    /// Normal bonds c ≥ 0, closest in the norm.
    pub fn central() -> Self {
        ModelSettings::Central(LowerBound::Value(0.0), Metric::Norm)
    }
}

/// A neighbourhood prepared for a model and any number of materials.
pub enum ModelCalibrator<'a> {
    /// Normal bonds.
    Central(Box<Calibrator<'a>>, LowerBound, Metric, Proof),
    /// Normal and tangential bonds.
    Micropolar(Box<MicropolarCalibrator<'a>>, Promise, Proof),
    /// Normal bonds and a nodal term.
    Hybrid(Box<HybridCalibrator<'a>>, Option<HybridForm>),
}

/// How much is done for the stability of waves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// A bound over the whole Brillouin zone where the signs of the bonds are not proof enough.
    Zone,
    /// What the signs do not prove is sampled: for tables, for it is several to tens of times faster.
    Signs,
}

/// The bonds of a material, and the waves of the grid that they make.
#[derive(Clone, Debug)]
pub enum ModelCalibration {
    /// Normal bonds.
    Central(Calibration, WaveEvidence),
    /// Normal and tangential bonds.
    Micropolar(MicropolarCalibration, WaveEvidence),
    /// Normal bonds and a nodal term; it carries its waves itself.
    Hybrid(HybridCalibration),
}

/// Waves of a grid: the weakest, and the longest against two continua.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaveEvidence {
    /// The weakest wave.
    pub stability: Stability,
    /// Long waves against Christoffel's speeds of the wanted tensor.
    pub target: LongWaves,
    /// Long waves against Christoffel's speeds of the tensor that the grid has; `None` where that is not positive
    /// definite.
    pub reached: Option<LongWaves>,
}

impl WaveEvidence {
    fn new(dispersion: &Dispersion, target: &Stiffness, reached: &Stiffness, proof: Proof) -> Self {
        WaveEvidence {
            stability: dispersion.stability_of(proof == Proof::Zone),
            target: dispersion.long_waves(target),
            reached: reached.require_positive_definite().is_ok().then(|| dispersion.long_waves(reached)),
        }
    }
}

impl<'a> ModelCalibrator<'a> {
    /// Prepare a neighbourhood.
    ///
    /// # Errors
    /// The hybrid model on bonds that all lie in a plane.
    pub fn new(neighbourhood: &'a Neighbourhood, settings: ModelSettings) -> Result<Self> {
        Ok(match settings {
            ModelSettings::Central(bound, metric) => {
                ModelCalibrator::Central(Box::new(Calibrator::new(neighbourhood)), bound, metric, Proof::Zone)
            }
            ModelSettings::Micropolar(promise) => {
                ModelCalibrator::Micropolar(Box::new(MicropolarCalibrator::new(neighbourhood)), promise, Proof::Zone)
            }
            ModelSettings::Hybrid(form) => {
                ModelCalibrator::Hybrid(Box::new(HybridCalibrator::new(neighbourhood)?), form)
            }
        })
    }

    /// Leave stability to the search of waves where the signs of bonds and nodal term do not prove it.
    #[must_use]
    pub fn without_proof(self) -> Self {
        match self {
            ModelCalibrator::Central(calibrator, bound, metric, _) => {
                ModelCalibrator::Central(calibrator, bound, metric, Proof::Signs)
            }
            ModelCalibrator::Micropolar(calibrator, promise, _) => {
                ModelCalibrator::Micropolar(calibrator, promise, Proof::Signs)
            }
            ModelCalibrator::Hybrid(calibrator, form) => {
                ModelCalibrator::Hybrid(Box::new(calibrator.without_proof()), form)
            }
        }
    }

    /// How much is done for the stability of waves.
    pub fn proof(&self) -> Proof {
        match self {
            ModelCalibrator::Central(.., proof) | ModelCalibrator::Micropolar(.., proof) => *proof,
            ModelCalibrator::Hybrid(calibrator, _) if calibrator.proves() => Proof::Zone,
            ModelCalibrator::Hybrid(..) => Proof::Signs,
        }
    }

    /// The neighbourhood.
    pub fn neighbourhood(&self) -> &'a Neighbourhood {
        match self {
            ModelCalibrator::Central(calibrator, ..) => calibrator.neighbourhood(),
            ModelCalibrator::Micropolar(calibrator, ..) => calibrator.neighbourhood(),
            ModelCalibrator::Hybrid(calibrator, _) => calibrator.calibrator().neighbourhood(),
        }
    }

    /// Number of distinct ± directions of the bonds.
    pub fn directions(&self) -> usize {
        match self {
            ModelCalibrator::Central(calibrator, ..) => calibrator.directions(),
            ModelCalibrator::Micropolar(calibrator, ..) => calibrator.directions(),
            ModelCalibrator::Hybrid(calibrator, _) => calibrator.calibrator().directions(),
        }
    }

    /// Dimension of the tensors that bonds of either sign can reach: when nothing is missing 15, and 21 with tangential
    /// bonds.
    pub fn rank(&self) -> usize {
        match self {
            ModelCalibrator::Central(calibrator, ..) => calibrator.rank(),
            ModelCalibrator::Micropolar(calibrator, ..) => calibrator.rank(),
            ModelCalibrator::Hybrid(calibrator, _) => calibrator.calibrator().rank(),
        }
    }

    /// The settings it was prepared with.
    pub fn settings(&self) -> ModelSettings {
        match *self {
            ModelCalibrator::Central(_, bound, metric, _) => ModelSettings::Central(bound, metric),
            ModelCalibrator::Micropolar(_, promise, _) => ModelSettings::Micropolar(promise),
            ModelCalibrator::Hybrid(_, form) => ModelSettings::Hybrid(form),
        }
    }

    /// Calibrate, and look at the waves.
    ///
    /// # Errors
    /// A tensor that is not positive definite, or a lower bound that is none; for the form `stable`, a neighbourhood
    /// whose bonds leave a uniform strain without energy.
    pub fn calibrate(&self, target: &Stiffness) -> Result<ModelCalibration> {
        let neighbourhood = self.neighbourhood();
        Ok(match self {
            ModelCalibrator::Central(calibrator, bound, metric, proof) => {
                let r = calibrator.calibrate_in(target, *bound, *metric)?;
                let dispersion = Dispersion::central(neighbourhood, &r.micromodulus)?;
                let waves = WaveEvidence::new(&dispersion, target, &r.reached, *proof);
                ModelCalibration::Central(r, waves)
            }
            ModelCalibrator::Micropolar(calibrator, promise, proof) => {
                let r = calibrator.calibrate(target, *promise)?;
                let dispersion = Dispersion::micropolar(neighbourhood, &r.normal, &r.tangential)?;
                let waves = WaveEvidence::new(&dispersion, target, &r.relaxed, *proof);
                ModelCalibration::Micropolar(r, waves)
            }
            ModelCalibrator::Hybrid(calibrator, None) => ModelCalibration::Hybrid(calibrator.calibrate(target)?),
            ModelCalibrator::Hybrid(calibrator, Some(form)) => {
                ModelCalibration::Hybrid(calibrator.calibrate_as(target, *form)?)
            }
        })
    }
}

impl ModelCalibration {
    /// The model.
    pub fn model(&self) -> Model {
        match self {
            ModelCalibration::Central(..) => Model::Central,
            ModelCalibration::Micropolar(..) => Model::Micropolar,
            ModelCalibration::Hybrid(_) => Model::Hybrid,
        }
    }

    /// The tensor that the bonds, and a nodal term, reach (Pa).
    pub fn promised(&self) -> &Stiffness {
        match self {
            ModelCalibration::Central(r, _) => &r.reached,
            ModelCalibration::Micropolar(r, _) => r.promised(),
            ModelCalibration::Hybrid(r) => &r.reached,
        }
    }

    /// ‖target − promised tensor‖/‖target‖.
    pub fn promised_error(&self) -> f64 {
        match self {
            ModelCalibration::Central(r, _) => r.relative_error,
            ModelCalibration::Micropolar(r, _) => r.promised_error(),
            ModelCalibration::Hybrid(r) => r.relative_error,
        }
    }

    /// Whether the bonds, with a nodal term where there is one, reach what the model can express of the target: no neighbourhood
    /// would bring this model closer in its metric. The error may be large all the same.
    pub fn feasible(&self) -> bool {
        match self {
            ModelCalibration::Central(r, _) => r.feasible(),
            ModelCalibration::Micropolar(r, _) => r.feasible(),
            ModelCalibration::Hybrid(r) => r.feasible(),
        }
    }

    /// What came of the calibration.
    pub fn outcome(&self) -> Outcome {
        match self {
            ModelCalibration::Central(r, _) => r.outcome(),
            ModelCalibration::Micropolar(r, _) => r.outcome(),
            ModelCalibration::Hybrid(r) => r.outcome(),
        }
    }

    /// The weakest wave of the grid.
    pub fn stability(&self) -> &Stability {
        match self {
            ModelCalibration::Central(_, waves) | ModelCalibration::Micropolar(_, waves) => &waves.stability,
            ModelCalibration::Hybrid(r) => &r.stability,
        }
    }

    /// Normal micromodulus of every bond (N/m⁶).
    pub fn normal(&self) -> &[f64] {
        match self {
            ModelCalibration::Central(r, _) => &r.micromodulus,
            ModelCalibration::Micropolar(r, _) => &r.normal,
            ModelCalibration::Hybrid(r) => &r.bonds.micromodulus,
        }
    }

    /// Tangential micromodulus of every bond (N/m⁶), where the model has one.
    pub fn tangential(&self) -> Option<&[f64]> {
        match self {
            ModelCalibration::Micropolar(r, _) => Some(&r.tangential),
            _ => None,
        }
    }

    /// The nodal term Z (Pa), where the model has one.
    pub fn nodal(&self) -> Option<&Stiffness> {
        match self {
            ModelCalibration::Hybrid(r) => Some(&r.nodal),
            _ => None,
        }
    }
}
