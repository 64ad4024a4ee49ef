//! The picture of a lattice on a packing: spheres coloured by the mean stiffness of their bonds, or the bonds themselves.

use nalgebra::Vector3;

use super::numbers::{length, significant};
use super::scene::{Ball, Rod, Scalar, Scene, View};
use anisobond::lattice::Lattice;
use anisobond::{Error, Result};

/// Radius of a bond's rod and of a node, in radii of the smallest sphere.
const ROD: f64 = 0.055;
const NODE: f64 = 0.14;

/// What the picture of a lattice shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LatticeView {
    /// The spheres, coloured by the mean of their bonds.
    Spheres,
    /// The bonds, coloured each by its own value; those that leave the periodic cell go half-way on both sides.
    Bonds,
}

/// The lattice along x with z upwards, and from in front, the right and above. `values` has one number per contact, such
/// as k_n (N/m); `scalar` names it.
///
/// # Errors
/// Another number of values than contacts, or one that is not finite.
pub fn lattice_scene(
    lattice: &Lattice,
    values: &[f64],
    scalar: Scalar,
    title: &str,
    what: LatticeView,
) -> Result<Scene> {
    if values.len() != lattice.contacts.len() {
        return Err(Error::input(
            format!("{} values for {} bonds", values.len(), lattice.contacts.len()),
            "give one value per bond",
        ));
    }
    let scene = match what {
        LatticeView::Spheres => Scene::new(spheres(lattice, values), scalar)?,
        LatticeView::Bonds => Scene::new(nodes(lattice), scalar)?.with_rods(rods(lattice, values))?,
    };
    let views = vec![View::along_x().captioned("along x"), View::whole().captioned("oblique")];
    scene.titled(title, subtitle(lattice)).viewed(views)
}

/// Spheres with the mean of their bonds; those without a bond are dark.
fn spheres(lattice: &Lattice, values: &[f64]) -> Vec<Ball> {
    let mut sums = vec![(0.0, 0_u32); lattice.packing.len()];
    for (contact, value) in lattice.contacts.iter().zip(values) {
        for end in [contact.a, contact.b] {
            if let Some((sum, count)) = sums.get_mut(end as usize) {
                *sum += value;
                *count += 1;
            }
        }
    }
    let packing = &lattice.packing;
    let bodies = packing.centres().iter().zip(packing.radii()).zip(sums);
    bodies
        .map(|((&centre, &radius), (sum, count))| Ball {
            centre,
            radius,
            value: (count > 0).then(|| sum / f64::from(count)),
        })
        .collect()
}

fn smallest(lattice: &Lattice) -> f64 {
    lattice.packing.radii().iter().copied().fold(f64::INFINITY, f64::min)
}

fn nodes(lattice: &Lattice) -> Vec<Ball> {
    let radius = NODE * smallest(lattice);
    lattice.packing.centres().iter().map(|&centre| Ball { centre, radius, value: None }).collect()
}

fn rods(lattice: &Lattice, values: &[f64]) -> Vec<Rod> {
    let radius = ROD * smallest(lattice);
    let centre = |index: u32| lattice.packing.centres().get(index as usize).copied().unwrap_or_else(Vector3::zeros);
    let mut rods = Vec::with_capacity(values.len());
    for (contact, &value) in lattice.contacts.iter().zip(values) {
        let (a, b) = (centre(contact.a), centre(contact.b));
        let (from_a, from_b) = (a + contact.branch, b - contact.branch);
        if (from_a - b).norm() <= 1e-9 * contact.branch.norm() {
            rods.push(Rod { ends: [a, b], radius, value });
        } else {
            rods.push(Rod { ends: [a, 0.5 * (a + from_a)], radius, value });
            rods.push(Rod { ends: [b, 0.5 * (b + from_b)], radius, value });
        }
    }
    rods
}

/// "2556 spheres · contact radius I_R = 1.8 · 28678 bonds, 22.4 per sphere · cubic cell 0.821373 m".
fn subtitle(lattice: &Lattice) -> String {
    let (spheres, bonds) = (lattice.packing.len(), lattice.contacts.len());
    let cell = match lattice.packing.cell() {
        Some(cell) if cell.max() - cell.min() <= 1e-9 * cell.max() => format!(" · cubic cell {}", length(cell.x)),
        Some(cell) => format!(" · cell {} × {} × {}", length(cell.x), length(cell.y), length(cell.z)),
        None => String::new(),
    };
    format!(
        "{spheres} spheres · contact radius I_R = {} · {bonds} bonds, {} per sphere{cell}",
        significant(lattice.contact_radius, 4),
        significant(2.0 * bonds as f64 / spheres as f64, 3)
    )
}
