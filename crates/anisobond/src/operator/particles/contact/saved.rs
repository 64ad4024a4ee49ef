//! Contacts as plain arrays.

use nalgebra::{Matrix3, Vector3};

use super::{Contacts, Near, TouchingPair};
use crate::Result;
use crate::operator::particles::system::{Snapshot, flat, vectors};

/// A pair as words.
fn words(a: u32, b: u32, image: [i32; 3]) -> [u64; 5] {
    let [i, j, k] = image.map(|s| i64::from(s) as u64);
    [u64::from(a), u64::from(b), i, j, k]
}

/// The pair of its words.
fn pair([a, b, i, j, k]: [u64; 5]) -> (u32, u32, [i32; 3]) {
    (a as u32, b as u32, [i, j, k].map(|s| s as i64 as i32))
}

impl Contacts {
    /// Put the state into a snapshot.
    pub(in crate::operator::particles) fn keep(&self, to: &mut Snapshot) {
        let mut nearer: Vec<_> = self.nearer.iter().collect();
        nearer.sort_by_key(|(pair, _)| **pair);
        let pairs = |name: &str, words: Vec<u64>| (format!("{name}_pairs"), words);
        to.words.push(pairs("near", self.near.iter().flat_map(|n| words(n.a, n.b, n.image)).collect()));
        to.words.push(pairs("touching", self.touching.iter().flat_map(|t| words(t.a, t.b, t.image)).collect()));
        to.words.push(pairs("nearer", nearer.iter().flat_map(|((a, b, image), _)| words(*a, *b, *image)).collect()));
        to.words.push(("contact_lists".into(), vec![self.lists as u64]));
        let touching = self.touching.iter().flat_map(|t| {
            let [n, s, f] = [t.normal, t.shear, t.force];
            [t.touch, n.x, n.y, n.z, s.x, s.y, s.z, f.x, f.y, f.z]
        });
        to.numbers.push(("touching".into(), touching.collect()));
        to.numbers.push(("nearer".into(), nearer.iter().map(|(_, touch)| **touch).collect()));
        to.numbers.push(("listed_at".into(), flat(&self.listed_at)));
        let cell = self.listed_cell.map_or(Vec::new(), |h| h.iter().copied().collect());
        to.numbers.push(("listed_cell".into(), cell));
        to.numbers.push(("friction_loss".into(), vec![self.friction]));
    }

    /// Take the state from a snapshot of so many spheres.
    pub(in crate::operator::particles) fn go_on(&mut self, from: &mut Snapshot, spheres: usize) -> Result<()> {
        let fives = |words: Vec<u64>| words.as_chunks::<5>().0.iter().map(|w| pair(*w)).collect::<Vec<_>>();
        let near = fives(from.take_words("near_pairs", None)?);
        let keys = fives(from.take_words("touching_pairs", None)?);
        let nearer = fives(from.take_words("nearer_pairs", None)?);
        let lists = from.take_words("contact_lists", Some(1))?;
        let touching = from.take_numbers("touching", Some(10 * keys.len()))?;
        let touch = from.take_numbers("nearer", Some(nearer.len()))?;
        let listed_at = vectors(&from.take_numbers("listed_at", None)?);
        let cell = from.take_numbers("listed_cell", None)?;
        let friction = from.take_numbers("friction_loss", Some(1))?;
        let all = near.iter().chain(&keys).chain(&nearer);
        if all.clone().any(|(a, b, _)| *a as usize >= spheres || *b as usize >= spheres) {
            return Err(crate::Error::input(
                "the saved contacts are of spheres that do not exist",
                "resume with the case that they were saved from, or start anew",
            ));
        }
        self.near = near.into_iter().map(|(a, b, image)| Near { a, b, image }).collect();
        let pairs = keys.into_iter().zip(touching.as_chunks::<10>().0);
        self.touching = pairs
            .map(|((a, b, image), t)| TouchingPair {
                a,
                b,
                image,
                touch: t[0],
                normal: Vector3::new(t[1], t[2], t[3]),
                shear: Vector3::new(t[4], t[5], t[6]),
                force: Vector3::new(t[7], t[8], t[9]),
            })
            .collect();
        self.nearer = nearer.into_iter().zip(touch).collect();
        self.listed_at = listed_at;
        self.listed_cell = (cell.len() == 9).then(|| Matrix3::from_column_slice(&cell));
        self.lists = lists[0] as usize;
        self.friction = friction[0];
        Ok(())
    }
}
