//! Forces where the spheres are now, and what breaks there.

use std::cell::OnceCell;
use std::collections::HashSet;

use nalgebra::{Matrix3, Vector3};

use super::{Broken, Particles, Sums};
use crate::Result;
use crate::operator::Kinematics;
use crate::operator::particles::contact::{Scene, ordered};
use crate::operator::particles::kernel::{At, RowSums, forces, piece};

impl Particles {
    /// Move the periodic body by a gradient D (–): F ← (1 + D) F and x ← (1 + D) x; with linear kinematics F ← F + D and
    /// u ← u + D X. Nothing for a free body.
    pub fn deform(&mut self, gradient: &Matrix3<f64>) {
        let linear = self.kinematics == Kinematics::Linear;
        let Some(periodic) = &mut self.periodic else { return };
        periodic.change += if linear { *gradient } else { gradient * periodic.deformation() };
        for (pose, x) in self.poses.iter_mut().zip(&self.start) {
            let place = if linear { *x } else { x + pose.u() };
            pose.shift(&(gradient * place));
        }
    }

    /// Forces and moments of bonds and contacts where the particles are now; bonds above their strength break. `step`
    /// (s) is the time since the last evaluation, over which contacts have slipped with the particles' velocities (0 for
    /// the first).
    ///
    /// # Errors
    /// Contacts that cannot be searched: positions that are not finite.
    pub fn evaluate(&mut self, step: f64) -> Result<Sums> {
        let n = self.len();
        if let Some(periodic) = &self.periodic {
            self.ghosts.refresh(&mut self.poses, n, &periodic.change);
        }
        let rows = forces(
            &At { rows: &self.rows, poses: &self.poses, kinematics: self.kinematics, virial: self.periodic.is_some() },
            &mut self.loads,
        );
        let mut sums = Sums { bonds: rows.energy, virial: matrix(&rows.virial), ..Sums::default() };
        if !rows.broken.is_empty() {
            sums.broken = self.break_bonds(&rows.broken, &mut sums);
        }
        self.evaluate_contacts(step, &mut sums)?;
        Ok(sums)
    }

    /// Take away what broke. A periodic bond's halves differ by rounding: one alone takes the other with it.
    fn break_bonds(&mut self, halves: &[(u32, f64)], sums: &mut Sums) -> Broken {
        let mut bonds: Vec<(u32, f64)> = halves.to_vec();
        bonds.sort_by_key(|b| b.0);
        let mut broken = Broken::default();
        for same in bonds.chunk_by(|a, b| a.0 == b.0) {
            let bond = same[0].0 as usize;
            self.remove_bond(bond);
            if same.len() == 1 {
                for end in [self.model.bonds[bond].a, self.model.bonds[bond].b] {
                    self.again(self.place[end as usize] as usize);
                }
                sums.bonds -= 0.5 * same[0].1;
            }
            broken.bonds += 1;
            broken.energy += same[0].1;
        }
        broken
    }

    /// Forces on one particle anew.
    fn again(&mut self, place: usize) {
        let mut ignored = RowSums::default();
        let at = At { rows: &self.rows, poses: &self.poses, kinematics: self.kinematics, virial: false };
        piece(&at, place, &mut self.loads[place..=place], &mut ignored);
    }

    pub(super) fn remove_bond(&mut self, number: usize) {
        self.rows.break_bond(number);
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
    fn image(&self, number: usize) -> [i32; 3] {
        self.images[number].key.map(|k| k as i32)
    }

    fn evaluate_contacts(&mut self, step: f64, sums: &mut Sums) -> Result<()> {
        let Some(mut contacts) = self.contacts.take() else { return Ok(()) };
        let n = self.len();
        let positions: Vec<Vector3<f64>> = self.start.iter().zip(&self.poses[..n]).map(|(x, p)| x + p.u()).collect();
        let turned: Vec<Vector3<f64>> = self.spin.iter().map(|w| w * step).collect();
        let scene = Scene {
            positions: &positions,
            radii: &self.radii,
            turned: &turned,
            cell: self.periodic.as_ref().and_then(|p| p.edges.map(|edges| (p.deformation(), edges))),
        };
        let bonded: OnceCell<HashSet<(u32, u32, [i32; 3])>> = OnceCell::new();
        let is_bonded = |pair| bonded.get_or_init(|| self.bonded_pairs()).contains(&pair);
        let listed = contacts.update_list(&scene, &is_bonded);
        let loads = &mut self.loads;
        let found = contacts.forces(&scene, |i, force, moment| {
            for a in 0..3 {
                loads[i].force[a] += force[a];
                loads[i].moment[a] += moment[a];
            }
        });
        sums.contacts = found.energy;
        sums.virial += found.virial;
        self.contacts = Some(contacts);
        listed
    }

    /// Pairs that a whole bond joins.
    fn bonded_pairs(&self) -> HashSet<(u32, u32, [i32; 3])> {
        let bonds = self.model.bonds.iter().enumerate().filter(|(number, _)| self.whole[*number]);
        bonds
            .map(|(number, bond)| ordered(self.place[bond.a as usize], self.place[bond.b as usize], self.image(number)))
            .collect()
    }
}

fn matrix(rows: &[f64; 9]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| rows[3 * i + j])
}
