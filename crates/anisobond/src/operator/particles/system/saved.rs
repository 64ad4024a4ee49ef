//! The state of spheres as plain arrays, to be kept and gone on with to the bit.

use nalgebra::{Matrix3, Vector3};

use super::Particles;
use crate::bond_law::BondState;
use crate::operator::particles::departed::Departed;
use crate::{Error, Result};

/// The arrays of a state by name, in the order of the places along the curve; nothing that the model says itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Arrays of numbers.
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Arrays of whole numbers and bits.
    pub words: Vec<(String, Vec<u64>)>,
}

impl Snapshot {
    /// An array of numbers, taken out; `length` where it is known.
    pub(in crate::operator::particles) fn take_numbers(
        &mut self,
        name: &str,
        length: Option<usize>,
    ) -> Result<Vec<f64>> {
        taken(&mut self.numbers, name, length)
    }

    /// An array of words, taken out; `length` where it is known.
    pub(in crate::operator::particles) fn take_words(&mut self, name: &str, length: Option<usize>) -> Result<Vec<u64>> {
        taken(&mut self.words, name, length)
    }
}

fn taken<T>(arrays: &mut Vec<(String, Vec<T>)>, name: &str, length: Option<usize>) -> Result<Vec<T>> {
    let at = arrays.iter().position(|(n, values)| n == name && length.is_none_or(|l| l == values.len()));
    let at = at.ok_or_else(|| {
        Error::input(
            format!("the saved state has no array {name} that fits"),
            "resume with the case that it was saved from, or start anew",
        )
    })?;
    Ok(arrays.swap_remove(at).1)
}

/// Vectors one after another.
pub(in crate::operator::particles) fn flat(vectors: &[Vector3<f64>]) -> Vec<f64> {
    vectors.iter().flat_map(|v| [v.x, v.y, v.z]).collect()
}

/// Vectors from their numbers.
pub(in crate::operator::particles) fn vectors(numbers: &[f64]) -> Vec<Vector3<f64>> {
    numbers.as_chunks::<3>().0.iter().map(|v| Vector3::from(*v)).collect()
}

impl Particles {
    /// The state: displacements, rotations, velocities, spins, the cell, which bonds are whole, what those that left the linear
    /// law remember, contacts. Forces are not
    /// part of it; they follow.
    pub fn snapshot(&self) -> Snapshot {
        let poses = &self.poses[..self.len()];
        let mut snapshot = Snapshot::default();
        let mut keep = |name: &str, values: Vec<f64>| snapshot.numbers.push((name.into(), values));
        keep(
            "displacement",
            poses.iter().flat_map(|p| [p.displacement[0], p.displacement[1], p.displacement[2]]).collect(),
        );
        keep("turn", poses.iter().flat_map(|p| p.turn).collect());
        keep("velocity", flat(&self.velocity));
        keep("spin", flat(&self.spin));
        keep("cell", self.periodic.map_or(Vec::new(), |p| p.change.iter().copied().collect()));
        let words = self
            .whole
            .chunks(64)
            .map(|bits| bits.iter().enumerate().fold(0u64, |word, (bit, whole)| word | (u64::from(*whole) << bit)));
        snapshot.words.push(("whole".into(), words.collect()));
        let departed = &self.departed.list;
        let mut keep = |name: &str, of: fn(&BondState) -> f64| {
            snapshot.numbers.push((name.into(), departed.iter().map(|d| of(&d.state)).collect()));
        };
        keep("bond_history", |state| state.history);
        keep("bond_permanent", |state| state.permanent);
        snapshot.words.push(("departed".into(), departed.iter().map(|d| u64::from(d.bond)).collect()));
        if let Some(contacts) = &self.contacts {
            contacts.keep(&mut snapshot);
        }
        snapshot
    }

    /// Go on from a state of spheres made from the same model; evaluate the forces before they are read.
    ///
    /// # Errors
    /// A state of another model.
    pub fn restore(&mut self, mut snapshot: Snapshot) -> Result<()> {
        let n = self.len();
        let displacement = snapshot.take_numbers("displacement", Some(3 * n))?;
        let turn = snapshot.take_numbers("turn", Some(4 * n))?;
        let (velocity, spin) =
            (snapshot.take_numbers("velocity", Some(3 * n))?, snapshot.take_numbers("spin", Some(3 * n))?);
        let cell = snapshot.take_numbers("cell", Some(if self.periodic.is_some() { 9 } else { 0 }))?;
        let whole = snapshot.take_words("whole", Some(self.whole.len().div_ceil(64)))?;
        let departed = snapshot.take_words("departed", None)?;
        let known = Some(departed.len());
        let (history, permanent) =
            (snapshot.take_numbers("bond_history", known)?, snapshot.take_numbers("bond_permanent", known)?);
        let listed = departed.is_sorted_by(|a, b| a < b) && departed.iter().all(|&b| (b as usize) < self.whole.len());
        let follows = departed.is_empty() || !self.departed.law.breaks_at_once();
        if !(listed && follows) {
            return Err(Error::input(
                "the saved bonds have another law than those of this case",
                "resume with the case as it was",
            ));
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.go_on(&mut snapshot, n)?;
        }
        for ((pose, u), turn) in self.poses.iter_mut().zip(displacement.as_chunks::<3>().0).zip(turn.as_chunks::<4>().0)
        {
            pose.displacement[..3].copy_from_slice(u);
            pose.turn = *turn;
        }
        self.velocity = vectors(&velocity);
        self.spin = vectors(&spin);
        if let Some(periodic) = &mut self.periodic {
            periodic.change = Matrix3::from_column_slice(&cell);
        }
        for bond in 0..self.whole.len() {
            if self.whole[bond] && whole[bond / 64] >> (bond % 64) & 1 == 0 {
                self.rows.break_bond(bond);
                self.whole[bond] = false;
                self.broken += 1;
            }
        }
        let state = |((&bond, &history), &permanent): ((&u64, &f64), &f64)| Departed {
            bond: bond as u32,
            state: BondState { history, permanent },
        };
        self.departed.list = departed.iter().zip(&history).zip(&permanent).map(state).collect();
        departed.iter().for_each(|&bond| self.rows.break_bond(bond as usize));
        Ok(())
    }
}
