//! Periodic images: a bond that crosses the cell's face joins a copy of its end, kept behind the particles' own poses.

use std::collections::HashMap;

use nalgebra::{Matrix3, Vector3};

use super::pose::Pose;

/// The way from a particle to the image that a bond leads to, at the start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Image {
    /// What tells images apart; zero for the particle itself.
    pub key: [i64; 3],
    /// H₀ s (m).
    pub shift: Vector3<f64>,
}

impl Image {
    /// The image on the other side.
    pub(super) fn back(&self) -> Image {
        Image { key: self.key.map(|k| -k), shift: -self.shift }
    }
}

/// The copies that bonds ask for.
#[derive(Clone, Debug, Default)]
pub(super) struct Ghosts {
    /// Whose copy, and where from it.
    of: Vec<(u32, Vector3<f64>)>,
    number: HashMap<(u32, [i64; 3]), u32>,
}

impl Ghosts {
    /// Index among all poses of an image of a particle: the particle itself for the cell's own, else a copy, made if it
    /// is new. `particles` is their number.
    pub(super) fn index(&mut self, particle: u32, image: &Image, particles: usize) -> u32 {
        if image.key == [0; 3] {
            return particle;
        }
        let of = &mut self.of;
        *self.number.entry((particle, image.key)).or_insert_with(|| {
            of.push((particle, image.shift));
            (particles + of.len() - 1) as u32
        })
    }

    /// Number of copies.
    pub(super) fn len(&self) -> usize {
        self.of.len()
    }

    /// Refresh all copies behind the particles: u + (F − I) H₀ s, same turn.
    pub(super) fn refresh(&self, poses: &mut [Pose], particles: usize, change: &Matrix3<f64>) {
        let (own, copies) = poses.split_at_mut(particles);
        for (copy, (of, shift)) in copies.iter_mut().zip(&self.of) {
            *copy = own[*of as usize];
            copy.shift(&(change * shift));
        }
    }
}
