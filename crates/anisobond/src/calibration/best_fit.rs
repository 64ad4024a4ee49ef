//! The best-fit estimate of a lattice's stiffness (Liao, Chang, Young & Chang, Int. J. Solids Struct. 34, 1997).

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::lattice_stiffness::LatticeStiffness;
use crate::lattice::Lattice;
use crate::tensor::{PAIRS, Stiffness, mandel_weight};
use crate::{Error, Result};

/// The stiffness (Pa) of a lattice by the best-fit (static) hypothesis, the companion of the Voigt sum from below.
///
/// The strain is the one that fits the relative displacements δ of all bonds best (least Σ|δ − ε·l|²):
/// ε_ij = (1/V) Σ δ_i A_jk l_k with A = ((1/V) Σ l⊗l)⁻¹. Its dual are the forces f = σ·A·l, whose mean (1/V) Σ f⊗l is
/// σ; every bond answers δ = (n⊗n/k_n + (I − n⊗n)/k_t)·f. Together
///
/// S_ijmq = sym (1/V) Σ (n⊗n/k_n + (I − n⊗n)/k_t)_im (A l)_j (A l)_q, and C = S⁻¹.
///
/// It is never above the Voigt sum: of all forces with mean σ, Voigt's have the least complementary energy. It is a
/// lower bound of the true stiffness where f balances at every node (a lattice of one sphere per cell); elsewhere an
/// estimate, dominated by the most compliant bonds.
///
/// # Errors
/// A bond without stiffness (its compliance is infinite and the estimate zero); bonds that do not span three directions.
pub fn best_fit_stiffness(lattice: &Lattice, stiffness: &LatticeStiffness) -> Result<Stiffness> {
    let fabric: Matrix3<f64> =
        lattice.contacts.iter().map(|c| c.branch * c.branch.transpose()).sum::<Matrix3<f64>>() / lattice.volume;
    let flat = || Error::mechanism("the bonds do not span three directions", "give a larger contact radius");
    let scale = fabric.amax();
    let a = (fabric / scale).try_inverse().ok_or_else(flat)? / scale;
    if !a.iter().all(|x| x.is_finite()) {
        return Err(flat());
    }
    let mut compliance = Matrix6::zeros();
    for ((c, kn), kt) in lattice.contacts.iter().zip(&stiffness.normal).zip(&stiffness.tangential) {
        if !(*kn > 0.0 && *kt > 0.0) {
            return Err(Error::input(
                format!("the bond between spheres {} and {} has k_n = {kn} and k_t = {kt} N/m", c.a + 1, c.b + 1),
                "the best-fit estimate needs bonds that are stiff in every direction: give positive moduli",
            ));
        }
        let n = c.branch.normalize();
        let nn = n * n.transpose();
        compliance += bond_compliance(&(nn / *kn + (Matrix3::identity() - nn) / *kt), &(a * c.branch));
    }
    let compliance = Stiffness::from_mandel(compliance / lattice.volume);
    compliance.compliance().map(Stiffness::from_mandel).ok_or_else(flat)
}

/// Kelvin-Mandel matrix of d_im g_j g_q with minor symmetries, so that σ:S:σ = (σg)·d·(σg).
fn bond_compliance(d: &Matrix3<f64>, g: &Vector3<f64>) -> Matrix6<f64> {
    Matrix6::from_fn(|a, b| {
        let ((i, j), (m, q)) = (PAIRS[a], PAIRS[b]);
        let sum = d[(i, m)] * g[j] * g[q] + d[(j, m)] * g[i] * g[q] + d[(i, q)] * g[j] * g[m] + d[(j, q)] * g[i] * g[m];
        0.25 * sum * mandel_weight(a) * mandel_weight(b)
    })
}
