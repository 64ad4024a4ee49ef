//! Case files: what they state comes out exactly.

use crate::given::case as case_common;

use anisobond::experiment::{Condition, Crack, FractureEnergy, History, Problem, Schedule};
use anisobond_app::CaseFile;
use case_common::{BLOCK, case, problem, with};
use nalgebra::{Rotation3, Vector3};

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
            local_damping: 0.0,
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
[fracture]
energy = "3 J/m2"
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
    assert!(p.cracks[3].cuts(&left, &right, 1e-12) && !p.cracks[2].cuts(&left, &right, 1e-12));
    assert_eq!(p.probes[0].nodes.len(), 2);
    assert_eq!(p.probes[1].nodes, [239]);
    assert_eq!(p.probes[2].nodes.len(), 24);
    assert_eq!(p.initial_velocity[0].0.len(), 24);
    assert_eq!(p.unbreakable.len(), 40 + 24 - 4);
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
