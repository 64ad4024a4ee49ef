//! Larger packings from a periodic one, and bodies cut out of packings.

use nalgebra::Vector3;

use super::contacts::Contact;
use super::parts::parts;
use super::{Lattice, Packing, Solid};
use crate::{Error, Result};

/// Spheres beyond this number are refused before memory is taken.
const MOST_SPHERES: f64 = 2e8;

impl Lattice {
    /// This periodic lattice repeated n₁ × n₂ × n₃ times, still periodic. Bonds across the cell's faces join neighbouring
    /// copies; spheres of copy (i, j, k) follow those of the copy before, i fastest.
    ///
    /// # Errors
    /// A free lattice; a count of zero; more spheres than memory holds.
    pub fn tiled(&self, copies: [usize; 3]) -> Result<Lattice> {
        let Some(edges) = self.packing.cell() else {
            return Err(Error::input("a free packing cannot be tiled", "give a periodic packing"));
        };
        let count = copies.iter().map(|&n| n as f64).product::<f64>();
        if count < 1.0 || count * self.packing.len() as f64 > MOST_SPHERES {
            return Err(Error::input(
                format!("{} × {} × {} copies of {} spheres", copies[0], copies[1], copies[2], self.packing.len()),
                format!("give counts of at least 1 and at most {MOST_SPHERES:e} spheres"),
            ));
        }
        let spheres = self.packing.len();
        let number = |at: [usize; 3]| (at[2] * copies[1] + at[1]) * copies[0] + at[0];
        let places = || {
            (0..copies[2]).flat_map(move |k| (0..copies[1]).flat_map(move |j| (0..copies[0]).map(move |i| [i, j, k])))
        };
        let centres = places().flat_map(|at| {
            let shift = edges.component_mul(&Vector3::from(at.map(|i| i as f64)));
            self.packing.centres().iter().map(move |x| x + shift)
        });
        let radii = places().flat_map(|_| self.packing.radii().iter().copied());
        let cell = edges.component_mul(&Vector3::from(copies.map(|n| n as f64)));
        let packing = Packing::new(Some(cell), centres.collect(), radii.collect())?;
        let images: Vec<[i64; 3]> = self.contacts.iter().map(|c| self.image(c, &edges)).collect();
        let mut contacts = Vec::with_capacity(self.contacts.len() * copies.iter().product::<usize>());
        for at in places() {
            for (contact, image) in self.contacts.iter().zip(&images) {
                let to = std::array::from_fn(|i| (at[i] as i64 + image[i]).rem_euclid(copies[i] as i64) as usize);
                let a = (number(at) * spheres) as u32 + contact.a;
                let b = (number(to) * spheres) as u32 + contact.b;
                contacts.push(if a <= b {
                    Contact { a, b, branch: contact.branch }
                } else {
                    Contact { a: b, b: a, branch: -contact.branch }
                });
            }
        }
        contacts.sort_by_key(|c| (c.a, c.b));
        Ok(Lattice {
            packing,
            contact_radius: self.contact_radius,
            contacts,
            volume: self.volume * copies.iter().product::<usize>() as f64,
        })
    }

    /// Image of b that a contact leads to.
    fn image(&self, contact: &Contact, edges: &Vector3<f64>) -> [i64; 3] {
        let centres = self.packing.centres();
        let rest = contact.branch - (centres[contact.b as usize] - centres[contact.a as usize]);
        let s = rest.component_div(edges).map(f64::round);
        [s.x as i64, s.y as i64, s.z as i64]
    }

    /// The body of a lattice inside a solid: spheres whose centres are in it and the bonds between them. `periodic` keeps
    /// the cell and the bonds through its faces (a hole in a periodic body is cut so); otherwise the body is free and these
    /// bonds are cut. Only the largest part that hangs together is kept; the others are named.
    ///
    /// The volume is the solid's, estimated as the lattice's own times the share of all spheres' volume inside.
    ///
    /// # Errors
    /// No sphere inside; `periodic` for a free lattice.
    pub fn cut(&self, solid: &Solid, periodic: bool) -> Result<CutBody> {
        let centres = self.packing.centres();
        let inside: Vec<bool> = centres.iter().map(|x| solid.contains(x, 0.0)).collect();
        let edges = self.packing.cell();
        if periodic && edges.is_none() {
            return Err(Error::input("a free packing has no cell to keep", "cut a free body"));
        }
        let joins = |c: &Contact| {
            let through = !periodic && edges.is_some_and(|edges| self.image(c, &edges) != [0; 3]);
            inside[c.a as usize] && inside[c.b as usize] && !through
        };
        let kept: Vec<&Contact> = self.contacts.iter().filter(|c| joins(c)).collect();
        let part = parts(centres.len(), kept.iter().map(|c| (c.a, c.b)));
        let mut size = vec![0usize; centres.len()];
        (0..centres.len()).filter(|&i| inside[i]).for_each(|i| size[part[i] as usize] += 1);
        let largest = (0..size.len()).max_by_key(|&r| (size[r], std::cmp::Reverse(r))).filter(|&r| size[r] > 0);
        let Some(largest) = largest else {
            return Err(Error::input("the body holds no sphere", "give a solid that overlaps the packing"));
        };
        let stays = |i: usize| inside[i] && part[i] as usize == largest;
        let sphere: Vec<u32> = (0..centres.len()).filter(|&i| stays(i)).map(|i| i as u32).collect();
        let floaters = (0..centres.len()).filter(|&i| inside[i] && !stays(i)).map(|i| i as u32).collect();
        let mut number = vec![u32::MAX; centres.len()];
        sphere.iter().enumerate().for_each(|(new, &old)| number[old as usize] = new as u32);
        let radii = self.packing.radii();
        let packing = Packing::new(
            edges.filter(|_| periodic),
            sphere.iter().map(|&i| centres[i as usize]).collect(),
            sphere.iter().map(|&i| radii[i as usize]).collect(),
        )?;
        let contacts = kept
            .into_iter()
            .filter(|c| stays(c.a as usize))
            .map(|c| Contact { a: number[c.a as usize], b: number[c.b as usize], branch: c.branch })
            .collect();
        let solid_of = |r: &[f64]| r.iter().map(|r| r.powi(3)).sum::<f64>();
        let volume = self.volume * solid_of(packing.radii()) / solid_of(radii);
        let lattice = Lattice { packing, contact_radius: self.contact_radius, contacts, volume };
        Ok(CutBody { lattice, sphere, floaters })
    }
}

/// A body cut from a lattice.
#[derive(Clone, Debug)]
pub struct CutBody {
    /// Its spheres and bonds.
    pub lattice: Lattice,
    /// The sphere of the original lattice that each one is.
    pub sphere: Vec<u32>,
    /// Spheres of the original lattice that were inside but hung on no bond of the body: left out.
    pub floaters: Vec<u32>,
}
