//! What becomes of bonds beyond their strength.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::{Broken, Particles, Sums};
use crate::operator::particles::bond::{Carried, Stretched};
use crate::operator::particles::departed::{Change, Departed, permanent};
use crate::operator::particles::model::Strength;
use crate::operator::particles::pose::Pose;
use crate::operator::{Kinematics, StiffBond};

/// Bonds that left the linear law per piece of work; fewer are not worth waking other threads.
const CHUNK: usize = 256;

/// Something of every bond of a list, in its order.
fn each<T: Send>(list: &[Departed], of: impl Fn(&Departed) -> T + Sync + Send) -> Vec<T> {
    match list.len() {
        0..=CHUNK => list.iter().map(of).collect(),
        _ => list.par_iter().with_min_len(CHUNK).map(of).collect(),
    }
}

impl Particles {
    /// Let bonds fail that the rows found beyond their strength, `halves` with the energy that they held there, and let others
    /// follow their law.
    pub(super) fn fail(&mut self, halves: &[(u32, f64)], step: f64, tolerance: f64, sums: &mut Sums) {
        self.follow(step, tolerance, &mut sums.broken);
        let mut found: Vec<(u32, f64)> = halves.to_vec();
        found.sort_by_key(|b| b.0);
        let mut begun = Vec::new();
        for same in found.chunk_by(|a, b| a.0 == b.0) {
            let bond = same[0].0 as usize;
            let change = self.first_change(bond, step);
            self.rows.break_bond(bond);
            if same.len() == 1 {
                // A periodic bond's halves differ by rounding: one alone takes the other with it.
                for end in [self.model.bonds[bond].a, self.model.bonds[bond].b] {
                    self.again(self.place[end as usize] as usize);
                }
                sums.bonds -= 0.5 * same[0].1;
            }
            sums.broken.energy += change.lost;
            sums.broken.changed += 1;
            match change.state {
                Some(state) => begun.push(Departed { bond: bond as u32, state }),
                None => {
                    sums.broken.bonds += 1;
                    self.forget_bond(bond);
                }
            }
        }
        if !begun.is_empty() {
            self.departed.list.extend(begun);
            self.departed.list.sort_unstable_by_key(|d| d.bond);
        }
    }

    /// What becomes of a linear bond beyond its strength.
    fn first_change(&self, bond: usize, step: f64) -> Change {
        let [before, now] = self.way_of(bond, step);
        let law = &self.departed.law;
        let (b, strength) = (&self.model.bonds[bond], self.strength(bond));
        match law.breaks_at_once() {
            // Where it is just above its strength, rounding decides: the rows have decided.
            true => {
                let crossed = b.normal * before.elongation * now.elongation + b.tangential * before.slip.dot(&now.slip);
                Change { lost: 0.5 * crossed, by: 1.0, state: None }
            }
            false => self.departed.follow(&law.start(), b, &strength, [&before, &now]),
        }
    }

    /// Let the bonds that left the linear law follow it, and drop those that broke.
    fn follow(&mut self, step: f64, tolerance: f64, broken: &mut Broken) {
        if self.departed.list.is_empty() {
            return;
        }
        let one = |d: &Departed| {
            let bond = d.bond as usize;
            let [before, now] = self.way_of(bond, step);
            self.departed.follow(&d.state, &self.model.bonds[bond], &self.strength(bond), [&before, &now])
        };
        let changes = each(&self.departed.list, one);
        let mut list = std::mem::take(&mut self.departed.list);
        let mut place = 0;
        list.retain_mut(|d| {
            let change = &changes[place];
            place += 1;
            if change.state.is_some() && change.by <= tolerance {
                return true;
            }
            broken.energy += change.lost;
            broken.changed += 1;
            let Some(state) = change.state else {
                broken.bonds += 1;
                self.forget_bond(d.bond as usize);
                return false;
            };
            d.state = state;
            true
        });
        self.departed.list = list;
    }

    /// Add the forces, energies and virials of the bonds that left the linear law, in their order.
    pub(super) fn add_departed(&mut self, sums: &mut Sums) {
        let all = each(&self.departed.list, |d| self.carried_by(d));
        for (d, carried) in self.departed.list.iter().zip(&all) {
            let bond = &self.model.bonds[d.bond as usize];
            for (end, force, moment) in
                [(bond.a, carried.force, carried.moments[0]), (bond.b, -carried.force, carried.moments[1])]
            {
                let load = &mut self.loads[self.place[end as usize] as usize];
                for i in 0..3 {
                    load.force[i] += force[i];
                    load.moment[i] += moment[i];
                }
            }
            sums.bonds += carried.energy;
            if self.periodic.is_some() {
                sums.virial += carried.virial;
            }
        }
    }

    fn carried_by(&self, d: &Departed) -> Carried {
        let bond = d.bond as usize;
        self.departed.carried(&d.state, &self.model.bonds[bond], &self.strength(bond), &self.stretched(bond))
    }

    /// What a bond carries where the spheres are; `None` of one that is broken.
    pub fn carried(&self, bond: usize) -> Option<Carried> {
        if !self.whole[bond] {
            return None;
        }
        let b = &self.model.bonds[bond];
        Some(match self.departed.find(bond) {
            Some(departed) => self.carried_by(departed),
            None => self.stretched(bond).carried([b.normal, b.tangential], 0.0),
        })
    }

    /// Share of the energy that a bond takes to break that is spent (–): 1 of a broken one.
    pub(super) fn spent(&self, bond: usize) -> f64 {
        match self.departed.find(bond) {
            _ if !self.whole[bond] => 1.0,
            Some(departed) => self.departed.law.damage(&departed.state),
            None => 0.0,
        }
    }

    /// The bonds that are not broken, as stiff as they are now (N/m).
    ///
    /// Bonds that yield are not without force at their first length; that is not in it.
    pub fn stiff_bonds(&self) -> Vec<StiffBond> {
        let of = |(number, bond): (usize, &StiffBond)| {
            let secant = match self.departed.find(number) {
                _ if !self.whole[number] => return None,
                Some(departed) => self.departed.law.secant(&departed.state),
                None => 1.0,
            };
            Some(StiffBond { normal: secant * bond.normal, tangential: secant * bond.tangential, ..*bond })
        };
        self.model.bonds.iter().enumerate().filter_map(of).collect()
    }

    /// Number of bonds that have left the linear law and are not broken.
    pub fn departed(&self) -> usize {
        self.departed.list.len()
    }

    /// Plastic stretch of each sphere (–): the mean over its bonds of |p|/ℓ₀, p the elongation at which a bond is without force.
    pub fn plastic_stretch(&self) -> Vec<f64> {
        let (mut sum, mut count) = (vec![0.0; self.len()], vec![0.0; self.len()]);
        for bond in &self.model.bonds {
            [bond.a, bond.b].iter().for_each(|&end| count[end as usize] += 1.0);
        }
        for d in &self.departed.list {
            let bond = &self.model.bonds[d.bond as usize];
            let stretch = permanent(&d.state, bond, &self.strength(d.bond as usize)).abs() / bond.branch.norm();
            [bond.a, bond.b].iter().for_each(|&end| sum[end as usize] += stretch);
        }
        sum.into_iter().zip(count).map(|(s, n)| if n > 0.0 { s / n } else { 0.0 }).collect()
    }

    pub(super) fn strength(&self, bond: usize) -> Strength {
        self.model.strength.as_ref().map_or(Strength::UNBREAKABLE, |s| s[bond])
    }

    /// Where a bond is, of the spheres now.
    fn stretched(&self, bond: usize) -> Stretched {
        let b = &self.model.bonds[bond];
        let [first, second] = [b.a, b.b].map(|end| &self.poses[self.place[end as usize] as usize]);
        Stretched::new(self.kinematics, b, &self.moved(bond), [first, second])
    }

    /// How far the second end of a bond is displaced against its first (m).
    pub fn moved(&self, bond: usize) -> Vector3<f64> {
        let b = &self.model.bonds[bond];
        let [u, v] = [b.a, b.b].map(|end| self.poses[self.place[end as usize] as usize].u());
        let image = self.periodic.map_or(Vector3::zeros(), |p| p.change * self.images[bond].shift);
        v + image - u
    }

    /// A bond where it was a step (s) ago, and where it is.
    fn way_of(&self, bond: usize, step: f64) -> [Stretched; 2] {
        let now = self.stretched(bond);
        let still = self.periodic.is_none_or(|p| p.gradient == Matrix3::zeros());
        if step == 0.0 && still {
            return [now, now];
        }
        let b = &self.model.bonds[bond];
        let places = [b.a, b.b].map(|end| self.place[end as usize] as usize);
        let gradient = self.periodic.map_or(Matrix3::zeros(), |p| p.gradient);
        let drift = step * (self.velocity[places[1]] - self.velocity[places[0]]);
        let moved = match self.kinematics {
            Kinematics::Linear => self.moved(bond) - gradient * b.branch - drift,
            Kinematics::Finite => {
                let back = (Matrix3::identity() + gradient).try_inverse().unwrap_or_else(Matrix3::identity);
                back * (b.branch + self.moved(bond)) - b.branch - drift
            }
        };
        let [first, second]: [Pose; 2] = places.map(|place| {
            let mut pose = self.poses[place];
            super::turn(&mut pose, self.kinematics, &(-step * self.spin[place]));
            pose
        });
        [Stretched::new(self.kinematics, b, &moved, [&first, &second]), now]
    }

    /// A bond is gone: what it kept apart touches from now on.
    pub(super) fn forget_bond(&mut self, number: usize) {
        self.whole[number] = false;
        self.broken += 1;
        let bond = &self.model.bonds[number];
        let (a, b, image) = (self.place[bond.a as usize], self.place[bond.b as usize], self.image(number));
        let touch = bond.branch.norm().min(self.radii[a as usize] + self.radii[b as usize]);
        if let Some(contacts) = &mut self.contacts {
            contacts.release((a, b, image), touch);
        }
    }

    /// Image s of b that a bond of the model leads to.
    pub(super) fn image(&self, number: usize) -> [i32; 3] {
        self.images[number].key.map(|k| k as i32)
    }
}
