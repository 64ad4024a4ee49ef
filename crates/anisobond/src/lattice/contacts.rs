//! Bonds of a packing: pairs of spheres within the contact radius.

use nalgebra::Vector3;

use super::packing::Packing;
use crate::{Error, Result};

/// A bond between two spheres, once per pair and periodic image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// One sphere.
    pub a: u32,
    /// The other; the same sphere when it touches its own periodic image.
    pub b: u32,
    /// Branch from a to that image of b (m); its length is the contact's length ℓ.
    pub branch: Vector3<f64>,
}

/// The lattice of a packing: nodes at the centres, bonds where ℓ ≤ I_R (rₐ + r_b) (S eq-IR).
#[derive(Clone, Debug)]
pub struct Lattice {
    /// The packing; its spheres are the nodes.
    pub packing: Packing,
    /// Contact radius I_R.
    pub contact_radius: f64,
    /// Every bond once, in the order of (a, b, image).
    pub contacts: Vec<Contact>,
    /// Volume that the bonds fill (m³): the cell, or what the caller says for a free packing.
    pub volume: f64,
}

/// A touching pair counts although rounding lengthens it by this share.
const TOUCHES: f64 = 1e-9;

/// The naive search, over all pairs and images: slow, obvious, the oracle of the fast one.
///
/// # Errors
/// A contact radius that is not positive and finite.
pub fn naive_contacts(packing: &Packing, contact_radius: f64) -> Result<Vec<Contact>> {
    if !(contact_radius.is_finite() && contact_radius > 0.0) {
        return Err(Error::input(format!("the contact radius I_R is {contact_radius}"), "give a positive number"));
    }
    let largest = packing.radii().iter().copied().fold(0.0, f64::max);
    let reach = 2.0 * largest * contact_radius * (1.0 + TOUCHES);
    let images = packing.cell().map_or([0; 3], |e| std::array::from_fn(|i| (reach / e[i]).ceil() as i32));
    let edges = packing.cell().unwrap_or_else(Vector3::zeros);
    let mut contacts = Vec::new();
    for a in 0..packing.len() {
        for b in a..packing.len() {
            for k in -images[2]..=images[2] {
                for j in -images[1]..=images[1] {
                    for i in -images[0]..=images[0] {
                        // A sphere and its own images: one of ± only.
                        if a == b && (k, j, i) <= (0, 0, 0) {
                            continue;
                        }
                        let shift = edges.component_mul(&Vector3::new(i, j, k).cast());
                        let branch = packing.centres()[b] - packing.centres()[a] + shift;
                        let limit = contact_radius * (packing.radii()[a] + packing.radii()[b]) * (1.0 + TOUCHES);
                        if branch.norm_squared() <= limit * limit {
                            contacts.push(Contact { a: a as u32, b: b as u32, branch });
                        }
                    }
                }
            }
        }
    }
    Ok(contacts)
}

impl Lattice {
    /// The lattice of a periodic packing at a contact radius I_R.
    ///
    /// # Errors
    /// A packing without a cell, coincident centres, or a contact radius that is not positive.
    pub fn new(packing: Packing, contact_radius: f64) -> Result<Self> {
        let Some(edges) = packing.cell() else {
            return Err(Error::input("the packing has no periodic cell", "give a packing with a cell"));
        };
        let contacts = naive_contacts(&packing, contact_radius)?;
        if let Some(c) = contacts.iter().find(|c| c.branch.norm() == 0.0) {
            return Err(Error::input(
                format!("spheres {} and {} have the same centre", c.a + 1, c.b + 1),
                "remove one of them",
            ));
        }
        let volume = edges.product();
        Ok(Lattice { packing, contact_radius, contacts, volume })
    }
}
