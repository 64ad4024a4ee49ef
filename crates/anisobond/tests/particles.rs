//! Spheres in motion: laws, conservation, contacts, strength, tests of whole packings.

mod common;

use anisobond::calibration::{EllipticFit, LatticeStiffness, TransverseConstants};
use anisobond::experiment::History;
use anisobond::experiment::particles::{MotionPlan, ParticleCondition, ParticleMotion};
use anisobond::lattice::{Lattice, Packing};
use anisobond::operator::particles::{ContactLaw, ParticleModel, Particles, Strength, bulk_masses, naive};
use anisobond::operator::{Kinematics, Network, StiffBond};
use common::{Random, jittered};
use nalgebra::{UnitQuaternion, Vector3};

/// A lattice with the document's stiffnesses.
fn network(packing: &Packing, contact_radius: f64) -> (Lattice, Network) {
    let constants = TransverseConstants { c11: 130e6, c33: 55e6, c13: 28e6, c12: 40e6 };
    let fit = EllipticFit::new(&constants.stiffness(&Vector3::z()), &Vector3::z()).unwrap();
    let lattice = Lattice::new(packing.clone(), contact_radius).unwrap();
    let stiffness = LatticeStiffness::new(&lattice, &fit.microplane).unwrap();
    let network = Network::new(&lattice, &stiffness);
    (lattice, network)
}

/// A periodic body of shaken spheres.
fn periodic(n: usize, seed: u64, kinematics: Kinematics) -> Particles {
    let (lattice, network) = network(&jittered(n, seed, 0.25), 1.5);
    let mass = bulk_masses(&lattice.packing, lattice.volume, 2500.0);
    Particles::new(ParticleModel::elastic(lattice.packing, &network, mass, kinematics)).unwrap()
}

/// Two spheres and a bond between them.
fn pair(branch: Vector3<f64>, kn: f64, kt: f64, kinematics: Kinematics) -> ParticleModel {
    let packing = Packing::new(None, vec![Vector3::zeros(), branch], vec![0.5, 0.5]).unwrap();
    let bonds = vec![StiffBond { a: 0, b: 1, branch, normal: kn, tangential: kt }];
    ParticleModel { packing, bonds, mass: vec![2.0, 2.0], kinematics, strength: None, contact: None }
}

/// A free body: a lattice of shaken spheres whose bonds through the cell's faces are cut.
fn free_model(n: usize, seed: u64, kinematics: Kinematics) -> ParticleModel {
    let (lattice, network) = network(&jittered(n, seed, 0.2), 1.5);
    let centres = lattice.packing.centres().to_vec();
    let whole = |b: &StiffBond| (centres[b.b as usize] - centres[b.a as usize] - b.branch).norm() < 1e-9;
    let bonds = network.bonds.iter().filter(|b| whole(b)).copied().collect();
    let mass = bulk_masses(&lattice.packing, lattice.volume, 2500.0);
    let packing = Packing::new(None, centres, lattice.packing.radii().to_vec()).unwrap();
    ParticleModel { packing, bonds, mass, kinematics, strength: None, contact: None }
}

fn vector(random: &mut Random, size: f64) -> Vector3<f64> {
    size * Vector3::new(random.number(), random.number(), random.number())
}

/// Move and turn all spheres at random.
fn shake(particles: &mut Particles, random: &mut Random, size: f64) {
    for i in 0..particles.len() {
        particles.move_by(i, &vector(random, size));
        particles.turn_by(i, &vector(random, size));
    }
}

/// Energy of all bonds by the formula, one after the other; free bodies only.
fn naive_energy(particles: &Particles) -> f64 {
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

#[test]
fn the_kernel_is_its_formula_and_force_the_derivative_of_energy() {
    for kinematics in [Kinematics::Linear, Kinematics::Finite] {
        let mut particles = Particles::new(free_model(4, 3, kinematics)).unwrap();
        shake(&mut particles, &mut Random(5), 0.1);
        let sums = particles.evaluate(0.0).unwrap();
        let expected = naive_energy(&particles);
        assert!((sums.bonds / expected - 1.0).abs() < 1e-13, "{} {expected}", sums.bonds);
        let (force, moment) = (particles.forces(), particles.moments());
        let h = 1e-6;
        for sphere in [0, 7, 31, 63] {
            for axis in 0..3 {
                let slope = |act: &dyn Fn(&mut Particles, f64)| {
                    let at = |x: f64| {
                        let mut moved = particles.clone();
                        act(&mut moved, x);
                        naive_energy(&moved)
                    };
                    -(at(h) - at(-h)) / (2.0 * h)
                };
                let e = Vector3::ith(axis, 1.0);
                let f = slope(&|p, x| p.move_by(sphere, &(e * x)));
                let m = slope(&|p, x| p.turn_by(sphere, &(e * x)));
                assert!((f - force[sphere][axis]).abs() < 1e-6 * force[sphere].norm(), "{f} {}", force[sphere]);
                assert!((m - moment[sphere][axis]).abs() < 1e-6 * moment[sphere].norm(), "{m} {}", moment[sphere]);
            }
        }
    }
}

#[test]
fn a_rigid_rotation_costs_nothing_at_any_angle() {
    let mut random = Random(11);
    for angle in [1e-3, 0.5, 2.0, 3.1] {
        let mut particles = Particles::new(free_model(4, 13, Kinematics::Finite)).unwrap();
        // What an ordinary strain of one per mille would cost.
        let scale = {
            let mut strained = particles.clone();
            let x = particles.positions();
            (0..x.len()).for_each(|i| strained.move_by(i, &(1e-3 * x[i])));
            strained.evaluate(0.0).unwrap().bonds
        };
        let axis = vector(&mut random, 1.0).normalize() * angle;
        // Twenty turns one after the other, positions and spheres alike.
        for turn in 1..=20 {
            let whole = UnitQuaternion::from_scaled_axis(axis * f64::from(turn));
            let (x0, x) = (particles.model().packing.centres().to_vec(), particles.positions());
            for i in 0..x.len() {
                particles.move_by(i, &(whole * x0[i] - x[i]));
                particles.turn_by(i, &axis);
            }
        }
        let energy = particles.evaluate(0.0).unwrap().bonds;
        assert!(energy < 1e-22 * scale, "{angle}: {energy:e} of {scale:e}");
    }
}

#[test]
fn two_spheres_by_hand() {
    let (kn, kt, length) = (3e5, 1e5, 1.1);
    for kinematics in [Kinematics::Linear, Kinematics::Finite] {
        let new = || Particles::new(pair(Vector3::x() * length, kn, kt, kinematics)).unwrap();
        let small = 1e-6;
        let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-5 * b.abs() + 1e-9, "{a} {b}");
        // Normal: f = k_n Δ.
        let mut p = new();
        p.move_by(1, &(Vector3::x() * small));
        p.evaluate(0.0).unwrap();
        close(p.forces()[0].x, kn * small);
        assert_eq!(p.forces()[0], -p.forces()[1]);
        // Shear: f = k_t Δ, moments ½ ℓ n×f on both.
        let mut p = new();
        p.move_by(1, &(Vector3::y() * small));
        p.evaluate(0.0).unwrap();
        close(p.forces()[0].y, kt * small);
        close(p.moments()[0].z, 0.5 * length * kt * small);
        close(p.moments()[1].z, 0.5 * length * kt * small);
        // One end turned: slip −½ ℓ θ.
        let mut p = new();
        p.turn_by(0, &(Vector3::z() * small));
        p.evaluate(0.0).unwrap();
        close(p.forces()[0].y, -0.5 * length * kt * small);
        close(p.moments()[0].z, -0.25 * length * length * kt * small);
        close(p.moments()[1].z, -0.25 * length * length * kt * small);
        // Rolling (opposite rotations) and twisting cost nothing.
        for (a, b) in [(Vector3::z(), -Vector3::z()), (Vector3::x(), -Vector3::x()), (Vector3::x(), Vector3::zeros())] {
            let mut p = new();
            p.turn_by(0, &(a * small));
            p.turn_by(1, &(b * small));
            assert!(p.evaluate(0.0).unwrap().bonds < 1e-12 * kt * small * small);
        }
    }
}
