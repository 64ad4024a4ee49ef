//! Bonds whose force falls linearly once damage has begun.
//!
//! With λ the largest elongation so far, the secant is g = 1 up to λ = 1, (r − λ)/(λ (r − 1)) up to the end λ = r, 0 beyond. A bond
//! unloads to the origin along the damaged secant. Of the energy r ½ k e₀² that it takes in all, the share (λ − 1)/(r − 1) is
//! spent at λ; with e₀ = e_c/√r it takes what a brittle bond of critical elongation e_c does.

use super::{BondLaw, BondState};
use crate::{Error, Result};

/// Linear softening, from the onset at λ = 1 to the end at λ = r.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSoftening {
    ratio: f64,
}

impl LinearSoftening {
    /// Softening whose end is at `ratio` times the elongation of its onset.
    ///
    /// # Errors
    /// A ratio that is not above 1 or not finite.
    pub fn new(ratio: f64) -> Result<Self> {
        if !(ratio.is_finite() && ratio > 1.0) {
            return Err(Error::input(format!("softening ends at {ratio} times its onset"), "give a ratio above 1"));
        }
        Ok(LinearSoftening { ratio })
    }

    /// r (–).
    pub fn ratio(&self) -> f64 {
        self.ratio
    }
}

impl BondLaw for LinearSoftening {
    fn energy_ratio(&self) -> f64 {
        self.ratio
    }

    fn secant(&self, state: &BondState) -> f64 {
        match state.history {
            l if l <= 1.0 => 1.0,
            l if l >= self.ratio => 0.0,
            l => (self.ratio - l) / (l * (self.ratio - 1.0)),
        }
    }

    fn damage(&self, state: &BondState) -> f64 {
        ((state.history - 1.0) / (self.ratio - 1.0)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_secant_is_continuous_and_a_ratio_is_above_one() {
        for ratio in [1.2, 2.0, 5.0] {
            let law = LinearSoftening::new(ratio).unwrap();
            let secant = |x: f64| law.secant(&law.after(&law.start(), x));
            assert!((secant(1.0 + 1e-9) - 1.0).abs() < 1e-7 && secant(ratio * (1.0 - 1e-9)) < 1e-7);
            assert_eq!(secant(ratio), 0.0);
        }
        assert!(LinearSoftening::new(1.0).is_err() && LinearSoftening::new(f64::NAN).is_err());
    }
}
