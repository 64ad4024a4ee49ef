//! The fourth-order elastic tensor, stored once as its Kelvin-Mandel matrix.

use nalgebra::{Matrix3, Matrix6, Vector6};

use crate::{Error, Result};

/// Index pairs of the six Kelvin-Mandel (and Voigt) rows: 11 22 33 23 13 12.
pub const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

/// Row of the pair (i, j) in the order 11 22 33 23 13 12.
pub const fn row_of(i: usize, j: usize) -> usize {
    if i == j { i } else { 6 - i - j }
}

/// Kelvin-Mandel weight of a row: 1 for 11 22 33, √2 for 23 13 12.
pub const fn mandel_weight(row: usize) -> f64 {
    if row < 3 { 1.0 } else { std::f64::consts::SQRT_2 }
}

/// Product of the weights of two rows, exactly 1, √2 or 2, so that shear constants come back as they were given.
pub const fn mandel_weights(a: usize, b: usize) -> f64 {
    match (a < 3, b < 3) {
        (true, true) => 1.0,
        (false, false) => 2.0,
        _ => std::f64::consts::SQRT_2,
    }
}

/// Largest |Cᵢⱼ − Cⱼᵢ| accepted as rounding in an input matrix, relative to the largest |Cᵢⱼ|.
const ASYMMETRY: f64 = 1e-6;

/// Smallest eigenvalue accepted as positive, relative to the largest: below it a matrix is singular to rounding.
const SINGULAR: f64 = 1e-13;

/// An elastic stiffness tensor C (Pa) with minor and major symmetries; any such tensor, positive definite or not.
///
/// Stored as the symmetric 6×6 Kelvin-Mandel matrix (order 11 22 33 23 13 12, shear rows scaled by √2), so that its
/// Frobenius norm is the tensor's own √(C_ijkl C_ijkl), its eigenvalues are the Kelvin moduli, and its inverse is the
/// compliance. The Voigt matrix is a view ([`Stiffness::voigt`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffness {
    mandel: Matrix6<f64>,
}

impl Stiffness {
    /// From a symmetric Kelvin-Mandel matrix (Pa); the upper triangle counts.
    pub fn from_mandel(mandel: Matrix6<f64>) -> Self {
        let mut m = mandel;
        m.fill_lower_triangle_with_upper_triangle();
        Stiffness { mandel: m }
    }

    /// From a 6×6 Voigt matrix (Pa, order 11 22 33 23 13 12).
    ///
    /// # Errors
    /// An entry that is not finite, or a matrix that is not symmetric to 10⁻⁶ of its largest entry.
    pub fn from_voigt(voigt: &Matrix6<f64>) -> Result<Self> {
        let c = symmetric(voigt, "c")?;
        Ok(Stiffness { mandel: Matrix6::from_fn(|a, b| c[(a, b)] * mandel_weights(a, b)) })
    }

    /// From a 6×6 Voigt compliance matrix s (1/Pa, engineering shear strains: s44 = 1/G23).
    ///
    /// # Errors
    /// As [`Stiffness::from_voigt`], or a matrix that cannot be inverted.
    pub fn from_compliance_voigt(voigt: &Matrix6<f64>) -> Result<Self> {
        let s = symmetric(voigt, "s")?;
        let s = Matrix6::from_fn(|a, b| s[(a, b)] / mandel_weights(a, b));
        let inverse = inverse(&s).ok_or_else(|| {
            Error::input("the compliance matrix is singular", "give a compliance whose six eigenvalues are not zero")
        })?;
        Ok(Stiffness::from_mandel(inverse))
    }

    /// The isotropic tensor of Lamé's λ and the shear modulus G (Pa).
    pub fn isotropic(lambda: f64, g: f64) -> Self {
        let mandel = Matrix6::from_fn(|a, b| {
            let dilatation = if a < 3 && b < 3 { lambda } else { 0.0 };
            dilatation + if a == b { 2.0 * g } else { 0.0 }
        });
        Stiffness { mandel }
    }

    /// The Kelvin-Mandel matrix (Pa).
    pub fn mandel(&self) -> &Matrix6<f64> {
        &self.mandel
    }

    /// The 6×6 Voigt matrix (Pa, order 11 22 33 23 13 12).
    pub fn voigt(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|a, b| self.mandel[(a, b)] / mandel_weights(a, b))
    }

    /// From the rows of a Voigt matrix (Pa), as [`Stiffness::voigt_rows`] gives them.
    ///
    /// # Errors
    /// As [`Stiffness::from_voigt`].
    pub fn from_voigt_rows(rows: &[[f64; 6]; 6]) -> Result<Self> {
        Stiffness::from_voigt(&Matrix6::from_fn(|a, b| rows[a][b]))
    }

    /// The Voigt matrix as rows (Pa), for output.
    pub fn voigt_rows(&self) -> [[f64; 6]; 6] {
        let c = self.voigt();
        std::array::from_fn(|a| std::array::from_fn(|b| c[(a, b)]))
    }

    /// C_ijkl (Pa), indices 0…2.
    pub fn component(&self, i: usize, j: usize, k: usize, l: usize) -> f64 {
        let (a, b) = (row_of(i, j), row_of(k, l));
        self.mandel[(a, b)] / mandel_weights(a, b)
    }

    /// The tensor's norm √(C_ijkl C_ijkl) (Pa), over all 81 components.
    pub fn norm(&self) -> f64 {
        self.mandel.norm()
    }

    /// ‖self − other‖ / ‖self‖: the relative error of `other` as an approximation of `self`.
    pub fn relative_error(&self, other: &Stiffness) -> f64 {
        (self.mandel - other.mandel).norm() / self.norm()
    }

    /// The compliance S = C⁻¹ as a Kelvin-Mandel matrix (1/Pa); `None` if C is singular.
    pub fn compliance(&self) -> Option<Matrix6<f64>> {
        inverse(&self.mandel)
    }

    /// The Voigt compliance (1/Pa, engineering shear strains: s44 = 1/G23); `None` if C is singular.
    pub fn compliance_voigt(&self) -> Option<Matrix6<f64>> {
        Some(self.compliance()?.map_with_location(|a, b, s| s * mandel_weights(a, b)))
    }

    /// Kelvin moduli (Pa, ascending) and eigentensors as columns in Kelvin-Mandel coordinates (unit norm).
    pub fn eigen(&self) -> (Vector6<f64>, Matrix6<f64>) {
        let eigen = self.mandel.symmetric_eigen();
        let mut order = [0, 1, 2, 3, 4, 5];
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        (
            Vector6::from_fn(|a, _| eigen.eigenvalues[order[a]]),
            Matrix6::from_fn(|a, b| eigen.eigenvectors[(a, order[b])]),
        )
    }

    /// Refuses a tensor that is not positive definite, naming its smallest eigenvalue and eigentensor.
    pub fn require_positive_definite(&self) -> Result<()> {
        let (values, vectors) = self.eigen();
        if values[0] > SINGULAR * values[5].abs() {
            return Ok(());
        }
        let strain = vectors.column(0);
        let strain: Vec<String> = (0..6).map(|a| format!("{:.3}", strain[a] / mandel_weight(a) + 0.0)).collect();
        Err(Error::input(
            format!(
                "the stiffness is not positive definite: eigenvalue {:.6e} Pa with eigentensor (11 22 33 23 13 12) = ({})",
                values[0],
                strain.join(" ")
            ),
            "an elastic solid stores energy under every strain: check signs, component order and units",
        ))
    }

    /// C′_pqrs = Q_pi Q_qj Q_rk Q_sl C_ijkl (P eq 44): the material turned (or reflected) by Q in a fixed frame.
    pub fn rotated(&self, q: &Matrix3<f64>) -> Self {
        let k = mandel_rotation(q);
        Stiffness::from_mandel(k * self.mandel * k.transpose())
    }

    /// C scaled by a number.
    pub fn scaled(&self, factor: f64) -> Self {
        Stiffness { mandel: self.mandel * factor }
    }
}

/// The 6×6 orthogonal Kelvin-Mandel matrix of a rotation or reflection Q: ε′ = Q ε Qᵀ.
pub fn mandel_rotation(q: &Matrix3<f64>) -> Matrix6<f64> {
    Matrix6::from_fn(|a, b| {
        let ((i, j), (k, l)) = (PAIRS[a], PAIRS[b]);
        let sum = q[(i, k)] * q[(j, l)] + q[(i, l)] * q[(j, k)];
        0.5 * sum * mandel_weights(a, b)
    })
}

/// The symmetric part of an input matrix that is finite and symmetric but for rounding.
fn symmetric(m: &Matrix6<f64>, letter: &str) -> Result<Matrix6<f64>> {
    for a in 0..6 {
        for b in 0..6 {
            if !m[(a, b)].is_finite() {
                return Err(Error::input(
                    format!("{letter}{}{} is {}", a + 1, b + 1, m[(a, b)]),
                    "give a finite number",
                ));
            }
        }
    }
    let largest = m.amax();
    for a in 0..6 {
        for b in a + 1..6 {
            if (m[(a, b)] - m[(b, a)]).abs() > ASYMMETRY * largest {
                return Err(Error::input(
                    format!(
                        "the matrix is not symmetric: {letter}{0}{1} = {2:e} but {letter}{1}{0} = {3:e}",
                        a + 1,
                        b + 1,
                        m[(a, b)],
                        m[(b, a)]
                    ),
                    "make both equal, or give the upper triangle only (rows of 6, 5, 4, 3, 2, 1 numbers)",
                ));
            }
        }
    }
    Ok((m + m.transpose()) * 0.5)
}

/// Inverse of a symmetric matrix through its eigenvalues' scale: scaled by the diagonal first, so that tensors whose
/// entries span decades lose no digits to units.
fn inverse(m: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let scale = m.amax();
    if scale == 0.0 || !scale.is_finite() {
        return None;
    }
    let inverse = (m / scale).try_inverse()? / scale;
    inverse.iter().all(|x| x.is_finite()).then_some((inverse + inverse.transpose()) * 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn component_agrees_with_the_definition_of_isotropy() {
        let c = Stiffness::isotropic(2.0, 3.0);
        let delta = |i, j| if i == j { 1.0 } else { 0.0 };
        for (i, j, k, l) in (0..81).map(|n| (n / 27, n / 9 % 3, n / 3 % 3, n % 3)) {
            let expected =
                2.0 * delta(i, j) * delta(k, l) + 3.0 * (delta(i, k) * delta(j, l) + delta(i, l) * delta(j, k));
            assert!((c.component(i, j, k, l) - expected).abs() < 1e-14);
        }
    }

    #[test]
    fn norm_is_the_norm_over_81_components() {
        let voigt = Matrix6::from_fn(|a, b| ((a * b + a + b) as f64).sin() + if a == b { 5.0 } else { 0.0 });
        let c = Stiffness::from_voigt(&((voigt + voigt.transpose()) * 0.5)).unwrap();
        let sum: f64 = (0..81).map(|n| c.component(n / 27, n / 9 % 3, n / 3 % 3, n % 3).powi(2)).sum();
        assert!((c.norm() - sum.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn rotation_agrees_with_the_four_index_sum() {
        let voigt = Matrix6::from_fn(|a, b| 1.0 / (1.0 + a as f64 + b as f64));
        let c = Stiffness::from_voigt(&voigt).unwrap();
        let q = *nalgebra::Rotation3::from_euler_angles(0.3, -0.7, 1.1).matrix();
        let rotated = c.rotated(&q);
        for n in 0..81 {
            let (p, r, s, t) = (n / 27, n / 9 % 3, n / 3 % 3, n % 3);
            let mut sum = 0.0;
            for m in 0..81 {
                let (i, j, k, l) = (m / 27, m / 9 % 3, m / 3 % 3, m % 3);
                sum += q[(p, i)] * q[(r, j)] * q[(s, k)] * q[(t, l)] * c.component(i, j, k, l);
            }
            assert!((rotated.component(p, r, s, t) - sum).abs() < 1e-14);
        }
    }

    #[test]
    fn indefinite_tensors_are_named() {
        let c = Stiffness::isotropic(-10.0, 1.0);
        let message = c.require_positive_definite().unwrap_err().to_string();
        assert!(message.contains("eigenvalue -2.8") && message.contains("0.577"), "{message}");
    }

    #[test]
    fn compliance_round_trip() {
        let c = Stiffness::isotropic(50e9, 30e9);
        let back = Stiffness::from_compliance_voigt(&c.compliance_voigt().unwrap()).unwrap();
        assert!(c.relative_error(&back) < 1e-14);
    }
}
