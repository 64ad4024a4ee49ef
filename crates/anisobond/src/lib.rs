//! From an elastic stiffness tensor to the bonds of a discrete model.
//!
//! Data flows one way; each module uses only modules before it (a test reads this list):
//! tensor → lattice → calibration → bond_law → operator → solver → experiment.
//!
//! SI units throughout: Pa, m, kg/m³; angles in radians unless a name says otherwise.

/// The README's example, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub mod error;
pub mod tensor;
pub mod lattice;
pub mod calibration;
pub mod bond_law;
pub mod operator;
pub mod solver;
pub mod experiment;
pub mod prelude;

pub use error::{Choice, Error, ErrorKind, Result, Wording};
/// Vectors and matrices of arguments and results.
pub use nalgebra;
