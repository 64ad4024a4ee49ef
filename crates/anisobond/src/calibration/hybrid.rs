//! The hybrid model: bonds, and a nodal term for what bonds cannot reach.
//!
//! A node's energy density is ½ Σ s c (n·η)²/|ξ|² + ½ ε̄:Z:ε̄, with ε̄ its average strain over its bonds
//! ([`StrainAverage`]). Of a uniform strain the model's tensor is Σ s c n⊗n⊗n⊗n + Z, which is the wanted C exactly.

use std::collections::HashSet;

use nalgebra::{Matrix6, Vector6};
use serde::Serialize;

use super::calibrator::{Calibration, Calibrator, LowerBound, Outcome, primitive_direction};
use super::dispersion::{Dispersion, LongWaves, Stability};
use super::least_trace::{largest_relative, least_trace};
use super::strain_average::StrainAverage;
use crate::lattice::Neighbourhood;
use crate::tensor::{PAIRS, Stiffness, mandel_weight};
use crate::{Error, Result};

/// The floor of the stable form, as a part of the largest uniform micromodulus that the tensor carries.
const FLOOR: f64 = 0.01;

/// ‖C − Σ s c n⊗n⊗n⊗n‖/‖C‖ up to which the bonds alone are the tensor and the nodal term is zero.
const REACHED: f64 = 1e-12;

/// What is added to the smallest eigenvalues of a Z that is to be ⪰ 0, relative to ‖C‖: enough that rounding leaves none
/// below zero.
const SEMIDEFINITE: f64 = 8.0 * f64::EPSILON;

/// How C is shared between bonds and nodal term.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum HybridForm {
    /// Z = C − S: the bonds are those of the central model, whatever their feasibility. Exact; Z may be indefinite, and
    /// stability is then a matter of the neighbourhood.
    Remainder,
    /// Z ⪰ 0 of least trace, with all bonds c ≥ l > 0. Exact; every wave that the bonds resist has positive energy.
    Stable,
}

impl HybridForm {
    /// remainder or stable.
    pub fn name(self) -> &'static str {
        match self {
            HybridForm::Remainder => "remainder",
            HybridForm::Stable => "stable",
        }
    }
}

/// The bonds and the nodal term of a material, with the evidence.
#[derive(Clone, Debug)]
pub struct HybridCalibration {
    /// The form used.
    pub form: HybridForm,
    /// The wanted tensor (Pa).
    pub target: Stiffness,
    /// The bonds; their own target is the part of C that they carry.
    pub bonds: Calibration,
    /// Z (Pa).
    pub nodal: Stiffness,
    /// The tensor of bonds and nodal term together (Pa).
    pub reached: Stiffness,
    /// ‖target − reached‖/‖target‖.
    pub relative_error: f64,
    /// The weakest wave of the grid.
    pub stability: Stability,
    /// Long waves against Christoffel's speeds of the target.
    pub long_waves: LongWaves,
    /// Evidence of the least trace; `None` in the form `remainder`, or where the bonds alone reach C.
    pub least_trace: Option<TraceEvidence>,
}

/// ‖target − reached‖/‖target‖ up to which the tensor counts as reached.
const EXACT: f64 = 1e-10;

impl HybridCalibration {
    /// Whether bonds and nodal term together reach the target, to 10⁻¹⁰, and the bonds' solver converged.
    pub fn feasible(&self) -> bool {
        self.bonds.converged && self.relative_error <= EXACT
    }

    /// What came of it: not converged where the bonds' solver was not.
    pub fn outcome(&self) -> Outcome {
        Outcome::of(self.feasible(), self.bonds.converged)
    }
}

/// How the semidefinite program of the stable form ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TraceEvidence {
    /// tr Z (Pa), of the Kelvin-Mandel matrix.
    pub trace: f64,
    /// A lower bound of tr Z over all bonds above the floor (Pa), proved by a point of the dual program.
    pub bound: f64,
    /// Newton steps taken.
    pub steps: usize,
}

/// A neighbourhood prepared for hybrid models of any number of materials.
pub struct HybridCalibrator<'a> {
    calibrator: Calibrator<'a>,
    average: StrainAverage,
    /// n⊗n of every distinct direction, Kelvin-Mandel.
    directions: Vec<Vector6<f64>>,
    /// X1 = Σ s n⊗n⊗n⊗n (m⁴): the tensor of bonds of micromodulus 1.
    uniform: Matrix6<f64>,
    /// Whether stability is proved over the whole zone, or left to the search where the signs do not prove it.
    proves: bool,
}

impl<'a> HybridCalibrator<'a> {
    /// Prepare a neighbourhood.
    ///
    /// # Errors
    /// Bonds that all lie in a plane.
    pub fn new(neighbourhood: &'a Neighbourhood) -> Result<Self> {
        let average = StrainAverage::new(neighbourhood)?;
        let mut directions: Vec<Vector6<f64>> = Vec::new();
        let mut seen = HashSet::new();
        let mut uniform = Matrix6::zeros();
        for bond in neighbourhood.bonds() {
            let n = bond.xi.normalize();
            let e = Vector6::from_fn(|a, _| n[PAIRS[a].0] * n[PAIRS[a].1] * mandel_weight(a));
            uniform += neighbourhood.stiffness_share(bond) * e * e.transpose();
            if seen.insert(primitive_direction(bond.offset)) {
                directions.push(e);
            }
        }
        Ok(HybridCalibrator { calibrator: Calibrator::new(neighbourhood), average, directions, uniform, proves: true })
    }

    /// Leave the stability of waves to the search, which is several to tens of times faster, where the signs of the bonds and of Z
    /// do not prove it: of a form that was asked for. Which form is taken by default must not depend on this, and is proved.
    #[must_use]
    pub fn without_proof(mut self) -> Self {
        self.proves = false;
        self
    }

    /// Whether stability is proved over the whole zone where signs are not proof enough.
    pub fn proves(&self) -> bool {
        self.proves
    }

    /// The calibrator of the bonds.
    pub fn calibrator(&self) -> &Calibrator<'a> {
        &self.calibrator
    }

    /// The model that is exact and stable: `remainder` if its waves are all positive, else `stable`. Where the
    /// neighbourhood's bonds resist too few strains for `stable` (horizon below √2), `remainder` with its
    /// evidence that it is not stable.
    ///
    /// # Errors
    /// A tensor that is not positive definite.
    pub fn calibrate(&self, target: &Stiffness) -> Result<HybridCalibration> {
        let remainder = self.calibrate_proving(target, HybridForm::Remainder, true)?;
        if remainder.stability.stable || !self.resists_all_strains() {
            return Ok(remainder);
        }
        self.calibrate_as(target, HybridForm::Stable)
    }

    /// The model in a given form.
    ///
    /// # Errors
    /// A tensor that is not positive definite; for the form `stable`, a neighbourhood whose bonds leave a uniform
    /// strain without energy (horizon below √2).
    pub fn calibrate_as(&self, target: &Stiffness, form: HybridForm) -> Result<HybridCalibration> {
        self.calibrate_proving(target, form, self.proves)
    }

    /// The same, stability proved or left to the search.
    fn calibrate_proving(&self, target: &Stiffness, form: HybridForm, proves: bool) -> Result<HybridCalibration> {
        target.require_positive_definite()?;
        let (bonds, evidence) = match form {
            HybridForm::Remainder => (self.calibrator.calibrate(target, LowerBound::Value(0.0))?, None),
            HybridForm::Stable => self.stable_bonds(target)?,
        };
        self.with_nodal_term(target, form, bonds, evidence, proves)
    }

    /// The floor l of the stable form (N/m⁶): 1 % of the largest t with t X1 ⪯ C, the uniform bonds that C carries.
    pub fn floor(&self, target: &Stiffness) -> f64 {
        FLOOR / largest_relative(&self.uniform, target.mandel())
    }

    /// Whether bonds of positive micromodulus give every uniform strain an energy.
    fn resists_all_strains(&self) -> bool {
        Stiffness::from_mandel(self.uniform).require_positive_definite().is_ok()
    }

    /// Bonds c ≥ l that leave a Z ⪰ 0 of least trace: their tensor B by the semidefinite program on C − l X1, then the
    /// least norm for B.
    fn stable_bonds(&self, target: &Stiffness) -> Result<(Calibration, Option<TraceEvidence>)> {
        if !self.resists_all_strains() {
            return Err(Error::mechanism(
                "the neighbourhood's bonds leave a uniform strain without energy: no bonds are stable on it",
                "use a horizon of at least √2 spacings (3 is common)",
            ));
        }
        let floor = self.floor(target);
        let central = self.calibrator.calibrate(target, LowerBound::Value(floor))?;
        if central.relative_error <= REACHED {
            return Ok((central, None));
        }
        let least = floor * self.uniform;
        let solution = least_trace(&(target.mandel() - least), &self.directions);
        let carried = self.directions.iter().zip(&solution.weights).fold(least, |b, (e, &d)| b + d * e * e.transpose());
        let bonds = self.calibrator.calibrate(&Stiffness::from_mandel(carried), LowerBound::Value(floor))?;
        let trace = target.mandel().trace() - bonds.reached.mandel().trace();
        Ok((bonds, Some(TraceEvidence { trace, bound: solution.trace_bound, steps: solution.steps })))
    }

    /// Z = C − Σ s c n⊗n⊗n⊗n and the evidence of the whole.
    fn with_nodal_term(
        &self,
        target: &Stiffness,
        form: HybridForm,
        bonds: Calibration,
        least_trace: Option<TraceEvidence>,
        proves: bool,
    ) -> Result<HybridCalibration> {
        let gap = target.mandel() - bonds.reached.mandel();
        let nodal = if gap.norm() <= REACHED * target.norm() { Matrix6::zeros() } else { gap };
        // What rounding leaves below zero is taken away and shows in the error.
        let nodal = match form {
            HybridForm::Stable if nodal.norm() > 0.0 => semidefinite(&nodal, SEMIDEFINITE * target.norm()),
            _ => nodal,
        };
        let nodal = Stiffness::from_mandel(nodal);
        let reached = Stiffness::from_mandel(bonds.reached.mandel() + nodal.mandel());
        let neighbourhood = self.calibrator.neighbourhood();
        let dispersion = Dispersion::with_average(neighbourhood, &self.average, &bonds.micromodulus, &nodal)?;
        Ok(HybridCalibration {
            form,
            target: *target,
            nodal,
            relative_error: target.relative_error(&reached),
            reached,
            stability: dispersion.stability_of(proves),
            long_waves: dispersion.long_waves(target),
            bonds,
            least_trace,
        })
    }
}

/// A symmetric matrix with its eigenvalues raised to a floor.
fn semidefinite(matrix: &Matrix6<f64>, floor: f64) -> Matrix6<f64> {
    let eigen = matrix.symmetric_eigen();
    let mut out = *matrix;
    for (value, axis) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value < floor {
            out += (floor - value) * axis * axis.transpose();
        }
    }
    0.5 * (out + out.transpose())
}
