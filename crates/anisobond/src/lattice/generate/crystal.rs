//! Crystalline packings of equal, touching spheres.

use nalgebra::Vector3;

use super::stream::Stream;
use crate::lattice::Packing;
use crate::{Error, Result};

/// More spheres than this are refused before memory is taken.
const MOST_SPHERES: f64 = 1e9;

/// A crystal of equal spheres that touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crystal {
    /// Simple cubic: 6 contacts, porosity 1 − π/6.
    Sc,
    /// Body-centred cubic: 8 contacts, porosity 1 − √3 π/8.
    Bcc,
    /// Face-centred cubic: 12 contacts, porosity 1 − π/√18.
    Fcc,
    /// Hexagonal close-packed, c along z, in its orthogonal cell of four spheres: 12 contacts, porosity 1 − π/√18.
    Hcp,
}

impl Crystal {
    /// Edges of the unit cell in radii.
    pub fn cell(self) -> [f64; 3] {
        match self {
            Crystal::Sc => [2.0; 3],
            Crystal::Bcc => [4.0 / 3f64.sqrt(); 3],
            Crystal::Fcc => [8f64.sqrt(); 3],
            Crystal::Hcp => [2.0, 12f64.sqrt(), (32.0 / 3f64).sqrt()],
        }
    }

    /// Spheres of the unit cell, in parts of its edges.
    fn sites(self) -> &'static [[f64; 3]] {
        match self {
            Crystal::Sc => &[[0.0; 3]],
            Crystal::Bcc => &[[0.0; 3], [0.5; 3]],
            Crystal::Fcc => &[[0.0; 3], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [0.5, 0.5, 0.0]],
            Crystal::Hcp => &[[0.0; 3], [0.5, 0.5, 0.0], [0.5, 5.0 / 6.0, 0.5], [0.0, 1.0 / 3.0, 0.5]],
        }
    }
}

/// A periodic crystal of touching spheres of a radius (m), so many unit cells along x, y, z. Each coordinate of each centre
/// is moved by up to `perturbation` radii either way, drawn from the stream of `seed`; perturbed spheres may overlap.
///
/// # Errors
/// A radius that is not positive, no cells or too many, a perturbation that is negative or not finite.
pub fn crystal(kind: Crystal, radius: f64, cells: [usize; 3], perturbation: f64, seed: u64) -> Result<Packing> {
    if !(radius.is_finite() && radius > 0.0) {
        return Err(Error::input(format!("the radius is {radius} m"), "give a positive length"));
    }
    if !(perturbation.is_finite() && perturbation >= 0.0) {
        return Err(Error::input(
            format!("the perturbation is {perturbation} radii"),
            "give a number ≥ 0, such as 0.05",
        ));
    }
    let number = cells.iter().map(|&n| n as f64).product::<f64>() * kind.sites().len() as f64;
    if !(1.0..=MOST_SPHERES).contains(&number) {
        let [x, y, z] = cells;
        return Err(Error::input(
            format!("{x} × {y} × {z} cells hold {number} spheres"),
            "give between 1 and 1e9 spheres",
        ));
    }
    let mut stream = Stream::new(seed);
    let unit = radius * Vector3::from(kind.cell());
    let mut centres = Vec::with_capacity(number as usize);
    for k in 0..cells[2] {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                for site in kind.sites() {
                    let corner = Vector3::new(i as f64, j as f64, k as f64);
                    let noise = Vector3::from_fn(|_, _| perturbation * radius * stream.signed());
                    centres.push(unit.component_mul(&(corner + Vector3::from(*site))) + noise);
                }
            }
        }
    }
    let cell = unit.component_mul(&Vector3::from(cells.map(|n| n as f64)));
    let radii = vec![radius; centres.len()];
    Packing::new(Some(cell), centres, radii)
}
