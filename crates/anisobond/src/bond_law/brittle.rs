//! Bonds that break at their critical stretch and are gone.

use super::{BondLaw, BondState};

/// Breaks at once, at the critical stretch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Brittle;

impl BondLaw for Brittle {
    fn energy_ratio(&self) -> f64 {
        1.0
    }

    fn breaks_at_once(&self) -> bool {
        true
    }

    fn secant(&self, state: &BondState) -> f64 {
        f64::from(u8::from(state.history <= 1.0))
    }

    fn damage(&self, state: &BondState) -> f64 {
        1.0 - self.secant(state)
    }
}
