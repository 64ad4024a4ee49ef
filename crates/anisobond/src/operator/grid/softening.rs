//! How a bond fails, and the bonds that have begun to soften.
//!
//! A bond that softens pulls with g k e instead of k e, where g is the secant of the largest elongation e it has had,
//! λ = e/e₀ in units of that at the onset of damage: 1 up to λ = 1, (r − λ)/(λ (r − 1)) up to the end λ = r, 0 beyond. It
//! unloads to the origin along the damaged secant. Of the energy r ½ k e₀² that it takes in all, the share (λ − 1)/(r − 1)
//! is spent at λ; with e₀ = e_c/√r it takes what a brittle bond of critical elongation e_c does.

use rayon::prelude::*;

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

    /// g (–) of a bond whose largest elongation was λ times that of the onset.
    pub fn secant(&self, largest: f64) -> f64 {
        match largest {
            l if l <= 1.0 => 1.0,
            l if l >= self.ratio => 0.0,
            l => (self.ratio - l) / (l * (self.ratio - 1.0)),
        }
    }

    /// Share of its fracture energy that a bond has spent at λ (–).
    pub fn spent(&self, largest: f64) -> f64 {
        ((largest - 1.0) / (self.ratio - 1.0)).clamp(0.0, 1.0)
    }

    /// The onset s₀ = s_c/√r (–) at which softening begins, so that it takes the energy of a brittle bond of critical
    /// stretch s_c (–).
    pub fn onset(&self, critical: f64) -> f64 {
        critical / self.ratio.sqrt()
    }
}

/// A bond that softens: half bond `half` of `node`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SoftBond {
    pub(super) node: u32,
    pub(super) half: u16,
    /// Its other end.
    pub(super) other: u32,
    /// Stiffness k (N/m) before damage.
    pub(super) stiffness: f64,
    /// Elongation e₀ at the onset (m).
    pub(super) onset: f64,
    /// λ ≥ 1.
    pub(super) largest: f64,
}

impl SoftBond {
    /// Order of the list.
    pub(super) fn place(&self) -> (u32, u16) {
        (self.node, self.half)
    }
}

/// What one bond's damage amounts to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Change {
    /// Energy lost (J).
    pub(super) energy: f64,
    pub(super) changed: bool,
    pub(super) broke: bool,
}

/// The bonds that soften, in the order of their nodes.
#[derive(Clone, Debug)]
pub(super) struct SoftBonds {
    pub(super) law: LinearSoftening,
    pub(super) list: Vec<SoftBond>,
    /// Ends in the order of nodes: node, place in `list`.
    ends: Vec<(u32, u32)>,
}

impl SoftBonds {
    pub(super) fn new(law: LinearSoftening) -> Self {
        SoftBonds { law, list: Vec::new(), ends: Vec::new() }
    }

    /// Bonds in any order, in place of those that were.
    pub(super) fn set(&mut self, list: Vec<SoftBond>) {
        self.list = list;
        self.list.sort_unstable_by_key(SoftBond::place);
        let of = |(place, bond): (usize, &SoftBond)| [(bond.node, place as u32), (bond.other, place as u32)];
        self.ends = self.list.iter().enumerate().flat_map(of).collect();
        self.ends.sort_unstable();
    }

    /// Ends in the order of nodes: node, place of the bond in the list.
    pub(super) fn ends(&self) -> &[(u32, u32)] {
        &self.ends
    }

    /// Stiffness g k (N/m) of a bond.
    pub(super) fn stiffness(&self, bond: &SoftBond) -> f64 {
        self.law.secant(bond.largest) * bond.stiffness
    }

    /// Bonds of a node.
    pub(super) fn of_node(&self, node: usize) -> impl Iterator<Item = &SoftBond> {
        let from = self.ends.partition_point(|(n, _)| (*n as usize) < node);
        let own = self.ends[from..].iter().take_while(move |(n, _)| *n as usize == node);
        own.map(|(_, place)| &self.list[*place as usize])
    }

    /// Damage of all bonds of the list whose elongation (m) is now larger than ever, given before and now by `elongations`;
    /// secants that would fall by no more than `tolerance` stay.
    pub(super) fn stretch(
        &mut self,
        elongations: impl Fn(&SoftBond) -> [f64; 2] + Sync,
        tolerance: f64,
    ) -> Vec<Change> {
        let law = self.law;
        let changes: Vec<Change> = self
            .list
            .par_iter_mut()
            .with_min_len(256)
            .map(|bond| {
                let elongations = elongations(bond);
                damage(&law, bond, elongations, tolerance)
            })
            .collect();
        changes
    }

    /// Drop the bonds that have broken, and take up more.
    pub(super) fn renew(&mut self, more: Vec<SoftBond>) {
        let broken = |bond: &SoftBond| bond.largest >= self.law.ratio();
        if more.is_empty() && !self.list.iter().any(broken) {
            return;
        }
        let left = self.list.iter().filter(|bond| !broken(bond)).copied().chain(more).collect();
        self.set(left);
    }
}

/// Damage of a bond by its elongation, before and now (m).
///
/// While the secant stiffness falls from κ to κ', the leapfrog does the work ½ (κ e + κ' e') (e' − e) on the bond and its
/// energy rises by ½ κ' e'² − ½ κ e²: what is lost is ½ (κ − κ') e e'. A step of the equilibrium changes the secant at rest,
/// e = e'.
pub(super) fn damage(law: &LinearSoftening, bond: &mut SoftBond, [before, now]: [f64; 2], tolerance: f64) -> Change {
    let largest = now / bond.onset;
    let fall = law.secant(bond.largest) - law.secant(largest);
    if largest <= bond.largest || fall <= tolerance {
        return Change::default();
    }
    bond.largest = largest;
    Change { energy: 0.5 * fall * bond.stiffness * before * now, changed: true, broke: largest >= law.ratio() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stretched slowly, with unloading on the way, a bond takes r ½ k e₀² in all, the share that it says on the way, and its
    /// force is continuous.
    #[test]
    fn a_softening_bond_takes_the_energy_of_a_brittle_one() {
        for ratio in [1.2, 2.0, 5.0] {
            let law = LinearSoftening::new(ratio).unwrap();
            let (k, critical) = (3.0, 0.7);
            let onset = law.onset(critical);
            let whole = 0.5 * k * critical * critical;
            let mut bond = SoftBond { node: 0, half: 0, other: 1, stiffness: k, onset, largest: 1.0 };
            let steps = 20_000;
            let mut spent = 0.0;
            let mut before = 0.0;
            for i in 0..=steps {
                // There and back and farther.
                let t = i as f64 / steps as f64;
                let now = onset * ratio * (1.02 * t + 0.3 * (6.0 * t).sin() * (1.0 - t));
                spent += damage(&law, &mut bond, [before, now], 0.0).energy;
                assert!((spent / whole - law.spent(bond.largest)).abs() < 1e-3, "{ratio}: {spent} at {t}");
                before = now;
            }
            assert!((spent / whole - 1.0).abs() < 1e-3, "{ratio}: {spent} for {whole}");
            assert!((law.secant(1.0 + 1e-9) - 1.0).abs() < 1e-7 && law.secant(ratio * (1.0 - 1e-9)) < 1e-7);
        }
        assert!(LinearSoftening::new(1.0).is_err() && LinearSoftening::new(f64::NAN).is_err());
    }
}
