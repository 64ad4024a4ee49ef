//! How runs end: broken, interrupted, completed; what is said of overlap, parts and coarse dimensions.

use crate::given::case;

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

use anisobond::Error;
use anisobond::experiment::{Between, Collapse, Outcome, PackingSimulation, Problem, RunCost, Simulation, WithinStep};
use anisobond_app::CaseFile;
use anisobond_app::run::{RunOptions, RunSummary, run_problem};
use anisobond_formats::Inputs;
use case::problem;

/// A bar in plane strain, 40 × 8 nodes, E = 80 GPa and ν = ¼, that breaks at a stretch of 10⁻³; its ends do not break.
const BAR: &str = r#"
name = "bar"
material = { class = "isotropic", unit = "GPa", engineering = { e = 80, nu = 0.25 } }
density = "2000 kg/m3"
[body]
box = { size = "40, 8 mm" }
[grid]
spacing = "1 mm"
plane_strain = "z"
"#;

const BREAKS: &str = r#"
[[region]]
name = "bar"
fracture = { stretch = 1e-3 }
[[unbreakable]]
on = "x-min"
thickness = 8
[[unbreakable]]
on = "x-max"
thickness = 8
"#;

fn pulled(load: &str, steps: usize) -> Problem {
    problem(&format!(
        "{BAR}{BREAKS}{load}\n[equilibrium]\nsteps = {steps}\n[output]\nfields = [\"damage\"]\nframes = 2\n"
    ))
}

/// Twice the stress at which its bonds along x reach the stretch.
const TRACTION: &str = r#"
[[condition]]
on = "x-min"
traction = ["-170.667 MPa", 0, 0]
[[condition]]
on = "x-max"
traction = ["170.667 MPa", 0, 0]
"#;

fn run(problem: Problem, folder: &std::path::Path, resume: bool, stop: &AtomicBool) -> anisobond::Result<RunSummary> {
    let options = RunOptions { folder, resume, force: false, stop };
    run_problem(problem, &Inputs::of_program(), &options, |_| ())
}

/// A load beyond collapse: σ = E/(1 − ν²) s_c of a uniform bar in plane strain lies between the two factors that are told, and all
/// that was reached is kept, with frames of the last equilibrium and of the broken bar.
#[test]
fn a_load_beyond_collapse_is_an_outcome() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let summary = run(pulled(TRACTION, 10), &out, false, &AtomicBool::new(false)).unwrap();
    let Outcome::Broke(end) = &summary.outcome else { panic!("{:?}", summary.outcome) };
    assert!(end.load_factor <= 0.5 && 0.5 - 0.15 <= end.load_factor && end.not_reached <= 0.6, "{end:?}");
    assert!(end.broken_bonds > 0 && end.how == Collapse::Apart && end.what.contains("translation along x"), "{end:?}");
    assert_eq!(summary.time, end.load_factor);
    assert!(
        summary.warnings.iter().any(|w| w.contains("the body broke between load factors")),
        "{:?}",
        summary.warnings
    );
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let probes = read("probes.csv");
    let last: f64 = probes.lines().last().unwrap().split(',').next().unwrap().parse().unwrap();
    assert_eq!(last, end.load_factor);
    let frames = read("frames.pvd");
    for time in [end.load_factor, end.not_reached] {
        assert!(frames.contains(&format!("timestep=\"{time:?}\"")), "{time}: {frames}");
    }
    assert!(summary.largest_damage > 0.4 && summary.relative_drift < 1e-6);
    let json: serde_json::Value = serde_json::from_str(&read("summary.json")).unwrap();
    assert_eq!((&json["outcome"]["kind"], &json["outcome"]["how"]), (&"broke".into(), &"apart".into()));
}

/// Pulled apart by its ends it ends in two pieces at rest, which is an equilibrium.
#[test]
fn a_bar_pulled_apart_by_its_ends_completes() {
    let ends = r#"
[[condition]]
on = "x-min"
displacement = ["-0.04 mm", 0, 0]
[[condition]]
on = "x-max"
displacement = ["0.04 mm", 0, 0]
"#;
    let mut simulation = Simulation::new(pulled(ends, 4)).unwrap();
    while !simulation.finished() {
        simulation.advance().unwrap();
    }
    assert_eq!((simulation.outcome(), simulation.step()), (&Outcome::Completed, 4));
    assert!(simulation.ledger().broken_bonds > 0);
}

/// What nothing held from the start is wrong input, not an outcome.
#[test]
fn a_body_that_was_never_held_is_refused() {
    let push = "[[condition]]\non = \"x-max\"\ntraction = [\"1 MPa\", 0, 0]\n";
    let Err(Error::Failure { problem, remedy, .. }) = Simulation::new(pulled(push, 2)).map(|_| ()) else { panic!() };
    assert!(problem.contains("nothing holds") && remedy.to_string().contains("prescribe"), "{problem}; {remedy}");
}

/// Ended within a load step, a simulation is where it was before the step, and goes on to the same bits.
#[test]
fn a_load_step_is_stopped_at_once_and_begun_anew() {
    let mut whole = Simulation::new(pulled(TRACTION, 10)).unwrap();
    let mut stopped = Simulation::new(pulled(TRACTION, 10)).unwrap();
    while !whole.finished() {
        whole.advance().unwrap();
        for after in [0, 3, 40] {
            let seen = Cell::new(0);
            let look = |_: &_| {
                seen.set(seen.get() + 1);
                seen.get() <= after
            };
            let before = stopped.save();
            match stopped.advance_seen(&look) {
                Ok(()) => break,
                Err(Error::Interrupted { .. }) => assert!(stopped.save() == before && seen.get() == after + 1),
                Err(e) => panic!("{e}"),
            }
        }
        if stopped.step() < whole.step() || whole.finished() && !stopped.finished() {
            stopped.advance().unwrap();
        }
        assert!(stopped.save() == whole.save() && stopped.outcome() == whole.outcome());
    }
    assert_ne!(*whole.outcome(), Outcome::Completed);
}

/// A run that is told to stop keeps its last load step, and goes on to the same files.
#[test]
fn a_run_stopped_within_a_load_step_resumes_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let (undisturbed, out) = (folder.path().join("undisturbed"), folder.path().join("out"));
    let never = AtomicBool::new(false);
    run(pulled(TRACTION, 10), &undisturbed, false, &never).unwrap();
    let message = run(pulled(TRACTION, 10), &out, false, &AtomicBool::new(true)).unwrap_err().to_string();
    assert!(message.contains("step 0 of 10 is done") && message.contains("with \"resume\" goes on"), "{message}");
    run(pulled(TRACTION, 10), &out, true, &never).unwrap();
    let files = |name: &str| [&undisturbed, &out].map(|f| std::fs::read(f.join(name)).unwrap());
    for name in ["probes.csv", "frames.pvd", "frame-00001.vti"] {
        let [a, b] = files(name);
        assert!(a == b, "{name}");
    }
    assert!(!never.load(Ordering::Relaxed));
}

/// The equilibrium that a motion starts from is seen iteration by iteration, of nodes and of spheres; ended, there is no
/// simulation, and nothing of a run is kept.
#[test]
fn an_equilibrium_at_the_start_can_be_stopped() {
    let pull = || {
        let held = "[[condition]]\non = \"x-min\"\nthickness = \"2 mm\"\ndisplacement = [0, 0, 0]\n";
        format!(
            "{BAR}{held}[[condition]]\non = \"x-max\"\nthickness = \"2 mm\"\ntraction = [\"1 MPa\", 0, 0]\n\
             [motion]\nduration = \"1 us\"\nfrom_equilibrium = true\n"
        )
    };
    let seen = Cell::new(0);
    let after = |iterations: usize| {
        seen.set(0);
        let seen = &seen;
        move |_: &WithinStep| {
            seen.set(seen.get() + 1);
            seen.get() <= iterations
        }
    };
    let nodes = || problem(&pull());
    assert!(Simulation::new_seen(nodes(), &after(usize::MAX)).is_ok() && seen.get() > 5, "{}", seen.get());
    let ended = Simulation::new_seen(nodes(), &after(3)).err();
    assert!(matches!(ended, Some(Error::Interrupted { .. })) && seen.get() == 4, "{ended:?}");
    let folder = tempfile::tempdir().unwrap();
    let stopped = run(nodes(), folder.path(), false, &AtomicBool::new(true)).unwrap_err();
    assert!(matches!(stopped, Error::Interrupted { .. }), "{stopped}");
    assert!(!folder.path().join("probes.csv").exists());

    let text = pull().replace("40, 8 mm", "10, 6, 6 mm").replace(
        "[grid]\nspacing = \"1 mm\"\nplane_strain = \"z\"\n",
        "[packing]\nradius = \"0.5 mm\"\nnumber = 200\nseed = 1\ncontact_radius = 1.6\n",
    );
    let spheres = || CaseFile::parse(&text, "spheres", &[]).unwrap().packing_problem().unwrap();
    assert!(PackingSimulation::new_seen(spheres(), &after(usize::MAX)).is_ok() && seen.get() > 5, "{}", seen.get());
    let ended = PackingSimulation::new_seen(spheres(), &after(3)).err();
    assert!(matches!(ended, Some(Error::Interrupted { .. })) && seen.get() == 4, "{ended:?}");
}

/// The bar cut in the middle, its halves moved as rigid bodies.
fn halves(left: &str, right: &str, more: &str) -> Simulation {
    let text = format!(
        "{BAR}{more}\n[[crack]]\nplane = {{ point = \"0, 0, 0 mm\", normal = \"x\" }}\n[[condition]]\non = \"x-min\"\nthickness = 20\n\
         displacement = {left}\n[[condition]]\non = \"x-max\"\nthickness = 20\ndisplacement = {right}\n[equilibrium]\n"
    );
    let mut simulation = Simulation::new(problem(&text)).unwrap();
    simulation.advance().unwrap();
    simulation
}

/// Faces overlap by exactly what brings two halves together; opening and sliding are none.
#[test]
fn closed_crack_faces_overlap_by_what_brings_them_together() {
    for kinematics in ["linear", "finite"] {
        let more = format!("[model]\nkinematics = \"{kinematics}\"\n");
        let overlap = |left: &str, right: &str| halves(left, right, &more).overlap().cloned();
        let closed = overlap("[\"0.03 mm\", 0, 0]", "[\"-0.02 mm\", 0, 0]").unwrap();
        assert!((closed.depth - 5e-5).abs() < 1e-8 && closed.between == Between::CrackFaces, "{closed:?}");
        assert!(closed.at[0].abs() < 3e-3, "{closed:?}");
        assert_eq!(overlap("[\"-0.03 mm\", 0, 0]", "[\"0.02 mm\", 0, 0]"), None);
        assert_eq!(overlap("[0, \"0.03 mm\", 0]", "[0, 0, 0]"), None);
        // Together as one body.
        assert_eq!(overlap("[\"0.03 mm\", 0, 0]", "[\"0.03 mm\", 0, 0]"), None);
    }
    let simulation = halves("[\"0.03 mm\", 0, 0]", "[\"-0.02 mm\", 0, 0]", "");
    let warnings = simulation.late_warnings();
    assert!(warnings.iter().any(|w| w.contains("no contact") && w.contains("5.000e-5 m")), "{warnings:?}");
    // Both halves are named before the run.
    let parts = simulation.warnings();
    assert!(parts.iter().any(|w| w.contains("2 parts, not one: 160 nodes around (-1.0000e-2")), "{parts:?}");
}

/// A block that flies into another: nodes meet without resistance, and the depth is what the way says.
#[test]
fn pieces_that_pass_through_each_other_are_named() {
    let text = r#"
material = { class = "isotropic", unit = "GPa", engineering = { e = 1, nu = 0.25 } }
density = "1000 kg/m3"
[solids]
left = { box = { min = "0, 0, 0 mm", max = "8, 8, 8 mm" } }
right = { box = { min = "12, 0, 0 mm", max = "20, 8, 8 mm" } }
[body]
union = ["left", "right"]
[grid]
spacing = "1 mm"
[model]
kinematics = "finite"
[[initial_velocity]]
on = "left"
velocity = ["100 m/s", 0, 0]
[motion]
duration = "DURATION us"
"#;
    // The gap of 4 spacings is crossed in 40 µs; 30 µs later the block is 3 spacings in the other.
    for (duration, depth) in [("30", None), ("70", Some(3e-3))] {
        let problem = problem(&text.replace("DURATION", duration));
        assert!(problem.coarse().iter().any(|w| w.contains("gap is 4 nodes across along x")), "{:?}", problem.coarse());
        let mut simulation = Simulation::new(problem).unwrap();
        assert!(simulation.warnings().iter().any(|w| w.contains("2 parts, not one")), "{:?}", simulation.warnings());
        while !simulation.finished() {
            simulation.advance().unwrap();
        }
        let seen = simulation.overlap();
        assert_eq!(seen.is_some(), depth.is_some(), "{seen:?}");
        if let (Some(seen), Some(depth)) = (seen, depth) {
            assert!(seen.between == Between::Pieces && (seen.depth - depth).abs() < 1.1e-3, "{seen:?}");
        }
    }
}

/// Few nodes across are named, in the plan and in the run, with what was measured for so few; enough are not.
#[test]
fn coarse_dimensions_are_named() {
    let plate = |n: usize, more: &str| {
        problem(&format!(
            "material = \"Pyroceram\"\n[body]\nbox = {{ size = \"40, 20, {n} mm\" }}\n[grid]\nspacing = \"1 mm\"\n{more}\n[equilibrium]\n"
        ))
    };
    for (n, expected) in [(1, "+12.5 %"), (2, "-10.0 %"), (3, "-0.7 %"), (6, "-12.9 %")] {
        let said = plate(n, "").coarse();
        let expected = if n == 6 { "-13 % in bending" } else { expected };
        assert!(said.len() == 1 && said[0].contains(expected) && said[0].contains("along z"), "{n}: {said:?}");
        assert_eq!(said[0].contains("plane_strain with hybrid bonds"), n <= 2, "{said:?}");
        assert_eq!(RunCost::with_warnings(&plate(n, "")).unwrap().1, said);
    }
    assert_eq!(plate(7, "").coarse(), Vec::<String>::new());
    // The figures are those of the nearest horizon that was measured and is not smaller.
    for (horizon, of, expected) in [("2", 2, "+0.0 %"), ("2.5", 3, "-0.7 %"), ("3.5", 4, "-4.2 %"), ("5", 4, "-4.2 %")]
    {
        let said = plate(3, &format!("horizon = {horizon}\n")).coarse();
        assert!(
            said[0].contains(expected) && said[0].contains(&format!("ν = 0.25, horizon of {of} spacings")),
            "{said:?}"
        );
    }
    let layers = "[[region]]\nname = \"ply\"\nlayers = { axis = \"z\", layup = [{ thickness = \"8 mm\" }, { thickness = \"2 mm\", \
                  angle = 90 }] }\n";
    let said = plate(10, layers).coarse();
    assert!(said.len() == 1 && said[0].contains("few nodes across: ply-2 (2 nodes along z at"), "{said:?}");
    assert!(said[0].contains("-6.6 % of stiffness along them"), "{said:?}");
    let crack = "[[crack]]\nrectangle = { corner = \"-10, -50, 0 mm\", a = \"26, 0, 0 mm\", b = \"0, 100, 0 mm\" }\n";
    let said = plate(20, crack).coarse();
    assert!(
        said.len() == 1 && said[0].contains("tip of crack 1") && said[0].contains("4 nodes from a face"),
        "{said:?}"
    );
    let near = "[[crack]]\nplane = { point = \"0, 0, 6 mm\", normal = \"z\" }\n";
    let said = plate(20, near).coarse();
    assert!(said.len() == 1 && said[0].contains("4 nodes across along z"), "{said:?}");
}

/// A packing's body of few diameters across is named; one that is periodic is not.
#[test]
fn packings_of_few_spheres_across_are_named() {
    let text = "material = \"Pyroceram\"\n[packing]\nradius = \"1 mm\"\nnumber = 200\nseed = 1\ncontact_radius = 1.6\n[equilibrium]\n";
    let body = "[body]\nbox = { size = \"40, 12, 26 mm\" }\n";
    let said = case::case(&format!("{text}{body}")).packing_problem().unwrap().warnings();
    assert!(said.iter().any(|w| w.contains("mean diameters across along y")), "{said:?}");
    let said = case::case(text).packing_problem().unwrap().warnings();
    assert!(!said.iter().any(|w| w.contains("diameters")), "{said:?}");
}
