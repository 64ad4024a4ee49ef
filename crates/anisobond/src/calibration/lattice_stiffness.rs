//! Microplane moduli put on the bonds of a packing (S, "Lattice stiffness tensor").

use nalgebra::Matrix6;

use super::microplane::{DirectionModuli, normal_projection, tangential_projection};
use crate::lattice::{Contact, Lattice};
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// π̂ of S: the fictitious cross-section of a bond is π̂ r².
pub const PI_HAT: f64 = std::f64::consts::PI;

/// The smaller radius r = min(rₐ, r_b) (m) of a contact.
fn radius(lattice: &Lattice, c: &Contact) -> f64 {
    let radii = lattice.packing.radii();
    radii[c.a as usize].min(radii[c.b as usize])
}

/// μ = (π̂/3V) Σ r′ r², r′ = ℓ/2, every contact once (S eq-mu): lattice moduli are E′ = E/μ.
pub fn lattice_mu(lattice: &Lattice) -> f64 {
    let sum: f64 = lattice.contacts.iter().map(|c| 0.5 * c.branch.norm() * radius(lattice, c).powi(2)).sum();
    PI_HAT * sum / (3.0 * lattice.volume)
}

/// The stiffnesses of a lattice's bonds.
#[derive(Clone, Debug)]
pub struct LatticeStiffness {
    /// μ = E/E′, dimensionless.
    pub mu: f64,
    /// k_n (N/m), one per contact, in the lattice's order.
    pub normal: Vec<f64>,
    /// k_t (N/m), one per contact.
    pub tangential: Vec<f64>,
}

impl LatticeStiffness {
    /// k_n = E_N′ π̂ r²/ℓ, k_t = E_T′ π̂ r²/ℓ (S eq-kn-En) with E′ = E/μ, from microplane moduli E (Pa).
    ///
    /// # Errors
    /// A lattice without contacts; a modulus that is negative or not finite in the direction of a bond.
    pub fn new(lattice: &Lattice, microplane: &impl DirectionModuli) -> Result<Self> {
        if lattice.contacts.is_empty() {
            return Err(Error::mechanism(
                format!("the lattice has no bonds at contact radius {}", lattice.contact_radius),
                "give a larger contact radius",
            ));
        }
        let mu = lattice_mu(lattice);
        let (mut normal, mut tangential) = (Vec::new(), Vec::new());
        for c in &lattice.contacts {
            let length = c.branch.norm();
            let n = c.branch / length;
            let (en, et) = microplane.moduli(&n);
            for (name, e) in [("E_N", en), ("E_T", et)] {
                if !(e.is_finite() && e >= 0.0) {
                    return Err(Error::input(
                        format!("{name} is {e} Pa in the direction ({:.4}, {:.4}, {:.4})", n.x, n.y, n.z),
                        "give moduli that are finite and not negative in every direction",
                    ));
                }
            }
            let share = PI_HAT * radius(lattice, c).powi(2) / (length * mu);
            normal.push(en * share);
            tangential.push(et * share);
        }
        Ok(LatticeStiffness { mu, normal, tangential })
    }

    /// C = (1/V) Σ ℓ² (k_n N + k_t T) (Pa) (S eq-tE-knkt): the stiffness if every node followed the mean strain and no
    /// node rotated against it (Voigt's hypothesis), an upper bound of the measured one.
    pub fn summed(&self, lattice: &Lattice) -> Stiffness {
        let mut sum = Matrix6::zeros();
        for ((c, kn), kt) in lattice.contacts.iter().zip(&self.normal).zip(&self.tangential) {
            let square = c.branch.norm_squared();
            let n = c.branch / square.sqrt();
            sum += square * (*kn * normal_projection(&n) + *kt * tangential_projection(&n));
        }
        Stiffness::from_mandel(sum / lattice.volume)
    }
}
