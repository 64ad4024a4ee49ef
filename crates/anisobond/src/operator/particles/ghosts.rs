//! Periodic images: a bond that crosses the cell's face joins a copy of its end, kept behind the particles' own poses.

use std::collections::HashMap;

use nalgebra::Matrix3;

use super::model::image_shift;
use super::pose::Pose;

/// The copies that bonds ask for.
#[derive(Clone, Debug, Default)]
pub(super) struct Ghosts {
    /// Whose copy, and of which image.
    of: Vec<(u32, [i32; 3])>,
    number: HashMap<(u32, [i32; 3]), u32>,
}

impl Ghosts {
    /// Index among all poses of image s of a particle: the particle itself for the cell's own, else a copy, made if it
    /// is new. `particles` is their number.
    pub(super) fn index(&mut self, particle: u32, image: [i32; 3], particles: usize) -> u32 {
        if image == [0; 3] {
            return particle;
        }
        let of = &mut self.of;
        *self.number.entry((particle, image)).or_insert_with(|| {
            of.push((particle, image));
            (particles + of.len() - 1) as u32
        })
    }

    /// Number of copies.
    pub(super) fn len(&self) -> usize {
        self.of.len()
    }

    /// Refresh all copies behind the particles: u + (H − H₀) s, same turn.
    pub(super) fn refresh(&self, poses: &mut [Pose], particles: usize, change: &Matrix3<f64>) {
        let (own, copies) = poses.split_at_mut(particles);
        for (copy, (of, image)) in copies.iter_mut().zip(&self.of) {
            *copy = own[*of as usize];
            copy.shift(&image_shift(change, *image));
        }
    }
}
