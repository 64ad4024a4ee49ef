//! How far a tensor misses a wanted one, in the sense of energy.

use nalgebra::Cholesky;

use super::stiffness::Stiffness;

/// A tensor whose energy is further off than this part, under some strain, is said to miss the wanted one.
pub const NOTICEABLE_MISS: f64 = 0.01;

impl Stiffness {
    /// Least and largest relative error of the energy of `other`, over all strains: (ε:R:ε − ε:C:ε)/ε:C:ε with C this tensor
    /// and R the other, the extreme eigenvalues of C^(−½) (R − C) C^(−½). `None` unless C is positive definite.
    ///
    /// The norm of C hides small components, which this does not.
    ///
    /// ```
    /// use anisobond::tensor::Stiffness;
    /// let (wanted, reached) = (Stiffness::isotropic(1e9, 1e9), Stiffness::isotropic(1e9, 1.1e9));
    /// let [least, largest] = wanted.energy_error(&reached).unwrap();
    /// // Under pure volume change 3λ + 2μ grows from 5 to 5.2, under shear 2μ by a tenth.
    /// assert!((least - 0.04).abs() < 1e-12 && (largest - 0.1).abs() < 1e-12);
    /// ```
    pub fn energy_error(&self, other: &Stiffness) -> Option<[f64; 2]> {
        // With C = L Lᵀ the matrix L⁻¹ (R − C) L⁻ᵀ has the same eigenvalues.
        let lower = Cholesky::new(*self.mandel())?.l();
        let half = lower.solve_lower_triangular(&(other.mandel() - self.mandel()))?;
        let both = lower.solve_lower_triangular(&half.transpose())?;
        let values = (0.5 * (both + both.transpose())).symmetric_eigenvalues();
        let (least, largest) = (values.min(), values.max());
        (least.is_finite() && largest.is_finite()).then_some([least, largest])
    }

    /// What to say of another tensor that is to be this one, in a sentence without an end: the errors of energy, and the
    /// component R_ab that is furthest off, by |R_ab − C_ab|/√(C_aa C_bb). `None` where no strain's energy is off by more than
    /// [`NOTICEABLE_MISS`].
    pub fn miss(&self, other: &Stiffness) -> Option<String> {
        let [least, largest] = self.energy_error(other)?;
        if least.abs().max(largest.abs()) <= NOTICEABLE_MISS {
            return None;
        }
        let (c, r) = (self.voigt(), other.voigt());
        let off = |&(a, b): &(usize, usize)| (r[(a, b)] - c[(a, b)]).abs() / (c[(a, a)] * c[(b, b)]).sqrt();
        let pairs = (0..6).flat_map(|a| (a..6).map(move |b| (a, b)));
        let (a, b) = pairs.max_by(|x, y| off(x).total_cmp(&off(y)))?;
        let (wanted, reached) = (c[(a, b)], r[(a, b)]);
        // A component that is nothing beside its diagonal has no relative error.
        let relative = (wanted.abs() > 1e-3 * (c[(a, a)] * c[(b, b)]).sqrt())
            .then(|| format!(", {}", percent((reached - wanted) / wanted.abs())));
        Some(format!(
            "the energy of a strain is off by {} to {}; the component furthest off is C{}{} = {:.4} GPa for {:.4} GPa{}",
            percent(least),
            percent(largest),
            a + 1,
            b + 1,
            1e-9 * reached,
            1e-9 * wanted,
            relative.unwrap_or_default()
        ))
    }
}

/// A signed percentage.
fn percent(x: f64) -> String {
    format!("{:+.1} %", 100.0 * x).replace('-', "−")
}

/// A carbon/epoxy ply (E 140/10, G 5 GPa, ν .3/.4), its fibres along x.
#[cfg(test)]
pub(super) fn ply() -> Stiffness {
    let (e1, e2, g, n12, n23) = (140e9, 10e9, 5e9, 0.3, 0.4);
    let mut s = nalgebra::Matrix6::zeros();
    for (a, value) in [1.0 / e1, 1.0 / e2, 1.0 / e2, 2.0 * (1.0 + n23) / e2, 1.0 / g, 1.0 / g].into_iter().enumerate() {
        s[(a, a)] = value;
    }
    for (a, b, value) in [(0, 1, -n12 / e1), (0, 2, -n12 / e1), (1, 2, -n23 / e2)] {
        (s[(a, b)], s[(b, a)]) = (value, value);
    }
    Stiffness::from_voigt(&s.try_inverse().unwrap()).unwrap()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix6;

    /// Total symmetrisation, %: computed independently of this program.
    #[test]
    fn cauchy_parts_miss_by_so_much() {
        let named = |name: &str| crate::tensor::Material::builtin(name).unwrap().stiffness;
        for (c, least, largest) in [
            (ply(), -5.44, 12.81),
            (named("Te2W"), -7.91, 16.67),
            (named("CoTeO4"), -8.26, 34.26),
            (named("Si"), -7.04, 4.09),
            (named("Spinel"), -0.74, 1.87),
        ] {
            let [a, b] = c.energy_error(&c.cauchy_part()).unwrap();
            assert!((100.0 * a - least).abs() < 0.006 && (100.0 * b - largest).abs() < 0.006, "{a} {b}");
        }
    }

    #[test]
    fn what_hardly_misses_is_not_told_of_and_the_worst_component_is() {
        let c = ply();
        assert!(c.miss(&c).is_none() && c.miss(&c.scaled(1.009)).is_none());
        let mut voigt = c.voigt();
        voigt[(3, 3)] *= 1.3;
        let other = Stiffness::from_voigt(&voigt).unwrap();
        let words = c.miss(&other).unwrap();
        assert!(words.contains("C44") && words.contains("+30.0 %"), "{words}");
        assert!(words.starts_with("the energy of a strain is off by +0.0 % to +30.0 %"), "{words}");
        // The energy is that of strains: it does not depend on the axes.
        let q = nalgebra::Rotation3::from_euler_angles(0.3, -0.8, 1.2);
        let (a, b) =
            (c.energy_error(&other).unwrap(), c.rotated(q.matrix()).energy_error(&other.rotated(q.matrix())).unwrap());
        assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12);
        assert!(Stiffness::from_mandel(Matrix6::zeros()).energy_error(&c).is_none());
    }
}
