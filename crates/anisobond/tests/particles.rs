//! Spheres in motion: laws, conservation, contacts, strength, tests of whole packings.

mod common;

use anisobond::calibration::{EllipticFit, LatticeStiffness, TransverseConstants};
use anisobond::experiment::History;
use anisobond::experiment::element_test::ElementTest;
use anisobond::experiment::particles::{MotionPlan, ParticleCondition, ParticleMotion, TriaxialTest};
use anisobond::lattice::solid::exposed_spheres;
use anisobond::lattice::{Lattice, Packing, Solid};
use anisobond::operator::particles::{
    ContactLaw, ParticleModel, Particles, Strength, bulk_masses, naive, sphere_masses,
};
use anisobond::operator::{Kinematics, Network, StiffBond};
use anisobond::solver::Stopping;
use anisobond::solver::particles::{PointLoad, Support, equilibrium, stable_step};
use common::{Random, jittered};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

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
    free_model_within(1.8, n, seed, kinematics)
}

fn free_model_within(contact_radius: f64, n: usize, seed: u64, kinematics: Kinematics) -> ParticleModel {
    let (lattice, network) = network(&jittered(n, seed, 0.2), contact_radius);
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

/// Σ m v and Σ x×m v + I ω, half a step behind the positions that they go with.
fn momenta(p: &Particles) -> [Vector3<f64>; 2] {
    let (x, v, w) = (p.positions(), p.velocities(), p.spins());
    let mut sum = [Vector3::zeros(); 2];
    for i in 0..p.len() {
        let (_, m, inertia) = p.sphere(i);
        sum[0] += m * v[i];
        sum[1] += x[i].cross(&(m * v[i])) + inertia * w[i];
    }
    sum
}

#[test]
fn momenta_are_kept_and_energy_does_not_drift_over_a_hundred_thousand_steps() {
    let mut random = Random(17);
    let mut particles = Particles::new(free_model(2, 19, Kinematics::Finite)).unwrap();
    // Fast enough for finite strains and turns.
    let pace = 0.02 / stable_step(&particles).unwrap();
    for i in 0..particles.len() {
        particles.set_velocity(i, &vector(&mut random, pace));
        particles.set_spin(i, &vector(&mut random, pace));
    }
    let [p0, l0] = momenta(&particles);
    let plan = MotionPlan { safety: 0.2, fastest: Some(f64::INFINITY), ..MotionPlan::default() };
    let mut motion = ParticleMotion::new(particles, Vec::new(), &plan).unwrap();
    let (mut early, mut late, mut energy) = (0.0f64, 0.0f64, 0.0);
    for step in 0..100_000 {
        motion.advance().unwrap();
        let drift = motion.ledger().drift();
        energy = motion.ledger().stored();
        match step {
            0..20_000 => early = early.max(drift.abs()),
            80_000.. => late = late.max(drift.abs()),
            _ => (),
        }
    }
    let [p, l] = momenta(motion.particles());
    assert!((p - p0).norm() < 1e-11 * p0.norm(), "{:e}", (p - p0).norm() / p0.norm());
    assert!((l - l0).norm() < 1e-11 * l0.norm(), "{:e}", (l - l0).norm() / l0.norm());
    // It swings by the order of the step squared and goes nowhere.
    assert!(early < 1e-2 * energy && late < 1.2 * early, "{early:e} {late:e} of {energy:e}");
    assert!(motion.particles().rotations().iter().any(|r| r.angle() > 0.5));
}

/// Largest swing of the energy while a small body vibrates for a given time.
fn swing(safety: f64) -> f64 {
    let mut random = Random(23);
    let mut particles = Particles::new(free_model(2, 19, Kinematics::Finite)).unwrap();
    let stable = stable_step(&particles).unwrap();
    for i in 0..particles.len() {
        particles.set_velocity(i, &vector(&mut random, 0.01 / stable));
        particles.set_spin(i, &vector(&mut random, 0.01 / stable));
    }
    let plan = MotionPlan { safety, ..MotionPlan::default() };
    let mut motion = ParticleMotion::new(particles, Vec::new(), &plan).unwrap();
    let mut most = 0.0f64;
    while motion.time() < 40.0 * stable {
        motion.advance().unwrap();
        most = most.max(motion.ledger().drift().abs());
    }
    most
}

#[test]
fn the_energy_swings_by_the_square_of_the_step() {
    let order = (swing(0.1) / swing(0.05)).log2();
    assert!((1.7..2.3).contains(&order), "{order}");
}

#[test]
fn threads_and_numbering_do_not_change_a_bit() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut particles = periodic(8, 29, Kinematics::Finite);
            let mut random = Random(31);
            for i in 0..particles.len() {
                particles.set_velocity(i, &vector(&mut random, 5.0));
            }
            let plan = MotionPlan { local: 0.1, viscous: 3.0, ..MotionPlan::default() };
            let mut motion = ParticleMotion::new(particles, Vec::new(), &plan).unwrap();
            (0..20).for_each(|_| motion.advance().unwrap());
            (motion.particles().positions(), *motion.ledger())
        })
    };
    let one = run(1);
    assert!(run(2) == one && run(3) == one);
}

#[test]
fn periodic_images_carry_the_cell() {
    // A uniform strain of the whole cell: energy of all bonds by their branches, by the formula.
    for kinematics in [Kinematics::Linear, Kinematics::Finite] {
        let mut particles = periodic(4, 37, kinematics);
        let gradient = Matrix3::new(0.01, 0.002, 0.0, 0.002, -0.004, 0.003, 0.0, 0.003, 0.005);
        particles.deform(&gradient);
        let sums = particles.evaluate(0.0).unwrap();
        let energy = |b: &StiffBond| {
            let d = [Vector3::zeros(), gradient * b.branch];
            match kinematics {
                Kinematics::Finite => naive::finite_energy(b, d, [UnitQuaternion::identity(); 2]),
                Kinematics::Linear => naive::linear_energy(b, d, [Vector3::zeros(); 2]),
            }
        };
        let expected: f64 = particles.model().bonds.iter().map(energy).sum();
        assert!((sums.bonds / expected - 1.0).abs() < 1e-12, "{} {expected}", sums.bonds);
        // The virial is the derivative of the energy: dU = Σ F⊗l : D.
        let rate = |h: f64| {
            let mut moved = particles.clone();
            moved.deform(&(h * gradient));
            moved.evaluate(0.0).unwrap().bonds
        };
        let slope = (rate(1e-5) - rate(-1e-5)) / 2e-5;
        // Linear: positions stay, so the branches of the virial are those at rest.
        assert!((slope / sums.virial.dot(&gradient) - 1.0).abs() < 1e-6, "{slope} {}", sums.virial.dot(&gradient));
    }
}

/// Breaks exactly where the envelope says, over a table of normal and shear forces.
#[test]
fn a_bond_breaks_on_its_mohr_coulomb_envelope() {
    let (kn, kt) = (1e5, 5e4);
    let strength = Strength { tension: 40.0, cohesion: 60.0, friction_angle: 0.6 };
    for kinematics in [Kinematics::Linear, Kinematics::Finite] {
        let (mut held, mut broken) = (0, 0);
        for i in -30..=10 {
            for j in 0..=40 {
                let (normal, shear) = (f64::from(5 * i) + 0.3, f64::from(4 * j) + 0.1);
                let mut model = pair(Vector3::x(), kn, kt, kinematics);
                model.strength = Some(vec![strength]);
                let mut p = Particles::new(model).unwrap();
                p.move_by(1, &Vector3::new(normal / kn, shear / kt, 0.0));
                let before = naive_energy(&p);
                let sums = p.evaluate(0.0).unwrap();
                let should = normal > 40.0 || shear > 60.0 - normal * 0.6f64.tan();
                // Finite kinematics shifts both by some 10⁻³ relative.
                let margin = (normal - 40.0).abs().min((shear - 60.0 + normal * 0.6f64.tan()).abs());
                if margin > 1.0 {
                    assert_eq!(sums.broken.bonds == 1, should, "{kinematics:?} {normal} {shear}");
                }
                if sums.broken.bonds == 1 {
                    assert!((sums.broken.energy / before - 1.0).abs() < 1e-9 && sums.bonds == 0.0);
                    assert!(p.forces() == vec![Vector3::zeros(); 2] && !p.whole()[0] && p.damage() == [1.0, 1.0]);
                    broken += 1;
                } else {
                    held += 1;
                }
            }
        }
        assert!(held > 300 && broken > 300);
    }
}

/// Two spheres of radius 0.5 that only touch.
fn touching(distance: f64, friction: f64) -> ParticleModel {
    let mut model = pair(Vector3::x() * distance, 1.0, 1.0, Kinematics::Finite);
    model.bonds.clear();
    model.contact = Some(ContactLaw { modulus: 1e6, tangential_ratio: 0.5, friction });
    model
}

#[test]
fn a_contact_bounces_back() {
    let mut particles = Particles::new(touching(1.05, 0.3)).unwrap();
    let speed = 1.0;
    particles.set_velocity(0, &Vector3::new(speed, 0.0, 0.0));
    particles.set_velocity(1, &Vector3::new(-speed, 0.0, 0.0));
    let law = particles.model().contact.unwrap();
    let k = law.normal_stiffness(0.5, 0.5);
    let reduced = 1.0; // two masses of 2 kg
    let duration = std::f64::consts::PI * (reduced / k).sqrt();
    let step = duration / 2000.0;
    let plan = MotionPlan { step: Some(step), ..MotionPlan::default() };
    let mut motion = ParticleMotion::new(particles, Vec::new(), &plan).unwrap();
    let (mut steps, mut deepest) = (0, 0.0f64);
    while motion.time() < 0.05 / (2.0 * speed) + 1.5 * duration {
        motion.advance().unwrap();
        if !motion.particles().touching().is_empty() {
            steps += 1;
            let x = motion.particles().positions();
            deepest = deepest.max(1.0 - (x[1] - x[0]).norm());
        }
    }
    assert!((f64::from(steps) * step / duration - 1.0).abs() < 2e-3);
    assert!((deepest / (2.0 * speed * (reduced / k).sqrt()) - 1.0).abs() < 1e-4, "{deepest}");
    let v = motion.particles().velocities();
    assert!((v[0].x + speed).abs() < 1e-4 && (v[1].x - speed).abs() < 1e-4, "{v:?}");
    assert!(motion.ledger().relative_drift() < 1e-4);
}

#[test]
fn a_contact_sticks_then_slides() {
    let (friction, overlap, speed) = (0.4, 0.01, 0.1);
    let model = {
        let mut model = touching(1.0 - overlap, friction);
        // Apart at the start, so that the overlap is one.
        let x = vec![Vector3::zeros(), Vector3::x() * 1.001];
        model.packing = Packing::new(None, x, vec![0.5, 0.5]).unwrap();
        model
    };
    let mut particles = Particles::new(model).unwrap();
    particles.evaluate(0.0).unwrap();
    particles.move_by(1, &(Vector3::x() * (-0.001 - overlap)));
    let law = particles.model().contact.unwrap();
    let kn = law.normal_stiffness(0.5, 0.5);
    let (push, kt) = (kn * overlap, 0.5 * kn);
    let hold = |spheres: Vec<u32>, value: [f64; 3]| ParticleCondition::Velocity {
        spheres,
        value: value.map(Some),
        history: History::Constant,
    };
    let conditions = vec![
        hold(vec![0], [0.0; 3]),
        hold(vec![1], [0.0, speed, 0.0]),
        ParticleCondition::Spin { spheres: vec![0, 1], value: [Some(0.0); 3], history: History::Constant },
    ];
    let plan = MotionPlan { step: Some(1e-4), ..MotionPlan::default() };
    let mut motion = ParticleMotion::new(particles, conditions, &plan).unwrap();
    let slides_at = friction * push / kt;
    let mut expected_loss = 0.0;
    for _ in 0..1500 {
        motion.advance().unwrap();
        let slip = motion.particles().displacement(1).y;
        let shear = motion.particles().touching()[0].shear.norm();
        // The pair turns a little while it shears: one per mille.
        let closed = kt * slip.min(slides_at);
        assert!((shear - closed).abs() < 2e-2 * friction * push, "{slip}: {shear} {closed}");
        expected_loss = friction * push * (slip - slides_at).max(0.0);
    }
    let loss = motion.ledger().friction;
    assert!((loss / expected_loss - 1.0).abs() < 3e-2, "{loss} {expected_loss}");
    assert!(motion.ledger().relative_drift() < 2e-2, "{}", motion.ledger().relative_drift());
}

#[test]
fn a_touching_pair_turned_as_a_whole_does_not_slip() {
    let mut model = touching(1.001, 0.4);
    model.contact = Some(ContactLaw { modulus: 1e6, tangential_ratio: 0.5, friction: 10.0 });
    let mut p = Particles::new(model).unwrap();
    p.evaluate(0.0).unwrap();
    p.move_by(1, &Vector3::new(-0.011, 0.0, 0.0));
    p.evaluate(0.0).unwrap();
    p.move_by(1, &Vector3::new(0.0, 0.005, 0.0));
    p.evaluate(0.0).unwrap();
    let before = p.touching()[0];
    let spin = Vector3::new(0.7, -0.3, 1.9);
    let turn = UnitQuaternion::from_scaled_axis(spin);
    let x = p.positions();
    for i in 0..2 {
        p.move_by(i, &(turn * x[i] - x[i]));
        p.turn_by(i, &spin);
        p.set_spin(i, &spin);
    }
    p.evaluate(1.0).unwrap();
    let after = p.touching()[0];
    assert!(before.shear.norm() > 0.1);
    assert!((after.force - turn * before.force).norm() < 1e-11 * before.force.norm());
}

/// All pairs of spheres and images that touch, one by one.
fn brute_force(p: &Particles) -> Vec<(u32, u32)> {
    let (x, cell) = (p.positions(), p.cell().unwrap());
    let mut found = Vec::new();
    for a in 0..p.len() {
        for b in a..p.len() {
            for s in 0..125 {
                let image = Vector3::new((s % 5 - 2) as f64, (s / 5 % 5 - 2) as f64, (s / 25 - 2) as f64);
                if a == b && s <= 62 {
                    continue;
                }
                if (x[b] - x[a] + cell * image).norm() < p.sphere(a).0 + p.sphere(b).0 {
                    found.push((a as u32, b as u32));
                }
            }
        }
    }
    found.sort_unstable();
    found
}

#[test]
fn contacts_found_are_those_of_all_pairs() {
    let mut random = Random(41);
    let packing = jittered(4, 43, 0.05);
    let radii = packing.radii().iter().map(|r| 0.8 * r).collect();
    let packing = Packing::new(packing.cell(), packing.centres().to_vec(), radii).unwrap();
    let mass = sphere_masses(&packing, 2500.0);
    let contact = Some(ContactLaw { modulus: 1e7, tangential_ratio: 0.5, friction: 0.5 });
    let model =
        ParticleModel { packing, bonds: Vec::new(), mass, kinematics: Kinematics::Finite, strength: None, contact };
    let mut particles = Particles::new(model).unwrap();
    let gradient = Matrix3::new(-0.012, 0.004, 0.0, 0.004, -0.01, 0.006, 0.0, 0.006, -0.008);
    let mut most = 0;
    particles.evaluate(0.0).unwrap();
    for _ in 0..30 {
        for i in 0..particles.len() {
            particles.move_by(i, &vector(&mut random, 0.02));
        }
        particles.deform(&gradient);
        particles.evaluate(0.0).unwrap();
        let mut found: Vec<(u32, u32)> = particles.touching().iter().map(|t| (t.a.min(t.b), t.a.max(t.b))).collect();
        found.sort_unstable();
        assert_eq!(found, brute_force(&particles));
        most = most.max(found.len());
        let sum: Vector3<f64> = particles.forces().iter().sum();
        assert!(sum.norm() < 1e-8);
    }
    // Not at every step, and not only once.
    assert!(most > 50 && (2..25).contains(&particles.pair_lists()), "{most} {}", particles.pair_lists());
}

/// Where bonds are, no pair is in reach: the list is made once and stays empty.
#[test]
fn an_intact_body_needs_one_list() {
    let mut model = free_model(4, 47, Kinematics::Finite);
    model.contact = Some(ContactLaw { modulus: 1e7, tangential_ratio: 0.5, friction: 0.5 });
    let mut particles = Particles::new(model).unwrap();
    let mut random = Random(1);
    for i in 0..particles.len() {
        let drift = Vector3::new(50.0, 0.0, 0.0);
        particles.set_velocity(i, &(drift + vector(&mut random, 0.1)));
    }
    let mut motion = ParticleMotion::new(particles, Vec::new(), &MotionPlan::default()).unwrap();
    (0..300).for_each(|_| motion.advance().unwrap());
    assert_eq!(motion.particles().pair_lists(), 1, "{}", motion.particles().displacement(0));
    assert!(motion.particles().displacement(0).x > 1.0);
}

#[test]
fn statics_are_relaxed_dynamics() {
    let model = free_model(3, 53, Kinematics::Linear);
    let n = model.packing.len() as u32;
    let x = model.packing.centres();
    let bottom: Vec<u32> = (0..n).filter(|&i| x[i as usize].z < 0.5).collect();
    let top: Vec<u32> = (0..n).filter(|&i| x[i as usize].z > 1.5).collect();
    let loads: Vec<PointLoad> = top
        .iter()
        .map(|&s| PointLoad { sphere: s, force: Vector3::new(3e3, 0.0, 5e3), moment: Vector3::y() * 1e2 })
        .collect();
    let supports: Vec<Support> = bottom.iter().map(|&sphere| Support { sphere, value: [Some(0.0); 6] }).collect();
    let rest = equilibrium(&model, &supports, &loads, &Stopping { tolerance: 1e-12, ..Stopping::default() }).unwrap();
    let held = [Some(0.0); 3];
    let conditions = vec![
        ParticleCondition::Velocity { spheres: bottom.clone(), value: held, history: History::Constant },
        ParticleCondition::Spin { spheres: bottom.clone(), value: held, history: History::Constant },
        ParticleCondition::Load { loads: loads.clone(), history: History::Constant },
    ];
    let particles = Particles::new(model.clone()).unwrap();
    let step = stable_step(&particles).unwrap();
    let plan = MotionPlan { viscous: 0.008 / step, ..MotionPlan::default() };
    let mut motion = ParticleMotion::new(particles, conditions, &plan).unwrap();
    (0..6000).for_each(|_| motion.advance().unwrap());
    let u = motion.particles().displacements();
    let largest = rest.displacement.iter().map(|u| u.norm()).fold(0.0, f64::max);
    for (a, b) in u.iter().zip(&rest.displacement) {
        assert!((a - b).norm() < 1e-6 * largest, "{a} {b}");
    }
    let ledger = motion.ledger();
    assert!((ledger.bonds / rest.energy - 1.0).abs() < 1e-5 && ledger.relative_drift() < 1e-9, "{ledger:?}");
    // Reactions balance the loads.
    let load: Vector3<f64> = loads.iter().map(|l| l.force).sum();
    let reaction: Vector3<f64> = rest.reaction.iter().map(|r| r[0]).sum();
    assert!((load + reaction).norm() < 1e-6 * load.norm());
    // Prescribed displacements move the body as a whole at no cost.
    let shifted: Vec<Support> = bottom
        .iter()
        .map(|&sphere| Support { sphere, value: [Some(1e-3), Some(0.0), Some(0.0), Some(0.0), Some(0.0), Some(0.0)] })
        .collect();
    let rigid = equilibrium(&model, &shifted, &[], &Stopping::default()).unwrap();
    assert!(rigid.displacement.iter().all(|u| (u - Vector3::x() * 1e-3).norm() < 1e-9));
    // A sphere on one bond swings freely: named. And nothing holds the whole.
    let loose = free_model_within(1.5, 3, 53, Kinematics::Linear);
    let said = equilibrium(&loose, &supports, &loads, &Stopping::default()).unwrap_err().to_string();
    assert!(said.contains("19"), "{said}");
    assert!(equilibrium(&model, &[], &loads, &Stopping::default()).is_err());
}

#[test]
fn faults_are_named() {
    let model = free_model(3, 59, Kinematics::Finite);
    let stable = stable_step(&Particles::new(model.clone()).unwrap()).unwrap();
    let start = |plan: &MotionPlan| {
        let mut particles = Particles::new(model.clone()).unwrap();
        particles.set_velocity(5, &Vector3::new(0.1, 0.0, 0.0));
        ParticleMotion::new(particles, Vec::new(), plan)
    };
    let message = |plan: &MotionPlan| match start(plan) {
        Err(e) => e.to_string(),
        Ok(mut motion) => (0..5000).find_map(|_| motion.advance().err()).map_or(String::new(), |e| e.to_string()),
    };
    let base = MotionPlan::default();
    assert_eq!(message(&base), "");
    let above = MotionPlan { step: Some(1.01 * stable), ..base.clone() };
    assert!(message(&above).contains("above the stable one"));
    // The bound is close: twice the step explodes, and the sphere is named.
    let exploding = MotionPlan { step: Some(2.0 * stable), force_step: true, ..base.clone() };
    let said = message(&exploding);
    assert!(said.contains("exploded") && said.contains("sphere") && said.contains("step "), "{said}");
    let bounds = Some([Vector3::repeat(-0.5), Vector3::repeat(3.0)]);
    let leaving = {
        let mut particles = Particles::new(model.clone()).unwrap();
        (0..particles.len()).for_each(|i| particles.set_velocity(i, &Vector3::new(40.0, 0.0, 0.0)));
        let mut motion = ParticleMotion::new(particles, Vec::new(), &MotionPlan { bounds, ..base.clone() }).unwrap();
        (0..5000).find_map(|_| motion.advance().err()).unwrap().to_string()
    };
    assert!(leaving.contains("has left the box"), "{leaving}");
    for plan in [
        MotionPlan { step: Some(0.0), ..base.clone() },
        MotionPlan { safety: 2.0, ..base.clone() },
        MotionPlan { local: 1.0, ..base.clone() },
        MotionPlan { viscous: -1.0, ..base.clone() },
    ] {
        assert!(start(&plan).is_err());
    }
    let mut short = model.clone();
    short.mass.pop();
    assert!(Particles::new(short).is_err());
    let mut astray = model.clone();
    astray.bonds[0].branch *= 1.1;
    assert!(Particles::new(astray).unwrap_err().to_string().contains("leads"));
    let mut weightless = model.clone();
    weightless.mass[3] = 0.0;
    assert!(Particles::new(weightless).unwrap_err().to_string().contains("sphere 4"));
}

#[test]
fn the_stable_step_is_the_pair_s_own() {
    // Two masses on a spring: ω² = 2k/m along, and with rotation across: k_t (2/m + ½ ℓ²/I).
    let (kn, kt) = (1e5, 8e4);
    let p = Particles::new(pair(Vector3::x() * 1.2, kn, kt, Kinematics::Finite)).unwrap();
    let (_, m, inertia) = p.sphere(0);
    let exact = (2.0 * kn / m).max(kt * (2.0 / m + 0.5 * 1.44 / inertia));
    let bound = anisobond::solver::particles::largest_squared_frequency(&p).unwrap();
    assert!(bound >= exact && bound < 1.06 * exact, "{bound} {exact}");
}

/// A standing wave through a packing has the frequency of its measured tensor.
#[test]
fn waves_travel_as_the_measured_tensor_says() {
    let density = 2500.0;
    let (lattice, one) = network(&jittered(4, 61, 0.15), 1.5);
    let tensor = ElementTest::default().run(&one).unwrap().measured;
    let long = lattice.tiled([6, 1, 1]).unwrap();
    let constants = TransverseConstants { c11: 130e6, c33: 55e6, c13: 28e6, c12: 40e6 };
    let fit = EllipticFit::new(&constants.stiffness(&Vector3::z()), &Vector3::z()).unwrap();
    let network = Network::new(&long, &LatticeStiffness::new(&long, &fit.microplane).unwrap());
    let acoustic = Matrix3::from_fn(|i, k| tensor.component(i, 0, k, 0));
    let eigen = acoustic.symmetric_eigen();
    let length = long.packing.cell().unwrap().x;
    let wave = 2.0 * std::f64::consts::PI / length;
    for which in 0..3 {
        let e: Vector3<f64> = eigen.eigenvectors.column(which).into();
        let mass = bulk_masses(&long.packing, long.volume, density);
        let model = ParticleModel::elastic(long.packing.clone(), &network, mass, Kinematics::Finite);
        let mut particles = Particles::new(model).unwrap();
        let x: Vec<f64> = long.packing.centres().iter().map(|x| x.x).collect();
        (0..x.len()).for_each(|i| particles.set_velocity(i, &(1e-3 * e * (wave * x[i]).cos())));
        let mut motion = ParticleMotion::new(particles, Vec::new(), &MotionPlan::default()).unwrap();
        let amplitude = |p: &Particles| -> f64 {
            let u = p.displacements();
            (0..x.len()).map(|i| p.sphere(i).1 * u[i].dot(&e) * (wave * x[i]).cos()).sum()
        };
        // sin(ωt) comes back to zero after half a period.
        let (mut last, mut crossing) = (0.0, f64::NAN);
        while crossing.is_nan() {
            motion.advance().unwrap();
            let now = amplitude(motion.particles());
            if now < 0.0 {
                crossing = motion.time() - motion.step() * now / (now - last);
            }
            last = now;
        }
        let measured = std::f64::consts::PI / crossing / wave;
        let expected = (eigen.eigenvalues[which] / density).sqrt();
        assert!((measured / expected - 1.0).abs() < 0.02, "{which}: {measured} {expected}");
    }
}

#[test]
fn a_tiled_lattice_is_the_lattice_of_the_tiled_packing() {
    let (lattice, one) = network(&jittered(3, 67, 0.2), 1.5);
    let tiled = lattice.tiled([2, 1, 3]).unwrap();
    let searched = Lattice::new(tiled.packing.clone(), 1.5).unwrap();
    assert_eq!(tiled.packing.len(), 6 * lattice.packing.len());
    let key = |l: &Lattice| {
        let mut keys: Vec<(u32, u32, [i64; 3])> =
            l.contacts.iter().map(|c| (c.a, c.b, c.branch.map(|x| (x * 1e6).round() as i64).into())).collect();
        keys.sort_unstable();
        keys
    };
    assert_eq!(key(&tiled), key(&searched));
    let (_, many) = network(&tiled.packing, 1.5);
    let test = |network: &Network| ElementTest::default().run(network).unwrap().measured;
    // A periodic medium is the same medium, however many of its cells are looked at.
    assert!(test(&many).relative_error(&test(&one)) < 1e-6);
    assert!(lattice.tiled([0, 1, 1]).is_err() && lattice.tiled([100_000, 100_000, 1]).is_err());
}

#[test]
fn bodies_cut_from_a_packing() {
    let (lattice, _) = network(&jittered(8, 71, 0.2), 1.4);
    let middle = Vector3::repeat(3.5);
    let hole = Solid::Cylinder { centre: middle, axis: Vector3::z(), radius: 1.8, half_length: f64::INFINITY };
    let everything = Solid::Box { min: Vector3::repeat(-1.0), max: Vector3::repeat(9.0) };
    let rest = Solid::Difference(Box::new(everything.clone()), vec![hole.clone()]);
    let body = lattice.cut(&rest, true).unwrap();
    assert!(body.lattice.packing.cell().is_some() && body.floaters.is_empty());
    assert!(body.lattice.packing.centres().iter().all(|x| rest.contains(x, 0.0)));
    // Free: no bond through the faces.
    let free = lattice.cut(&rest, false).unwrap().lattice;
    let x = free.packing.centres();
    assert!(free.contacts.iter().all(|c| (x[c.b as usize] - x[c.a as usize] - c.branch).norm() < 1e-12));
    assert!(free.contacts.len() < body.lattice.contacts.len());
    // Far apart from the rest: named.
    let island = Solid::Sphere { centre: Vector3::repeat(7.0), radius: 0.9 };
    let corner = Solid::Box { min: Vector3::repeat(-1.0), max: Vector3::repeat(4.0) };
    let cut = lattice.cut(&Solid::Union(vec![corner, island.clone()]), false).unwrap();
    assert!(!cut.floaters.is_empty());
    assert!(cut.floaters.iter().all(|&i| island.contains(&lattice.packing.centres()[i as usize], 0.0)));
    // Pressure in the hole: its area, into the rock, with no resultant.
    let region = Some([Vector3::new(-1.0, -1.0, 0.0), Vector3::new(9.0, 9.0, 8.0)]);
    let patches = exposed_spheres(&free.packing, &hole, true, 1.2, region).unwrap();
    let area: f64 = patches.iter().map(|p| p.area).sum();
    let exact = 2.0 * std::f64::consts::PI * 1.8 * 8.0;
    assert!((area / exact - 1.0).abs() < 0.1, "{area} {exact}");
    let resultant: Vector3<f64> = patches.iter().map(|p| p.area * p.normal).sum();
    assert!(resultant.norm() < 1e-2 * exact, "{resultant}");
    let work: f64 = patches
        .iter()
        .map(|p| {
            let x = free.packing.centres()[p.node as usize] - middle;
            -p.area * p.normal.dot(&Vector3::new(x.x, x.y, 0.0).normalize())
        })
        .sum();
    assert!((work / exact - 1.0).abs() < 0.1, "{work} {exact}");
    assert!(exposed_spheres(&free.packing, &island, true, -1.0, None).is_err());
    assert!(lattice.cut(&Solid::Sphere { centre: Vector3::repeat(40.0), radius: 1.0 }, false).is_err());
}

fn triaxial(strength: Option<Strength>, strain: f64) -> (TriaxialTest, Particles) {
    let mut particles = periodic(4, 73, Kinematics::Finite);
    let mut model = particles.model().clone();
    model.strength = strength.map(|s| vec![s; model.bonds.len()]);
    model.contact = Some(ContactLaw { modulus: 50e6, tangential_ratio: 0.5, friction: 0.5 });
    particles = Particles::new(model).unwrap();
    let step = 0.8 * stable_step(&particles).unwrap();
    let test = TriaxialTest {
        axis: 2,
        confinement: -2e5,
        rate: strain / (4000.0 * step),
        strain,
        points: 60,
        gain: 0.1,
        lateral_rate: 3.0,
        confining_steps: 800,
        plan: MotionPlan { viscous: 0.05 / step, ..MotionPlan::default() },
    };
    (test, particles)
}

#[test]
fn the_triaxial_test_begins_elastic_and_fails() {
    let (test, particles) = triaxial(None, -1e-4);
    let network = Network {
        nodes: particles.model().packing.centres().to_vec(),
        bonds: particles.model().bonds.clone(),
        volume: particles.volume().unwrap(),
        nodal: None,
    };
    let fixed = ElementTest::default().run(&network).unwrap();
    let elastic = test.run(particles).unwrap();
    let (first, last) = (&elastic.curve[0], &elastic.curve[elastic.curve.len() - 1]);
    assert!((first.stress[(0, 0)] / -2e5 - 1.0).abs() < 0.01, "{}", first.stress);
    let young = (last.stress - first.stress)[(2, 2)] / last.strain[(2, 2)];
    // Shear strains are held, so a little stiffer than the free body.
    let expected = fixed.engineering.unwrap().e3;
    assert!((young / expected - 1.0).abs() < 0.03, "{young:e} {expected:e}");
    // Pulled apart it has a peak; pushed together friction would carry on.
    let (mut test, particles) = triaxial(Some(Strength { tension: 2e5, cohesion: 3e5, friction_angle: 0.5 }), 0.03);
    test.confinement = -1e3;
    let failed = test.run(particles).unwrap();
    let peak = &failed.curve[failed.peak];
    let end = &failed.curve[failed.curve.len() - 1];
    assert!(failed.peak > 3 && end.broken_bonds > 20, "{} {}", failed.peak, end.broken_bonds);
    assert!(test.deviator(end) < 0.9 * test.deviator(peak), "{} {}", test.deviator(end), test.deviator(peak));
    assert!(end.coordination < failed.curve[0].coordination);
}
