//! Bonds that fail: at once, or as another law has them. What fails is booked with the energy that it takes out of a step.
//!
//! In the leapfrog ½ m v₋·v₊ changes from one step to the next by ½ (F + F')·Δu of the forces F, F' at its ends
//! (`solver::motion`). The elongation of a linear bond goes from e to e' over the step. If it breaks there, its force −k e
//! still did half the work of the step, −½ k e (e' − e), that at the end is already missing, and its energy ½ k e² is gone: so
//! the lost energy is ½ k e e'. On average that is the energy at the critical elongation, which lies between the two, to
//! second order in the step.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::build::GridBonds;
use super::measure::{NodeState, elongation};
use super::nonlinear::{Change, NonlinearBond, NonlinearBonds, follow};
use super::padded::Padded;
use super::strip::Event;
use super::sweep::Law;
use crate::bond_law::{BondLaw, BondState, Brittle};
use crate::lattice::Body;
use crate::operator::{GridOperator, Kinematics, VectorField};
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// State of a bond that has no law but to break.
const UNSTRETCHED: BondState = BondState { history: 1.0, permanent: 0.0 };

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
pub struct Overstretched(Vec<Event>);

/// The bonds of a body, and how they fail.
#[derive(Debug)]
pub struct FailingBonds {
    pub(super) grid: GridBonds<f64>,
    /// `None` where the kernels break them at once.
    pub(super) nonlinear: Option<NonlinearBonds>,
}

/// Which state bonds that left the linear law pull by.
#[derive(Clone, Copy, PartialEq)]
enum Pulling {
    /// Their own.
    Own,
    /// Their own, taken from where they are without force: linear in the displacements.
    FromRest,
    /// That which the displacements would bring them to.
    Coming,
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

    /// Forces (N) of displacements, row by row, as [`GridBonds::sweep_breaking`] visits them; brittle bonds that are stretched
    /// too far are without force and are returned, to be broken by [`FailingBonds::break_off`]. Bonds that left the linear law pull
    /// as that of theirs lets them.
    ///
    /// # Errors
    /// As [`GridBonds::sweep`].
    pub fn sweep<V: Send, R: Send>(
        &self,
        u: &Padded<f64>,
        kinematics: Kinematics,
        fields: [&mut [V]; 3],
        visit: impl Fn(usize, [&[f64]; 3], [&mut [V]; 3]) -> R + Sync,
    ) -> Result<(Overstretched, Vec<R>)> {
        if self.nonlinear.is_none() {
            self.grid.refuse_others(u)?;
            let law = Law { kinematics, breaking: self.grid.breakable() };
            let (results, events) = self.grid.pass(u, law, fields, visit);
            return Ok((Overstretched(events), results));
        }
        Ok((Overstretched::default(), self.sweep_intact(u, kinematics, fields, visit)?))
    }

    /// As [`FailingBonds::sweep`], and nothing fails.
    ///
    /// # Errors
    /// As [`GridBonds::sweep`].
    pub fn sweep_intact<V: Send, R: Send>(
        &self,
        u: &Padded<f64>,
        kinematics: Kinematics,
        fields: [&mut [V]; 3],
        visit: impl Fn(usize, [&[f64]; 3], [&mut [V]; 3]) -> R + Sync,
    ) -> Result<Vec<R>> {
        self.grid.refuse_others(u)?;
        let n = self.grid.row_nodes();
        let pulls = self.pulls(kinematics, Pulling::Own, |node| Vector3::from(u.at(node)));
        self.grid.sweep(u, kinematics, fields, |row, force, fields| {
            let here = row_of(&pulls, row * n, n);
            if here.is_empty() {
                return visit(row, force, fields);
            }
            let mut force = force.map(<[f64]>::to_vec);
            for (node, pull) in here {
                force.iter_mut().zip(pull.iter()).for_each(|(f, p)| f[*node as usize - row * n] += p);
            }
            let [x, y, z] = &force;
            visit(row, [x, y, z], fields)
        })
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
            self.grid.nonlinear_bond(*event, UNSTRETCHED).map_or(0.0, |bond| {
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

    /// Forces (N) of displacements (m) under either kinematics.
    pub fn forces_of(&self, u: &VectorField, kinematics: Kinematics, f: &mut VectorField) {
        self.forces_by(u, kinematics, Pulling::Own, f);
    }

    /// Forces (N) of displacements (m), those of bonds that left the linear law as that has them there: not linear in the
    /// displacements.
    pub fn coming_forces(&self, u: &VectorField, kinematics: Kinematics, f: &mut VectorField) {
        self.forces_by(u, kinematics, Pulling::Coming, f);
    }

    fn forces_by(&self, u: &VectorField, kinematics: Kinematics, pulling: Pulling, f: &mut VectorField) {
        match kinematics {
            Kinematics::Linear => self.grid.forces(u, f),
            Kinematics::Finite => self.grid.finite_forces(u, f),
        }
        for (node, pull) in self.pulls(kinematics, pulling, |node| u.at(node)) {
            let sum = f.at(node as usize) + pull;
            f.set(node as usize, &sum);
        }
    }

    /// Forces (N) of the bonds that left the linear law on their ends, by node.
    fn pulls(
        &self,
        kinematics: Kinematics,
        pulling: Pulling,
        at: impl Fn(usize) -> Vector3<f64> + Sync,
    ) -> Vec<(u32, Vector3<f64>)> {
        let Some(nonlinear) = &self.nonlinear else { return Vec::new() };
        let of = |bond: &NonlinearBond| {
            let eta = at(bond.other as usize) - at(bond.node as usize);
            let (elongation, to) = elongation(kinematics, &self.grid.half.xi[usize::from(bond.half)], &eta);
            let (stiffness, beyond) = match pulling {
                Pulling::Own => (nonlinear.stiffness(bond), bond.beyond(elongation)),
                Pulling::FromRest => (nonlinear.stiffness(bond), elongation),
                Pulling::Coming => {
                    let state = nonlinear.law.after_unbroken(&bond.state, elongation / bond.onset);
                    let coming = NonlinearBond { state, ..*bond };
                    (nonlinear.stiffness(&coming), coming.beyond(elongation))
                }
            };
            stiffness * beyond / to.norm() * to
        };
        let pulls: Vec<Vector3<f64>> = nonlinear.list.par_iter().with_min_len(256).map(of).collect();
        let of_end = |&(node, place): &(u32, u32)| {
            let (bond, pull) = (&nonlinear.list[place as usize], pulls[place as usize]);
            (node, if bond.node == node { pull } else { -pull })
        };
        nonlinear.ends().iter().map(of_end).collect()
    }

    /// Every bond that left the linear law, with its stiffness g k (N/m).
    fn departed_bonds(&self) -> impl Iterator<Item = (&NonlinearBond, f64)> {
        self.nonlinear.iter().flat_map(|n| n.list.iter().map(|bond| (bond, n.stiffness(bond))))
    }

    /// Strain energy (J).
    ///
    /// # Errors
    /// Displacements of other bonds.
    pub fn energy(&self, u: &Padded<f64>, kinematics: Kinematics) -> Result<f64> {
        let of = |(bond, stiffness): (&NonlinearBond, f64)| {
            let [_, e] = self.grid.elongations(u, kinematics, |_, _| Vector3::zeros(), bond);
            let beyond = bond.beyond(e);
            0.5 * stiffness * beyond * beyond
        };
        let departed: f64 = self.departed_bonds().map(of).sum();
        Ok(self.grid.energy(u, kinematics)? + departed)
    }

    /// Σ ½ κ (e − p) p (J) of the bonds that yield: by so much their energy is less than −½ Σ u·f.
    pub fn energy_of_rest(&self, u: &Padded<f64>) -> f64 {
        if !self.yields() {
            return 0.0;
        }
        let of = |(bond, stiffness): (&NonlinearBond, f64)| {
            let [_, e] = self.grid.elongations(u, Kinematics::Linear, |_, _| Vector3::zeros(), bond);
            0.5 * stiffness * bond.beyond(e) * bond.state.permanent * bond.onset
        };
        self.departed_bonds().map(of).sum()
    }

    /// Energy and stress of every node; those of a bond that left the linear law are shared by its ends as those of others.
    pub fn node_states(&self, u: &Padded<f64>, kinematics: Kinematics) -> Vec<NodeState> {
        let mut states = self.grid.node_states(u, kinematics);
        let volume = self.grid.body.grid.spacing.powi(3);
        for (bond, k) in self.departed_bonds() {
            let eta = Vector3::from(u.at(bond.other as usize)) - Vector3::from(u.at(bond.node as usize));
            let (elongation, to) = elongation(kinematics, &self.grid.half.xi[usize::from(bond.half)], &eta);
            let beyond = bond.beyond(elongation);
            for node in [bond.node, bond.other] {
                let state = &mut states[node as usize];
                state.energy += 0.25 * k * beyond * beyond;
                state.stress += 0.5 * k * beyond / to.norm() / volume * to * to.transpose();
            }
        }
        states
    }

    /// Plastic stretch of each node (–): the mean over its original bonds of |p|/|ξ|, p the elongation at which a bond is without
    /// force.
    pub fn plastic_stretch(&self) -> Vec<f64> {
        let mut stretch = vec![0.0; self.grid.stencil.len()];
        for (bond, _) in self.departed_bonds() {
            let length = self.grid.half.xi[usize::from(bond.half)].norm();
            for node in [bond.node as usize, bond.other as usize] {
                let bonds = self.grid.original_bonds(node) as f64;
                stretch[node] += bond.state.permanent.abs() * bond.onset / length / bonds;
            }
        }
        stretch
    }

    /// Damage of each node (–): the mean over its original bonds of the share of their fracture energy that they have spent; of
    /// brittle bonds, the share that is broken.
    pub fn damage(&self) -> Vec<f64> {
        let mut damage = self.grid.damage();
        for (bond, law) in self.nonlinear.iter().flat_map(|n| n.list.iter().map(|b| (b, &n.law))) {
            for node in [bond.node, bond.other] {
                let unspent = 1.0 - law.damage(&bond.state);
                damage[node as usize] -= unspent / self.grid.original_bonds(node as usize) as f64;
            }
        }
        damage
    }

    /// Damage (–) of half bond p of a node, or of the bond at its −ξ, which is no longer linear.
    pub(super) fn spent(&self, node: usize, p: usize, ahead: bool) -> f64 {
        let is_it =
            |b: &&NonlinearBond| usize::from(b.half) == p && (if ahead { b.node } else { b.other }) as usize == node;
        let of = |n: &NonlinearBonds| n.of_node(node).find(is_it).map(|bond| n.law.damage(&bond.state));
        self.nonlinear.as_ref().and_then(of).unwrap_or(1.0)
    }

    /// The bonds that left the linear law, as they are kept: node and half bond in a word, history and permanent elongation.
    pub fn departed_state(&self) -> (Vec<u64>, [Vec<f64>; 2]) {
        let words = self.list().iter().map(|b| u64::from(b.node) << 16 | u64::from(b.half)).collect();
        let numbers = |of: fn(&BondState) -> f64| self.list().iter().map(|b| of(&b.state)).collect();
        (words, [numbers(|s| s.history), numbers(|s| s.permanent)])
    }

    /// Go on with bonds as they were: bits of [`GridBonds::unbroken_bits`], and what [`FailingBonds::departed_state`] says.
    ///
    /// # Errors
    /// The state of another body, or of bonds that fail otherwise.
    pub fn restore(&mut self, bits: &[u64], departed: &[u64], [history, permanent]: [&[f64]; 2]) -> Result<()> {
        self.grid.restore_bits(bits)?;
        let bond = |((&word, &history), &permanent): ((&u64, &f64), &f64)| {
            let event = ((word >> 16) as u32, word as u16);
            let inside = (event.0 as usize) < self.grid.stencil.len() && usize::from(event.1) < self.grid.half.len();
            inside.then(|| self.grid.nonlinear_bond(event, BondState { history, permanent })).flatten()
        };
        let list: Option<Vec<NonlinearBond>> = departed.iter().zip(history).zip(permanent).map(bond).collect();
        match (&mut self.nonlinear, list) {
            (Some(nonlinear), Some(list)) => nonlinear.set(list),
            (None, Some(list)) if list.is_empty() => {}
            _ => {
                return Err(Error::input(
                    "the saved bonds have another law than those of this case",
                    "resume with the case as it was",
                ));
            }
        }
        Ok(())
    }
}

/// How far apart two nodes have moved (m) over a step.
fn way_of(way: Option<Way>) -> impl Fn(usize, usize) -> Vector3<f64> + Sync {
    move |first, second| way.map_or(Vector3::zeros(), |(v, step)| step * (v.at(second) - v.at(first)))
}

/// Entries of nodes `first` … `first + count − 1` of a list sorted by node.
fn row_of(pulls: &[(u32, Vector3<f64>)], first: usize, count: usize) -> &[(u32, Vector3<f64>)] {
    let from = |node: usize| pulls.partition_point(|(n, _)| (*n as usize) < node);
    &pulls[from(first)..from(first + count)]
}

fn summed(changes: &[Change]) -> f64 {
    changes.iter().map(|c| c.energy).sum()
}

fn counted(changes: &[Change]) -> Failure {
    let count = |of: fn(&Change) -> bool| changes.iter().filter(|c| of(c)).count();
    Failure { broken: count(|c| c.broke), changed: count(|c| c.changed), ..Failure::default() }
}

impl GridBonds<f64> {
    /// Bonds above their critical stretch.
    fn overstretched(&self, u: &Padded<f64>, kinematics: Kinematics) -> Vec<Event> {
        let nodes = self.stencil.len();
        let (mut x, mut y, mut z) = (vec![(); nodes], vec![(); nodes], vec![(); nodes]);
        let law = Law { kinematics, breaking: true };
        self.pass(u, law, [&mut x, &mut y, &mut z], |_, _, _| ()).1
    }

    /// Unbroken bonds that could fail and are compressed by more than their critical stretch.
    fn compressed(&self, u: &Padded<f64>, kinematics: Kinematics) -> Vec<Event> {
        let n = self.row_nodes();
        let of_node = |node: usize| {
            let (row, e) = (node / n, node % n);
            let here = Vector3::from(u.at(node));
            let is = move |p: usize| {
                let xi = &self.half.xi[p];
                let Some(other) = self.node_at(row, e, self.half.offset[p]).filter(|_| self.own_bit(row, e, p)) else {
                    return false;
                };
                let (shortened, _) = elongation(kinematics, xi, &(Vector3::from(u.at(other)) - here));
                // Most bonds are stretched, or hardly shortened.
                shortened < 0.0 && -shortened > self.constants_of(node, p, true)[1] * xi.norm()
            };
            (0..self.half.len()).filter(move |&p| is(p)).map(move |p| (node as u32, p as u16))
        };
        let nodes = (0..self.stencil.len()).into_par_iter().with_min_len(256);
        nodes.filter(|&node| self.stencil[node] > 0).flat_map_iter(of_node).collect()
    }

    /// A half bond, whether broken or not, in a state of its law; `None` without a node at its end.
    fn nonlinear_bond(&self, (node, half): Event, state: BondState) -> Option<NonlinearBond> {
        let (n, p) = (self.row_nodes(), usize::from(half));
        let other = self.node_at(node as usize / n, node as usize % n, self.half.offset[p])?;
        let [stiffness, critical] = self.constants_of(node as usize, p, true);
        let onset = critical * self.half.xi[p].norm();
        Some(NonlinearBond { node, half, other: other as u32, stiffness, onset, state })
    }

    /// Elongations of a bond (m): before its ends moved apart (m), and now.
    fn elongations(
        &self,
        u: &Padded<f64>,
        kinematics: Kinematics,
        moved: impl Fn(usize, usize) -> Vector3<f64>,
        bond: &NonlinearBond,
    ) -> [f64; 2] {
        let xi = &self.half.xi[usize::from(bond.half)];
        let (first, second) = (bond.node as usize, bond.other as usize);
        let now = Vector3::from(u.at(second)) - Vector3::from(u.at(first));
        let way = moved(first, second);
        [now - way, now].map(|eta| elongation(kinematics, xi, &eta).0)
    }

    /// Break bonds, and return the energy (J) that nodal terms lose by it on a way from u or, with a negative time, to u.
    ///
    /// On a way w from u to u' a changing quadratic energy ½ B(u, u) loses ½ B(u, u') − ½ B'(u, u'), and ½ B(u, u') is the
    /// energy of the mean of both less that of half their difference. Of any energy W it is W(u) + ½ W'(u) w, which at finite
    /// stretch leaves an error of second order in the step.
    fn clear_with_nodal(&mut self, events: &[Event], u: &Padded<f64>, kinematics: Kinematics, way: Option<Way>) -> f64 {
        let broken = || events.iter().map(|&(node, p)| (node as usize, usize::from(p)));
        if !self.has_nodal_term() || events.is_empty() {
            self.fail_bonds(broken());
            return 0.0;
        }
        let other = |&(node, p): &Event| {
            let n = self.row_nodes();
            self.node_at(node as usize / n, node as usize % n, self.half.offset[usize::from(p)])
        };
        let mut ends: Vec<usize> = events.iter().filter_map(other).chain(broken().map(|(node, _)| node)).collect();
        ends.sort_unstable();
        ends.dedup();
        let (mut middle, mut half_way) = (u.clone(), self.padded());
        if let (Some((velocity, step)), Kinematics::Linear) = (way, kinematics) {
            let [x, y, z] = &velocity.components;
            middle.drift([x, y, z], 0.5 * step);
            half_way.drift([x, y, z], 0.5 * step);
        }
        let of = |bonds: &Self, node: usize| match kinematics {
            Kinematics::Linear => {
                bonds.nodal_state(&middle, kinematics, node).0 - bonds.nodal_state(&half_way, kinematics, node).0
            }
            Kinematics::Finite => {
                let work = way.map_or(0.0, |way| 0.5 * bonds.nodal_work(u, node, way));
                bonds.nodal_state(u, kinematics, node).0 + work
            }
        };
        let energy = |bonds: &Self| -> f64 { ends.iter().map(|&node| of(bonds, node)).sum() };
        let before = energy(self);
        self.fail_bonds(broken());
        before - energy(self)
    }

    /// Number of bonds of a node before any broke.
    fn original_bonds(&self, node: usize) -> usize {
        let n = self.row_nodes();
        let offsets = self.half.offset.iter().flat_map(|&offset| [offset, offset.map(|x| -x)]);
        offsets.filter(|&offset| self.node_at(node / n, node % n, offset).is_some()).count()
    }
}

impl GridOperator for FailingBonds {
    fn body(&self) -> &Body {
        self.grid.body()
    }

    fn forces(&self, u: &VectorField, f: &mut VectorField) {
        self.forces_by(u, Kinematics::Linear, Pulling::FromRest, f);
    }

    fn diagonal_block(&self, node: usize) -> Matrix3<f64> {
        let mut block = self.grid.diagonal_block(node);
        for (nonlinear, bond) in self.nonlinear.iter().flat_map(|n| n.of_node(node).map(move |b| (n, b))) {
            let n = self.grid.half.xi[usize::from(bond.half)].normalize();
            block += nonlinear.stiffness(bond) * n * n.transpose();
        }
        block
    }

    fn half_bonds(&self, node: usize, visit: &mut dyn FnMut(usize)) {
        self.grid.half_bonds(node, visit);
        let list = self.list();
        let from = list.partition_point(|b| (b.node as usize) < node);
        let own = list[from..].iter().take_while(|b| b.node as usize == node);
        own.filter(|b| b.stiffness != 0.0).for_each(|b| visit(b.other as usize));
    }

    fn bonds_along(&self, offset: [i32; 3], visit: &(dyn Fn(usize, usize) + Sync)) {
        self.grid.bonds_along(offset, visit);
    }

    fn bulk_stiffness(&self, region: u16) -> Stiffness {
        self.grid.bulk_stiffness(region)
    }

    fn bulk_bonds(&self, region: u16) -> Vec<([i32; 3], f64)> {
        self.grid.bulk_bonds(region)
    }

    fn wholeness(&self, node: usize) -> f64 {
        self.grid.wholeness(node)
    }
}
