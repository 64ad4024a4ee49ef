//! Closeness of two tensors in the sense of energy: ‖C^(−½)(R − C)C^(−½)‖, which sees soft directions as well as stiff ones.

use nalgebra::{Cholesky, Matrix6, SMatrix};
use serde::{Deserialize, Serialize};

use super::cauchy::{Quartic, tensor_of};
use super::stiffness::Stiffness;

/// In which sense a tensor out of reach is come close to (docs/theory.md, "Closest in the sense of energy").
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Metric {
    /// The norm over all 81 components, ‖R − C‖: relative to the stiffest directions.
    #[default]
    Norm,
    /// ‖C^(−½)(R − C)C^(−½)‖: the relative errors of the energy of strains.
    Energy,
}

impl Metric {
    /// norm or energy.
    pub fn name(self) -> &'static str {
        match self {
            Metric::Norm => "norm",
            Metric::Energy => "energy",
        }
    }

    /// The metric of a name.
    pub fn named(name: &str) -> Option<Self> {
        [Metric::Norm, Metric::Energy].into_iter().find(|metric| metric.name() == name)
    }
}

/// L⁻¹ of C = L Lᵀ, which brings tensors into units of C: L⁻¹ R L⁻ᵀ is C^(−½) R C^(−½) but for a turn, so that norms and
/// eigenvalues are the same.
#[derive(Clone, Copy)]
pub(super) struct Whitened {
    inverse: Matrix6<f64>,
}

impl Whitened {
    /// By a tensor; `None` unless it is positive definite.
    pub fn by(c: &Stiffness) -> Option<Self> {
        let inverse = Cholesky::new(*c.mandel())?.l().try_inverse()?;
        inverse.iter().all(|x| x.is_finite()).then_some(Whitened { inverse })
    }

    /// L⁻¹ R L⁻ᵀ.
    pub fn of(&self, r: &Matrix6<f64>) -> Matrix6<f64> {
        self.inverse * r * self.inverse.transpose()
    }
}

impl Stiffness {
    /// ‖C^(−½)(R − C)C^(−½)‖/√6 with C this tensor and R the other: the root mean square of the six relative errors of energy
    /// between the two of [`Stiffness::energy_error`]. `None` unless C is positive definite.
    pub fn energy_distance(&self, other: &Stiffness) -> Option<f64> {
        let distance = Whitened::by(self)?.of(&(other.mandel() - self.mandel())).norm() / 6.0_f64.sqrt();
        distance.is_finite().then_some(distance)
    }

    /// The tensor that central bonds come closest to in a sense: the Cauchy part, or
    /// [`Stiffness::cauchy_part_in_energy`].
    pub fn cauchy_part_in(&self, metric: Metric) -> Option<Stiffness> {
        match metric {
            Metric::Norm => Some(self.cauchy_part()),
            Metric::Energy => self.cauchy_part_in_energy(),
        }
    }

    /// S* = argmin ‖C^(−½)(S − C)C^(−½)‖ over the fully symmetric tensors S: 15 linear equations in place of total
    /// symmetrisation. `None` unless C is positive definite. S* need not be.
    ///
    /// ```
    /// use anisobond::tensor::Stiffness;
    /// let c = Stiffness::isotropic(2e9, 1e9);
    /// let (s, e) = (c.cauchy_part(), c.cauchy_part_in_energy().unwrap());
    /// assert!(e.cauchy_gap() < 1e-14);
    /// assert!(c.energy_distance(&e) < c.energy_distance(&s) && c.relative_error(&e) > c.relative_error(&s));
    /// ```
    pub fn cauchy_part_in_energy(&self) -> Option<Stiffness> {
        let gram = energy_gram(self)?;
        let whitened = Whitened::by(self)?;
        let right = Quartic::from_fn(|k, _| whitened.of(unit(k).mandel()).trace());
        let solution = Cholesky::new(gram)?.solve(&right);
        solution.iter().all(|x| x.is_finite()).then(|| tensor_of(&solution))
    }
}

/// The fully symmetric tensor of one coordinate.
fn unit(k: usize) -> Stiffness {
    tensor_of(&Quartic::from_fn(|n, _| if n == k { 1.0 } else { 0.0 }))
}

/// ⟨E_k, E_l⟩ in units of C, E_k the orthonormal fully symmetric tensors of [`Quartic`]: the metric of energy on them
/// (1/Pa²). `None` unless C is positive definite.
pub fn energy_gram(c: &Stiffness) -> Option<SMatrix<f64, 15, 15>> {
    let whitened = Whitened::by(c)?;
    let all: [Matrix6<f64>; 15] = std::array::from_fn(|k| whitened.of(unit(k).mandel()));
    Some(SMatrix::from_fn(|k, l| all[k].dot(&all[l])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Material;
    use crate::tensor::miss::ply;

    /// THEORY: least and largest error of energy (%), error in the norm (%) of S*; computed independently of this program.
    #[test]
    fn closest_cauchy_tensors_in_the_sense_of_energy() {
        let named = |name: &str| Material::builtin(name).unwrap().stiffness;
        for (c, least, largest, norm) in [
            (ply(), -11.98, 5.13, 1.446),
            (named("Te2W"), -7.89, 8.51, 5.803),
            (named("CoTeO4"), -9.21, 11.39, 5.378),
            (named("Si"), -4.56, 6.60, 4.329),
            (named("Spinel"), -1.36, 0.36, 1.010),
        ] {
            let s = c.cauchy_part_in_energy().unwrap();
            let [a, b] = c.energy_error(&s).unwrap();
            assert!((100.0 * a - least).abs() < 0.006 && (100.0 * b - largest).abs() < 0.006, "{a} {b}");
            assert!((100.0 * c.relative_error(&s) - norm).abs() < 6e-4, "{}", c.relative_error(&s));
            assert!(s.cauchy_gap() < 1e-12 && s.require_positive_definite().is_ok());
        }
    }

    /// No Cauchy tensor near S* is closer, and S* turns with the material.
    #[test]
    fn it_is_a_minimum_and_turns_with_the_material() {
        for material in Material::builtin_names().into_iter().filter_map(Material::builtin) {
            let c = material.stiffness;
            let s = c.cauchy_part_in_energy().unwrap();
            let least = c.energy_distance(&s).unwrap();
            for k in 0..15 {
                for step in [-1e-3, 1e-3] {
                    let other = Stiffness::from_mandel(s.mandel() + unit(k).mandel() * (step * c.norm()));
                    assert!(c.energy_distance(&other).unwrap() >= least, "{} {k}", material.name);
                }
            }
            let q = *nalgebra::Rotation3::from_euler_angles(0.3, -0.8, 1.2).matrix();
            let turned = c.rotated(&q).cauchy_part_in_energy().unwrap();
            assert!(s.rotated(&q).relative_error(&turned) < 1e-11, "{}", material.name);
        }
    }

    #[test]
    fn what_is_in_reach_is_itself_and_an_indefinite_tensor_has_none() {
        let c = Stiffness::isotropic(1.0, 1.0);
        assert!(c.relative_error(&c.cauchy_part_in_energy().unwrap()) < 1e-14);
        assert!(Stiffness::isotropic(-10.0, 1.0).cauchy_part_in_energy().is_none());
        let error = c.energy_error(&c.scaled(1.1)).unwrap();
        assert!((c.energy_distance(&c.scaled(1.1)).unwrap() - error[0]).abs() < 1e-14);
        assert!(Metric::named("energy") == Some(Metric::Energy) && Metric::named("Norm").is_none());
    }
}
