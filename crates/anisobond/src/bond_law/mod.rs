//! What a bond does beyond the linear law: one file per law.
//!
//! The kernels know linear bonds only. A bond that is stretched beyond the onset e₀ of its law leaves them and stands in a list
//! beside them, where its law says what has become of it. Lengths are in units of e₀, forces in units of k e₀: a bond pulls
//! with g (x − p), x its elongation, g the secant stiffness and p the elongation at which it is without force.
//!
//! To add a law, write a file with an `impl BondLaw`; see `examples/bond_law.rs`.

mod brittle;
mod elastic_plastic;
mod linear_softening;
mod table_softening;

use std::fmt::Debug;

pub use brittle::Brittle;
pub use elastic_plastic::ElasticPlastic;
pub use linear_softening::LinearSoftening;
pub use table_softening::TableSoftening;

/// What a bond remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BondState {
    /// What its law counts: the largest elongation of a softening bond, all the plastic elongation of one that yields, both in
    /// units of e₀.
    pub history: f64,
    /// Elongation p at which it is without force, in units of e₀.
    pub permanent: f64,
}

impl BondState {
    /// That of a bond at its onset whose law counts its largest elongation.
    pub const AT_ONSET: BondState = BondState { history: 1.0, permanent: 0.0 };
}

/// A law of bonds: when they leave the linear law, and what they do then.
///
/// The scalar law of one bond, for grids and, in the linear range, whatever their kinematics. `critical` is the stretch at which
/// a brittle bond of the same energy breaks.
pub trait BondLaw: Debug + Send + Sync {
    /// The stretch s₀ (–) at which a bond leaves the linear law, so that it takes in all the energy of a brittle bond that breaks
    /// at the stretch `critical` (–).
    fn onset(&self, critical: f64) -> f64 {
        critical / self.energy_ratio().sqrt()
    }

    /// The energy that a bond takes in all when it is stretched once until it breaks, relative to ½ k e₀² (–).
    fn energy_ratio(&self) -> f64;

    /// Whether bonds leave the linear law only to break, which the kernels do by themselves.
    fn breaks_at_once(&self) -> bool {
        false
    }

    /// Whether bonds yield: they are without force at another length than at first, and leave the linear law in compression as
    /// they do in tension.
    fn yields(&self) -> bool {
        false
    }

    /// The state of a bond that leaves the linear law; by default that of one that remembers its largest elongation.
    fn start(&self) -> BondState {
        BondState::AT_ONSET
    }

    /// The state of a bond that has come to the elongation x (units of e₀); by default the largest so far is what it remembers.
    fn after(&self, state: &BondState, x: f64) -> BondState {
        BondState { history: state.history.max(x), ..*state }
    }

    /// As [`BondLaw::after`], of a bond that does not break: an equilibrium is sought with the bonds that there are, and breaks them
    /// where it is found.
    fn after_unbroken(&self, state: &BondState, x: f64) -> BondState {
        self.after(state, x)
    }

    /// Secant stiffness g (–) relative to the linear one; 0 of a bond that is broken.
    fn secant(&self, state: &BondState) -> f64;

    /// Damage (–), from 0 to 1 where the bond breaks: of a softening bond the share of its energy that is spent.
    fn damage(&self, state: &BondState) -> f64;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Force of a bond (units of k e₀).
    fn force(law: &dyn BondLaw, state: &BondState, x: f64) -> f64 {
        law.secant(state) * (x - state.permanent)
    }

    /// Stretched once, every law takes the energy that it says, continuously, and breaks at its end; it never gives energy back
    /// that it has lost, on any path.
    #[test]
    fn every_law_takes_the_energy_that_it_says() {
        let laws: Vec<Box<dyn BondLaw>> = vec![
            Box::new(LinearSoftening::new(1.2).unwrap()),
            Box::new(LinearSoftening::new(5.0).unwrap()),
            Box::new(TableSoftening::new(vec![(1.0, 1.0), (2.0, 0.3), (6.0, 0.0)]).unwrap()),
            Box::new(TableSoftening::exponential(2.0).unwrap()),
            Box::new(ElasticPlastic::new(0.0, 4.0).unwrap()),
            Box::new(ElasticPlastic::new(0.3, 8.0).unwrap()),
        ];
        for law in &laws {
            assert!((law.onset(3.0).powi(2) * law.energy_ratio() / 9.0 - 1.0).abs() < 1e-12);
            let (mut state, mut x, mut work, mut last) = (law.start(), 1.0, 0.5, 1.0);
            let step = 1e-4;
            while law.secant(&state) > 0.0 {
                x += step;
                state = law.after(&state, x);
                let now = force(&**law, &state, x);
                work += 0.5 * (last + now) * step;
                last = now;
                assert!(x < 1e3, "{law:?} never breaks");
            }
            assert!((2.0 * work / law.energy_ratio() - 1.0).abs() < 1e-3, "{law:?}: {work}");
            assert_eq!(law.damage(&state), 1.0);
            // A path there and back: work done on the bond less its energy never falls.
            let (mut state, mut before, mut lost) = (law.start(), 0.0, 0.0);
            for i in 0..20_000 {
                let t = f64::from(i) / 20_000.0;
                let x = 3.0 * t * (40.0 * t).sin() + 0.9 * (1.0 - t);
                let next = law.after(&state, x);
                let energy = |s: &BondState, x: f64| 0.5 * law.secant(s) * (x - s.permanent).powi(2);
                let work = 0.5 * (force(&**law, &state, before) + force(&**law, &next, x)) * (x - before);
                if i > 0 {
                    let more = work - (energy(&next, x) - energy(&state, before));
                    assert!(more > -1e-5, "{law:?} at {t}: {more}");
                    lost += more;
                }
                (state, before) = (next, x);
            }
            assert!(lost > 0.0, "{law:?}");
        }
    }
}
