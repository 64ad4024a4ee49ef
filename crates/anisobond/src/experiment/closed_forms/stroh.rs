//! Stroh's sextic formalism: all solutions of generalised plane strain for any tensor.

use nalgebra::{Complex, DMatrix, Matrix3, Matrix6, Schur, Vector3};

use crate::tensor::Stiffness;

/// Smallest pivot of the normalised eigenvectors from which the three solutions count as independent.
const INDEPENDENT: f64 = 1e-4;

/// Size h of the perturbation that separates equal roots, relative to the least Kelvin modulus. Its error is O(h⁴), its rounding 10⁻¹⁶/h.
const SEPARATION: f64 = 4e-3;

/// Q_ik = C_i1k1, R_ik = C_i1k2, T_ik = C_i2k2 (Pa) of a tensor.
pub(super) fn plane_blocks(c: &Stiffness) -> [Matrix3<f64>; 3] {
    [(0, 0), (0, 1), (1, 1)].map(|(j, l)| Matrix3::from_fn(|i, k| c.component(i, j, k, l)))
}

/// Stroh's fundamental matrix N = [N₁ N₂; N₃ N₁ᵀ], N₁ = −T⁻¹Rᵀ, N₂ = T⁻¹, N₃ = R T⁻¹ Rᵀ − Q (Ting 1996, eq 5.5-3), in
/// units of `unit` (Pa); `None` when T is singular. `inertia` = ρv² (Pa) is taken off Q for waves that run along x₁.
pub(super) fn fundamental(c: &Stiffness, unit: f64, inertia: f64) -> Option<Matrix6<f64>> {
    let [q, r, t] = plane_blocks(c).map(|m| m / unit);
    let q = q - Matrix3::identity() * (inertia / unit);
    let inverse = t.try_inverse()?;
    let n1 = -inverse * r.transpose();
    let n3 = r * inverse * r.transpose() - q;
    let mut n = Matrix6::zeros();
    n.fixed_view_mut::<3, 3>(0, 0).copy_from(&n1);
    n.fixed_view_mut::<3, 3>(0, 3).copy_from(&inverse);
    n.fixed_view_mut::<3, 3>(3, 0).copy_from(&n3);
    n.fixed_view_mut::<3, 3>(3, 3).copy_from(&n1.transpose());
    Some(n)
}

/// The roots and vectors of a tensor: u = 2 Re Σ a_α f_α(x₁ + p_α x₂) solves div σ = 0 for any analytic f, with the
/// stress function φ = 2 Re Σ b_α f_α, σ_i1 = −φ_i,2 and σ_i2 = φ_i,1 (Ting, Anisotropic Elasticity, 1996, ch. 5).
#[derive(Clone, Debug)]
pub struct Stroh {
    /// p_α, positive imaginary part.
    pub roots: [Complex<f64>; 3],
    /// Columns a_α (–), of length 1.
    pub a: Matrix3<Complex<f64>>,
    /// Columns b_α (Pa).
    pub b: Matrix3<Complex<f64>>,
}

impl Stroh {
    /// The roots and vectors; `None` where two roots (nearly) share a vector, as in an isotropic medium, and for a
    /// tensor that is not positive definite.
    pub fn new(c: &Stiffness) -> Option<Self> {
        let unit = c.norm();
        let n = fundamental(c, unit, 0.0)?;
        // Multiple roots may keep the QR iteration from ending: those are the ones that share a vector.
        let schur = Schur::try_new(DMatrix::from_column_slice(6, 6, n.as_slice()), f64::EPSILON, 500)?;
        let values = schur.complex_eigenvalues();
        let mut roots: Vec<Complex<f64>> = values.iter().copied().filter(|p| p.im > 0.0).collect();
        roots.sort_by(|x, y| x.re.total_cmp(&y.re).then(x.im.total_cmp(&y.im)));
        let roots: [Complex<f64>; 3] = roots.try_into().ok()?;
        let [q, r, t] = plane_blocks(c).map(|m| (m / unit).map(|x| Complex::new(x, 0.0)));
        let a = roots.map(|p| null_vector(&(q + (r + r.transpose()) * p + t * (p * p))));
        let b: [Vector3<Complex<f64>>; 3] = std::array::from_fn(|k| (r.transpose() + t * roots[k]) * a[k]);
        let (a, b) = (Matrix3::from_columns(&a), Matrix3::from_columns(&b));
        let independent = |m: &Matrix3<Complex<f64>>| m.svd(false, false).singular_values.min() > INDEPENDENT;
        (independent(&a) && independent(&b)).then(|| Stroh { roots, a, b: b * Complex::new(unit, 0.0) })
    }

    /// Solutions and weights whose weighted sum is the answer for the tensor: the tensor itself, or, where its roots
    /// coincide, four neighbours C ± h D, C ± 2h D. Answers are analytic in C although the roots are not, so that
    /// 4/3 of the mean at ±h less 1/3 of that at ±2h is exact to O(h⁴).
    pub fn weighted(c: &Stiffness) -> Option<Vec<(f64, Self)>> {
        if let Some(regular) = Stroh::new(c) {
            return Some(vec![(1.0, regular)]);
        }
        // Any tensor without a symmetry separates the roots.
        let d = Matrix6::from_fn(|i, j| ((1 + i.min(j)) as f64 * 1.7 + (i.max(j) as f64) * 2.3).sin());
        let unit = c.eigen().0[0] / d.norm() * SEPARATION;
        [(1.0, 2.0 / 3.0), (-1.0, 2.0 / 3.0), (2.0, -1.0 / 6.0), (-2.0, -1.0 / 6.0)]
            .into_iter()
            .map(|(h, weight)| {
                let shifted = Stiffness::from_mandel(c.mandel() + d * (h * unit));
                Stroh::new(&shifted).map(|s| (weight, s))
            })
            .collect()
    }
}

/// The unit vector that a singular matrix sends to zero: orthogonal to its rows, hence along the largest of their cross
/// products.
fn null_vector(m: &Matrix3<Complex<f64>>) -> Vector3<Complex<f64>> {
    let row = |i: usize| m.row(i).transpose();
    let size = |v: &Vector3<Complex<f64>>| v.norm();
    let crosses = [row(0).cross(&row(1)), row(1).cross(&row(2)), row(2).cross(&row(0))];
    let largest = crosses.into_iter().max_by(|x, y| size(x).total_cmp(&size(y)));
    let v = largest.unwrap_or_else(Vector3::zeros);
    let length = size(&v);
    if length > 0.0 { v / Complex::new(length, 0.0) } else { Vector3::x().map(|x| Complex::new(x, 0.0)) }
}
