//! What free node rotations leave of a sum over normal and tangential bonds, on a perfect grid of one kind of node.
//!
//! All nodes share one rotation θ, which follows the strain: the energy density ½ ε:C ε + θ·B ε + ½ θ·D_r θ is least at
//! θ = −D_r⁻¹ B ε, and C_eff = C − Bᵀ D_r⁻¹ B (THEORY section 6). B and D_r are linear in the tangential fabric
//! M = Σ s c_t n⊗n, which shows in the Cauchy defect of the sum.

use nalgebra::{Matrix3, Matrix3x6};

use crate::tensor::{PAIRS, Stiffness, mandel_weight};

/// Largest negative eigenvalue of the tangential fabric that is rounding, relative to its trace.
const FABRIC_ROUNDING: f64 = 1e-12;

/// Fixed-point steps towards a sum whose relaxed tensor is the target; a dozen are used.
const MOST_RELAXATIONS: usize = 500;

/// M = Σ s c_t n⊗n (Pa) of a sum over bonds, read from its Cauchy defect: a tangential bond has the defect
/// ¼ s c_t (1 − n⊗n), hence 4D = tr(M) 1 − M and M = 2 tr(D) 1 − 4D.
pub(super) fn fabric_of_defect(sum: &Stiffness) -> Matrix3<f64> {
    let defect = sum.cauchy_defect();
    Matrix3::identity() * (2.0 * defect.trace()) - 4.0 * defect
}

/// B (3×6, Kelvin-Mandel): B ε = −Σ s c_t n×(ε n) = −(axial vector of M ε).
fn coupling(fabric: &Matrix3<f64>) -> Matrix3x6<f64> {
    Matrix3x6::from_fn(|i, a| {
        let (p, q) = PAIRS[a];
        let mut strain = Matrix3::zeros();
        strain[(p, q)] = mandel_weight(a) / if p == q { 1.0 } else { 2.0 };
        strain[(q, p)] = strain[(p, q)];
        let product = fabric * strain;
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        product[(k, j)] - product[(j, k)]
    })
}

/// D_r = tr(M) 1 − M.
fn resistance(fabric: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::identity() * fabric.trace() - fabric
}

/// The rotation of the nodes under unit strains (3×6, Kelvin-Mandel), −D_r⁻¹ B.
pub(super) fn rotation(fabric: &Matrix3<f64>) -> Matrix3x6<f64> {
    let coupling = coupling(fabric);
    let eigen = resistance(fabric).symmetric_eigen();
    let floor = FABRIC_ROUNDING * fabric.trace();
    let mut out = Matrix3x6::zeros();
    for (value, axis) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        // An axis about which nothing resists has nothing that turns it either.
        if *value > floor {
            out -= axis * (axis.transpose() * coupling) / *value;
        }
    }
    out
}

/// The tensor of a sum over bonds whose nodes turn by a given rotation Θ per unit strain: C + ΘᵀB + BᵀΘ + Θᵀ D_r Θ,
/// linear in the sum. It is least, in the sense of the energy of every strain, at the rotation of the sum itself.
pub(super) fn turned(sum: &Stiffness, fabric: &Matrix3<f64>, rotation: &Matrix3x6<f64>) -> Stiffness {
    let cross = rotation.tr_mul(&coupling(fabric));
    let turned = sum.mandel() + cross + cross.transpose() + rotation.tr_mul(&(resistance(fabric) * rotation));
    Stiffness::from_mandel(0.5 * (turned + turned.transpose()))
}

/// C_eff = C − Bᵀ D_r⁻¹ B of a sum and its tangential fabric.
pub(super) fn relax(sum: &Stiffness, fabric: &Matrix3<f64>) -> Stiffness {
    let work = coupling(fabric).tr_mul(&rotation(fabric));
    Stiffness::from_mandel(sum.mandel() + 0.5 * (work + work.transpose()))
}

/// The tensor that a perfect grid of one kind of node has when its nodes rotate freely, from its sum over normal and
/// tangential bonds, C_eff = C − Bᵀ D_r⁻¹ B. It depends on the sum alone: normal bonds resist no rotation, and
/// what the tangential ones do shows in the Cauchy defect. `None` for a tensor that is no such sum because an eigenvalue
/// of its defect is above half of the trace (or the trace is negative).
pub fn with_free_rotations(sum: &Stiffness) -> Option<Stiffness> {
    let fabric = fabric_of_defect(sum);
    let rounding = FABRIC_ROUNDING * sum.norm();
    if fabric.norm() <= rounding {
        return Some(*sum);
    }
    (fabric.symmetric_eigenvalues().min() >= -rounding).then(|| relax(sum, &fabric))
}

/// The sum over bonds whose tensor with free rotations is a given one, by the fixed point C ← C + (C* − relaxed(C));
/// `None` where there is none within reach of normal and tangential bonds, or the fixed point does not find it.
pub fn sum_for_free_rotations(measured: &Stiffness) -> Option<Stiffness> {
    let mut sum = *measured;
    for _ in 0..MOST_RELAXATIONS {
        let missing = measured.mandel() - with_free_rotations(&sum)?.mandel();
        sum = Stiffness::from_mandel(sum.mandel() + missing);
        if missing.norm() <= 1e-15 * measured.norm() {
            return Some(sum);
        }
    }
    let missing = (measured.mandel() - with_free_rotations(&sum)?.mandel()).norm();
    (missing <= 1e-12 * measured.norm()).then_some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::microplane::{normal_projection, tangential_projection};
    use nalgebra::Vector3;

    fn sum() -> Stiffness {
        let (n, m) = (Vector3::new(0.3, -0.5, 0.2).normalize(), Vector3::new(-1.0, 0.4, 0.7).normalize());
        let tangential = 3.0 * tangential_projection(&n) + 2.0 * tangential_projection(&m);
        Stiffness::from_mandel(tangential + 7.0 * normal_projection(&n))
    }

    /// The defect of one tangential bond gives back its fabric.
    #[test]
    fn fabric_is_in_the_defect() {
        let n = Vector3::new(0.3, -0.5, 0.2).normalize();
        let sum = Stiffness::from_mandel(3.0 * tangential_projection(&n) + 7.0 * normal_projection(&n));
        assert!((fabric_of_defect(&sum) - 3.0 * n * n.transpose()).norm() < 1e-14);
    }

    /// The nodes' own rotation gives the relaxed tensor, and any other one a stiffer one.
    #[test]
    fn the_nodes_own_rotation_is_the_softest() {
        let sum = sum();
        let fabric = fabric_of_defect(&sum);
        let (own, relaxed) = (rotation(&fabric), relax(&sum, &fabric));
        assert!(relaxed.relative_error(&turned(&sum, &fabric, &own)) < 1e-14);
        assert!(turned(&sum, &fabric, &Matrix3x6::zeros()).relative_error(&sum) < 1e-15);
        for k in 0..18 {
            let mut other = own;
            other[k] += 0.1;
            let stiffer = turned(&sum, &fabric, &other).mandel() - relaxed.mandel();
            assert!(stiffer.symmetric_eigenvalues().min() > -1e-14 && stiffer.norm() > 1e-4);
        }
    }
}
