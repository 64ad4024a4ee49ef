//! Contact of spheres that no bond joins.

use crate::common;

use std::sync::Arc;

use anisobond::bond_law::Brittle;
use anisobond::experiment::particles::{MotionPlan, ParticleMotion};
use anisobond::lattice::Packing;
use anisobond::operator::Kinematics;
use anisobond::operator::particles::{ContactLaw, ParticleModel, Particles, sphere_masses};
use anisobond::solver::particles::{Acting, Held};
use common::spheres::{free, free_model, pair, vector};
use common::{Random, jittered};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

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
    let mut motion = ParticleMotion::new(particles, &plan, free).unwrap();
    let (mut steps, mut deepest) = (0, 0.0f64);
    while motion.time() < 0.05 / (2.0 * speed) + 1.5 * duration {
        motion.advance(free).unwrap();
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
    // Nothing moves or turns but the second sphere, along y.
    let held =
        (0..12).map(|i| Held { sphere: i / 6, component: i as usize % 6, velocity: if i == 7 { speed } else { 0.0 } });
    let acting = Acting { loads: Vec::new(), held: held.collect() };
    let act = |_: &Particles, _: f64, _: f64| acting.clone();
    let plan = MotionPlan { step: Some(1e-4), ..MotionPlan::default() };
    let mut motion = ParticleMotion::new(particles, &plan, act).unwrap();
    let slides_at = friction * push / kt;
    let mut expected_loss = 0.0;
    for _ in 0..1500 {
        motion.advance(act).unwrap();
        let slip = motion.particles().displacement(1).y;
        let shear = motion.particles().touching()[0].shear.norm();
        // The pair turns a little while it shears: one per mille.
        let closed = kt * slip.min(slides_at);
        assert!((shear - closed).abs() < 2e-2 * friction * push, "{slip}: {shear} {closed}");
        expected_loss = friction * push * (slip - slides_at).max(0.0);
    }
    let loss = motion.particles().friction_loss();
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
    let model = ParticleModel {
        packing,
        bonds: Vec::new(),
        mass,
        kinematics: Kinematics::Finite,
        strength: None,
        law: Arc::new(Brittle),
        contact,
    };
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
    let mut motion = ParticleMotion::new(particles, &MotionPlan::default(), free).unwrap();
    (0..300).for_each(|_| motion.advance(free).unwrap());
    assert_eq!(motion.particles().pair_lists(), 1, "{}", motion.particles().displacement(0));
    assert!(motion.particles().displacement(0).x > 1.0);
}
