//! What most programs use: `use anisobond::prelude::*`.
//!
//! ```
//! use anisobond::prelude::*;
//!
//! let crystal = Material::builtin("Te2W").unwrap();
//! let bonds = Neighbourhood::sphere(3.0, 1e-3, Influence::Inverse)?;
//! let found = Calibrator::new(&bonds).calibrate(&crystal.stiffness, LowerBound::Value(0.0))?;
//! assert_eq!(found.micromodulus.len(), bonds.bonds().len());
//! # Ok::<(), Error>(())
//! ```

pub use crate::bond_law::{BondLaw, BondState, Brittle, ElasticPlastic, LinearSoftening, TableSoftening};
pub use crate::calibration::{
    Calibration, Calibrator, LatticeStiffness, LowerBound, Model, ModelCalibrator, TransverseConstants,
};
pub use crate::experiment::element_test::ElementTest;
pub use crate::experiment::{
    Condition, Crack, FieldName, FractureEnergy, History, Probe, Problem, Quantity, RegionMaterial, RunCost, Schedule,
    Simulation,
};
pub use crate::lattice::{Body, Grid, Influence, Lattice, Neighbourhood, Packing};
pub use crate::operator::{Kinematics, Network};
pub use crate::tensor::{EngineeringConstants, Material, Stiffness, SymmetryClass};
pub use crate::{Error, Result};
