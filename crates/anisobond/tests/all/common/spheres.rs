//! Spheres with bonds, for the tests of their forces and their motion.

use std::sync::Arc;

use anisobond::bond_law::Brittle;
use anisobond::calibration::{EllipticFit, LatticeStiffness, TransverseConstants};
use anisobond::lattice::{Lattice, Packing};
use anisobond::operator::particles::{ParticleModel, Particles, bulk_masses, naive};
use anisobond::operator::{Kinematics, Network, StiffBond};
use anisobond::solver::particles::Acting;
use nalgebra::Vector3;

use super::{Random, jittered};

/// Nothing acts.
pub fn free(_: &Particles, _: f64, _: f64) -> Acting {
    Acting::default()
}

/// The bonds of a periodic model.
pub fn network_of(model: &ParticleModel) -> Network {
    let nodes = model.packing.centres().to_vec();
    Network { nodes, bonds: model.bonds.clone(), volume: model.packing.cell().unwrap().product(), nodal: None }
}

/// A lattice with the document's stiffnesses.
pub fn network(packing: &Packing, contact_radius: f64) -> (Lattice, Network) {
    let constants = TransverseConstants { c11: 130e6, c33: 55e6, c13: 28e6, c12: 40e6 };
    let fit = EllipticFit::new(&constants.stiffness(&Vector3::z()), &Vector3::z()).unwrap();
    let lattice = Lattice::new(packing.clone(), contact_radius).unwrap();
    let stiffness = LatticeStiffness::new(&lattice, &fit.microplane).unwrap();
    let network = Network::new(&lattice, &stiffness);
    (lattice, network)
}

/// A periodic body of shaken spheres.
pub fn periodic(n: usize, seed: u64, kinematics: Kinematics) -> Particles {
    let (lattice, network) = network(&jittered(n, seed, 0.25), 1.5);
    let mass = bulk_masses(&lattice.packing, lattice.volume, 2500.0);
    Particles::new(ParticleModel::elastic(lattice.packing, &network, mass, kinematics)).unwrap()
}

/// Two spheres and a bond between them.
pub fn pair(branch: Vector3<f64>, kn: f64, kt: f64, kinematics: Kinematics) -> ParticleModel {
    let packing = Packing::new(None, vec![Vector3::zeros(), branch], vec![0.5, 0.5]).unwrap();
    let bonds = vec![StiffBond { a: 0, b: 1, branch, normal: kn, tangential: kt }];
    ParticleModel {
        packing,
        bonds,
        mass: vec![2.0, 2.0],
        kinematics,
        strength: None,
        law: Arc::new(Brittle),
        contact: None,
    }
}

/// A free body: a lattice of shaken spheres whose bonds through the cell's faces are cut.
pub fn free_model(n: usize, seed: u64, kinematics: Kinematics) -> ParticleModel {
    free_model_within(1.8, n, seed, kinematics)
}

pub fn free_model_within(contact_radius: f64, n: usize, seed: u64, kinematics: Kinematics) -> ParticleModel {
    let (lattice, network) = network(&jittered(n, seed, 0.2), contact_radius);
    let centres = lattice.packing.centres().to_vec();
    let whole = |b: &StiffBond| (centres[b.b as usize] - centres[b.a as usize] - b.branch).norm() < 1e-9;
    let bonds = network.bonds.iter().filter(|b| whole(b)).copied().collect();
    let mass = bulk_masses(&lattice.packing, lattice.volume, 2500.0);
    let packing = Packing::new(None, centres, lattice.packing.radii().to_vec()).unwrap();
    ParticleModel { packing, bonds, mass, kinematics, strength: None, law: Arc::new(Brittle), contact: None }
}

pub fn vector(random: &mut Random, size: f64) -> Vector3<f64> {
    size * Vector3::new(random.number(), random.number(), random.number())
}

/// Move and turn all spheres at random.
pub fn shake(particles: &mut Particles, random: &mut Random, size: f64) {
    for i in 0..particles.len() {
        particles.move_by(i, &vector(random, size));
        particles.turn_by(i, &vector(random, size));
    }
}

/// Energy of all bonds by the formula, one after the other; free bodies only.
pub fn naive_energy(particles: &Particles) -> f64 {
    let (u, r) = (particles.displacements(), particles.rotations());
    let of = |b: &StiffBond| {
        let (a, b_) = (b.a as usize, b.b as usize);
        match particles.kinematics() {
            Kinematics::Finite => naive::finite_energy(b, [u[a], u[b_]], [r[a], r[b_]]),
            Kinematics::Linear => naive::linear_energy(b, [u[a], u[b_]], [r[a].scaled_axis(), r[b_].scaled_axis()]),
        }
    };
    particles.model().bonds.iter().map(of).sum()
}
