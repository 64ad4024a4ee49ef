//! The state of spheres, and the forces on them.
//!
//! Inside, particles are numbered along a space-filling curve; everything public counts as the packing does.

mod evaluate;
mod fail;
mod reading;
mod saved;

use nalgebra::{Matrix3, Vector3};

use super::contact::Contacts;
use super::departed::DepartedBonds;
use super::ghosts::{Ghosts, Image};
use super::kernel::Load;
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

/// Bonds that broke, or that their law has changed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Broken {
    /// Number of bonds that broke.
    pub bonds: usize,
    /// Number of bonds that changed, those that broke among them.
    pub changed: usize,
    /// Energy lost (J): ½ k e e' of a linear bond of stiffness k that breaks on its way from the elongation e to e'
    /// (`operator::grid::failing`).
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
    /// The gradient (–) by which the cell has moved since the forces were last evaluated.
    gradient: Matrix3<f64>,
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
    departed: DepartedBonds,
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
            gradient: Matrix3::zeros(),
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
            Some(Periodic {
                edges: None,
                volume: network.volume,
                change: Matrix3::zeros(),
                gradient: Matrix3::zeros(),
            }),
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
            departed: DepartedBonds::new(model.law.clone()),
            contacts: model.contact.map(Contacts::new),
            periodic,
            images,
            broken: 0,
            sphere,
            model,
        })
    }
}

pub(super) fn turn(pose: &mut Pose, kinematics: Kinematics, by: &Vector3<f64>) {
    match kinematics {
        Kinematics::Linear => pose.add_theta(by),
        Kinematics::Finite => pose.rotate(by),
    }
}
