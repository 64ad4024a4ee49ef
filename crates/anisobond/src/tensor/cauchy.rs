//! What central bonds can see of a tensor: its Cauchy (fully symmetric) part, and what they cannot: its defect.

use nalgebra::{Matrix3, SVector, Vector3};

use super::stiffness::Stiffness;

/// Exponents (a, b, c) of the 15 monomials n₁ᵃ n₂ᵇ n₃ᶜ of a quartic form, in the order of all quartic coefficients
/// of this crate: 1111 2222 3333 · 1122 1133 2233 · 1112 1113 2223 1222 1333 2333 · 1123 1223 1233.
pub const MONOMIALS: [[usize; 3]; 15] = [
    [4, 0, 0],
    [0, 4, 0],
    [0, 0, 4],
    [2, 2, 0],
    [2, 0, 2],
    [0, 2, 2],
    [3, 1, 0],
    [3, 0, 1],
    [0, 3, 1],
    [1, 3, 0],
    [1, 0, 3],
    [0, 1, 3],
    [2, 1, 1],
    [1, 2, 1],
    [1, 1, 2],
];

/// "1111", "2222", … in the order of [`MONOMIALS`].
pub fn monomial_names() -> [String; 15] {
    MONOMIALS.map(|[a, b, c]| "1".repeat(a) + &"2".repeat(b) + &"3".repeat(c))
}

/// Coordinates of a fully symmetric tensor in an orthonormal basis: √m S_abc, m = 4!/(a! b! c!) the number of index
/// orders of a monomial, so that the dot product of two vectors is that of the tensors (all 81 components).
pub type Quartic = SVector<f64, 15>;

/// √(4!/(a! b! c!)) of each monomial: 1, √6, √4 and √12 for the forms 1111, 1122, 1112 and 1123.
pub fn quartic_weights() -> Quartic {
    const SQRT_6: f64 = 2.449_489_742_783_178;
    const SQRT_12: f64 = 3.464_101_615_137_754_4;
    Quartic::from_fn(|k, _| [1.0, SQRT_6, 2.0, SQRT_12][KIND[k]])
}

/// Which of the forms 1111, 1122, 1112, 1123 a monomial has.
const KIND: [usize; 15] = [0, 0, 0, 1, 1, 1, 2, 2, 2, 2, 2, 2, 3, 3, 3];

/// Coordinates of n⊗n⊗n⊗n. For two unit vectors, `quartic_of(n).dot(&quartic_of(m)) == (n·m)⁴`.
pub fn quartic_of(n: &Vector3<f64>) -> Quartic {
    let powers = |x: f64| [1.0, x, x * x, x * x * x, x * x * (x * x)];
    let (x, y, z) = (powers(n[0]), powers(n[1]), powers(n[2]));
    let weights = quartic_weights();
    Quartic::from_fn(|k, _| {
        let [a, b, c] = MONOMIALS[k];
        weights[k] * x[a] * y[b] * z[c]
    })
}

/// Coordinates of the Cauchy part of C.
pub fn cauchy_coordinates(c: &Stiffness) -> Quartic {
    let s = c.cauchy_part();
    let weights = quartic_weights();
    Quartic::from_fn(|k, _| {
        let i = indices(MONOMIALS[k]);
        weights[k] * s.component(i[0], i[1], i[2], i[3])
    })
}

/// The fully symmetric tensor of given coordinates.
pub fn tensor_of(coordinates: &Quartic) -> Stiffness {
    let weights = quartic_weights();
    let mut mandel = nalgebra::Matrix6::zeros();
    for (a, &(i, j)) in super::PAIRS.iter().enumerate() {
        for (b, &(k, l)) in super::PAIRS.iter().enumerate() {
            let mut exponents = [0; 3];
            for index in [i, j, k, l] {
                exponents[index] += 1;
            }
            let m = MONOMIALS.iter().position(|&e| e == exponents).expect("four indices make one of the 15 monomials");
            mandel[(a, b)] = coordinates[m] / weights[m] * super::mandel_weights(a, b);
        }
    }
    Stiffness::from_mandel(mandel)
}

/// Four indices of a monomial: [2, 1, 1] → 0 0 1 2.
fn indices(exponents: [usize; 3]) -> [usize; 4] {
    let mut out = [0; 4];
    let mut next = 0;
    for (index, &count) in exponents.iter().enumerate() {
        for _ in 0..count {
            out[next] = index;
            next += 1;
        }
    }
    out
}

impl Stiffness {
    /// S_ijkl = (C_ijkl + C_ikjl + C_iljk)/3: the fully symmetric part, the closest tensor that satisfies Cauchy's
    /// relations (P eq 28).
    pub fn cauchy_part(&self) -> Stiffness {
        let mandel = nalgebra::Matrix6::from_fn(|a, b| {
            let ((i, j), (k, l)) = (super::PAIRS[a], super::PAIRS[b]);
            let s = (self.component(i, j, k, l) + self.component(i, k, j, l) + self.component(i, l, j, k)) / 3.0;
            s * super::mandel_weights(a, b)
        });
        Stiffness::from_mandel(mandel)
    }

    /// ‖C − S‖/‖C‖: the least relative error of any model of central bonds, known before any neighbourhood.
    pub fn cauchy_gap(&self) -> f64 {
        self.relative_error(&self.cauchy_part())
    }

    /// D_pq = −½ ε_pik ε_qjl C_ijkl (Pa): the six numbers central bonds cannot reach (zero if C is Cauchy symmetric);
    /// D11 = C44 − C23, D12 = C36 − C45, …
    pub fn cauchy_defect(&self) -> Matrix3<f64> {
        // The two other indices of p with the sign of the permutation.
        let others = |p: usize| [((p + 1) % 3, (p + 2) % 3, 1.0), ((p + 2) % 3, (p + 1) % 3, -1.0)];
        Matrix3::from_fn(|p, q| {
            let mut sum = 0.0;
            for (i, k, sign_p) in others(p) {
                for (j, l, sign_q) in others(q) {
                    sum += sign_p * sign_q * self.component(i, j, k, l);
                }
            }
            -0.5 * sum
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix6;

    fn generic() -> Stiffness {
        Stiffness::from_mandel(Matrix6::from_fn(|a, b| ((5 * a + b) as f64).sin() + ((5 * b + a) as f64).sin()))
    }

    #[test]
    fn weights_are_the_multinomial_ones() {
        let factorial = |n: usize| (1..=n).product::<usize>() as f64;
        for (k, exponents) in MONOMIALS.iter().enumerate() {
            let count = 24.0 / exponents.iter().map(|&e| factorial(e)).product::<f64>();
            assert!((quartic_weights()[k] - count.sqrt()).abs() < 1e-15);
        }
    }

    #[test]
    fn quartic_coordinates_are_orthonormal() {
        let (n, m) = (Vector3::new(0.3, -0.5, 0.2), Vector3::new(-1.0, 0.4, 0.7));
        assert!((quartic_of(&n).dot(&quartic_of(&m)) - n.dot(&m).powi(4)).abs() < 1e-15);
        let s = cauchy_coordinates(&generic());
        assert!((s.norm() - generic().cauchy_part().norm()).abs() < 1e-14);
        assert!((tensor_of(&s).relative_error(&generic().cauchy_part())) < 1e-15);
    }

    /// D11 = C44−C23, D22 = C55−C13, D33 = C66−C12, D12 = C36−C45, D13 = C25−C46, D23 = C14−C56.
    #[test]
    fn defect_is_the_six_differences() {
        let c = generic();
        let v = c.voigt();
        let v = |a: usize, b: usize| v[(a - 1, b - 1)];
        let d = c.cauchy_defect();
        let expected = Matrix3::new(
            v(4, 4) - v(2, 3),
            v(3, 6) - v(4, 5),
            v(2, 5) - v(4, 6),
            v(3, 6) - v(4, 5),
            v(5, 5) - v(1, 3),
            v(1, 4) - v(5, 6),
            v(2, 5) - v(4, 6),
            v(1, 4) - v(5, 6),
            v(6, 6) - v(1, 2),
        );
        assert!((d - expected).norm() < 1e-14, "{d} {expected}");
        assert!(c.cauchy_part().cauchy_defect().norm() < 1e-14);
    }
}
