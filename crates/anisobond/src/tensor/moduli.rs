//! Single numbers of a tensor: average moduli, anisotropy index, engineering constants.

use serde::Serialize;

use super::stiffness::Stiffness;

/// Bulk modulus K and shear modulus G (Pa) of an isotropic average.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BulkShear {
    /// K (Pa).
    pub bulk: f64,
    /// G (Pa).
    pub shear: f64,
}

/// Isotropic averages of a tensor and how far it is from isotropy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AverageModuli {
    /// Voigt's average (uniform strain), an upper bound of a polycrystal's moduli.
    pub voigt: BulkShear,
    /// Reuss's average (uniform stress), a lower bound.
    pub reuss: BulkShear,
    /// Hill's average, the mean of both.
    pub hill: BulkShear,
    /// Young's modulus of Hill's average (Pa).
    pub hill_young: f64,
    /// Poisson's ratio of Hill's average.
    pub hill_poisson: f64,
    /// Universal anisotropy index A^U ≥ 0, zero for an isotropic tensor (Ranganathan & Ostoja-Starzewski 2008).
    pub universal_anisotropy: f64,
}

/// Engineering constants in the tensor's given axes, read from the compliance.
///
/// They describe a tensor completely only if it is orthotropic in these axes; for any other they are its answers to
/// uniaxial tension and simple shear along the axes, couplings such as tension to shear left out.
/// νij = −εj/εi under tension along i, so νij/Ei = νji/Ej.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs)] // Eighteen letters that the line above explains.
pub struct EngineeringConstants {
    /// E1 (Pa).
    pub e1: f64,
    /// E2 (Pa).
    pub e2: f64,
    /// E3 (Pa).
    pub e3: f64,
    pub nu12: f64,
    pub nu21: f64,
    pub nu13: f64,
    pub nu31: f64,
    pub nu23: f64,
    pub nu32: f64,
    /// G23 (Pa).
    pub g23: f64,
    /// G13 (Pa).
    pub g13: f64,
    /// G12 (Pa).
    pub g12: f64,
}

impl Stiffness {
    /// Voigt's averages: 9K_V = (C11 + C22 + C33) + 2(C12 + C23 + C31) (P eq 105),
    /// 15G_V = (C11 + C22 + C33) − (C12 + C23 + C31) + 3(C44 + C55 + C66) (P eq 107).
    pub fn voigt_average(&self) -> BulkShear {
        let c = self.voigt();
        let axial = c[(0, 0)] + c[(1, 1)] + c[(2, 2)];
        let coupling = c[(0, 1)] + c[(1, 2)] + c[(0, 2)];
        let shear = c[(3, 3)] + c[(4, 4)] + c[(5, 5)];
        BulkShear { bulk: (axial + 2.0 * coupling) / 9.0, shear: (axial - coupling + 3.0 * shear) / 15.0 }
    }

    /// Reuss's averages: 1/K_R = (s11 + s22 + s33) + 2(s12 + s23 + s31) (P eq 106),
    /// 15/G_R = 4(s11 + s22 + s33) − 4(s12 + s23 + s31) + 3(s44 + s55 + s66) (P eq 108); `None` if C is singular.
    pub fn reuss_average(&self) -> Option<BulkShear> {
        let s = self.compliance_voigt()?;
        let axial = s[(0, 0)] + s[(1, 1)] + s[(2, 2)];
        let coupling = s[(0, 1)] + s[(1, 2)] + s[(0, 2)];
        let shear = s[(3, 3)] + s[(4, 4)] + s[(5, 5)];
        Some(BulkShear {
            bulk: 1.0 / (axial + 2.0 * coupling),
            shear: 15.0 / (4.0 * axial - 4.0 * coupling + 3.0 * shear),
        })
    }

    /// Voigt, Reuss and Hill averages (P eqs 104-110) and A^U = 5 G_V/G_R + K_V/K_R − 6 (P eq 111); `None` if C is
    /// singular. Of a tensor that is not positive definite the Reuss values are numbers without a meaning.
    pub fn average_moduli(&self) -> Option<AverageModuli> {
        let voigt = self.voigt_average();
        let reuss = self.reuss_average()?;
        let (k, g) = (0.5 * (voigt.bulk + reuss.bulk), 0.5 * (voigt.shear + reuss.shear));
        Some(AverageModuli {
            voigt,
            reuss,
            hill: BulkShear { bulk: k, shear: g },
            hill_young: 9.0 * k * g / (3.0 * k + g),
            hill_poisson: (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g)),
            universal_anisotropy: 5.0 * voigt.shear / reuss.shear + voigt.bulk / reuss.bulk - 6.0,
        })
    }

    /// Ei = 1/sii, νij = −sij/sii, Gij = 1/skk of the Voigt compliance s; `None` if C is singular.
    pub fn engineering_constants(&self) -> Option<EngineeringConstants> {
        let s = self.compliance_voigt()?;
        let nu = |i: usize, j: usize| -s[(i, j)] / s[(i, i)];
        Some(EngineeringConstants {
            e1: 1.0 / s[(0, 0)],
            e2: 1.0 / s[(1, 1)],
            e3: 1.0 / s[(2, 2)],
            nu12: nu(0, 1),
            nu21: nu(1, 0),
            nu13: nu(0, 2),
            nu31: nu(2, 0),
            nu23: nu(1, 2),
            nu32: nu(2, 1),
            g23: 1.0 / s[(3, 3)],
            g13: 1.0 / s[(4, 4)],
            g12: 1.0 / s[(5, 5)],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Material, Stiffness};
    use nalgebra::Matrix6;

    /// A^U of C_ref as the document prints it for its eight materials, to the nine digits recomputed for THEORY.
    #[test]
    fn universal_anisotropy_of_the_built_in_materials() {
        let expected = [
            ("KIO3", 0.196473169),
            ("CoTeO4", 28.3168889),
            ("Te2W", 54.0622587),
            ("Ta2C", 0.587466885),
            ("Si", 0.123145494),
            ("MoN", 0.255076855),
            ("Spinel", 1.23715941),
            ("Pyroceram", 0.0),
        ];
        for (name, value) in expected {
            let found = Material::builtin(name).unwrap().stiffness.average_moduli().unwrap().universal_anisotropy;
            assert!((found - value).abs() < 2e-9 * (1.0 + 10.0 * value), "{name}: {found}");
        }
    }

    #[test]
    fn every_average_of_an_isotropic_tensor_is_the_tensor() {
        let (e, nu): (f64, f64) = (70e9, 0.33);
        let (lambda, g) = (e * nu / (1.0 + nu) / (1.0 - 2.0 * nu), e / 2.0 / (1.0 + nu));
        let c = Stiffness::isotropic(lambda, g);
        let a = c.average_moduli().unwrap();
        for average in [a.voigt, a.reuss, a.hill] {
            assert!((average.bulk / (lambda + 2.0 / 3.0 * g) - 1.0).abs() < 1e-14);
            assert!((average.shear / g - 1.0).abs() < 1e-14);
        }
        assert!((a.hill_young / e - 1.0).abs() < 1e-14 && (a.hill_poisson / nu - 1.0).abs() < 1e-14);
        assert!(a.universal_anisotropy.abs() < 1e-13);
        let k = c.engineering_constants().unwrap();
        for young in [k.e1, k.e2, k.e3] {
            assert!((young / e - 1.0).abs() < 1e-13);
        }
        for ratio in [k.nu12, k.nu21, k.nu13, k.nu31, k.nu23, k.nu32] {
            assert!((ratio / nu - 1.0).abs() < 1e-13);
        }
    }

    /// Orthotropic constants → compliance → stiffness → the same constants.
    #[test]
    fn engineering_constants_round_trip() {
        let (e1, e2, e3, nu12, nu13, nu23) = (11.0, 0.9, 0.5, 0.37, 0.44, 0.6);
        let mut s = Matrix6::from_diagonal(&[1.0 / e1, 1.0 / e2, 1.0 / e3, 1.0 / 0.2, 1.0 / 0.7, 1.0 / 0.8].into());
        for (i, j, value) in [(0, 1, nu12 / e1), (0, 2, nu13 / e1), (1, 2, nu23 / e2)] {
            s[(i, j)] = -value;
            s[(j, i)] = -value;
        }
        let k = Stiffness::from_compliance_voigt(&s).unwrap().engineering_constants().unwrap();
        let pairs = [
            (k.e1, e1),
            (k.e2, e2),
            (k.e3, e3),
            (k.nu12, nu12),
            (k.nu21, nu12 * e2 / e1),
            (k.nu13, nu13),
            (k.nu31, nu13 * e3 / e1),
            (k.nu23, nu23),
            (k.nu32, nu23 * e3 / e2),
            (k.g23, 0.2),
            (k.g13, 0.7),
            (k.g12, 0.8),
        ];
        for (found, expected) in pairs {
            assert!((found / expected - 1.0).abs() < 1e-13, "{found} {expected}");
        }
    }

    #[test]
    fn a_singular_tensor_has_no_reuss_average() {
        let c = Stiffness::from_mandel(Matrix6::from_diagonal(&[1.0, 1.0, 1.0, 1.0, 1.0, 0.0].into()));
        assert!(c.average_moduli().is_none() && c.engineering_constants().is_none());
        assert!(c.voigt_average().bulk > 0.0);
    }
}
