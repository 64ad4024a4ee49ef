//! The state of a run as plain arrays, to be kept and gone on with.

use crate::{Error, Result};

/// Arrays of a run's state by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SavedState {
    /// What the run says of itself (JSON).
    pub about: String,
    /// Arrays of numbers.
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Arrays of bits.
    pub words: Vec<(String, Vec<u64>)>,
}

impl SavedState {
    /// An array of numbers, taken out.
    ///
    /// # Errors
    /// No such array, or one of another length.
    pub fn take_numbers(&mut self, name: &str, length: usize) -> Result<Vec<f64>> {
        taken(&mut self.numbers, name, length)
    }

    /// An array of bits, taken out.
    ///
    /// # Errors
    /// No such array, or one of another length.
    pub fn take_words(&mut self, name: &str, length: usize) -> Result<Vec<u64>> {
        taken(&mut self.words, name, length)
    }
}

/// An array taken out of a list.
fn taken<T>(arrays: &mut Vec<(String, Vec<T>)>, name: &str, length: usize) -> Result<Vec<T>> {
    let at = arrays.iter().position(|(n, values)| n == name && values.len() == length);
    let at = at.ok_or_else(|| {
        Error::input(
            format!("the saved state has no array {name} of {length} entries"),
            "resume with the case that it was saved from, or start anew",
        )
    })?;
    Ok(arrays.swap_remove(at).1)
}
