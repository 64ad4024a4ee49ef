//! Bonds of spheres that leave the linear law: against the scalar law, by their energies, and kept and gone on with.

use crate::common;

use std::sync::Arc;

use anisobond::bond_law::{BondLaw, Brittle, ElasticPlastic, LinearSoftening, TableSoftening};
use anisobond::experiment::element_test::Rotations;
use anisobond::experiment::particles::{MotionPlan, ParticleMotion};
use anisobond::experiment::{
    Collapse, Condition, History, Outcome, OutputPlan, PackingEvidence, PackingProblem, PackingSimulation, Schedule,
};
use anisobond::lattice::Packing;
use anisobond::operator::particles::{ContactLaw, ParticleModel, Particles, Strength};
use anisobond::operator::{Kinematics, StiffBond};
use anisobond::solver::particles::{Acting, Control, Held, Servo, affine_stiffness};
use anisobond::tensor::Material;
use common::Random;
use common::spheres::{free_model, network_of, pair, periodic};
use nalgebra::Vector3;

fn laws() -> Vec<Arc<dyn BondLaw>> {
    vec![
        Arc::new(Brittle),
        Arc::new(LinearSoftening::new(3.0).unwrap()),
        Arc::new(TableSoftening::new(vec![(1.0, 1.0), (2.0, 0.3), (5.0, 0.0)]).unwrap()),
        Arc::new(TableSoftening::exponential(1.5).unwrap()),
        Arc::new(ElasticPlastic::new(0.1, 6.0).unwrap()),
    ]
}

/// Two spheres whose bond has a law, pulled in small steps along x and y (m).
fn pulled(law: &Arc<dyn BondLaw>, kinematics: Kinematics, strength: Strength) -> Particles {
    let mut model = pair(Vector3::x(), 3e5, 1e5, kinematics);
    (model.strength, model.law) = (Some(vec![strength]), law.clone());
    Particles::new(model).unwrap()
}

/// Along its length a bond is the scalar law, to rounding, on a path of tension and compression.
#[test]
fn a_bond_pulled_along_itself_is_the_scalar_law() {
    let tension = 60.0;
    let strength = Strength { tension, cohesion: 1e9, friction_angle: 0.0 };
    let onset = tension / 3e5;
    for law in laws() {
        for kinematics in [Kinematics::Linear, Kinematics::Finite] {
            let mut p = pulled(&law, kinematics, strength);
            let (mut state, mut departed, mut at) = (law.start(), false, 0.0);
            for i in 1..400 {
                let t = f64::from(i) / 400.0;
                let x = onset * 13.0 * t * (30.0 * t).sin();
                p.move_by(1, &(Vector3::x() * (x - at)));
                at = x;
                let sums = p.evaluate(0.0).unwrap();
                let e = x / onset;
                departed |= e > 1.0 || law.yields() && e < -1.0;
                if departed {
                    state = law.after(&state, e);
                }
                let g = if departed { law.secant(&state) } else { 1.0 };
                let wanted = g * tension * (e - state.permanent);
                assert!((p.forces()[0].x - wanted).abs() < 1e-8 * tension, "{law:?} {kinematics:?} at {t}");
                assert!((sums.bonds - 0.5 * wanted * (e - state.permanent) * onset).abs() < 1e-9 * tension * onset);
                let damage = if departed { law.damage(&state) } else { 0.0 };
                assert!((p.damage()[1] - damage).abs() < 1e-9, "{law:?} {kinematics:?} at {t}");
                let plastic = if p.whole()[0] { state.permanent.abs() * onset } else { 0.0 };
                assert!((p.plastic_stretch()[0] - plastic).abs() < 1e-12);
            }
            assert!(!p.whole()[0] && p.departed() == 0 && p.broken_bonds() == 1, "{law:?}");
        }
    }
}

/// Softening bonds take as much of the energy ½ T²/k_n of a brittle one in tension, or of ½ c²/k_t in shear, as their law says.
#[test]
fn bonds_take_the_energy_of_their_law_in_tension_and_in_shear() {
    let strength = Strength { tension: 60.0, cohesion: 40.0, friction_angle: 0.5 };
    for law in laws().into_iter().filter(|law| !law.yields()) {
        for (way, brittle) in [
            (Vector3::x(), 0.5 * 60.0 * 60.0 / 3e5),
            (Vector3::y(), 0.5 * 40.0 * 40.0 / 1e5),
            // Both shares of the strength grow in proportion: (shear + normal tan φ)/c is 1 first.
            (Vector3::new(0.3, 1.0, 0.0), {
                let at = 40.0 / (1e5 + 0.3 * 3e5 * 0.5f64.tan());
                0.5 * (3e5 * 0.09 + 1e5) * at * at
            }),
        ] {
            let mut p = pulled(&law, Kinematics::Linear, strength);
            let (mut lost, step) = (0.0, 1e-8);
            while p.whole()[0] {
                p.move_by(1, &(way * step));
                lost += p.evaluate(0.0).unwrap().broken.energy;
            }
            assert!((lost / (brittle * law.energy_ratio()) - 1.0).abs() < 1e-3, "{law:?} {way:?}: {lost}");
        }
    }
}

/// Spheres torn apart, a plane of them held and another one pulled: the motion and its ledger.
fn torn(law: &Arc<dyn BondLaw>, kinematics: Kinematics) -> (ParticleMotion, impl Fn(&Particles, f64, f64) -> Acting) {
    let mut model = free_model(4, 5, kinematics);
    let radii = model.packing.radii().to_vec();
    let of = |b: &StiffBond| Strength::of_stresses(2e5, 4e5, 0.6, radii[b.a as usize].min(radii[b.b as usize]));
    (model.strength, model.law) = (Some(model.bonds.iter().map(of).collect()), law.clone());
    let z: Vec<f64> = model.packing.centres().iter().map(|c| c.z).collect();
    let acting = move |_: &Particles, _: f64, _: f64| {
        let speed = |z: f64| if z < 0.8 { Some(0.0) } else { (z > 2.2).then_some(4.0) };
        let held = z
            .iter()
            .enumerate()
            .filter_map(|(sphere, z)| speed(*z).map(|velocity| Held { sphere: sphere as u32, component: 2, velocity }));
        Acting { loads: Vec::new(), held: held.collect() }
    };
    let particles = Particles::new(model).unwrap();
    (ParticleMotion::new(particles, &MotionPlan::default(), &acting).unwrap(), acting)
}

/// In motion every joule is accounted for, whatever becomes of the bonds; to rounding where they are linear.
#[test]
fn energies_balance_while_bonds_follow_their_law() {
    for law in laws() {
        for kinematics in [Kinematics::Linear, Kinematics::Finite] {
            let (mut motion, acting) = torn(&law, kinematics);
            let mut departed = 0;
            for _ in 0..1500 {
                motion.advance(&acting).unwrap();
                departed = departed.max(motion.particles().departed());
            }
            let ledger = motion.ledger();
            assert!(ledger.broken_bonds > 5 && ledger.fracture > 0.0, "{law:?}: {ledger:?}");
            assert!(law.breaks_at_once() || departed > 5, "{law:?}: {departed}");
            let bound = if kinematics == Kinematics::Linear { 1e-12 } else { 1e-3 };
            assert!(ledger.relative_drift() < bound, "{law:?} {kinematics:?}: {} {ledger:?}", ledger.relative_drift());
        }
    }
}

/// The same of a periodic cell that a servo strains.
#[test]
fn energies_balance_while_a_servo_strains_the_cell() {
    for law in laws() {
        let mut model = periodic(4, 21, Kinematics::Linear).model().clone();
        let strength = Strength { tension: 4e4, cohesion: 6e4, friction_angle: 0.5 };
        (model.strength, model.law) = (Some(vec![strength; model.bonds.len()]), law.clone());
        let stiffness = affine_stiffness(&network_of(&model)).unwrap();
        let mut controls = [Control::Rate(0.0); 6];
        controls[2] = Control::Rate(1.5);
        let servo = Servo { controls, gain: 0.01, fastest: f64::INFINITY, stiffness };
        let plan = MotionPlan { servo: Some(servo), ..MotionPlan::default() };
        let mut motion = ParticleMotion::new(Particles::new(model).unwrap(), &plan, common::spheres::free).unwrap();
        (0..1200).for_each(|_| motion.advance(common::spheres::free).unwrap());
        let ledger = motion.ledger();
        assert!(ledger.broken_bonds > 5 && ledger.fracture > 0.0, "{law:?}: {ledger:?}");
        assert!(ledger.relative_drift() < 1e-11, "{law:?}: {} {ledger:?}", ledger.relative_drift());
    }
}

/// Kept and gone on with, spheres do to the bit what they do without; threads change nothing.
#[test]
fn states_of_every_law_are_kept_to_the_bit() {
    for law in laws() {
        let (mut motion, acting) = torn(&law, Kinematics::Linear);
        (0..700).for_each(|_| motion.advance(&acting).unwrap());
        let kept = motion.particles().snapshot();
        let mut particles = Particles::new(motion.particles().model().clone()).unwrap();
        particles.restore(kept.clone()).unwrap();
        assert!(particles.snapshot() == kept && particles.departed() == motion.particles().departed());
        assert!(law.breaks_at_once() || particles.departed() > 0, "{law:?}");
        let step = motion.step();
        let forces = |mut p: Particles, threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let sums = p.evaluate(step).unwrap();
                (p.forces(), p.moments(), sums.bonds, p.damage())
            })
        };
        let want = forces(motion.particles().clone(), 1);
        assert!(forces(particles.clone(), 1) == want && forces(particles, 3) == want, "{law:?}");
        // Bonds of another law are not gone on with.
        if !law.breaks_at_once() {
            let mut model = motion.particles().model().clone();
            model.law = Arc::new(Brittle);
            let refused = Particles::new(model).unwrap().restore(kept).unwrap_err().to_string();
            assert!(refused.contains("another law"), "{refused}");
        }
    }
}

/// A bond's share of its strength is 1 exactly where it stops to hold, over a table of forces.
#[test]
fn the_share_of_a_strength_is_one_on_its_envelope() {
    let mut random = Random(17);
    for _ in 0..10_000 {
        let number = |random: &mut Random, low: f64, high: f64| low + (high - low) * 0.5 * (1.0 + random.number());
        let strength = Strength {
            tension: number(&mut random, 1.0, 50.0),
            cohesion: number(&mut random, 1.0, 50.0),
            friction_angle: number(&mut random, 0.0, 1.3),
        };
        let (normal, shear) = (number(&mut random, -80.0, 60.0), number(&mut random, 0.0, 100.0));
        let share = strength.share(normal, shear);
        assert_eq!(share <= 1.0, strength.holds(normal, shear), "{strength:?} {normal} {shear}: {share}");
        assert!(share >= 0.0);
    }
}

/// Three spheres in a row, the first held and the last moved: two bonds, the first of which is weak.
fn row(law: Arc<dyn BondLaw>, last: f64, steps: usize) -> PackingProblem {
    let centres: Vec<Vector3<f64>> = (0..3).map(|i| Vector3::x() * f64::from(i)).collect();
    let bond = |a: u32, normal: f64| StiffBond { a, b: a + 1, branch: Vector3::x(), normal, tangential: 1e5 };
    let weak = Strength { tension: WEAK, cohesion: 1e9, friction_angle: 0.0 };
    let model = ParticleModel {
        packing: Packing::new(None, centres, vec![0.5; 3]).unwrap(),
        bonds: vec![bond(0, 2e5), bond(1, 3e5)],
        mass: vec![1.0; 3],
        kinematics: Kinematics::Linear,
        strength: Some(vec![weak, Strength::UNBREAKABLE]),
        law,
        contact: None,
    };
    let silicon = Material::builtin("Si").unwrap().stiffness;
    let evidence = PackingEvidence {
        region: "row".into(),
        contact_radius: 1.0,
        coordination: 2.0,
        prescribed: silicon,
        summed: silicon,
        elliptic: None,
        measured: None,
        energy_error: None,
        miss: None,
    };
    let held = |sphere: u32, x: f64| Condition::Displacement {
        nodes: vec![sphere],
        value: [Some(x), Some(0.0), Some(0.0)],
        history: History::Ramp { start: 0.0, end: 1.0 },
    };
    PackingProblem {
        name: "row".into(),
        model,
        volumes: vec![1.0; 3],
        region: vec![0; 3],
        origin: Vector3::zeros(),
        periodic: [false; 3],
        rotations: Rotations::Blocked,
        conditions: vec![held(0, 0.0), held(2, last)],
        initial_velocity: vec![],
        schedule: Schedule::equilibrium(steps),
        servo: None,
        probes: vec![],
        output: OutputPlan::default(),
        evidence: vec![evidence],
    }
}

/// Tensile strength of the weak bond (N).
const WEAK: f64 = 50.0;

/// In equilibrium the weak bond of a row breaks where the closed form says; it spends its energy, and what the other gives back is
/// set free.
#[test]
fn a_row_of_spheres_breaks_as_its_closed_form() {
    let compliance = 1.0 / 2e5 + 1.0 / 3e5;
    let last = 1.2 * WEAK * compliance;
    let mut run = PackingSimulation::new(row(Arc::new(Brittle), last, 12)).unwrap();
    for step in 1..=12 {
        run.advance().unwrap();
        let u = last * f64::from(step) / 12.0;
        let ledger = run.ledger();
        if step <= 10 {
            let force = run.particles().force(0).x;
            assert!((force * compliance / u - 1.0).abs() < 1e-9 && ledger.broken_bonds == 0, "{step}: {force}");
        }
        if step == 11 {
            let force = u / compliance;
            assert_eq!(ledger.broken_bonds, 1);
            assert!((ledger.fracture / (0.5 * force * force / 2e5) - 1.0).abs() < 1e-9, "{ledger:?}");
            assert!((ledger.damping / (0.5 * force * force / 3e5) - 1.0).abs() < 1e-6, "{ledger:?}");
            assert!(ledger.strain.abs() < 1e-12 * ledger.external && ledger.relative_drift() < 1e-12, "{ledger:?}");
        }
    }
    assert_eq!((run.outcome(), run.particles().whole()), (&Outcome::Completed, &[false, true][..]));
}

/// A softening bond in a row: k₂ (u − e) = k₁ g(e) e, solved by bisection.
#[test]
fn a_row_of_spheres_softens_as_its_law() {
    let laws: [Arc<dyn BondLaw>; 2] = [
        Arc::new(LinearSoftening::new(6.0).unwrap()),
        Arc::new(TableSoftening::new(vec![(1.0, 1.0), (3.0, 0.4), (7.0, 0.0)]).unwrap()),
    ];
    for law in laws {
        let (k, onset) = ([2e5, 3e5], WEAK / 2e5);
        let last = 5.0 * onset;
        let mut run = PackingSimulation::new(row(law.clone(), last, 50)).unwrap();
        for step in 1..=50 {
            run.advance().unwrap();
            let u = last * f64::from(step) / 50.0;
            let pull = |e: f64| {
                let x = e / onset;
                let g = if x <= 1.0 { 1.0 } else { law.secant(&law.after(&law.start(), x)) };
                k[0] * g * e
            };
            let (mut low, mut high) = (0.0, u);
            for _ in 0..200 {
                let e = 0.5 * (low + high);
                if pull(e) > k[1] * (u - e) { high = e } else { low = e }
            }
            let (found, wanted) = (run.particles().force(0).x, pull(low));
            // Secants are followed to 10⁻⁴.
            assert!((found - wanted).abs() < 2e-3 * WEAK, "{law:?} {step}: {found} {wanted}");
        }
        assert!(run.ledger().fracture > 0.0 && run.ledger().relative_drift() < 1e-12, "{:?}", run.ledger());
    }
}

/// A row that is pulled by a force breaks apart: the outcome says where and what, and the last equilibrium stays.
#[test]
fn a_row_of_spheres_under_a_force_comes_apart() {
    let mut problem = row(Arc::new(Brittle), 0.0, 10);
    let force = vec![Vector3::x() * 2.0 * WEAK];
    let history = History::Ramp { start: 0.0, end: 1.0 };
    problem.conditions[1] = Condition::Force { nodes: vec![2], force, history };
    let mut run = PackingSimulation::new(problem).unwrap();
    while !run.finished() {
        run.advance().unwrap();
    }
    let Outcome::Broke(end) = run.outcome().clone() else { panic!("{:?}", run.outcome()) };
    assert_eq!((end.how, end.broken_bonds), (Collapse::Apart, 1));
    assert!((end.load_factor - 0.5).abs() < 1e-12 && (end.not_reached - 0.6).abs() < 1e-12, "{end:?}");
    assert!(run.particles().whole()[0] && (run.particles().force(0).x - WEAK).abs() < 1e-6 * WEAK);
    assert!((run.time() - 0.5).abs() < 1e-12 && run.ledger().broken_bonds == 0);
    run.show_broken();
    assert!(!run.particles().whole()[0] && (run.time() - 0.6).abs() < 1e-12 && (run.reached() - 0.5).abs() < 1e-12);
    assert!(run.late_warnings()[0].contains("the body broke between load factors 0.5000"), "{:?}", run.late_warnings());
}

/// What equilibrium of packings cannot do is refused before it begins, a start that breaks at its start.
#[test]
fn what_packings_at_rest_cannot_do_is_refused() {
    let refused = |problem: PackingProblem| PackingSimulation::new(problem).err().expect("refused").to_string();
    let yields = row(Arc::new(ElasticPlastic::new(0.1, 5.0).unwrap()), 1e-3, 4);
    assert!(refused(yields).contains("bonds of a packing that yield need motion"));
    let mut touches = row(Arc::new(Brittle), 1e-3, 4);
    touches.model.contact = Some(ContactLaw { modulus: 1e9, tangential_ratio: 0.5, friction: 0.3 });
    assert!(refused(touches).contains("contacts need motion"));
    let mut starts = row(Arc::new(Brittle), 1e-2, 4);
    for condition in &mut starts.conditions {
        if let Condition::Displacement { history, .. } = condition {
            *history = History::Constant;
        }
    }
    starts.schedule = Schedule::motion(1e-3);
    if let Schedule::Motion { from_equilibrium, .. } = &mut starts.schedule {
        *from_equilibrium = true;
    }
    assert!(refused(starts).contains("breaks in its equilibrium at the start: 1 bonds"));
}
