//! An elastic tensor and what can be said of it without a lattice.

mod cauchy;
mod class;
mod closeness;
mod directional;
mod energy_symmetry;
mod material;
mod miss;
mod moduli;
mod noise;
mod plausible;
mod stiffness;
mod symmetry;
mod turning;
mod waves;

pub use cauchy::{MONOMIALS, Quartic, cauchy_coordinates, monomial_names, quartic_of, quartic_weights, tensor_of};
pub use class::{SymmetryClass, closure, project};
pub use closeness::{Metric, energy_gram};
pub use directional::{DirectionalExtremes, DirectionalModuli, Extreme, Extremes};
pub use energy_symmetry::{EnergyFit, EnergySymmetry};
pub use material::Material;
pub use miss::NOTICEABLE_MISS;
pub use moduli::{AverageModuli, BulkShear, EngineeringConstants};
pub use noise::SYMMETRY_TOLERANCE;
pub use plausible::doubtful_length;
pub use stiffness::{PAIRS, Stiffness, mandel_rotation, mandel_weight, mandel_weights, row_of};
pub use symmetry::{ClassFit, Symmetry};
pub use waves::{Wave, WaveExtremes};
