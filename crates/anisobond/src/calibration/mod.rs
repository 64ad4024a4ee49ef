//! How stiff the bonds are: from a tensor and a neighbourhood to micromoduli, with the evidence.
//!
//! The problem (P eqs 36-43): minimise ½‖c‖² subject to X c = S and c ≥ l, where column i of X is sᵢ nᵢ⊗nᵢ⊗nᵢ⊗nᵢ,
//! sᵢ = ½ ωᵢ |ξᵢ| ΔV, and S is the Cauchy part of the wanted tensor. Its solution is cᵢ = max(l, sᵢ p(nᵢ)) with one
//! quartic form p of 15 coefficients, the dual vector, found by a semismooth Newton method (`dual_newton`). Where no
//! c ≥ l reaches S, non-negative least squares (`nnls`) gives the closest reachable tensor and, as its residual,
//! the certificate. In the sense of energy (`Metric::Energy`) S* takes the place of S and distances are those of energy
//! (`in_energy`).
//!
//! [`MicropolarCalibrator`] is the same in all 21 dimensions for normal and tangential bonds.
//! What bonds cannot reach, a nodal term adds ([`HybridCalibrator`]); the waves of the grid show whether the whole is
//! stable ([`Dispersion`]). [`advise`] says beforehand which model a tensor needs, and [`ModelCalibrator`] is any of the
//! three behind one door.
//!
//! On sphere packings the bonds' stiffnesses come from direction-dependent moduli instead ([`EllipticFit`],
//! [`LatticeStiffness`]).

mod advice;
mod best_fit;
mod bounded_squares;
mod calibrator;
mod dense_reference;
mod dispersion;
mod dual_newton;
mod elliptic_range;
mod energy_by_normal;
mod fracture;
mod free_rotations;
mod hybrid;
mod in_energy;
mod lattice_stiffness;
mod layers;
mod least_norm;
mod least_trace;
mod micropolar;
mod microplane;
mod model;
pub mod naive;
mod nearest_relaxed;
mod nnls;
mod proximal_newton;
mod rays;
mod sphere_rule;
mod strain_average;
mod surface;

pub use advice::{Advice, Model, ModelAdvice, advise};
pub use best_fit::best_fit_stiffness;
pub use calibrator::{Calibration, Calibrator, Cause, Infeasibility, LowerBound, Outcome};
pub use dense_reference::{DenseReference, ReferenceModel};
pub use dispersion::{Dispersion, Evidence, LongWaves, Stability, StabilityEvidence};
pub use energy_by_normal::EnergyByNormal;
pub use fracture::{CrackPlanes, CriticalStretches, FractureReport, fracture_energy};
pub use free_rotations::{sum_for_free_rotations, with_free_rotations};
pub use hybrid::{HybridCalibration, HybridCalibrator, HybridForm, TraceEvidence};
pub use lattice_stiffness::{LatticeStiffness, PI_HAT, lattice_mu};
pub use layers::Layers;
pub(crate) use microplane::strain_dot;
pub use microplane::{
    DirectionModuli, EllipticFit, EllipticMicroplane, EllipticModuli, TransverseConstants, axis_of_strike_and_dip,
    microplane_stiffness, normal_projection, tangential_projection, unit_axis,
};
pub use micropolar::{MicropolarCalibration, MicropolarCalibrator, MicropolarInfeasibility, Promise};
pub(crate) use micropolar::{tensor_coordinates, tensor_of_coordinates};
pub use model::{ModelCalibration, ModelCalibrator, ModelSettings, Proof, WaveEvidence};
pub use sphere_rule::SphereRule;
pub use strain_average::StrainAverage;
pub use surface::{SurfaceStencil, SurfaceStencils, surface_stencils};
