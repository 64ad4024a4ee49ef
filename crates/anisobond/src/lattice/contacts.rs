//! Bonds of a packing: pairs of spheres within the contact radius.

use nalgebra::Vector3;

use super::packing::Packing;
use super::search::{extent, search};
use crate::{Error, Result};

/// A bond between two spheres, once per pair and periodic image; 32 bytes.
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
///
/// Memory: 32 bytes per contact and 32 per sphere; while contacts are searched, twice that.
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

/// Centres nearer than this share of the sum of radii are the same: a bond needs a direction.
const SAME_CENTRE: f64 = 1e-9;

/// More contacts than this are refused before memory is taken (32 GB).
const MOST_CONTACTS: f64 = 1e9;

/// More images of spheres than this are not searched.
const MOST_IMAGES: f64 = 1e8;

/// Largest length (m) of a bond between spheres of this sum of radii (m). Whether a pair on the border is bonded is
/// decided here and nowhere else.
pub(super) fn touching_distance(contact_radius: f64, sum_of_radii: f64) -> f64 {
    contact_radius * sum_of_radii * (1.0 + TOUCHES)
}

/// The contacts of a packing, ℓ ≤ I_R (rₐ + r_b), each once and in the order of (a, b, image); the same as
/// [`naive_contacts`] to the last bit, for any number of threads. Coincident centres are contacts of length zero.
///
/// # Errors
/// A contact radius that is not positive and finite, or one that gives more contacts than memory holds.
pub fn contacts(packing: &Packing, contact_radius: f64) -> Result<Vec<Contact>> {
    check_contact_radius(contact_radius)?;
    let expected = expected_contacts(packing, contact_radius);
    if expected.is_nan() || expected > MOST_CONTACTS || packing.len() > u32::MAX as usize {
        let problem = format!("contact radius {contact_radius} gives about {expected:.1e} contacts");
        return Err(Error::input(
            format!("{problem} for {} spheres", packing.len()),
            "reduce the contact radius I_R (1 to 3 is usual) or check the units of cell and radii",
        ));
    }
    let images = images_in_reach(packing, contact_radius);
    if images * packing.len() as f64 > MOST_IMAGES {
        return Err(Error::input(
            format!("the cell is so small that a bond may reach {images:.1e} of its images"),
            "check the units of cell and radii, or reduce the contact radius I_R (1 to 3 is usual)",
        ));
    }
    Ok(search(packing, contact_radius))
}

fn check_contact_radius(contact_radius: f64) -> Result<()> {
    if contact_radius.is_finite() && contact_radius > 0.0 {
        return Ok(());
    }
    Err(Error::input(format!("the contact radius I_R is {contact_radius}"), "give a positive number"))
}

/// Contacts of spheres that lie independently of each other: ½ N² (4π/3) I_R³ ⟨(rₐ + r_b)³⟩ / V.
fn expected_contacts(packing: &Packing, contact_radius: f64) -> f64 {
    let number = packing.len() as f64;
    let moment = |power: i32| packing.radii().iter().map(|r| r.powi(power)).sum::<f64>() / number;
    let cube = 2.0 * moment(3) + 6.0 * moment(2) * moment(1);
    let pairs = 0.5 * number * number;
    let share = 4.0 / 3.0 * std::f64::consts::PI * contact_radius.powi(3) * cube / extent(packing).edges.product();
    // Free spheres have no images.
    if packing.cell().is_some() { pairs * share } else { pairs * share.min(1.0) }
}

/// Images of the cell that the longest bond may reach.
fn images_in_reach(packing: &Packing, contact_radius: f64) -> f64 {
    let largest = packing.radii().iter().copied().fold(0.0, f64::max);
    let reach = touching_distance(contact_radius, 2.0 * largest);
    packing.cell().map_or(1.0, |edges| edges.iter().map(|edge| (2.0 * reach / edge).max(1.0)).product())
}

/// The naive search, over all pairs and images: slow, obvious, the oracle of the fast one.
///
/// # Errors
/// A contact radius that is not positive and finite.
pub fn naive_contacts(packing: &Packing, contact_radius: f64) -> Result<Vec<Contact>> {
    check_contact_radius(contact_radius)?;
    let largest = packing.radii().iter().copied().fold(0.0, f64::max);
    let reach = touching_distance(contact_radius, 2.0 * largest);
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
                        let limit = touching_distance(contact_radius, packing.radii()[a] + packing.radii()[b]);
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
    /// The lattice of a periodic packing at a contact radius I_R. Overlapping spheres are welcome.
    ///
    /// # Errors
    /// A packing without a cell, coincident centres, or a contact radius that is not positive.
    pub fn new(packing: Packing, contact_radius: f64) -> Result<Self> {
        let Some(volume) = packing.volume() else {
            return Err(Error::input(
                "the packing has no periodic cell",
                "give the edges of its cell (in a file: a first line ##PERIODIC:: a b c), or the volume of a free lattice",
            ));
        };
        Lattice::with_volume(packing, contact_radius, volume)
    }

    /// The lattice of a free packing whose bonds fill a volume (m³).
    ///
    /// # Errors
    /// A packing with a cell (its volume is known), coincident centres, a contact radius or volume that is not positive.
    pub fn free(packing: Packing, contact_radius: f64, volume: f64) -> Result<Self> {
        if packing.cell().is_some() {
            return Err(Error::input("a packing with a periodic cell is not free", "use the periodic lattice"));
        }
        if !(volume.is_finite() && volume > 0.0) {
            return Err(Error::input(format!("the volume of the lattice is {volume} m³"), "give a positive volume"));
        }
        Lattice::with_volume(packing, contact_radius, volume)
    }

    fn with_volume(packing: Packing, contact_radius: f64, volume: f64) -> Result<Self> {
        let contacts = contacts(&packing, contact_radius)?;
        refuse_coincident(&packing, &contacts)?;
        Ok(Lattice { packing, contact_radius, contacts, volume })
    }
}

/// A bond without length has no direction.
fn refuse_coincident(packing: &Packing, contacts: &[Contact]) -> Result<()> {
    let radius = |sphere: u32| packing.radii()[sphere as usize];
    let coincident = |c: &&Contact| c.branch.norm() <= SAME_CENTRE * (radius(c.a) + radius(c.b));
    match contacts.iter().find(coincident) {
        None => Ok(()),
        Some(c) if c.a == c.b => Err(Error::input(
            format!("the cell is so small that sphere {} coincides with its own image", c.a + 1),
            "check the units of the cell and the radii",
        )),
        Some(c) => {
            let at = packing.centres()[c.a as usize];
            Err(Error::input(
                format!("spheres {} and {} have the same centre ({}, {}, {}) m", c.a + 1, c.b + 1, at.x, at.y, at.z),
                "remove one of them",
            ))
        }
    }
}
