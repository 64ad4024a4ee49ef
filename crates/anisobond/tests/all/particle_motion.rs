//! Spheres in motion and at rest: what is kept, stable steps, waves, faults, the servo.

use crate::common;

use anisobond::calibration::{EllipticFit, LatticeStiffness, TransverseConstants};
use anisobond::experiment::element_test::ElementTest;
use anisobond::experiment::particles::{MotionPlan, ParticleMotion};
use anisobond::operator::particles::{ContactLaw, ParticleModel, Particles, Strength, bulk_masses};
use anisobond::operator::{Kinematics, Network};
use anisobond::solver::Stopping;
use anisobond::solver::particles::{
    Acting, Control, Held, PointLoad, Servo, Support, affine_stiffness, equilibrium, stable_step,
};
use common::spheres::{free, free_model, free_model_within, network, network_of, pair, periodic, vector};
use common::{Random, jittered};
use nalgebra::{Matrix3, Vector3};

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
    let plan = MotionPlan { safety: 0.2, ..MotionPlan::default() };
    let mut motion = ParticleMotion::new(particles, &plan, free).unwrap();
    let (mut early, mut late, mut energy) = (0.0f64, 0.0f64, 0.0);
    for step in 0..100_000 {
        motion.advance(free).unwrap();
        let drift = motion.ledger().drift();
        energy = motion.ledger().kinetic + motion.ledger().strain;
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
    let mut motion = ParticleMotion::new(particles, &plan, free).unwrap();
    let mut most = 0.0f64;
    while motion.time() < 40.0 * stable {
        motion.advance(free).unwrap();
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
            let mut motion = ParticleMotion::new(particles, &plan, free).unwrap();
            (0..20).for_each(|_| motion.advance(free).unwrap());
            (motion.particles().positions(), *motion.ledger())
        })
    };
    let one = run(1);
    assert!(run(2) == one && run(3) == one);
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
    let still = |&sphere: &u32| (0..6).map(move |component| Held { sphere, component, velocity: 0.0 });
    let acting = Acting { loads: loads.clone(), held: bottom.iter().flat_map(still).collect() };
    let act = |_: &Particles, _: f64, _: f64| acting.clone();
    let particles = Particles::new(model.clone()).unwrap();
    let step = stable_step(&particles).unwrap();
    let plan = MotionPlan { viscous: 0.008 / step, ..MotionPlan::default() };
    let mut motion = ParticleMotion::new(particles, &plan, act).unwrap();
    (0..6000).for_each(|_| motion.advance(act).unwrap());
    let u = motion.particles().displacements();
    let largest = rest.displacement.iter().map(|u| u.norm()).fold(0.0, f64::max);
    for (a, b) in u.iter().zip(&rest.displacement) {
        assert!((a - b).norm() < 1e-6 * largest, "{a} {b}");
    }
    let ledger = motion.ledger();
    assert!((ledger.strain / rest.energy - 1.0).abs() < 1e-5 && ledger.relative_drift() < 1e-9, "{ledger:?}");
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
        ParticleMotion::new(particles, plan, free)
    };
    let message = |plan: &MotionPlan| match start(plan) {
        Err(e) => e.to_string(),
        Ok(mut motion) => (0..5000).find_map(|_| motion.advance(free).err()).map_or(String::new(), |e| e.to_string()),
    };
    let base = MotionPlan::default();
    assert_eq!(message(&base), "");
    let above = MotionPlan { step: Some(1.01 * stable), ..base.clone() };
    assert!(message(&above).contains("above the stable one"));
    // The bound is close: twice the step explodes, and the sphere is named.
    let exploding = MotionPlan { step: Some(2.0 * stable), force_step: true, ..base.clone() };
    let said = message(&exploding);
    assert!(said.contains("thrown out") && said.contains("sphere") && said.contains("step "), "{said}");
    let astray =
        |_: &Particles, _: f64, _: f64| Acting { loads: vec![PointLoad::force(27, Vector3::x())], held: Vec::new() };
    let particles = Particles::new(model.clone()).unwrap();
    let missing = ParticleMotion::new(particles, &base, astray).unwrap_err().to_string();
    assert!(missing.contains("sphere 28 is held or loaded, but there are 27"), "{missing}");
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

/// Local damping takes energy, to rounding what the ledger says, at the default step for every λ: a body held below, driven or
/// pulled above.
#[test]
fn local_damping_balances_and_is_stable() {
    let model = free_model(3, 53, Kinematics::Linear);
    let n = model.packing.len() as u32;
    let x = model.packing.centres();
    let bottom: Vec<u32> = (0..n).filter(|&i| x[i as usize].z < 0.5).collect();
    let top: Vec<u32> = (0..n).filter(|&i| x[i as usize].z > 1.5).collect();
    let force = Vector3::new(3e3, 0.0, 5e3);
    let loads: Vec<PointLoad> = top.iter().map(|&s| PointLoad::force(s, force)).collect();
    let supports: Vec<Support> = bottom.iter().map(|&sphere| Support { sphere, value: [Some(0.0); 6] }).collect();
    let rest = equilibrium(&model, &supports, &loads, &Stopping { tolerance: 1e-12, ..Stopping::default() }).unwrap();
    let still = |&sphere: &u32| (0..6).map(move |component| Held { sphere, component, velocity: 0.0 });
    let held: Vec<Held> = bottom.iter().flat_map(still).collect();
    let pulled = Acting { loads, held: held.clone() };
    for lambda in [0.1, 0.4, 0.7, 0.9, 0.99] {
        let plan = MotionPlan { safety: 0.9, local: lambda, ..MotionPlan::default() };
        let start = |viscous: f64, acting: &Acting| {
            let particles = Particles::new(model.clone()).unwrap();
            let plan = MotionPlan { viscous, ..plan.clone() };
            ParticleMotion::new(particles, &plan, |_, _, _| acting.clone()).unwrap()
        };
        // Pulled: comes to rest where equilibrium is.
        let mut motion = start(0.0, &pulled);
        let mut lost = 0.0;
        for _ in 0..1500 {
            motion.advance(|_, _, _| pulled.clone()).unwrap();
            let ledger = motion.ledger();
            // It may lag by the half step that a turn begins with.
            assert!(ledger.damping >= lost - 1e-3 * ledger.external.abs(), "{lambda}: {ledger:?}");
            lost = ledger.damping;
        }
        let ledger = motion.ledger();
        assert!(ledger.relative_drift() < 1e-12 && ledger.damping > 0.0, "{lambda}: {ledger:?}");
        // Little damping lets it swing on, and near λ = 1 what is left of a force moves the body slowly.
        let settles = (0.3..0.8).contains(&lambda);
        assert!(!settles || (ledger.strain / rest.energy - 1.0).abs() < 0.01, "{lambda}: {ledger:?} {}", rest.energy);
        // Driven, held and free spheres, viscous damping beside.
        let mut motion = start(1e-3 / motion.step(), &Acting { loads: Vec::new(), held: held.clone() });
        for step in 0..400 {
            let pace = 1e-3 / motion.step() * (0.05 * f64::from(step)).sin();
            let mut acting = Acting { loads: Vec::new(), held: held.clone() };
            acting.held.extend(top.iter().map(|&sphere| Held { sphere, component: 2, velocity: pace }));
            motion.advance(|_, _, _| acting.clone()).unwrap();
        }
        let ledger = motion.ledger();
        assert!(ledger.relative_drift() < 1e-12 && ledger.damping > 0.0, "{lambda}: {ledger:?}");
    }
}

/// A sphere on a spring that damping is to bring to rest, at the largest step that it damps at: no swing is left.
#[test]
fn no_swing_is_left_at_the_damped_step() {
    for lambda in [0.1, 0.5, 0.9, 0.99] {
        let mut particles = Particles::new(pair(Vector3::x() * 1.2, 1e5, 8e4, Kinematics::Linear)).unwrap();
        particles.set_velocity(0, &Vector3::new(0.1, 0.05, 0.0));
        let plan = MotionPlan { safety: 0.99, local: lambda, ..MotionPlan::default() };
        let mut motion = ParticleMotion::new(particles, &plan, free).unwrap();
        let start = motion.ledger().kinetic;
        (0..3000).for_each(|_| motion.advance(free).unwrap());
        let ledger = motion.ledger();
        // What is left has no force: the pair as a whole goes on.
        assert!(ledger.strain < 1e-6 * start, "{lambda}: {ledger:?}");
        assert!(ledger.relative_drift() < 1e-10, "{lambda}: {ledger:?}");
    }
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
        let mut motion = ParticleMotion::new(particles, &MotionPlan::default(), free).unwrap();
        let amplitude = |p: &Particles| -> f64 {
            let u = p.displacements();
            (0..x.len()).map(|i| p.sphere(i).1 * u[i].dot(&e) * (wave * x[i]).cos()).sum()
        };
        // sin(ωt) comes back to zero after half a period.
        let (mut last, mut crossing) = (0.0, f64::NAN);
        while crossing.is_nan() {
            motion.advance(free).unwrap();
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

/// A periodic body confined, then strained along z, logarithmically and at a constant rate: points of the axial strain, the
/// mean stress and the number of broken bonds, the first at the end of confinement.
fn triaxial(strength: Option<Strength>, confinement: f64, strain: f64) -> Vec<(f64, Matrix3<f64>, usize)> {
    let mut model = periodic(4, 73, Kinematics::Finite).model().clone();
    model.strength = strength.map(|s| vec![s; model.bonds.len()]);
    model.contact = Some(ContactLaw { modulus: 50e6, tangential_ratio: 0.5, friction: 0.5 });
    let network = network_of(&model);
    let particles = Particles::new(model).unwrap();
    let step = 0.8 * stable_step(&particles).unwrap();
    let (steps, still) = (4000, Control::Rate(0.0));
    let rate = strain / (f64::from(steps) * step);
    let controls =
        [Control::Stress(confinement), Control::Stress(confinement), Control::Stress(confinement), still, still, still];
    let servo = Servo { controls, gain: 0.1, fastest: f64::INFINITY, stiffness: affine_stiffness(&network).unwrap() };
    let plan = MotionPlan { viscous: 0.05 / step, servo: Some(servo), ..MotionPlan::default() };
    let mut motion = ParticleMotion::new(particles, &plan, free).unwrap();
    (0..800).for_each(|_| motion.advance(free).unwrap());
    let height = |motion: &ParticleMotion| motion.particles().deformation().unwrap()[(2, 2)].ln();
    let confined = height(&motion);
    let point = |motion: &ParticleMotion| {
        (height(motion) - confined, motion.stress().unwrap(), motion.particles().broken_bonds())
    };
    let mut curve = vec![point(&motion)];
    let servo = motion.servo_mut().unwrap();
    servo.controls[2] = Control::Rate(rate);
    servo.fastest = 3.0 * rate.abs();
    for done in 1..=steps {
        motion.advance(free).unwrap();
        if done % 67 == 0 || done == steps {
            curve.push(point(&motion));
        }
    }
    // The work of the cell is what is stored and lost.
    assert!(strength.is_some() || motion.ledger().relative_drift() < 1e-3, "{:?}", motion.ledger());
    curve
}

#[test]
fn the_triaxial_test_begins_elastic_and_fails() {
    let network = network_of(periodic(4, 73, Kinematics::Finite).model());
    let fixed = ElementTest::default().run(&network).unwrap();
    let elastic = triaxial(None, -2e5, -1e-4);
    let (first, last) = (&elastic[0], &elastic[elastic.len() - 1]);
    assert!((first.1[(0, 0)] / -2e5 - 1.0).abs() < 0.01, "{}", first.1);
    let young = (last.1 - first.1)[(2, 2)] / last.0;
    // Shear strains are held, so a little stiffer than the free body.
    let expected = fixed.engineering.unwrap().e3;
    assert!((young / expected - 1.0).abs() < 0.03, "{young:e} {expected:e}");
    // Pulled apart it has a peak; pushed together friction would carry on.
    let failed = triaxial(Some(Strength { tension: 2e5, cohesion: 3e5, friction_angle: 0.5 }), -1e3, 0.03);
    let deviator = |(_, s, _): &(f64, Matrix3<f64>, usize)| (s[(2, 2)] - 0.5 * (s[(0, 0)] + s[(1, 1)])).abs();
    let peak = (0..failed.len()).max_by(|&i, &j| deviator(&failed[i]).total_cmp(&deviator(&failed[j]))).unwrap();
    let end = &failed[failed.len() - 1];
    assert!(peak > 3 && end.2 > 20, "{peak} {}", end.2);
    assert!(deviator(end) < 0.9 * deviator(&failed[peak]), "{} {}", deviator(end), deviator(&failed[peak]));
}
