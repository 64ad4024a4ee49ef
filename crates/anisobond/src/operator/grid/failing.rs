//! Bonds that fail: at once, or softening. What fails is booked with the energy that it takes out of a step.
//!
//! In the leapfrog ½ m v₋·v₊ changes from one step to the next by ½ (F + F')·Δu of the forces F, F' at its ends
//! (`solver::motion`). The elongation of a linear bond goes from e to e' over the step. If it breaks there, its force −k e
//! still did half the work of the step, −½ k e (e' − e), that at the end is already missing, and its energy ½ k e² is gone: so
//! the lost energy is ½ k e e'. On average that is the energy at the critical elongation, which lies between the two, to
//! second order in the step.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::build::GridBonds;
use super::measure::{NodeState, elongation};
use super::padded::Padded;
use super::softening::{Change, LinearSoftening, SoftBond, SoftBonds, damage};
use super::strip::Event;
use super::sweep::Law;
use crate::lattice::Body;
use crate::operator::{GridOperator, Kinematics, VectorField};
use crate::tensor::Stiffness;
use crate::{Error, Result};

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
    pub(super) soft: Option<SoftBonds>,
}

impl FailingBonds {
    /// Bonds that break at once at their critical stretch.
    pub fn brittle(grid: GridBonds<f64>) -> Self {
        FailingBonds { grid, soft: None }
    }

    /// Bonds that soften, and take the energy of bonds that break at their critical stretch.
    pub fn softening(mut grid: GridBonds<f64>, law: LinearSoftening) -> Self {
        let critical = grid.stencils.iter_mut().flat_map(|s| &mut s.critical).chain(&mut grid.critical);
        critical.for_each(|s| *s = law.onset(*s));
        grid.surroundings.change_critical(|s| law.onset(s));
        FailingBonds { grid, soft: Some(SoftBonds::new(law)) }
    }

    /// The bonds on the grid; of those that soften it knows nothing but that they are not whole.
    pub fn grid(&self) -> &GridBonds<f64> {
        &self.grid
    }

    /// Number of bonds that soften at present.
    pub fn softened(&self) -> usize {
        self.list().len()
    }

    pub(super) fn list(&self) -> &[SoftBond] {
        self.soft.as_ref().map_or(&[], |soft| &soft.list)
    }

    /// Damage softening bonds by displacements u (m), to which the step `behind` has led; secants that would fall by no more
    /// than `tolerance` (–) stay. Brittle bonds are left as they are.
    ///
    /// # Errors
    /// As [`GridBonds::sweep`].
    pub fn soften(
        &mut self,
        u: &Padded<f64>,
        kinematics: Kinematics,
        behind: Option<Way>,
        tolerance: f64,
    ) -> Result<Failure> {
        self.grid.refuse_others(u)?;
        Ok(self.soften_by(u, kinematics, behind, tolerance))
    }

    /// [`FailingBonds::soften`] by displacements of these bonds.
    fn soften_by(&mut self, u: &Padded<f64>, kinematics: Kinematics, behind: Option<Way>, tolerance: f64) -> Failure {
        let (grid, Some(soft)) = (&self.grid, &mut self.soft) else { return Failure::default() };
        if !grid.breakable() {
            return Failure::default();
        }
        let elongations = |bond: &SoftBond| grid.elongations(u, kinematics, behind, bond);
        let mut changes = soft.stretch(elongations, tolerance);
        let (mut begun, mut events) = (Vec::new(), Vec::new());
        for event in grid.overstretched(u, kinematics) {
            let Some(mut bond) = grid.soft_bond(event) else { continue };
            let elongations = grid.elongations(u, kinematics, behind, &bond);
            let change = damage(&soft.law, &mut bond, elongations, tolerance);
            if change.changed {
                events.push(event);
                changes.push(change);
            }
            if change.changed && !change.broke {
                begun.push(bond);
            }
        }
        soft.renew(begun);
        let nodal =
            self.grid.clear_with_nodal(&events, u, kinematics, behind.map(|(velocity, step)| (velocity, -step)));
        Failure { energy: summed(&changes) + nodal, ..counted(&changes) }
    }

    /// Forces (N) of displacements, row by row, as [`GridBonds::sweep_breaking`] visits them; brittle bonds that are stretched
    /// too far are without force and are returned, to be broken by [`FailingBonds::break_off`]. Softening bonds pull as damage
    /// lets them.
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
        if self.soft.is_none() {
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
        let pulls = self.pulls(kinematics, |node| Vector3::from(u.at(node)));
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
            self.grid.soft_bond(*event).map_or(0.0, |bond| {
                let [before, now] = self.grid.elongations(u, kinematics, behind, &bond);
                0.5 * bond.stiffness * before * now
            })
        };
        let energy = events.iter().map(lost).sum();
        let nodal = self.grid.clear_with_nodal(&events, u, kinematics, ahead);
        Failure { broken: events.len(), changed: events.len(), energy, ahead: nodal }
    }

    /// Let fail at rest what displacements (m) stretch too far; of softening bonds that whose secant falls by more than
    /// `tolerance`.
    pub fn fail(&mut self, u: &VectorField, kinematics: Kinematics, tolerance: f64) -> Failure {
        if !self.grid.breakable() {
            return Failure::default();
        }
        let mut padded = self.grid.padded();
        padded.set(u);
        if self.soft.is_some() {
            return self.soften_by(&padded, kinematics, None, tolerance);
        }
        let found = Overstretched(self.grid.overstretched(&padded, kinematics));
        let failure = self.break_off(found, &padded, kinematics, None, None);
        Failure { energy: failure.energy + failure.ahead, ahead: 0.0, ..failure }
    }

    /// Forces (N) of displacements (m) under either kinematics.
    pub fn forces_of(&self, u: &VectorField, kinematics: Kinematics, f: &mut VectorField) {
        match kinematics {
            Kinematics::Linear => self.grid.forces(u, f),
            Kinematics::Finite => self.grid.finite_forces(u, f),
        }
        for (node, pull) in self.pulls(kinematics, |node| u.at(node)) {
            let sum = f.at(node as usize) + pull;
            f.set(node as usize, &sum);
        }
    }

    /// Forces (N) of the softening bonds on their ends, by node.
    fn pulls(&self, kinematics: Kinematics, at: impl Fn(usize) -> Vector3<f64> + Sync) -> Vec<(u32, Vector3<f64>)> {
        let Some(soft) = &self.soft else { return Vec::new() };
        let of = |bond: &SoftBond| {
            let eta = at(bond.other as usize) - at(bond.node as usize);
            let (elongation, to) = elongation(kinematics, &self.grid.half.xi[usize::from(bond.half)], &eta);
            soft.stiffness(bond) * elongation / to.norm() * to
        };
        let pulls: Vec<Vector3<f64>> = soft.list.par_iter().with_min_len(256).map(of).collect();
        let of_end = |&(node, place): &(u32, u32)| {
            let (bond, pull) = (&soft.list[place as usize], pulls[place as usize]);
            (node, if bond.node == node { pull } else { -pull })
        };
        soft.ends().iter().map(of_end).collect()
    }

    /// Strain energy (J).
    ///
    /// # Errors
    /// Displacements of other bonds.
    pub fn energy(&self, u: &Padded<f64>, kinematics: Kinematics) -> Result<f64> {
        let of = |soft: &SoftBonds, bond: &SoftBond| {
            let [_, e] = self.grid.elongations(u, kinematics, None, bond);
            0.5 * soft.stiffness(bond) * e * e
        };
        let softened: f64 = self.soft.iter().flat_map(|s| s.list.iter().map(|b| of(s, b))).sum();
        Ok(self.grid.energy(u, kinematics)? + softened)
    }

    /// Energy and stress of every node; a softening bond's are shared by its ends as those of others.
    pub fn node_states(&self, u: &Padded<f64>, kinematics: Kinematics) -> Vec<NodeState> {
        let mut states = self.grid.node_states(u, kinematics);
        let volume = self.grid.body.grid.spacing.powi(3);
        for (soft, bond) in self.soft.iter().flat_map(|s| s.list.iter().map(move |b| (s, b))) {
            let eta = Vector3::from(u.at(bond.other as usize)) - Vector3::from(u.at(bond.node as usize));
            let (elongation, to) = elongation(kinematics, &self.grid.half.xi[usize::from(bond.half)], &eta);
            let k = soft.stiffness(bond);
            for node in [bond.node, bond.other] {
                let state = &mut states[node as usize];
                state.energy += 0.25 * k * elongation * elongation;
                state.stress += 0.5 * k * elongation / to.norm() / volume * to * to.transpose();
            }
        }
        states
    }

    /// Damage of each node (–): the mean over its original bonds of the share of their fracture energy that they have spent; of
    /// brittle bonds, the share that is broken.
    pub fn damage(&self) -> Vec<f64> {
        let mut damage = self.grid.damage();
        for (bond, law) in self.soft.iter().flat_map(|s| s.list.iter().map(|b| (b, s.law))) {
            for node in [bond.node, bond.other] {
                let unspent = 1.0 - law.spent(bond.largest);
                damage[node as usize] -= unspent / self.grid.original_bonds(node as usize) as f64;
            }
        }
        damage
    }

    /// Share of its fracture energy (–) that half bond p of a node, or the bond at its −ξ, has spent, which is no longer whole.
    pub(super) fn spent(&self, node: usize, p: usize, ahead: bool) -> f64 {
        let is_it = |b: &&SoftBond| usize::from(b.half) == p && (if ahead { b.node } else { b.other }) as usize == node;
        let of = |soft: &SoftBonds| soft.of_node(node).find(is_it).map(|bond| soft.law.spent(bond.largest));
        self.soft.as_ref().and_then(of).unwrap_or(1.0)
    }

    /// The bonds that soften, as they are kept: node and half bond in a word, and λ.
    pub fn softened_state(&self) -> (Vec<u64>, Vec<f64>) {
        self.list().iter().map(|b| (u64::from(b.node) << 16 | u64::from(b.half), b.largest)).unzip()
    }

    /// Go on with bonds as they were: bits of [`GridBonds::unbroken_bits`], and what [`FailingBonds::softened_state`] says.
    ///
    /// # Errors
    /// The state of another body, or of bonds that fail otherwise.
    pub fn restore(&mut self, bits: &[u64], softened: &[u64], largest: &[f64]) -> Result<()> {
        self.grid.restore_bits(bits)?;
        let bond = |(&word, &largest): (&u64, &f64)| {
            let event = ((word >> 16) as u32, word as u16);
            let inside = (event.0 as usize) < self.grid.stencil.len() && usize::from(event.1) < self.grid.half.len();
            let bond = inside.then(|| self.grid.soft_bond(event)).flatten();
            bond.map(|bond| SoftBond { largest, ..bond })
        };
        let list: Option<Vec<SoftBond>> = softened.iter().zip(largest).map(bond).collect();
        match (&mut self.soft, list) {
            (Some(soft), Some(list)) => soft.set(list),
            (None, Some(list)) if list.is_empty() => {}
            _ => {
                return Err(Error::input(
                    "the saved bonds soften, but not those of this case",
                    "resume with the case as it was",
                ));
            }
        }
        Ok(())
    }
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

    /// A half bond, whether broken or not, as one whose damage has not begun; `None` without a node at its end.
    fn soft_bond(&self, (node, half): Event) -> Option<SoftBond> {
        let (n, p) = (self.row_nodes(), usize::from(half));
        let other = self.node_at(node as usize / n, node as usize % n, self.half.offset[p])?;
        let [stiffness, critical] = self.constants_of(node as usize, p, true);
        Some(SoftBond {
            node,
            half,
            other: other as u32,
            stiffness,
            onset: critical * self.half.xi[p].norm(),
            largest: 1.0,
        })
    }

    /// Elongations of a bond (m): before the step behind, and now.
    fn elongations(&self, u: &Padded<f64>, kinematics: Kinematics, behind: Option<Way>, bond: &SoftBond) -> [f64; 2] {
        let xi = &self.half.xi[usize::from(bond.half)];
        let (first, second) = (bond.node as usize, bond.other as usize);
        let now = Vector3::from(u.at(second)) - Vector3::from(u.at(first));
        let way = behind.map_or(Vector3::zeros(), |(v, step)| step * (v.at(second) - v.at(first)));
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
        self.forces_of(u, Kinematics::Linear, f);
    }

    fn diagonal_block(&self, node: usize) -> Matrix3<f64> {
        let mut block = self.grid.diagonal_block(node);
        for (soft, bond) in self.soft.iter().flat_map(|s| s.of_node(node).map(move |b| (s, b))) {
            let n = self.grid.half.xi[usize::from(bond.half)].normalize();
            block += soft.stiffness(bond) * n * n.transpose();
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
