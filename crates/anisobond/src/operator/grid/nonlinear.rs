//! The bonds that have left the linear law: a list beside the kernels, each with the state that its law keeps.

use std::sync::Arc;

use rayon::prelude::*;

use crate::bond_law::{BondLaw, BondState};

/// A bond that follows its law: half bond `half` of `node`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NonlinearBond {
    pub(super) node: u32,
    pub(super) half: u16,
    /// Its other end.
    pub(super) other: u32,
    /// Stiffness k (N/m) of the linear law.
    pub(super) stiffness: f64,
    /// Elongation e₀ at the onset (m).
    pub(super) onset: f64,
    /// What it remembers.
    pub(super) state: BondState,
}

impl NonlinearBond {
    /// Order of the list.
    pub(super) fn place(&self) -> (u32, u16) {
        (self.node, self.half)
    }

    /// The elongation (m) beyond that at which it is without force.
    pub(super) fn beyond(&self, elongation: f64) -> f64 {
        elongation - self.state.permanent * self.onset
    }
}

/// What a step has made of one bond.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Change {
    /// Energy lost (J).
    pub(super) energy: f64,
    pub(super) changed: bool,
    pub(super) broke: bool,
}

/// The bonds that have left the linear law, in the order of their nodes.
#[derive(Clone, Debug)]
pub(super) struct NonlinearBonds {
    pub(super) law: Arc<dyn BondLaw>,
    pub(super) list: Vec<NonlinearBond>,
    /// Ends in the order of nodes: node, place in `list`.
    ends: Vec<(u32, u32)>,
}

impl NonlinearBonds {
    pub(super) fn new(law: Arc<dyn BondLaw>) -> Self {
        NonlinearBonds { law, list: Vec::new(), ends: Vec::new() }
    }

    /// Bonds in any order, in place of those that were.
    pub(super) fn set(&mut self, list: Vec<NonlinearBond>) {
        self.list = list;
        self.list.sort_unstable_by_key(NonlinearBond::place);
        let of = |(place, bond): (usize, &NonlinearBond)| [(bond.node, place as u32), (bond.other, place as u32)];
        self.ends = self.list.iter().enumerate().flat_map(of).collect();
        self.ends.sort_unstable();
    }

    /// Ends in the order of nodes: node, place of the bond in the list.
    pub(super) fn ends(&self) -> &[(u32, u32)] {
        &self.ends
    }

    /// Stiffness g k (N/m) of a bond.
    pub(super) fn stiffness(&self, bond: &NonlinearBond) -> f64 {
        self.law.secant(&bond.state) * bond.stiffness
    }

    /// Bonds of a node.
    pub(super) fn of_node(&self, node: usize) -> impl Iterator<Item = &NonlinearBond> {
        let from = self.ends.partition_point(|(n, _)| (*n as usize) < node);
        let own = self.ends[from..].iter().take_while(move |(n, _)| *n as usize == node);
        own.map(|(_, place)| &self.list[*place as usize])
    }

    /// Let every bond of the list follow its law to its elongations (m), before and now; changes of no more than `tolerance`
    /// are left.
    pub(super) fn follow(
        &mut self,
        elongations: impl Fn(&NonlinearBond) -> [f64; 2] + Sync,
        tolerance: f64,
        at_rest: bool,
    ) -> Vec<Change> {
        let law = &*self.law;
        let one = |bond: &mut NonlinearBond| {
            let elongations = elongations(bond);
            follow(law, bond, elongations, tolerance, at_rest)
        };
        self.list.par_iter_mut().with_min_len(256).map(one).collect()
    }

    /// Drop the bonds that have broken, and take up more.
    pub(super) fn renew(&mut self, more: Vec<NonlinearBond>) {
        let broken = |bond: &NonlinearBond| self.law.secant(&bond.state) == 0.0;
        if more.is_empty() && !self.list.iter().any(broken) {
            return;
        }
        let left = self.list.iter().filter(|bond| !broken(bond)).copied().chain(more).collect();
        self.set(left);
    }
}

/// Let a bond follow its law to its elongations, before and now (m), unless neither its secant nor its permanent elongation (in
/// units of the onset's) would change by more than the tolerance.
///
/// At rest it has come there unbroken, and breaks where it is: [`BondLaw::after_unbroken`].
pub(super) fn follow(
    law: &dyn BondLaw,
    bond: &mut NonlinearBond,
    [before, now]: [f64; 2],
    tolerance: f64,
    at_rest: bool,
) -> Change {
    let x = now / bond.onset;
    if !at_rest {
        return change(law, bond, law.after(&bond.state, x), [before, now], tolerance);
    }
    let came = change(law, bond, law.after_unbroken(&bond.state, x), [before, now], tolerance);
    let stays = change(law, bond, law.after(&bond.state, x), [now, now], tolerance);
    Change {
        energy: came.energy + stays.energy,
        changed: came.changed || stays.changed,
        broke: came.broke || stays.broke,
    }
}

/// Bring a bond into its next state, and book what that takes.
///
/// A bond pulls with κ a, a = e − p. While κ falls to κ' and p goes to p', the leapfrog does the work ½ (κ a + κ' a') (e' − e) on it,
/// and its energy rises by ½ κ' a'² − ½ κ a²: what is lost is ½ (κ − κ') a a' + ½ (κ a + κ' a') (p' − p). A step of the
/// equilibrium of softening bonds changes the secant at rest, e = e'.
fn change(
    law: &dyn BondLaw,
    bond: &mut NonlinearBond,
    next: BondState,
    [before, now]: [f64; 2],
    tolerance: f64,
) -> Change {
    let next = NonlinearBond { state: next, ..*bond };
    let secants = [law.secant(&bond.state), law.secant(&next.state)];
    let (fall, flow) = (secants[0] - secants[1], next.state.permanent - bond.state.permanent);
    if fall <= tolerance && flow.abs() <= tolerance {
        return Change::default();
    }
    let (a, b) = (bond.beyond(before), next.beyond(now));
    let forces = bond.stiffness * (secants[0] * a + secants[1] * b);
    let energy = 0.5 * fall * bond.stiffness * a * b + 0.5 * forces * flow * bond.onset;
    *bond = next;
    Change { energy, changed: true, broke: secants[1] == 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bond_law::{ElasticPlastic, LinearSoftening};

    /// Stretched slowly, with unloading on the way, a bond loses all the energy of a brittle one, and on the way what its law
    /// says.
    #[test]
    fn a_softening_bond_takes_the_energy_of_a_brittle_one() {
        for ratio in [1.2, 2.0, 5.0] {
            let law = LinearSoftening::new(ratio).unwrap();
            let (k, critical) = (3.0, 0.7);
            let onset = law.onset(critical);
            let whole = 0.5 * k * critical * critical;
            let mut bond = NonlinearBond { node: 0, half: 0, other: 1, stiffness: k, onset, state: law.start() };
            let steps = 20_000;
            let mut spent = 0.0;
            let mut before = 0.0;
            for i in 0..=steps {
                // There and back and farther.
                let t = i as f64 / steps as f64;
                let now = onset * ratio * (1.02 * t + 0.3 * (6.0 * t).sin() * (1.0 - t));
                spent += follow(&law, &mut bond, [before, now], 0.0, false).energy;
                assert!((spent / whole - law.damage(&bond.state)).abs() < 1e-3, "{ratio}: {spent} at {t}");
                before = now;
            }
            assert!((spent / whole - 1.0).abs() < 1e-3, "{ratio}: {spent} for {whole}");
        }
    }

    /// On any path, the work ½ (f + f') (e' − e) is the rise of the energy and what is lost, to rounding.
    #[test]
    fn work_is_energy_and_loss() {
        let laws: [&dyn BondLaw; 2] = [&ElasticPlastic::new(0.2, 50.0).unwrap(), &LinearSoftening::new(6.0).unwrap()];
        for law in laws {
            let onset = 0.3;
            let mut bond = NonlinearBond { node: 0, half: 0, other: 1, stiffness: 2.0, onset, state: law.start() };
            let force = |b: &NonlinearBond, e: f64| law.secant(&b.state) * b.stiffness * b.beyond(e);
            let energy = |b: &NonlinearBond, e: f64| 0.5 * force(b, e) * b.beyond(e);
            let (mut before, mut lost) = (0.0, 0.0);
            for i in 1..60 {
                let now = onset * (0.1 * f64::from(i) * f64::from(i).sin());
                let old = bond;
                let change = follow(law, &mut bond, [before, now], 0.0, false);
                let work = 0.5 * (force(&old, before) + force(&bond, now)) * (now - before);
                let rest = work - energy(&bond, now) + energy(&old, before) - change.energy;
                assert!(rest.abs() < 1e-14, "{law:?}: {rest}");
                lost += change.energy;
                before = now;
            }
            assert!(lost > 0.01, "{law:?}: {lost}");
        }
    }
}
