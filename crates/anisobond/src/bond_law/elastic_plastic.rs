//! Bonds that yield in tension and compression, harden, and break.
//!
//! The force g = x − p of a bond stays within ±(1 + H α), α = ∫|dp| all its plastic elongation (isotropic hardening). Beyond that the
//! bond flows: Δα = (|x − p| − 1 − H α)/(1 + H) in the direction of the force, which is the closest point on the yield limit
//! (Simo and Hughes 1998, box 1.4). Stretched once, its force rises with the slope h = H/(1 + H) after the yield at x = 1;
//! it breaks where x reaches r, in tension only. It takes 1 + 2 (r − 1) + h (r − 1)² times ½ k e₀² in all.

use super::{BondLaw, BondState};
use crate::{Error, Result};

/// Elastic-plastic bonds with isotropic linear hardening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticPlastic {
    hardening: f64,
    ductility: f64,
}

impl ElasticPlastic {
    /// `hardening` h is the slope after the yield relative to that before, 0 ≤ h < 1; `ductility` r the stretch at which a bond
    /// breaks relative to that at which it yields, above 1.
    ///
    /// # Errors
    /// Numbers out of range.
    pub fn new(hardening: f64, ductility: f64) -> Result<Self> {
        if !(0.0..1.0).contains(&hardening) {
            return Err(Error::input(
                format!("a hardening of {hardening}"),
                "give the slope after the yield relative to that before, at least 0 and below 1",
            ));
        }
        if !(ductility.is_finite() && ductility > 1.0) {
            return Err(Error::input(
                format!("bonds break at {ductility} times the stretch at which they yield"),
                "let them break beyond that",
            ));
        }
        Ok(ElasticPlastic { hardening, ductility })
    }
}

impl BondLaw for ElasticPlastic {
    fn energy_ratio(&self) -> f64 {
        let flow = self.ductility - 1.0;
        1.0 + 2.0 * flow + self.hardening * flow * flow
    }

    fn yields(&self) -> bool {
        true
    }

    fn start(&self) -> BondState {
        BondState { history: 0.0, permanent: 0.0 }
    }

    fn after(&self, state: &BondState, x: f64) -> BondState {
        if x >= self.ductility || state.history.is_infinite() {
            return BondState { history: f64::INFINITY, ..*state };
        }
        self.after_unbroken(state, x)
    }

    fn after_unbroken(&self, state: &BondState, x: f64) -> BondState {
        let modulus = self.hardening / (1.0 - self.hardening);
        let force = x - state.permanent;
        let over = force.abs() - 1.0 - modulus * state.history;
        if over <= 0.0 {
            return *state;
        }
        let flow = over / (1.0 + modulus);
        BondState { history: state.history + flow, permanent: state.permanent + flow.copysign(force) }
    }

    fn secant(&self, state: &BondState) -> f64 {
        f64::from(u8::from(state.history.is_finite()))
    }

    fn damage(&self, state: &BondState) -> f64 {
        1.0 - self.secant(state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stretched once, compressed and stretched again: forces at the corners of the path by hand. With h = ½, H = 1.
    #[test]
    fn a_bond_that_hardens_follows_its_curve() {
        let law = ElasticPlastic::new(0.5, 10.0).unwrap();
        let mut state = law.start();
        let mut force = |x: f64| {
            state = law.after(&state, x);
            law.secant(&state) * (x - state.permanent)
        };
        assert_eq!(force(1.0), 1.0);
        // f = 1 + ½ (3 − 1), p = α = 1.
        assert_eq!(force(3.0), 2.0);
        assert_eq!(force(1.0), 0.0);
        // The limit is 2 both ways: −2 at x = −1, and at −3 it has flowed by 1 more.
        assert_eq!(force(-1.0), -2.0);
        assert_eq!(force(-3.0), -3.0);
        assert_eq!(force(0.0), 0.0);
        assert_eq!(force(10.0), 0.0);
        assert!(ElasticPlastic::new(1.0, 3.0).is_err() && ElasticPlastic::new(0.1, 1.0).is_err());
    }
}
