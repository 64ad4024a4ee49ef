//! The state of a run as plain arrays, to be kept and gone on with.

use crate::{Error, Result};

/// Facts and arrays of a run's state, the arrays by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SavedState<F> {
    /// What the run says of itself beside the arrays.
    pub facts: F,
    /// Arrays of numbers.
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Arrays of bits.
    pub words: Vec<(String, Vec<u64>)>,
}

impl<F> SavedState<F> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_is_taken_once_and_as_long_as_it_is() {
        let mut state: SavedState<()> = SavedState {
            numbers: vec![("u".into(), vec![1.0, 2.0])],
            words: vec![("bits".into(), vec![3])],
            ..SavedState::default()
        };
        assert!(state.take_numbers("u", 3).is_err() && state.take_words("u", 2).is_err());
        assert_eq!(state.take_numbers("u", 2).unwrap(), [1.0, 2.0]);
        assert_eq!(state.take_words("bits", 1).unwrap(), [3]);
        assert!(state.take_numbers("u", 2).unwrap_err().to_string().contains("no array u of 2 entries"));
    }
}
