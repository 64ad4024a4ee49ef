//! A packing, a material and a contact radius: the lattice they make, and its stiffness prescribed, summed and measured.

use nalgebra::{Rotation3, Vector3};

use crate::Result;
use crate::calibration::{EllipticFit, EllipticModuli, LatticeStiffness, best_fit_stiffness, unit_axis};
use crate::lattice::{Lattice, Packing};
use crate::operator::Network;
use crate::tensor::{SYMMETRY_TOLERANCE, Stiffness, SymmetryClass};

/// A lattice with the stiffnesses that S assigns to its bonds.
#[derive(Clone, Debug)]
pub struct LatticeStudy {
    /// The packing's lattice.
    pub lattice: Lattice,
    /// The material as elliptic microplane moduli about its axis; the prescribed tensor.
    pub fit: EllipticFit,
    /// k_n and k_t of every contact.
    pub stiffness: LatticeStiffness,
}

impl LatticeStudy {
    /// The lattice of a periodic packing at contact radius I_R, for a stiffness transversely isotropic about an axis.
    ///
    /// # Errors
    /// A lattice that cannot be made ([`Lattice::new`]) or moduli that are not admissible
    /// ([`EllipticModuli::admissible`]).
    pub fn new(packing: Packing, target: &Stiffness, axis: &Vector3<f64>, contact_radius: f64) -> Result<Self> {
        let fit = EllipticFit::new(target, axis)?;
        let lattice = Lattice::new(packing, contact_radius)?;
        let stiffness = LatticeStiffness::new(&lattice, &fit.microplane)?;
        Ok(LatticeStudy { lattice, fit, stiffness })
    }

    /// Lattice moduli E′ = E/μ (Pa) (S eq-Eelliptic-micro).
    pub fn lattice_moduli(&self) -> EllipticModuli {
        self.fit.microplane.moduli.scaled(1.0 / self.stiffness.mu)
    }

    /// The sum over bonds at uniform strain (Pa) (S eq-tE-knkt), an upper bound.
    pub fn summed(&self) -> Stiffness {
        self.stiffness.summed(&self.lattice)
    }

    /// The best-fit estimate (Pa), a lower companion.
    ///
    /// # Errors
    /// As [`best_fit_stiffness`].
    pub fn best_fit(&self) -> Result<Stiffness> {
        best_fit_stiffness(&self.lattice, &self.stiffness)
    }

    /// Nodes and stiff bonds.
    pub fn network(&self) -> Network {
        Network::new(&self.lattice, &self.stiffness)
    }
}

/// The tensor turned by the smallest rotation that takes its own anisotropy axis to a given one (any length but zero).
///
/// # Errors
/// An axis without direction.
pub fn turned_to_axis(c: &Stiffness, axis: &Vector3<f64>) -> Result<Stiffness> {
    let axis = unit_axis(axis)?;
    let own = anisotropy_axis(c);
    // An axis has no sign.
    let own = if own.dot(&axis) < 0.0 { -own } else { own };
    Ok(match Rotation3::rotation_between(&own, &axis) {
        Some(q) => c.rotated(q.matrix()),
        None => *c,
    })
}

/// The axis of a material: that of its closest transversely isotropic tensor; e₃ for an isotropic one.
pub fn anisotropy_axis(c: &Stiffness) -> Vector3<f64> {
    let symmetry = c.symmetry(SYMMETRY_TOLERANCE);
    if symmetry.fit(SymmetryClass::Isotropic).distance < 1e-12 {
        return Vector3::z();
    }
    symmetry.fit(SymmetryClass::TransverselyIsotropic).axes.column(2).into()
}
