//! Forces where the spheres are now.

use std::cell::OnceCell;
use std::collections::HashSet;

use nalgebra::{Matrix3, Vector3};

use super::{Particles, Sums};
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
        periodic.gradient = *gradient;
        for (pose, x) in self.poses.iter_mut().zip(&self.start) {
            let place = if linear { *x } else { x + pose.u() };
            pose.shift(&(gradient * place));
        }
    }

    /// Forces and moments of bonds and contacts where the particles are now; bonds beyond their strength break or follow their
    /// law. `step` (s) is the time since the last evaluation, over which the ends of bonds have moved and contacts have slipped
    /// with the particles' velocities (0 for the first).
    ///
    /// # Errors
    /// Contacts that cannot be searched: positions that are not finite.
    pub fn evaluate(&mut self, step: f64) -> Result<Sums> {
        self.evaluate_within(step, 0.0)
    }

    /// The same at rest; what a law would change by no more than `tolerance` (–) is left.
    ///
    /// # Errors
    /// As [`Particles::evaluate`].
    pub fn evaluate_at_rest(&mut self, tolerance: f64) -> Result<Sums> {
        self.evaluate_within(0.0, tolerance)
    }

    fn evaluate_within(&mut self, step: f64, tolerance: f64) -> Result<Sums> {
        let n = self.len();
        if let Some(periodic) = &self.periodic {
            self.ghosts.refresh(&mut self.poses, n, &periodic.change);
        }
        let rows = forces(
            &At {
                rows: &self.rows,
                poses: &self.poses,
                kinematics: self.kinematics,
                virial: self.periodic.is_some(),
                yields: self.departed.law.yields(),
            },
            &mut self.loads,
        );
        let mut sums = Sums { bonds: rows.energy, virial: matrix(&rows.virial), ..Sums::default() };
        self.fail(&rows.broken, step, tolerance, &mut sums);
        self.add_departed(&mut sums);
        if let Some(periodic) = &mut self.periodic {
            periodic.gradient = Matrix3::zeros();
        }
        self.evaluate_contacts(step, &mut sums)?;
        Ok(sums)
    }

    /// Forces on one particle anew.
    pub(super) fn again(&mut self, place: usize) {
        let mut ignored = RowSums::default();
        let at = At {
            rows: &self.rows,
            poses: &self.poses,
            kinematics: self.kinematics,
            virial: false,
            yields: self.departed.law.yields(),
        };
        piece(&at, place, &mut self.loads[place..=place], &mut ignored);
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
