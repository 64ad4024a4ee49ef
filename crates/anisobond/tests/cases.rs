//! Case files: what they state comes out exactly, and what is wrong in them is said with its place and a remedy.

use std::path::{Path, PathBuf};

use anisobond::experiment::{Condition, Crack, FractureEnergy, History, Problem, Schedule};
use anisobond::io::{CaseFile, LatticeKind, PackingFormat, packing_text, parse_stl, starter_case};
use anisobond::lattice::Solid;
use anisobond::lattice::generate::{Crystal, crystal};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

/// A small block of everything that a case needs; the tests add to it and replace in it.
const BLOCK: &str = r#"
material = "Pyroceram"
density = "2600 kg/m3"

[body]
box = { min = "0, 0, 0 mm", max = "10, 6, 4 mm" }

[grid]
spacing = "1 mm"

[motion]
duration = "1 us"
"#;

fn case(text: &str) -> CaseFile {
    CaseFile::parse(text, "block.toml", &[]).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn problem(text: &str) -> Problem {
    case(text).problem().unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn with(more: &str) -> Problem {
    problem(&format!("{BLOCK}\n{more}"))
}

/// The message of a case that is refused, while parsed or while resolved.
fn message(text: &str) -> String {
    match CaseFile::parse(text, "block.toml", &[]).and_then(|c| c.problem()) {
        Ok(_) => panic!("accepted:\n{text}"),
        Err(e) => e.to_string(),
    }
}

fn forces(p: &Problem, n: usize) -> (&[u32], &[Vector3<f64>]) {
    match &p.conditions[n] {
        Condition::Force { nodes, force, .. } => (nodes, force),
        other => panic!("{other:?}"),
    }
}

fn total(p: &Problem, n: usize) -> Vector3<f64> {
    forces(p, n).1.iter().sum()
}

#[test]
fn a_block_is_its_nodes() {
    let p = with("");
    assert_eq!(p.body.grid.nodes, [10, 6, 4]);
    assert_eq!(p.body.nodes(), 240);
    assert!((p.body.grid.position(0) - Vector3::repeat(0.5e-3)).norm() < 1e-15);
    assert_eq!((p.regions.len(), p.regions[0].density), (1, 2600.0));
    assert_eq!(p.neighbourhood.bonds().len(), 122);
    assert_eq!(
        p.schedule,
        Schedule::Motion {
            duration: 1e-6,
            step: None,
            safety: 0.9,
            damping: 0.0,
            force_step: false,
            from_equilibrium: false
        }
    );
}

/// Exact resultants: traction and pressure on faces times their areas, body forces times the volume.
#[test]
fn loads_have_their_exact_totals() {
    let p = with(
        r#"
[[condition]]
on = "x-max"
traction = "1, 2, 3 MPa"
[[condition]]
on = "y-min"
thickness = 2.5
pressure = "2 MPa"
[[condition]]
on = "all"
body_force = [0, 0, "-5 kN/m3"]
[[condition]]
on = "all"
acceleration = "0, 0, -10 m/s2"
[[condition]]
on = "z-max"
thickness = "2 mm"
force = ["6 N", 0, 0]
history = { table = [["0 s", 0], ["2 ms", 1]] }
"#,
    );
    let volume = 240e-9;
    for (n, exact, nodes) in [
        (0, Vector3::new(1.0, 2.0, 3.0) * 24.0, 24),
        (1, Vector3::new(0.0, 2.0 * 40.0, 0.0), 120),
        (2, Vector3::new(0.0, 0.0, -5000.0 * volume), 240),
        (3, Vector3::new(0.0, 0.0, -10.0 * 2600.0 * volume), 240),
        (4, Vector3::new(6.0, 0.0, 0.0), 120),
    ] {
        assert!((total(&p, n) - exact).norm() < 1e-9 * exact.norm(), "{n}: {:?}", total(&p, n));
        assert_eq!(forces(&p, n).0.len(), nodes, "{n}");
    }
    let Condition::Force { history, .. } = &p.conditions[4] else { panic!() };
    assert_eq!(history, &History::Table(vec![(0.0, 0.0), (2e-3, 1.0)]));
}

fn hole(solid: &str, spacing: &str, plane: &str) -> Problem {
    problem(&format!(
        "material = 'Pyroceram'\n[solids]\nhole = {{ {solid} }}\n[body]\n\
         difference = [{{ box = {{ size = '20, 20, 20 mm' }} }}, 'hole']\n[grid]\nspacing = '{spacing}'\n{plane}\n\
         [[condition]]\non = 'hole'\npressure = '3 MPa'\n[equilibrium]\n"
    ))
}

/// Pressure in a hole: the magnitudes sum to p·A, and the resultant vanishes.
#[test]
fn pressure_in_holes_acts_on_the_true_area() {
    let pi = std::f64::consts::PI;
    for (solid, spacing, h, plane, area) in [
        ("sphere = { radius = '6 mm' }", "0.5 mm", 0.5e-3, "", 4.0 * pi * 36e-6),
        (
            "cylinder = { axis = 'z', radius = '6 mm' }",
            "0.25 mm",
            0.25e-3,
            "plane_strain = 'z'",
            2.0 * pi * 6e-3 * 0.25e-3,
        ),
    ] {
        let p = hole(solid, spacing, plane);
        let (nodes, force) = forces(&p, 0);
        let sum: f64 = force.iter().map(|f| f.norm()).sum();
        assert!((sum / (3e6 * area) - 1.0).abs() < 5e-3, "{solid}: {sum} for {}", 3e6 * area);
        assert!(total(&p, 0).norm() < 1e-9 * sum);
        for (&n, f) in nodes.iter().zip(force).step_by(53) {
            let mut x = p.body.grid.position(n as usize);
            if !plane.is_empty() {
                x.z = 0.0;
            }
            assert!(f.dot(&x) > 0.9 * f.norm() * x.norm(), "outwards");
            assert!((x.norm() - 6e-3).abs() < 1.8 * h);
        }
    }
}

/// Bonds of the plan against every node asking its neighbours.
#[test]
fn bonds_are_counted_as_nodes_would() {
    for periodic in ["", "periodic = ['x', 'z']"] {
        let text = BLOCK.replace("spacing", &format!("{periodic}\nspacing"));
        let text = text
            .replace("box = {", "difference = [{ box = {")
            .replace("4 mm\" }", "4 mm\" } }, { sphere = { radius = \"3 mm\" } }]");
        let case = case(&text);
        let p = case.problem().unwrap();
        let grid = &p.body.grid;
        let bonds = |n: usize| p.neighbourhood.bonds().iter().filter_map(move |b| grid.neighbour(n, b.offset));
        let ends = (0..grid.len()).filter(|&n| p.body.has(n)).map(|n| bonds(n).filter(|&m| p.body.has(m)).count());
        let plan = case.plan(&p);
        assert_eq!(2 * plan.bonds, ends.sum::<usize>() as u64);
        assert!(plan.nodes < 240 && plan.regions[0].nodes == plan.nodes && plan.memory == 240 * 84);
    }
}

#[test]
fn conditions_hold_components_and_may_agree() {
    let p = with(
        r#"
[[condition]]
name = "left"
on = "x-min"
thickness = 2
displacement = [0, "free", "1 um"]
[[condition]]
name = "below"
on = "y-min"
displacement = [0, 0, "free"]
[[condition]]
name = "pulse"
on = { box = { min = '9, 0, 0 mm', max = '10, 1, 1 mm' } }
velocity = ["free", "free", "1 m/s"]
"#,
    );
    let Condition::Displacement { nodes, value, history } = &p.conditions[0] else { panic!() };
    assert_eq!((nodes.len(), *value, history), (48, [Some(0.0), None, Some(1e-6)], &History::Constant));
    assert!(nodes.iter().all(|&n| p.body.grid.coordinates(n as usize)[0] < 2));
    let Condition::Velocity { nodes, .. } = &p.conditions[2] else { panic!() };
    assert_eq!(nodes, &[9]);
}

#[test]
fn regions_layers_and_grains() {
    let p = with(
        r#"
[[region]]
name = "core"
solid = { sphere = { centre = "5, 3, 2 mm", radius = "1 mm" } }
material = { unit = "GPa", class = "isotropic", c11 = 3, c12 = 1, density = "1000 kg/m3" }
[[region]]
name = "ball"
over = true
solid = { sphere = { centre = "4.5, 2.5, 1.5 mm", radius = "0.9 mm" } }
orientation = { axis = [0, 0, 1], angle = 30 }
[[region]]
name = "rest"
fracture = { directional = [{ normal = "x", energy = "1 J/m2" }, { normal = [0, 1, 1], energy = "2 J/m2" }] }
"#,
    );
    let count = |r: u16| p.body.region.iter().filter(|&&x| x == r).count();
    // The eight nodes around the centre are √3/2 mm away from it; one of them is the second region's.
    assert_eq!((count(1), count(2), count(3)), (7, 1, 232));
    assert_eq!((p.regions[0].density, p.regions[2].density), (2600.0, 2600.0));
    let Some(FractureEnergy::Directional(rows)) = &p.regions[2].fracture else { panic!() };
    assert!((rows[1].0 - Vector3::new(0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt())).norm() < 1e-15 && rows[1].1 == 2.0);

    let layers = |layup: &str| {
        with(&format!("[[region]]\nname = 'ply'\nmaterial = 'Te2W'\n[region.layers]\naxis = 'z'\n{layup}"))
    };
    let p = layers("layup = [{ thickness = '1 mm', angle = 0 }, { thickness = '3 mm', angle = 90 }]");
    let of = |p: &Problem, r: u16| p.body.region.iter().filter(|&&x| x == r).count();
    assert_eq!((of(&p, 1), of(&p, 2), p.regions[1].name.as_str()), (60, 180, "ply-2"));
    let quarter = *Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2).matrix();
    assert!(p.regions[1].stiffness.relative_error(&p.regions[0].stiffness.rotated(&quarter)) < 1e-12);
    let p = layers("layup = [{ thickness = '1 mm' }, { thickness = '1 mm', material = 'Si' }]\nrepeat = 2");
    let by_height: Vec<u16> = (0..4).map(|k| p.body.region[60 * k]).collect();
    assert_eq!((by_height, p.regions.len()), (vec![1, 2, 1, 2], 2));

    let grains = |seed: usize| {
        with(&format!("[[region]]\nname = 'g'\nmaterial = 'Si'\ngrains = {{ number = 6, seed = {seed} }}"))
    };
    let (a, b) = (grains(1), grains(1));
    assert_eq!((&a.body.region, &a.regions), (&b.body.region, &b.regions));
    assert_ne!(a.body.region, grains(2).body.region);
    let si = &problem(&BLOCK.replace("Pyroceram", "Si")).regions[0].stiffness;
    for region in &a.regions {
        // A rotation keeps the norm.
        assert!((region.stiffness.norm() / si.norm() - 1.0).abs() < 1e-12);
    }
}

/// Directional energies turn with their material.
#[test]
fn energies_turn_with_the_material() {
    let p = with(
        "[[region]]\norientation = { axis = [0, 0, 1], angle = 90 }\nfracture.directional = [{ normal = 'x', energy = '1 J/m2' }]",
    );
    let Some(FractureEnergy::Directional(rows)) = &p.regions[0].fracture else { panic!() };
    assert!((rows[0].0 - Vector3::y()).norm() < 1e-15);
}

#[test]
fn cracks_probes_and_velocities() {
    let p = with(
        r#"
[[crack]]
plane = { point = "5, 0, 0 mm", normal = "x" }
[[crack]]
disc = { centre = "3, 3, 2 mm", normal = [0, 0, 2], radius = "2 mm" }
[[crack]]
rectangle = { corner = "0, 3, 0 mm", a = "4, 0, 0 mm", b = "0, 0, 4 mm" }
[[crack]]
line = { from = "6, 2 mm", to = "9, 2 mm" }
[[probe]]
quantity = "displacement"
at = ["1, 1, 1 mm", "9.2, 5, 3 mm"]
[[probe]]
name = "one"
quantity = "damage"
at = ["10 mm", "6 mm", "4 mm"]
[[probe]]
quantity = "reaction"
condition = "hold"
[[condition]]
name = "hold"
on = "x-min"
displacement = "0, 0, 0"
[[initial_velocity]]
on = "x-max"
velocity = ["1 m/s", 0, 0]
[[unbreakable]]
on = "y-max"
[[unbreakable]]
on = "x-max"
"#,
    );
    assert_eq!(
        p.cracks[0],
        Crack::Disc { centre: Vector3::new(5e-3, 0.0, 0.0), normal: Vector3::x(), radius: f64::INFINITY }
    );
    let (left, right) = (Vector3::new(7.5e-3, 1.5e-3, 0.5e-3), Vector3::new(7.5e-3, 2.5e-3, 0.5e-3));
    assert!(p.cracks[3].cuts(&left, &right) && !p.cracks[2].cuts(&left, &right));
    assert_eq!(p.probes[0].nodes.len(), 2);
    assert_eq!(p.probes[1].nodes, [239]);
    assert_eq!(p.probes[2].nodes.len(), 24);
    assert_eq!(p.initial_velocity[0].0.len(), 24);
    assert_eq!(p.unbreakable.len(), 40 + 24 - 4);
}

/// Every kind of wrong input: what to replace in the block (or to add to it), and parts of the message.
#[test]
fn wrong_cases_are_refused_with_place_and_remedy() {
    let add = |more: &str| format!("{BLOCK}{more}");
    let replace = |from: &str, to: &str| {
        assert!(BLOCK.contains(from), "{from}");
        BLOCK.replace(from, to)
    };
    let condition = |more: &str| add(&format!("[[condition]]\non = \"x-min\"\n{more}\n"));
    let table: Vec<(String, &[&str])> = vec![
        (add("[gird]\n"), &["block.toml, line 13, gird: unknown key \"gird\"", "did you mean grid?"]),
        (replace("spacing", "spacign"), &["line 9, grid.spacign: unknown key", "did you mean spacing?"]),
        (replace("\"1 mm\"", "\"1 MPa\""), &["line 9, grid.spacing", "is a unit of a stress, but a length is needed"]),
        (replace("\"1 mm\"", "1"), &["line 9, grid.spacing: 1 has no unit", "\"2 mm\""]),
        (replace("\"1 mm\"", "nan"), &["grid.spacing: a finite number is needed, not NaN"]),
        (replace("\"1 mm\"", "\"-1 mm\""), &["grid.spacing: \"-1 mm\" is not positive"]),
        (replace("\"1 mm\"", "\"1 um\""), &["line 8, grid", "2.40e11 nodes", "about 24000 GB", "larger spacing"]),
        (replace("\"1 mm\"", "\"1 mm\"\nhorizon = 0.5"), &["line 10, grid.horizon", "no neighbour"]),
        (replace("\"1 mm\"", "\"1 mm\"\nperiodic = [\"w\"]"), &["grid.periodic.0: \"w\" is not known here", "line 10"]),
        (replace("\"1 mm\"", "\"0.7 mm\"\nperiodic = [\"x\"]"), &["periodic along x", "whole multiple"]),
        (replace("10, 6, 4 mm", "10, 6 mm"), &["infinite along z", "plane_strain = \"z\""]),
        (replace("10, 6, 4 mm", "10, 6, 0 mm"), &["line 6, body.box", "empty along z"]),
        (replace("box", "bocks"), &["line 6, body.bocks: unknown key"]),
        (replace("\"Pyroceram\"", "\"Pyrocerm\""), &["line 2, material", "did you mean Pyroceram?"]),
        (replace("\"Pyroceram\"", "{ c11 = 1 }"), &["material", "c11: 1 has no unit"]),
        (replace("density = \"2600 kg/m3\"", ""), &["has no density, which motion needs", "add density"]),
        (replace("[motion]\nduration = \"1 us\"", ""), &["neither moves nor rests", "[motion]"]),
        (add("[equilibrium]\n"), &["line 13, equilibrium: motion and equilibrium are both given"]),
        (replace("duration = \"1 us\"", "duration = \"1 us\"\nsafety = 1.5"), &["motion.safety: 1.5 is above 1"]),
        (condition(""), &["line 13, condition.0: the condition says nothing", "displacement, velocity"]),
        (condition("pressure = \"1 MPa\"\ntraction = [0, 0, 0]"), &["traction and pressure are both given"]),
        (
            condition("displacement = [\"free\", \"free\", \"free\"]"),
            &["line 15, condition.0.displacement: all components"],
        ),
        (condition("displacement = [0, 0]"), &["three components are needed, not 2"]),
        (condition("velocity = [\"1 mm\", 0, 0]"), &["condition.0.velocity.0", "a velocity is needed"]),
        (condition("pressure = \"1 MPa\"\nhistory = { ramp = [\"2 s\", \"1 s\"] }"), &["line 16", "a later end"]),
        (condition("pressure = \"1 MPa\"\nhistory = { table = [[0, 0], [0, 1]] }"), &["do not ascend at row 2"]),
        (condition("pressure = \"1 MPa\"\nhistory = { rammp = [0, 1] }"), &["did you mean ramp?"]),
        (add("[[condition]]\non = \"x-mim\"\npressure = 0\n"), &["line 14, condition.0.on", "did you mean x-min?"]),
        (add("[[condition]]\non = \"all\"\npressure = \"1 MPa\"\n"), &["a pressure acts on a surface", "name a face"]),
        (
            add(
                "[[condition]]\non = { sphere = { radius = \"1 mm\", centre = \"50, 0, 0 mm\" } }\npressure = \"1 MPa\"\n",
            ),
            &["line 14, condition.0.on: no node of the body is"],
        ),
        (
            add(
                "[[condition]]\non = \"x-min\"\ndisplacement = [0, 0, 0]\n[[condition]]\non = \"y-min\"\nvelocity = [0, 0, 0]\n",
            ),
            &["line 16, condition.1", "\"condition 1\" and \"condition 2\" both prescribe x"],
        ),
        (
            add("[[region]]\nname = \"a\"\nsolid = { halfspace = { point = \"5, 0, 0 mm\", normal = \"x\" } }\n\
                 [[region]]\nname = \"b\"\nsolid = { halfspace = { point = \"4, 0, 0 mm\", normal = \"-x\" } }\n"),
            &["line 16, region.1: region \"b\" overlaps region \"a\" in 24 nodes", "over = true"],
        ),
        (
            add("[[region]]\nname = \"a\"\nsolid = { halfspace = { point = \"5, 0, 0 mm\", normal = \"x\" } }\n"),
            &["120 nodes of the body are in no region, the first at (0.0055", "without solid"],
        ),
        (
            add("[[region]]\nname = \"a\"\nsolid = { sphere = { radius = \"0.1 mm\" } }\n[[region]]\nname = \"b\"\n"),
            &["line 13, region.0: region \"a\" has no nodes", "units"],
        ),
        (add("[[region]]\ngrains = { number = 300 }\n"), &["line 14, region.0.grains: 300 grains of 240 nodes"]),
        (
            add("[[region]]\nlayers = { axis = \"z\", layup = [{ thickness = \"1 mm\" }] }\n"),
            &["region.0.layers: the layers reach from z = 0", "add layers"],
        ),
        (
            add("[[crack]]\nplane = { point = \"5, 0, 9 mm\", normal = \"z\" }\n"),
            &["line 13, crack.0: the crack cuts no bond"],
        ),
        (
            add("[[crack]]\nplane = { point = [0, 0, 0], normal = [0, 0, 0] }\n"),
            &["normal: the direction has length zero"],
        ),
        (add("[[probe]]\nquantity = \"damage\"\nat = \"1, 1, 1 m\"\n"), &["line 15, probe.0.at: the nearest node is"]),
        (add("[[probe]]\nquantity = \"damage\"\ncondition = \"left\"\n"), &["there is no condition \"left\""]),
        (
            add("[[probe]]\nquantity = \"damge\"\non = \"all\"\n"),
            &["line 14, probe.0.quantity", "did you mean damage?"],
        ),
        (add("[output]\nfields = [\"stress\", \"stress\"]\n"), &["output.fields.1: the field is named twice"]),
        (add("[output]\nframes = 1.5\n"), &["output.frames: 1.5 is not a whole number"]),
        (add("[model]\nsurface_calibration = \"yes\"\n"), &["true or false is needed, not \"yes\""]),
        (add("[model]\nsoftening = { linear = 1 }\n"), &["model.softening.linear", "above 1"]),
        (
            add("[fracture]\nenergy = \"3 J\"\n"),
            &["line 14, fracture.energy: unknown unit \"J\" of an energy per area"],
        ),
        (add("[solids]\na = { union = [\"b\"] }\nb = { union = [\"a\"] }\n"), &["refers to itself"]),
        (add("[[condition]]\nname = 3\n"), &["condition.0", "on"]),
        (add("condition = [1]\n"), &["unknown key \"condition\""]),
        (replace("\"1 mm\"", "[1 2]"), &["block.toml:9:12: this is not TOML"]),
    ];
    for (text, parts) in &table {
        let message = message(text);
        assert!(message.starts_with("block.toml") && message.contains(';'), "{message}");
        for part in *parts {
            assert!(message.contains(part), "{part}\nnot in\n{message}");
        }
    }
}

#[test]
fn a_body_of_no_nodes_and_equilibrium_histories() {
    let nothing = BLOCK.replace(
        "box = { min = \"0, 0, 0 mm\", max = \"10, 6, 4 mm\" }",
        "difference = [{ sphere = { radius = \"3 mm\" } }, { sphere = { radius = \"4 mm\" } }]",
    );
    assert!(message(&nothing).contains("line 5, body: the body holds no node"), "{}", message(&nothing));
    let still = BLOCK.replace("[motion]\nduration = \"1 us\"", "[equilibrium]\nsteps = 4");
    let load = "[[condition]]\non = \"x-max\"\npressure = \"1 MPa\"\n";
    let Condition::Force { history, .. } = &problem(&format!("{still}{load}")).conditions[0] else { panic!() };
    assert_eq!(history, &History::Ramp { start: 0.0, end: 1.0 });
    let seconds = format!("{still}{load}history = {{ ramp = [0, \"1 s\"] }}\n");
    assert!(message(&seconds).contains("run over the load factor"), "{}", message(&seconds));
    let moving = format!("{still}[[condition]]\non = \"x-max\"\nvelocity = [\"1 m/s\", 0, 0]\n");
    assert!(message(&moving).contains("no meaning in equilibrium"));
}

#[test]
fn values_are_set_from_the_command_line() {
    let set = |assignments: &[&str]| {
        let text = format!("{BLOCK}[[condition]]\non = \"x-max\"\npressure = \"1 MPa\"\n");
        let assignments: Vec<String> = assignments.iter().map(ToString::to_string).collect();
        CaseFile::parse(&text, "block.toml", &assignments).and_then(|c| c.problem()).map_err(|e| e.to_string())
    };
    let p = set(&["grid.spacing=0.5 mm", "condition.0.pressure=4 MPa", "material=Si", "grid.periodic=['y']"]).unwrap();
    assert_eq!((p.body.grid.nodes, p.body.grid.periodic), ([20, 12, 8], [false, true, false]));
    assert!((total(&p, 0).x + 4e6 * 24e-6).abs() < 1e-9);
    for (assignment, parts) in [
        ("grid.spacign=1 mm", ["block.toml, --set grid.spacign: unknown key", "did you mean spacing?"]),
        ("grid.spacing=1 s", ["block.toml, --set grid.spacing: ", "a length is needed"]),
        ("condition.0.pressure=1", ["--set condition.0.pressure: 1 has no unit", "GPa"]),
        ("condition.3.pressure=1", ["--set condition.3.pressure=1: condition is a list of 1", "from 0"]),
    ] {
        let message = set(&[assignment]).unwrap_err();
        assert!(parts.iter().all(|p| message.contains(p)), "{message}");
    }
}

/// A ball of triangles on a sphere of radius 1, from an octahedron split `times` over.
fn ball(times: usize) -> Vec<[Vector3<f64>; 3]> {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let mut triangles = Vec::new();
    for (a, b, c) in [(x, y, z), (y, -x, z), (-x, -y, z), (-y, x, z)] {
        triangles.push([a, b, c]);
        triangles.push([b, a, -c]);
    }
    // Coordinates as an STL file holds them, so that corners are the same points.
    let round = |v: Vector3<f64>| v.normalize().map(|c| f64::from(c as f32));
    for _ in 0..times {
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) = (round(a + b), round(b + c), round(c + a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    triangles
}

fn binary_stl(triangles: &[[Vector3<f64>; 3]]) -> Vec<u8> {
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for t in triangles {
        bytes.extend([0; 12]);
        t.iter()
            .flat_map(|p| p.iter().copied().collect::<Vec<_>>())
            .for_each(|x| bytes.extend((x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn text_stl(triangles: &[[Vector3<f64>; 3]]) -> String {
    let facet = |t: &[Vector3<f64>; 3]| {
        let vertices: String = t.iter().map(|p| format!("  vertex {:e} {:e} {:e}\n", p.x, p.y, p.z)).collect();
        format!("facet normal 0 0 0\n outer loop\n{vertices} endloop\nendfacet\n")
    };
    format!("solid ball\n{}endsolid ball\n", triangles.iter().map(facet).collect::<String>())
}

#[test]
fn a_ball_from_stl_is_a_ball() {
    let triangles = ball(4);
    let mesh = parse_stl(&binary_stl(&triangles), 1e-3).unwrap();
    assert_eq!(mesh, parse_stl(text_stl(&triangles).as_bytes(), 1e-3).unwrap());
    assert_eq!(mesh.len(), 2048);
    let exact = Solid::Sphere { centre: Vector3::zeros(), radius: 1e-3 };
    for n in 0..4000 {
        let t = f64::from(n);
        let x = Vector3::new((0.7 * t).sin(), (1.3 * t).sin(), (2.9 * t).sin()) * 1.3e-3;
        // The largest triangles have edges of 0.15 and lie within 0.15²/6 of the sphere.
        assert!(
            (mesh.distance(&x) - exact.distance(&x)).abs() < 4e-6,
            "{x:?} {} {}",
            mesh.distance(&x),
            exact.distance(&x)
        );
    }
    for (bytes, part) in [
        (binary_stl(&triangles[..2047]), "not closed"),
        (binary_stl(&triangles)[..5000].to_vec(), "neither a binary nor a text STL"),
        (b"solid a\nvertex 1 2\n".to_vec(), "line 2: \"vertex 1 2\" is not a vertex"),
        (b"solid a\nendsolid\n".to_vec(), "no triangles"),
        (Vec::new(), "neither"),
    ] {
        let message = parse_stl(&bytes, 1.0).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn files_beside_the_case_are_found() {
    let folder = files();
    let path = folder.path().join("case.toml");
    let text = r#"
density = "1 kg/m3"
[body]
stl = { file = "part.stl", unit = "mm" }
rotate = { axis = [0, 0, 1], angle = 20 }
move = "1, 2, 3 mm"
[grid]
spacing = "0.1 mm"
[[region]]
name = "g"
material = "rock.toml"
grains = { number = 2, orientations = "orientations.csv" }
fracture = { directional = "energies.csv" }
[[condition]]
on = "x-min"
displacement = [0, 0, 0]
history = { table = "load.csv" }
[motion]
duration = "1 ms"
"#;
    std::fs::write(&path, text).unwrap();
    let p = anisobond::io::read_case(&path, &["name=ball".to_string()]).unwrap();
    // A polyhedron's volume is a sixth of the sum of a·(b × c).
    let exact = ball(3).iter().map(|[a, b, c]| a.dot(&b.cross(c))).sum::<f64>().abs() / 6.0 * 1e-9;
    let volume = p.body.nodes() as f64 * 1e-12;
    assert!((volume / exact - 1.0).abs() < 0.01, "{volume} {exact}");
    assert_eq!((p.name.as_str(), p.regions.len()), ("ball", 2));
    assert!(
        (p.body.grid.position(p.body.grid.index(p.body.grid.nodes.map(|n| n / 2))) - Vector3::new(1e-3, 2e-3, 3e-3))
            .norm()
            < 2e-4
    );
    for (from, to, parts) in [
        ("part.stl", "prt.stl", ["case.toml, line 4, body.stl.file", "cannot read"]),
        ("orientations.csv", "load.csv", ["region.0.grains.orientations", "3 numbers"]),
        ("number = 2", "number = 3", ["2 orientations for 3 grains", "one for each"]),
    ] {
        let wrong = text.replace(from, to);
        let result = CaseFile::parse(&wrong, path.to_str().unwrap(), &[]);
        let message = result.err().map(|e| e.to_string()).unwrap();
        // A file that cannot be read names itself.
        assert!(parts.iter().skip(usize::from(from == "part.stl")).all(|p| message.contains(p)), "{message}");
    }
}

/// The files that examples refer to.
fn files() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    write("part.stl", &binary_stl(&ball(3)));
    write("orientations.csv", b"phi1,Phi,phi2\n10,20,30\n40,50,60\n");
    write("energies.csv", b"n1,n2,n3,G\n0,0,1,3.8\n1,0,0,10\n");
    write("load.csv", b"t,value\n0,0\n0.001,1\n");
    write(
        "rock.toml",
        b"unit = 'MPa'\nclass = 'transversely-isotropic'\nc11 = 130\nc33 = 55\nc13 = 28\nc12 = 40\nc44 = 32.25\n",
    );
    write("influence.csv", b"0,1\n1,0.5\n");
    let spheres = crystal(Crystal::Fcc, 1e-3, [4, 4, 4], 0.0, 0).unwrap();
    write("spheres.txt", packing_text(&spheres, PackingFormat::of_name("spheres.txt").unwrap()).as_bytes());
    folder
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Every case of the repository is read, and resolved on a grid four times as coarse.
#[test]
fn the_cases_of_the_repository_are_sound() {
    let mut found = 0;
    for entry in std::fs::read_dir(root().join("cases")).unwrap() {
        let path = entry.unwrap().path();
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        if path.extension().is_none_or(|e| e != "toml") || !text.contains("[body]") {
            continue;
        }
        found += 1;
        let case = CaseFile::read(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
        let spacing = case.grid().unwrap().spacing;
        if case.grid().unwrap().len() < 100_000 {
            let p = case.problem().unwrap_or_else(|e| panic!("{e}"));
            let plan = case.plan(&p);
            assert!(
                plan.nodes > 1000 && plan.bonds > 10 * plan.nodes as u64 && plan.conditions.len() == p.conditions.len()
            );
            assert!(p.probes.iter().all(|q| !q.nodes.is_empty()) && !case.description().is_empty());
        }
        assert!(spacing > 0.0);
    }
    assert!(found >= 8, "{found}");
}

#[test]
fn the_starter_is_a_case() {
    for name in ["bar", "a \"b\"\n"] {
        let case = CaseFile::parse(&starter_case(name), "bar.toml", &[]).unwrap();
        let p = case.problem().unwrap();
        let plan = case.plan(&p);
        assert_eq!((plan.nodes, plan.conditions[0].force), (3200, Some([0.0, 80.0, 0.0])));
    }
}

/// Blocks of docs/cases.md are complete cases with what they leave out filled in.
#[test]
fn the_examples_of_the_page_are_read() {
    let folder = files();
    let page = std::fs::read_to_string(root().join("docs/cases.md")).unwrap();
    let blocks: Vec<&str> = page.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert!(blocks.len() >= 10);
    for block in blocks {
        let has = |key: &str| {
            toml::from_str::<toml::Table>(block).unwrap_or_else(|e| panic!("{e}\n{block}")).contains_key(key)
        };
        let mut text = String::new();
        // Bonds of a packing that are not corrected need a Poisson's ratio below ¼.
        let stiff = "{ class = 'isotropic', unit = 'GPa', engineering = { e = 72, nu = 0.2 } }";
        let material = if has("packing") { format!("material = {stiff}\n") } else { "material = 'Pyroceram'\n".into() };
        for (key, line, fits) in [
            ("material", material.as_str(), true),
            ("density", "density = '2600 kg/m3'\n", true),
            ("body", "body = { box = { min = '0, 0, 0 mm', max = '100, 40, 20 mm' } }\n", !has("servo")),
            ("grid", "grid = { spacing = '2 mm' }\n", !has("packing")),
        ] {
            text += if has(key) || !fits { "" } else { line };
        }
        if !has("motion") && !has("equilibrium") {
            text += "motion = { duration = '1 us' }\n";
        }
        text += block;
        let place = folder.path().join("page.toml");
        let case = CaseFile::parse(&text, place.to_str().unwrap(), &[]).unwrap_or_else(|e| panic!("{e}\n{text}"));
        if case.lattice() == LatticeKind::Packing {
            let p = case.packing_problem().unwrap_or_else(|e| panic!("{e}\n{text}"));
            assert!(p.model.packing.len() >= 200 && p.model.bonds.len() > p.model.packing.len());
        } else if case.grid().unwrap().len() < 50_000 {
            case.problem().unwrap_or_else(|e| panic!("{e}\n{text}"));
        }
    }
}

/// Distances of a turned solid are those of the solid at the point turned back.
#[test]
fn solids_turn_and_move() {
    let p = problem(&BLOCK.replace(
        "max = \"10, 6, 4 mm\" }",
        "max = \"10, 6, 4 mm\" }\nrotate = { axis = [0, 0, 1], angle = 90 }\nmove = \"6, 0, 0 mm\"",
    ));
    assert_eq!((p.body.grid.nodes, p.body.nodes()), ([6, 10, 4], 240));
    assert!((p.body.grid.position(0) - Vector3::repeat(0.5e-3)).norm() < 1e-12);
}

/// A case file with pieces replaced by pieces that a file might hold.
fn mutated() -> impl Strategy<Value = String> {
    let rich = format!(
        "{BLOCK}[[condition]]\non = \"x-min\"\ndisplacement = [0, \"free\", \"1 mm\"]\nhistory = {{ ramp = [0, \"1 ms\"] }}\n\
         [[region]]\nname = \"g\"\ngrains = {{ number = 4, seed = 1 }}\nfracture = {{ energy = \"1 J/m2\" }}\n\
         [[crack]]\ndisc = {{ centre = \"5, 3, 2 mm\", normal = \"z\", radius = \"2 mm\" }}\n\
         [[probe]]\nquantity = \"damage\"\nat = \"1, 1, 1 mm\"\n[output]\nfields = [\"damage\"]\nframes = 3\n"
    );
    let text = prop_oneof![Just(rich), Just(starter_case("fuzz"))];
    let pieces = prop::sample::select(vec![
        "",
        "0",
        "-1",
        "nan",
        "inf",
        "1e308",
        "\"",
        "[",
        "]",
        "{}",
        "[]",
        "true",
        "\"x-min\"",
        "\"all\"",
        "1979-05-27",
        "\n",
        "=",
        "\"1e-300 mm\"",
        "\"1e300 mm\"",
        "grid",
        "box",
        "[[region]]",
        "\u{feff}",
        "é",
        "\"1 mm\"",
        ",",
        "65536",
    ]);
    (text, prop::collection::vec((any::<prop::sample::Index>(), 0usize..12, pieces), 1..5)).prop_map(
        |(mut text, changes)| {
            for (at, length, piece) in changes {
                let places: Vec<usize> = text.char_indices().map(|c| c.0).chain([text.len()]).collect();
                let from = at.index(places.len());
                let to = (from + length).min(places.len() - 1);
                text.replace_range(places[from]..places[to], piece);
            }
            text
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]
    #[test]
    fn nearly_valid_cases_never_panic(text in mutated()) {
        match CaseFile::parse(&text, "block.toml", &[]) {
            Ok(case) => {
                if case.grid().is_ok_and(|g| g.len() < 10_000) && let Err(e) = case.problem() {
                    prop_assert!(e.to_string().starts_with("block.toml"), "{}", e);
                }
            }
            Err(e) => prop_assert!(e.to_string().starts_with("block.toml"), "{}", e),
        }
    }

    #[test]
    fn overrides_never_panic(assignment in "[a-z.0-9]{0,12}=?[ -~]{0,12}") {
        let _ = CaseFile::parse(BLOCK, "block.toml", &[assignment]).map(|c| c.grid());
    }
}
