//! Element tests: the stiffness that a periodic lattice really has.
//!
//! [`ElementTest`] is the static test (periodic homogenisation at infinitesimal strain); [`DynamicTest`] is the procedure
//! of the cross-anisotropy document, at finite strain.

mod dynamic;
mod mechanism;
mod relaxed;
mod static_test;

pub use dynamic::{DynamicTest, DynamicTestResult};
pub use mechanism::Mechanism;
pub use relaxed::{BondDeformation, bond_deformations, nodal_strains};
pub(crate) use relaxed::{nodal_sensitivity, sensitivity};
pub use static_test::{Certificate, ElementTest, ElementTestResult, Fields, Mechanisms, Rotations};
