//! Cases on packings whose bonds fail: any law, in motion and at rest, interrupted or not; what is refused.

use anisobond::experiment::{FieldName, Outcome, PackingSimulation};
use anisobond::{ErrorKind, Result};
use anisobond_app::CaseFile;

use crate::common::energies;

const LAWS: [&str; 4] = [
    "softening = \"brittle\"",
    "softening = { linear = 3 }",
    "softening = { exponential = 1 }",
    "plastic = { hardening = 0.2, ductility = 8 }",
];

const MOVING: &str = "motion = { duration = \"30 us\" }\n[[condition]]\non = \"z-max\"\nthickness = 2\n\
                      velocity = [0, 0, \"1 m/s\"]\n";
const RESTING: &str = "equilibrium = { steps = 6, tolerance = 1e-10 }\n[[condition]]\non = \"z-max\"\nthickness = 2\n\
                       displacement = [0, 0, \"30 um\"]\n";

/// A block of spheres, held below and torn above.
fn block(law: &str, schedule: &str) -> Result<PackingSimulation> {
    let text = format!(
        "material = \"Pyroceram\"\ndensity = \"2600 kg/m3\"\nmodel = {{ {law} }}\n\
         packing = {{ radius = \"1 mm\", number = 300, seed = 4, contact_radius = 1.5 }}\n\
         body = {{ box = {{ min = \"0, 0, 0 mm\", max = \"9, 9, 14 mm\" }} }}\n\
         strength = {{ tension = \"20 MPa\", cohesion = \"50 MPa\", friction_angle = 30 }}\n{schedule}\
         [[condition]]\non = \"z-min\"\nthickness = 2\ndisplacement = [0, 0, 0]\n"
    );
    PackingSimulation::new(CaseFile::parse(&text, ".", &[])?.packing_problem()?)
}

/// One thread or two, in one go or saved and restored in the middle: the same bits, and energies that balance.
#[test]
fn runs_on_packings_of_every_law_balance_and_go_on() {
    for law in LAWS {
        for (schedule, balance) in [(MOVING, 1e-11), (RESTING, 1e-8)] {
            let at_rest = schedule == RESTING;
            if law.contains("plastic") && at_rest {
                let refused = block(law, schedule).err().expect("refused").to_string();
                assert!(refused.contains("bonds of a packing that yield need motion"), "{refused}");
                continue;
            }
            let run = |threads: usize, interrupted: bool| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let (mut simulation, mut restored) = (block(law, schedule).unwrap(), false);
                    let mut departed = 0;
                    while !simulation.finished() {
                        simulation.advance().unwrap();
                        departed = departed.max(simulation.particles().departed());
                        if interrupted && !restored && simulation.step() == simulation.steps() / 2 {
                            restored = true;
                            let state = simulation.save();
                            simulation = block(law, schedule).unwrap();
                            simulation.restore(state).unwrap();
                        }
                    }
                    assert_eq!(*simulation.outcome(), Outcome::Completed);
                    let plastic: f32 = simulation.field(FieldName::PlasticStretch).1.iter().sum();
                    (simulation.save(), departed, *simulation.ledger(), plastic)
                })
            };
            let (first, departed, ledger, plastic) = run(1, false);
            println!("{law}: {departed} bonds: {}", energies(&ledger));
            assert!(ledger.relative_drift() < balance, "{law}: {:.1e} {}", ledger.relative_drift(), energies(&ledger));
            assert!(ledger.fracture > 0.0 && ledger.broken_bonds > 3, "{law}: {ledger:?}");
            assert_eq!(departed > 0, !law.contains("brittle"), "{law}");
            assert_eq!(plastic > 0.0, law.contains("plastic"), "{law}");
            assert!(first == run(2, false).0 && first == run(2, true).0, "{law} {schedule}");
        }
    }
}

/// A load step that is stopped while bonds fail in it leaves the body as it was before it, and can be done again.
#[test]
fn a_load_step_that_is_stopped_leaves_nothing_behind() {
    let mut whole = block(LAWS[1], RESTING).unwrap();
    let mut stopped = block(LAWS[1], RESTING).unwrap();
    let mut ended = 0;
    while !whole.finished() {
        whole.advance().unwrap();
        let before = stopped.save();
        let said = stopped.advance_seen(&|within| within.equilibria < 2);
        if let Err(e) = said {
            assert_eq!(e.kind(), ErrorKind::Interrupted, "{e}");
            assert!(stopped.save() == before);
            ended += 1;
            stopped.advance().unwrap();
        }
        assert!(stopped.save() == whole.save());
    }
    assert!(ended > 1, "{ended}");
}

/// Keys about failing bonds that do nothing on a packing are refused, with what would make them do something.
#[test]
fn laws_of_packings_need_a_strength() {
    let case = |law: &str, strength: &str| {
        let text = format!(
            "material = \"Pyroceram\"\ndensity = \"2600 kg/m3\"\nmodel = {{ {law} }}\n{strength}\n\
             packing = {{ radius = \"1 mm\", number = 100, contact_radius = 1.5 }}\nmotion = {{ duration = \"1 us\" }}\n"
        );
        CaseFile::parse(&text, ".", &[]).and_then(|c| c.packing_problem()).map(|_| ()).map_err(|e| e.to_string())
    };
    let (tension, cohesion) = ("strength = { tension = \"5 MPa\" }", "strength = { cohesion = \"5 MPa\" }");
    for law in LAWS {
        assert_eq!(case(law, tension), Ok(()), "{law}");
    }
    let refused = [
        (LAWS[1], "", "softening does nothing where no bond breaks; add [strength]"),
        (LAWS[3], "", "it is not said at which stretch bonds yield; add [strength]"),
        (LAWS[3], cohesion, "bonds yield at their tensile strength, and there is none"),
        ("plastic = { yield_stretch = 0.01, breaking_stretch = 0.1 }", tension, "the tensile strength says when"),
    ];
    for (law, strength, words) in refused {
        let said = case(law, strength).expect_err(law);
        assert!(said.contains("model.") && said.contains(words), "{law}: {said}");
    }
    assert_eq!(case(LAWS[0], ""), Ok(()));
}
