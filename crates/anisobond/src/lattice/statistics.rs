//! What can be said of a packing and its contacts in a few numbers.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::contacts::{Contact, Lattice, contacts};
use super::packing::Packing;
use crate::Result;

/// A sphere held by forces along its bonds alone needs at least four of them.
const HOLDING_CONTACTS: u32 = 4;

/// Smallest, mean and largest of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Range {
    /// Smallest.
    pub least: f64,
    /// Mean over the spheres.
    pub mean: f64,
    /// Largest.
    pub most: f64,
}

/// A packing and its contacts in a few numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PackingStatistics {
    /// Number of spheres.
    pub number: usize,
    /// Edges of the cell (m); none for a free packing.
    pub cell: Option<[f64; 3]>,
    /// 1 − Σ (4/3) π r³ / V, exact where spheres do not overlap; none for a free packing.
    pub porosity: Option<f64>,
    /// Radii (m).
    pub radius: Range,
    /// Contact radius I_R of what follows.
    pub contact_radius: f64,
    /// Number of contacts, each pair and image once.
    pub contacts: usize,
    /// Contacts per sphere; a contact counts at both its spheres, so that the mean is 2 contacts / number.
    pub coordination: Range,
    /// How many spheres have 0, 1, 2, … contacts.
    pub coordination_histogram: Vec<usize>,
    /// Spheres with fewer than four contacts, which bonds without shear stiffness do not hold.
    pub floaters: usize,
    /// Fabric tensor F = ⟨n⊗n⟩ over the contacts (–); of trace 1, or zero without contacts.
    pub fabric: [[f64; 3]; 3],
    /// √(3/2) ‖F − I/3‖: 0 for isotropic contacts, 1 if all are parallel.
    pub fabric_deviation: f64,
    /// Largest overlap 1 − ℓ / (rₐ + r_b) of two spheres, 0 if none overlap.
    pub largest_overlap: f64,
}

impl Packing {
    /// Statistics of the packing with its contacts at a contact radius I_R.
    ///
    /// # Errors
    /// A contact radius that is not positive, or one that gives more contacts than memory holds.
    pub fn statistics(&self, contact_radius: f64) -> Result<PackingStatistics> {
        statistics(self, contact_radius, &contacts(self, contact_radius)?)
    }

    /// 1 − Σ (4/3) π r³ / V (–), exact where spheres do not overlap; `None` for a free packing.
    pub fn porosity(&self) -> Option<f64> {
        self.volume().map(|volume| 1.0 - self.solid_volume() / volume)
    }

    /// Σ (4/3) π r³ (m³).
    pub fn solid_volume(&self) -> f64 {
        4.0 / 3.0 * std::f64::consts::PI * self.radii().iter().map(|r| r.powi(3)).sum::<f64>()
    }
}

impl Lattice {
    /// Statistics of the packing with the lattice's contacts.
    ///
    /// # Errors
    /// None for a lattice as [`Lattice::new`] makes it.
    pub fn statistics(&self) -> Result<PackingStatistics> {
        statistics(&self.packing, self.contact_radius, &self.contacts)
    }

    /// Contacts of each sphere; one with its own image counts twice, for its two ends.
    pub fn coordination(&self) -> Vec<u32> {
        coordination(self.packing.len(), &self.contacts)
    }

    /// Spheres (from 0) with fewer than a number of contacts.
    pub fn floaters(&self, fewer_than: u32) -> Vec<usize> {
        let few = self.coordination().into_iter().enumerate().filter(|&(_, n)| n < fewer_than);
        few.map(|(sphere, _)| sphere).collect()
    }
}

fn statistics(packing: &Packing, contact_radius: f64, found: &[Contact]) -> Result<PackingStatistics> {
    let coordination = coordination(packing.len(), found);
    let most = coordination.iter().copied().max().unwrap_or(0);
    let mut histogram = vec![0; most as usize + 1];
    coordination.iter().for_each(|&n| histogram[n as usize] += 1);
    let fabric = fabric(found);
    // Overlapping pairs are contacts only where I_R ≥ 1.
    let overlap = if contact_radius >= 1.0 {
        largest_overlap(packing, found)
    } else {
        largest_overlap(packing, &contacts(packing, 1.0)?)
    };
    Ok(PackingStatistics {
        number: packing.len(),
        cell: packing.cell().map(Into::into),
        porosity: packing.porosity(),
        radius: range(packing.radii().iter().copied()),
        contact_radius,
        contacts: found.len(),
        coordination: range(coordination.iter().map(|&n| f64::from(n))),
        coordination_histogram: histogram,
        floaters: coordination.iter().filter(|&&n| n < HOLDING_CONTACTS).count(),
        fabric: fabric.transpose().into(),
        fabric_deviation: if found.is_empty() { 0.0 } else { deviation(&fabric) },
        largest_overlap: overlap,
    })
}

fn coordination(spheres: usize, contacts: &[Contact]) -> Vec<u32> {
    let mut count = vec![0; spheres];
    for c in contacts {
        count[c.a as usize] += 1;
        count[c.b as usize] += 1;
    }
    count
}

/// F = ⟨n⊗n⟩; a contact without length has no direction and does not count.
fn fabric(contacts: &[Contact]) -> Matrix3<f64> {
    let directions = || contacts.iter().filter_map(|c| c.branch.try_normalize(0.0));
    let sum = directions().fold(Matrix3::zeros(), |sum: Matrix3<f64>, n: Vector3<f64>| sum + n * n.transpose());
    sum / (directions().count().max(1) as f64)
}

/// √(3/2) ‖F − I/3‖.
fn deviation(fabric: &Matrix3<f64>) -> f64 {
    1.5f64.sqrt() * (fabric - Matrix3::identity() / 3.0).norm()
}

/// Largest 1 − ℓ / (rₐ + r_b), at least 0.
fn largest_overlap(packing: &Packing, contacts: &[Contact]) -> f64 {
    let radius = |sphere: u32| packing.radii()[sphere as usize];
    contacts.iter().map(|c| 1.0 - c.branch.norm() / (radius(c.a) + radius(c.b))).fold(0.0, f64::max)
}

fn range(values: impl Iterator<Item = f64> + Clone) -> Range {
    Range {
        least: values.clone().fold(f64::INFINITY, f64::min),
        mean: values.clone().sum::<f64>() / values.clone().count() as f64,
        most: values.fold(f64::NEG_INFINITY, f64::max),
    }
}
