//! Materials in the input files of finite element programs.

pub(super) mod abaqus;
pub(super) mod ansys;

use nalgebra::Matrix6;

use super::figure::Figure;
use crate::material::StressUnit;
use crate::words::quoted;
use anisobond::tensor::Stiffness;
use anisobond::{Error, Result};

/// Engineering constants of an orthotropic material: moduli in one unit, ν_ij = −ε_j/ε_i.
struct Orthotropic {
    e: [f64; 3],
    /// 12, 13, 23.
    nu: [f64; 3],
    /// 12, 13, 23.
    g: [f64; 3],
}

impl Orthotropic {
    /// The stiffness, moduli in a unit.
    fn stiffness(&self, unit: &StressUnit) -> Result<Stiffness> {
        let (e, nu, g) = (self.e, self.nu, self.g);
        if e.iter().chain(&g).any(|modulus| !(*modulus > 0.0 && modulus.is_finite())) {
            return Err(Error::input("a modulus is not positive", "correct the engineering constants"));
        }
        let mut s =
            Matrix6::from_diagonal(&[1.0 / e[0], 1.0 / e[1], 1.0 / e[2], 1.0 / g[2], 1.0 / g[1], 1.0 / g[0]].into());
        for (a, b, nu) in [(0, 1, nu[0]), (0, 2, nu[1]), (1, 2, nu[2])] {
            s[(a, b)] = -nu / e[a];
            s[(b, a)] = s[(a, b)];
        }
        let stiffness = Stiffness::from_compliance_voigt(&(s / unit.size))?;
        stiffness.require_positive_definite()?;
        Ok(stiffness)
    }

    /// One modulus and one ratio.
    fn isotropic(e: f64, nu: f64) -> Self {
        Orthotropic { e: [e; 3], nu: [nu; 3], g: [0.5 * e / (1.0 + nu); 3] }
    }
}

/// The number of a field of a card.
fn number_of(field: &str) -> Result<Figure> {
    Figure::of(field.trim()).ok_or_else(|| {
        Error::input(
            format!("{} is not a finite number", quoted(field.trim())),
            "write a number such as 130, 0.25 or 1.3e2",
        )
    })
}
