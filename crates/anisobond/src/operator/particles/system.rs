//! The state of spheres, and the forces on them.
//!
//! Inside, particles are numbered along a space-filling curve; everything public counts as the packing does.

mod saved;

use std::collections::HashSet;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::contact::{Contacts, Scene, TouchingPair, ordered};
use super::ghosts::{Ghosts, Image};
use super::kernel::{At, Load, RowSums, forces, piece};
use super::model::ParticleModel;
use super::pose::Pose;
use super::rows::{Rows, images, unknown_images};
use crate::lattice::Packing;
use crate::operator::morton::morton_order;
use crate::operator::{Kinematics, Network};
use crate::{Error, Result};

pub use saved::Snapshot;
pub(super) use saved::{flat, vectors};

/// What one evaluation of the forces summed up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sums {
    /// Energy of bonds (J).
    pub bonds: f64,
    /// Energy of contacts (J), of their shear as far as it is stored.
    pub contacts: f64,
    /// Σ F⊗l over bonds and contacts (J), F on the particle from which l leads: V times the mean stress. Of a free body
    /// that of contacts alone.
    pub virial: Matrix3<f64>,
    /// What broke in this evaluation.
    pub broken: Broken,
}

/// Bonds that broke.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Broken {
    /// Number.
    pub bonds: usize,
    /// Energy that they held, less what contacts take over (J).
    pub energy: f64,
}

/// The cell's state.
#[derive(Clone, Copy, Debug)]
struct Periodic {
    /// Edges at the start, along the axes (m); `None` for a network whose cell is not known.
    edges: Option<Vector3<f64>>,
    /// Volume at the start (m³).
    volume: f64,
    /// F − I, F the deformation gradient: kept apart from I so that small strains keep their digits.
    change: Matrix3<f64>,
}

impl Periodic {
    fn deformation(&self) -> Matrix3<f64> {
        self.change + Matrix3::identity()
    }
}

/// The parts of the state that solvers move, by place.
pub(crate) struct Motion<'a> {
    pub poses: &'a mut [Pose],
    pub velocity: &'a mut [Vector3<f64>],
    pub spin: &'a mut [Vector3<f64>],
    pub loads: &'a mut [Load],
    pub mass: &'a [f64],
    pub inertia: &'a [f64],
}

/// Spheres in motion: their state, bonds, contacts, and the forces last computed.
///
/// Displacements of a periodic body include the cell's affine motion; velocities do not.
#[derive(Clone, Debug)]
pub struct Particles {
    pub(super) kinematics: Kinematics,
    /// Place of each sphere of the packing, and the sphere of each place.
    place: Vec<u32>,
    sphere: Vec<u32>,
    start: Vec<Vector3<f64>>,
    radii: Vec<f64>,
    mass: Vec<f64>,
    inertia: Vec<f64>,
    /// Particles, then copies of periodic images.
    poses: Vec<Pose>,
    velocity: Vec<Vector3<f64>>,
    spin: Vec<Vector3<f64>>,
    loads: Vec<Load>,
    ghosts: Ghosts,
    rows: Rows,
    contacts: Option<Contacts>,
    periodic: Option<Periodic>,
    /// Images that the model's bonds lead to.
    images: Vec<Image>,
    model: ParticleModel,
    whole: Vec<bool>,
    broken: usize,
}

impl Particles {
    /// Bytes per bond that the kernel of intact bonds reads: two half bonds of 56.
    pub const BYTES_PER_BOND: usize = 2 * size_of::<super::rows::Block>() / super::rows::LANES;

    /// Spheres at rest where their packing has them.
    ///
    /// # Errors
    /// Lists that do not fit; masses, strengths or contact numbers that are not positive; bonds of length zero, with
    /// negative stiffness, or that do not lead from sphere to sphere.
    pub fn new(model: ParticleModel) -> Result<Self> {
        let periodic = model.packing.cell().map(|edges| Periodic {
            edges: Some(edges),
            volume: edges.product(),
            change: Matrix3::zeros(),
        });
        let images = images(&model)?;
        Particles::assemble(model, images, periodic)
    }

    /// The nodes of a network as spheres of radius 1 m and mass 1 kg, its cell known by volume and branches only. They
    /// may be deformed and evaluated; there are no contacts.
    ///
    /// # Errors
    /// As [`Particles::new`]; a nodal term.
    pub fn of_network(network: &Network, kinematics: Kinematics) -> Result<Self> {
        if network.nodal.is_some() {
            return Err(Error::input("spheres have no nodal term", "use bonds alone"));
        }
        let ones = vec![1.0; network.nodes.len()];
        let packing = Packing::new(None, network.nodes.clone(), ones.clone())?;
        let model = ParticleModel::elastic(packing, network, ones, kinematics);
        let images = unknown_images(&model)?;
        Particles::assemble(
            model,
            images,
            Some(Periodic { edges: None, volume: network.volume, change: Matrix3::zeros() }),
        )
    }

    fn assemble(model: ParticleModel, images: Vec<Image>, periodic: Option<Periodic>) -> Result<Self> {
        model.check()?;
        let sphere = morton_order(model.packing.centres());
        let mut place = vec![0u32; sphere.len()];
        for (new, &old) in sphere.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let mut ghosts = Ghosts::default();
        let rows = Rows::new(&model, &place, &images, &mut ghosts);
        let ordered = |values: &[f64]| sphere.iter().map(|&i| values[i as usize]).collect::<Vec<f64>>();
        let (radii, mass) = (ordered(model.packing.radii()), ordered(&model.mass));
        let inertia = mass.iter().zip(&radii).map(|(m, r)| 0.4 * m * r * r).collect();
        let n = sphere.len();
        Ok(Particles {
            kinematics: model.kinematics,
            place,
            start: sphere.iter().map(|&i| model.packing.centres()[i as usize]).collect(),
            radii,
            mass,
            inertia,
            poses: vec![Pose::START; n + ghosts.len()],
            velocity: vec![Vector3::zeros(); n],
            spin: vec![Vector3::zeros(); n],
            loads: vec![Load::default(); n],
            ghosts,
            whole: (0..model.bonds.len()).map(|b| rows.is_whole(b)).collect(),
            rows,
            contacts: model.contact.map(Contacts::new),
            periodic,
            images,
            broken: 0,
            sphere,
            model,
        })
    }

    /// What they were made from.
    pub fn model(&self) -> &ParticleModel {
        &self.model
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

    /// Which bonds of the model are whole.
    pub fn whole(&self) -> &[bool] {
        &self.whole
    }

    /// Number of bonds broken so far.
    pub fn broken_bonds(&self) -> usize {
        self.broken
    }

    /// Share of a sphere's bonds that are broken (–), by sphere; 0 without bonds.
    pub fn damage(&self) -> Vec<f64> {
        let mut count = vec![[0.0f64; 2]; self.len()];
        for (bond, &whole) in self.model.bonds.iter().zip(&self.whole) {
            for end in [bond.a, bond.b] {
                let [all, broken] = &mut count[end as usize];
                *all += 1.0;
                *broken += if whole { 0.0 } else { 1.0 };
            }
        }
        count.into_iter().map(|[all, broken]| if all > 0.0 { broken / all } else { 0.0 }).collect()
    }

    /// Break a bond of the model: a pre-crack; its energy is not accounted for.
    pub fn cut_bond(&mut self, bond: usize) {
        if self.whole[bond] {
            self.remove_bond(bond);
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

    fn remove_bond(&mut self, number: usize) {
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
        let bonded: std::cell::OnceCell<HashSet<(u32, u32, [i32; 3])>> = std::cell::OnceCell::new();
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

pub(super) fn turn(pose: &mut Pose, kinematics: Kinematics, by: &Vector3<f64>) {
    match kinematics {
        Kinematics::Linear => pose.add_theta(by),
        Kinematics::Finite => pose.rotate(by),
    }
}

fn matrix(rows: &[f64; 9]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| rows[3 * i + j])
}
