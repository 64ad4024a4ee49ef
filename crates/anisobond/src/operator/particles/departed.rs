//! Bonds that left the linear law: a list beside the rows, each with the state that its law keeps.
//!
//! A bond leaves where its forces use up its strength. From there on its force and its moments are the g-th part of a linear
//! bond's, g the secant of its law at the largest share of the strength that a linear bond in its place would have used. Bonds that
//! yield do so along their length: e₀ = T/k_n, T their tensile strength, and they break where they shear beyond their strength.
//!
//! While g falls to g' and the permanent elongation p goes to p', the leapfrog does half of its work with the forces before and
//! half with those after: ½ (g − g') (k_n a a' + k_t s·s') + ½ k_n (g a + g' a') (p' − p) is lost, a = e − p and s the slip
//! (`operator::grid::nonlinear`; `Stretched`).

use std::sync::Arc;

use super::bond::{Carried, Stretched};
use super::model::Strength;
use crate::bond_law::{BondLaw, BondState};
use crate::operator::StiffBond;

/// A bond that left the linear law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Departed {
    /// Its number in the model.
    pub(super) bond: u32,
    pub(super) state: BondState,
}

/// The list, in the order of the bonds, and their law.
#[derive(Clone, Debug)]
pub(super) struct DepartedBonds {
    pub(super) law: Arc<dyn BondLaw>,
    pub(super) list: Vec<Departed>,
}

/// What has become of a bond.
pub(super) struct Change {
    /// Energy lost (J).
    pub(super) lost: f64,
    /// By how much its secant fell, or its permanent elongation changed, whichever is more (–).
    pub(super) by: f64,
    /// Its state; `None` where it broke.
    pub(super) state: Option<BondState>,
}

impl DepartedBonds {
    pub(super) fn new(law: Arc<dyn BondLaw>) -> Self {
        DepartedBonds { law, list: Vec::new() }
    }

    /// A bond of the list; `None` of one that is not in it.
    pub(super) fn find(&self, bond: usize) -> Option<&Departed> {
        self.list.binary_search_by_key(&(bond as u32), |d| d.bond).ok().map(|place| &self.list[place])
    }

    /// What a bond in a state carries where its ends are.
    pub(super) fn carried(&self, state: &BondState, bond: &StiffBond, strength: &Strength, at: &Stretched) -> Carried {
        let secant = self.law.secant(state);
        at.carried([secant * bond.normal, secant * bond.tangential], permanent(state, bond, strength))
    }

    /// Let a bond follow its law from where its ends were to where they are now.
    pub(super) fn follow(
        &self,
        state: &BondState,
        bond: &StiffBond,
        strength: &Strength,
        [before, now]: [&Stretched; 2],
    ) -> Change {
        let stiffness = [bond.normal, bond.tangential];
        let next = if self.law.yields() {
            let onset = onset(bond, strength);
            let next = if onset.is_finite() { self.law.after(state, now.elongation / onset) } else { *state };
            let [normal, shear] = now.forces(stiffness, permanent(&next, bond, strength));
            strength.holds_in_shear(normal, shear).then_some(next)
        } else {
            Some(self.law.after(state, now.share(strength, stiffness)))
        };
        let next = next.filter(|next| self.law.secant(next) > 0.0);
        let after = next.unwrap_or(*state);
        let secants = [self.law.secant(state), next.map_or(0.0, |next| self.law.secant(&next))];
        let (p, q) = (permanent(state, bond, strength), permanent(&after, bond, strength));
        let (a, b) = (before.elongation - p, now.elongation - q);
        let crossed = bond.normal * a * b + bond.tangential * before.slip.dot(&now.slip);
        let flow = bond.normal * (secants[0] * a + secants[1] * b) * (q - p);
        Change {
            lost: 0.5 * (secants[0] - secants[1]) * crossed + 0.5 * flow,
            by: (secants[0] - secants[1]).max((after.permanent - state.permanent).abs()),
            state: next,
        }
    }
}

/// e₀ (m); infinite of bonds that do not break in tension.
pub(super) fn onset(bond: &StiffBond, strength: &Strength) -> f64 {
    strength.tension / bond.normal
}

/// p (m).
pub(super) fn permanent(state: &BondState, bond: &StiffBond, strength: &Strength) -> f64 {
    if state.permanent == 0.0 { 0.0 } else { state.permanent * onset(bond, strength) }
}
