//! All that is said of a tensor without a lattice, in one structure to print.

use serde::Serialize;

use super::directional::{DirectionalExtremes, DirectionalModuli};
use super::moduli::{AverageModuli, EngineeringConstants};
use super::stiffness::Stiffness;
use super::symmetry::Symmetry;
use super::waves::WaveExtremes;
use crate::{Error, Result};

/// What is said of a positive definite tensor without a lattice (SI units).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Analysis {
    /// Voigt matrix, rows (Pa, order 11 22 33 23 13 12).
    pub voigt: [[f64; 6]; 6],
    /// Kelvin moduli, ascending (Pa).
    pub kelvin_moduli: [f64; 6],
    /// Voigt, Reuss and Hill averages and A^U.
    pub average_moduli: AverageModuli,
    /// Engineering constants in the given axes.
    pub engineering_constants: EngineeringConstants,
    /// Extremes of E, β, G and ν over all directions.
    pub directional: DirectionalExtremes,
    /// Symmetry class in any orientation.
    pub symmetry: Symmetry,
    /// ‖C − S‖/‖C‖: the least relative error of any model of central bonds.
    pub cauchy_gap: f64,
    /// Extremes of the wave speeds, where the density is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub waves: Option<WaveExtremes>,
}

impl Stiffness {
    /// Everything above at once; `tolerance` is that of [`Stiffness::symmetry`], the density in kg/m³.
    ///
    /// # Errors
    /// A tensor that is not positive definite, or a density that is not positive.
    pub fn analysis(&self, tolerance: f64, density: Option<f64>) -> Result<Analysis> {
        let directional = DirectionalModuli::new(self)?.extremes();
        let singular = || Error::input("the stiffness is singular", "give a stiffness that is positive definite");
        Ok(Analysis {
            voigt: self.voigt_rows(),
            kelvin_moduli: self.eigen().0.into(),
            average_moduli: self.average_moduli().ok_or_else(singular)?,
            engineering_constants: self.engineering_constants().ok_or_else(singular)?,
            directional,
            symmetry: self.symmetry(tolerance),
            cauchy_gap: self.cauchy_gap(),
            waves: density.map(|density| self.wave_extremes(density)).transpose()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::tensor::{Material, SYMMETRY_TOLERANCE, Stiffness};

    /// The names that scripts read.
    #[test]
    fn json_has_the_documented_names() {
        let c = Material::builtin("Ta2C").unwrap().stiffness;
        let json = serde_json::to_value(c.analysis(SYMMETRY_TOLERANCE, Some(15000.0)).unwrap()).unwrap();
        for path in [
            "/voigt/0/0",
            "/kelvin_moduli/5",
            "/average_moduli/hill/bulk",
            "/average_moduli/universal_anisotropy",
            "/engineering_constants/nu12",
            "/directional/poisson/max/transverse/2",
            "/directional/linear_compressibility/min/direction/0",
            "/symmetry/fits/7/closest/5/5",
            "/symmetry/fits/1/axes/2/2",
            "/waves/fast/max/value",
        ] {
            assert!(json.pointer(path).is_some_and(|v| v.is_number()), "{path}: {json}");
        }
        assert_eq!(json["symmetry"]["class"], "trigonal");
        assert!(json["directional"]["young"]["min"].get("transverse").is_none());
        assert!(Stiffness::isotropic(-10.0, 1.0).analysis(SYMMETRY_TOLERANCE, None).is_err());
    }
}
