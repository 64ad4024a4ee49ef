//! Bonds that fail: at once, or as another law has them. What fails is booked with the energy that it takes out of a step.
//!
//! In the leapfrog ½ m v₋·v₊ changes from one step to the next by ½ (F + F')·Δu of the forces F, F' at its ends
//! (`solver::motion`). The elongation of a linear bond goes from e to e' over the step. If it breaks there, its force −k e
//! still did half the work of the step, −½ k e (e' − e), that at the end is already missing, and its energy ½ k e² is gone: so
//! the lost energy is ½ k e e'. On average that is the energy at the critical elongation, which lies between the two, to
//! second order in the step.

use std::sync::Arc;

use nalgebra::Vector3;

use super::build::GridBonds;
use super::nonlinear::{Change, NonlinearBond, NonlinearBonds, follow};
use super::padded::Padded;
use super::strip::Event;
use crate::Result;
use crate::bond_law::{BondLaw, BondState, Brittle};
use crate::operator::{Kinematics, VectorField};

/// Displacements of a step (m): velocities (m/s) times a time (s).
pub type Way<'a> = (&'a VectorField, f64);

/// What failed, and what it took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Failure {
    /// Bonds that broke.
    pub broken: usize,
    /// Bonds that broke or that damage has made softer.
    pub changed: usize,
    /// Energy lost (J) up to now.
    pub energy: f64,
    /// Energy lost (J) in the step that follows: that of nodal terms, which see a bond broken one pass later.
    pub ahead: f64,
}

impl std::ops::AddAssign for Failure {
    fn add_assign(&mut self, more: Failure) {
        self.broken += more.broken;
        self.changed += more.changed;
        self.energy += more.energy;
        self.ahead += more.ahead;
    }
}

/// Bonds found above their critical stretch in a pass: they are without force there, and are to be broken.
#[derive(Debug, Default)]
pub struct Overstretched(pub(super) Vec<Event>);

/// The bonds of a body, and how they fail.
#[derive(Debug)]
pub struct FailingBonds {
    pub(super) grid: GridBonds<f64>,
    /// `None` where the kernels break them at once.
    pub(super) nonlinear: Option<NonlinearBonds>,
}

impl FailingBonds {
    /// Bonds that break at once at their critical stretch.
    pub fn brittle(grid: GridBonds<f64>) -> Self {
        FailingBonds::new(grid, Arc::new(Brittle))
    }

    /// Bonds that follow a law, and take the energy of bonds that break at their critical stretch.
    pub fn new(mut grid: GridBonds<f64>, law: Arc<dyn BondLaw>) -> Self {
        if law.breaks_at_once() {
            return FailingBonds { grid, nonlinear: None };
        }
        let critical = grid.stencils.iter_mut().flat_map(|s| &mut s.critical).chain(&mut grid.critical);
        critical.for_each(|s| *s = law.onset(*s));
        grid.surroundings.change_critical(|s| law.onset(s));
        FailingBonds { grid, nonlinear: Some(NonlinearBonds::new(law)) }
    }

    /// Whether bonds have another length without force than at first, so that forces are not linear in the displacements.
    pub fn yields(&self) -> bool {
        self.nonlinear.as_ref().is_some_and(|n| n.law.yields())
    }

    /// The bonds on the grid; of those that left the linear law it knows nothing but that they are not whole.
    pub fn grid(&self) -> &GridBonds<f64> {
        &self.grid
    }

    /// Number of bonds that have left the linear law and are not broken.
    pub fn departed(&self) -> usize {
        self.list().len()
    }

    pub(super) fn list(&self) -> &[NonlinearBond] {
        self.nonlinear.as_ref().map_or(&[], |n| &n.list)
    }

    /// Let bonds follow their law to displacements u (m), to which the step `behind` has led; changes of no more than `tolerance`
    /// (–) are left. Brittle bonds stay as they are.
    ///
    /// # Errors
    /// As [`GridBonds::sweep`].
    pub fn follow(
        &mut self,
        u: &Padded<f64>,
        kinematics: Kinematics,
        behind: Option<Way>,
        tolerance: f64,
    ) -> Result<Failure> {
        self.grid.refuse_others(u)?;
        Ok(self.follow_from(u, kinematics, behind, way_of(behind), tolerance))
    }

    /// [`FailingBonds::follow`] to displacements of these bonds, whose ends have moved apart by
    /// `moved` (m) since the last.
    fn follow_from(
        &mut self,
        u: &Padded<f64>,
        kinematics: Kinematics,
        behind: Option<Way>,
        moved: impl Fn(usize, usize) -> Vector3<f64> + Sync,
        tolerance: f64,
    ) -> Failure {
        let (grid, Some(nonlinear)) = (&self.grid, &mut self.nonlinear) else { return Failure::default() };
        if !grid.breakable() {
            return Failure::default();
        }
        let law = nonlinear.law.clone();
        let still = behind.is_none();
        let elongations = |bond: &NonlinearBond| grid.elongations(u, kinematics, &moved, bond);
        let mut changes = nonlinear.follow(elongations, tolerance, still);
        let (mut begun, mut events) = (Vec::new(), Vec::new());
        let mut beyond = grid.overstretched(u, kinematics);
        if law.yields() {
            beyond.extend(grid.compressed(u, kinematics));
        }
        for event in beyond {
            let Some(mut bond) = grid.nonlinear_bond(event, law.start()) else { continue };
            let [before, now] = grid.elongations(u, kinematics, &moved, &bond);
            // At rest it was linear until now.
            let change = follow(&*law, &mut bond, [if still { now } else { before }, now], tolerance, still);
            if change.changed {
                events.push(event);
                changes.push(change);
            }
            if change.changed && !change.broke {
                begun.push(bond);
            }
        }
        nonlinear.renew(begun);
        let nodal =
            self.grid.clear_with_nodal(&events, u, kinematics, behind.map(|(velocity, step)| (velocity, -step)));
        Failure { energy: summed(&changes) + nodal, ..counted(&changes) }
    }

    /// Break bonds found by [`FailingBonds::sweep`] at displacements u (m), between the steps behind and ahead; at rest `None`.
    pub fn break_off(
        &mut self,
        found: Overstretched,
        u: &Padded<f64>,
        kinematics: Kinematics,
        behind: Option<Way>,
        ahead: Option<Way>,
    ) -> Failure {
        let Overstretched(events) = found;
        let lost = |event: &Event| {
            self.grid.nonlinear_bond(*event, BondState::AT_ONSET).map_or(0.0, |bond| {
                let [before, now] = self.grid.elongations(u, kinematics, way_of(behind), &bond);
                0.5 * bond.stiffness * before * now
            })
        };
        let energy = events.iter().map(lost).sum();
        let nodal = self.grid.clear_with_nodal(&events, u, kinematics, ahead);
        Failure { broken: events.len(), changed: events.len(), energy, ahead: nodal }
    }

    /// Let fail at rest what displacements u (m) stretch too far, or that has another law what it does there; changes of no more
    /// than `tolerance` are left. Bonds that yield have come there from the displacements `from`, with the forces of
    /// [`FailingBonds::coming_forces`].
    pub fn fail(&mut self, u: &VectorField, from: &VectorField, kinematics: Kinematics, tolerance: f64) -> Failure {
        if !self.grid.breakable() {
            return Failure::default();
        }
        let mut padded = self.grid.padded();
        padded.set(u);
        if self.nonlinear.is_some() {
            let yields = self.yields();
            let moved = |first: usize, second: usize| match yields {
                true => (u.at(second) - from.at(second)) - (u.at(first) - from.at(first)),
                false => Vector3::zeros(),
            };
            return self.follow_from(&padded, kinematics, None, moved, tolerance);
        }
        let found = Overstretched(self.grid.overstretched(&padded, kinematics));
        let failure = self.break_off(found, &padded, kinematics, None, None);
        Failure { energy: failure.energy + failure.ahead, ahead: 0.0, ..failure }
    }
}

/// How far apart two nodes have moved (m) over a step.
fn way_of(way: Option<Way>) -> impl Fn(usize, usize) -> Vector3<f64> + Sync {
    move |first, second| way.map_or(Vector3::zeros(), |(v, step)| step * (v.at(second) - v.at(first)))
}

fn summed(changes: &[Change]) -> f64 {
    changes.iter().map(|c| c.energy).sum()
}

fn counted(changes: &[Change]) -> Failure {
    let count = |of: fn(&Change) -> bool| changes.iter().filter(|c| of(c)).count();
    Failure { broken: count(|c| c.broke), changed: count(|c| c.changed), ..Failure::default() }
}
