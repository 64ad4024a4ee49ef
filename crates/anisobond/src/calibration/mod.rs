//! How stiff the bonds are: from a tensor and a neighbourhood to micromoduli, with the evidence.
//!
//! The problem (P eqs 36-43): minimise ½‖c‖² subject to X c = S and c ≥ l, where column i of X is sᵢ nᵢ⊗nᵢ⊗nᵢ⊗nᵢ,
//! sᵢ = ½ ωᵢ |ξᵢ| ΔV, and S is the Cauchy part of the wanted tensor. Its solution is cᵢ = max(l, sᵢ p(nᵢ)) with one
//! quartic form p of 15 coefficients, the dual vector, found by a semismooth Newton method. Where no
//! c ≥ l reaches S, non-negative least squares (`nnls`) gives the closest reachable tensor and, as its residual,
//! the certificate.

mod calibrator;
mod dual_newton;
pub mod naive;
mod nnls;
mod rays;

pub use calibrator::{Calibration, Calibrator, Cause, Infeasibility, LowerBound};
