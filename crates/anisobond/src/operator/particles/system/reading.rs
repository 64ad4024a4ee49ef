//! What is read of the state, and set in it, by the numbers of the packing's spheres.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{Motion, Particles, Periodic, turn};
use crate::operator::Kinematics;
use crate::operator::particles::contact::TouchingPair;
use crate::operator::particles::model::ParticleModel;

impl Particles {
    /// What they were made from.
    pub fn model(&self) -> &ParticleModel {
        &self.model
    }

    /// Bytes of the bonds' rows, with their strengths: what the kernel reads of bonds. Rows are filled up to eight half bonds.
    pub fn bond_bytes(&self) -> usize {
        size_of_val(&self.rows.blocks[..]) + size_of_val(&self.rows.strength[..])
    }

    /// Number of spheres.
    pub fn len(&self) -> usize {
        self.place.len()
    }

    /// Never: a packing has at least one sphere.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Linear or finite.
    pub fn kinematics(&self) -> Kinematics {
        self.kinematics
    }

    /// Edges of the periodic cell now, as columns (m): H = F H₀. `None` also for a network whose cell is not known.
    pub fn cell(&self) -> Option<Matrix3<f64>> {
        let periodic = self.periodic.as_ref()?;
        periodic.edges.map(|edges| periodic.deformation() * Matrix3::from_diagonal(&edges))
    }

    /// Volume of the periodic body now (m³); with linear kinematics that of the start.
    pub fn volume(&self) -> Option<f64> {
        let stretch =
            |p: &Periodic| if self.kinematics == Kinematics::Linear { 1.0 } else { p.deformation().determinant() };
        self.periodic.as_ref().map(|p| p.volume * stretch(p))
    }

    /// Deformation gradient F of a periodic body; x = F X where nothing moves beside it.
    pub fn deformation(&self) -> Option<Matrix3<f64>> {
        self.periodic.as_ref().map(Periodic::deformation)
    }

    fn listed<T>(&self, of_place: impl Fn(usize) -> T) -> Vec<T> {
        self.place.iter().map(|&p| of_place(p as usize)).collect()
    }

    /// Displacements since the start (m), by sphere; a periodic body's include the cell's.
    pub fn displacements(&self) -> Vec<Vector3<f64>> {
        self.listed(|p| self.poses[p].u())
    }

    /// Positions (m), by sphere; periodic ones are not wrapped.
    pub fn positions(&self) -> Vec<Vector3<f64>> {
        self.listed(|p| self.start[p] + self.poses[p].u())
    }

    /// Rotations since the start, by sphere; of linear kinematics those of the rotation vectors θ.
    pub fn rotations(&self) -> Vec<UnitQuaternion<f64>> {
        self.listed(|p| match self.kinematics {
            Kinematics::Finite => self.poses[p].rotation(),
            Kinematics::Linear => UnitQuaternion::from_scaled_axis(self.poses[p].theta()),
        })
    }

    /// Velocities (m/s), by sphere, without the cell's affine motion.
    pub fn velocities(&self) -> Vec<Vector3<f64>> {
        self.listed(|p| self.velocity[p])
    }

    /// Angular velocities (rad/s), by sphere.
    pub fn spins(&self) -> Vec<Vector3<f64>> {
        self.listed(|p| self.spin[p])
    }

    /// Force of bonds and contacts (N) on a sphere as last computed.
    pub fn force(&self, sphere: usize) -> Vector3<f64> {
        Vector3::from(self.loads[self.place[sphere] as usize].force)
    }

    /// Forces of bonds and contacts (N) as last computed, by sphere.
    pub fn forces(&self) -> Vec<Vector3<f64>> {
        self.listed(|p| Vector3::from(self.loads[p].force))
    }

    /// Moments of bonds and contacts (N·m) as last computed, by sphere.
    pub fn moments(&self) -> Vec<Vector3<f64>> {
        self.listed(|p| Vector3::from(self.loads[p].moment))
    }

    /// Radius (m), mass (kg) and moment of inertia (kg·m²) of a sphere.
    pub fn sphere(&self, sphere: usize) -> (f64, f64, f64) {
        let p = self.place[sphere] as usize;
        (self.radii[p], self.mass[p], self.inertia[p])
    }

    /// Displacement (m) of a sphere.
    pub fn displacement(&self, sphere: usize) -> Vector3<f64> {
        self.poses[self.place[sphere] as usize].u()
    }

    /// Velocity (m/s) of a sphere.
    pub fn velocity(&self, sphere: usize) -> Vector3<f64> {
        self.velocity[self.place[sphere] as usize]
    }

    /// Set the velocity (m/s) of a sphere.
    pub fn set_velocity(&mut self, sphere: usize, velocity: &Vector3<f64>) {
        self.velocity[self.place[sphere] as usize] = *velocity;
    }

    /// Set the angular velocity (rad/s) of a sphere.
    pub fn set_spin(&mut self, sphere: usize, spin: &Vector3<f64>) {
        self.spin[self.place[sphere] as usize] = *spin;
    }

    /// Move a sphere by a displacement (m).
    pub fn move_by(&mut self, sphere: usize, by: &Vector3<f64>) {
        self.poses[self.place[sphere] as usize].shift(by);
    }

    /// Turn a sphere by a rotation vector (radians).
    pub fn turn_by(&mut self, sphere: usize, by: &Vector3<f64>) {
        let p = self.place[sphere] as usize;
        turn(&mut self.poses[p], self.kinematics, by);
    }

    /// What solvers move, in the order of the places.
    pub(crate) fn motion(&mut self) -> Motion<'_> {
        let n = self.place.len();
        Motion {
            poses: &mut self.poses[..n],
            velocity: &mut self.velocity,
            spin: &mut self.spin,
            loads: &mut self.loads,
            mass: &self.mass,
            inertia: &self.inertia,
        }
    }

    /// Place of a sphere.
    pub(crate) fn place_of(&self, sphere: usize) -> usize {
        self.place[sphere] as usize
    }

    /// Sphere of a place.
    pub(crate) fn sphere_at(&self, place: usize) -> usize {
        self.sphere[place] as usize
    }

    /// Which bonds of the model are not broken.
    pub fn whole(&self) -> &[bool] {
        &self.whole
    }

    /// Number of bonds broken so far.
    pub fn broken_bonds(&self) -> usize {
        self.broken
    }

    /// Damage of each sphere (–): the mean over its bonds of the share of their energy that is spent; of brittle bonds, the share
    /// that is broken; 0 without bonds.
    pub fn damage(&self) -> Vec<f64> {
        let mut count = vec![[0.0f64; 2]; self.len()];
        for (number, bond) in self.model.bonds.iter().enumerate() {
            let spent = self.spent(number);
            for end in [bond.a, bond.b] {
                let [all, broken] = &mut count[end as usize];
                *all += 1.0;
                *broken += spent;
            }
        }
        count.into_iter().map(|[all, broken]| if all > 0.0 { broken / all } else { 0.0 }).collect()
    }

    /// Break a bond of the model: a pre-crack; its energy is not accounted for.
    pub fn cut_bond(&mut self, bond: usize) {
        if self.whole[bond] {
            self.rows.break_bond(bond);
            self.forget_bond(bond);
        }
    }

    /// Pairs that touch without a bond, numbered as the packing is.
    pub fn touching(&self) -> Vec<TouchingPair> {
        let of = |t: &TouchingPair| TouchingPair { a: self.sphere[t.a as usize], b: self.sphere[t.b as usize], ..*t };
        self.contacts.as_ref().map_or(Vec::new(), |c| c.touching().iter().map(of).collect())
    }

    /// Times that the list of pairs in reach was made.
    pub fn pair_lists(&self) -> usize {
        self.contacts.as_ref().map_or(0, |c| c.lists)
    }

    /// Lost to friction so far (J).
    pub fn friction_loss(&self) -> f64 {
        self.contacts.as_ref().map_or(0.0, |c| c.friction)
    }
}
