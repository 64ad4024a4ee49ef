//! What each lattice can do, tried: docs/capabilities.md is the table that this test makes.

use std::path::Path;

use anisobond::experiment::{PackingSimulation, Simulation};
use anisobond_app::CaseFile;

const GRID: &str = "grid = { spacing = \"1 mm\", horizon = 2 }\n";
const PACKING: &str = "packing = { radius = \"0.5 mm\", number = 60, seed = 1, contact_radius = 1.6, @ }\n";
const BODY: &str = "body = { box = { min = \"0, 0, 0 mm\", max = \"6, 6, 6 mm\" } }\n";
const MOVING: &str = "motion = { duration = \"0.5 us\", @ }\n";
const RESTING: &str = "equilibrium = { @ }\n\
    condition = [{ on = \"x-min\", thickness = 2, displacement = [0, 0, 0] }, { on = \"x-max\", thickness = 2, displacement = \
    [\"0.1 um\", 0, 0] }]\n";
const SOLID: &str = "material = \"Pyroceram\"\ndensity = \"2600 kg/m3\"\n";

/// What is tried: its name, whether at rest, and what is added for a grid and for a packing. `motion: `, `equilibrium: ` and
/// `packing: ` go into those tables, `body: ` and `material: ` take their places.
const CAPABILITIES: [(&str, bool, &str, &str); 29] = [
    ("motion", false, "", ""),
    ("motion from an equilibrium", false, "motion: from_equilibrium = true", "motion: from_equilibrium = true"),
    ("viscous damping", false, "motion: damping = \"1e4 1/s\"", "motion: damping = \"1e4 1/s\""),
    ("local damping", false, "motion: local_damping = 0.5", "motion: local_damping = 0.5"),
    (
        "finite kinematics in motion",
        false,
        "model = { kinematics = \"finite\" }",
        "model = { kinematics = \"finite\" }",
    ),
    ("equilibrium", true, "", ""),
    (
        "finite kinematics in equilibrium",
        true,
        "model = { kinematics = \"finite\" }",
        "model = { kinematics = \"finite\" }",
    ),
    ("dynamic relaxation", true, "equilibrium: relaxation = true", "equilibrium: relaxation = true"),
    ("central bonds", false, "model = { bonds = \"central\" }", "packing: bonds = \"central\""),
    (
        "bonds with shear stiffness, sites that turn",
        false,
        "model = { bonds = \"micropolar\" }",
        "packing: bonds = \"micropolar\"",
    ),
    ("hybrid bonds: every stiffness", false, "model = { bonds = \"hybrid\" }", "packing: bonds = \"hybrid\""),
    ("calibrated surfaces", false, "model = { surface_calibration = true }", "model = { surface_calibration = true }"),
    ("several materials", false, REGIONS, REGIONS),
    ("grains", false, GRAINS, GRAINS),
    ("layers", false, LAYERS, LAYERS),
    ("pre-cracks", false, CRACK, CRACK),
    ("fracture energy", false, "fracture = { energy = \"5 J/m2\" }", "fracture = { energy = \"5 J/m2\" }"),
    ("strength, Mohr-Coulomb", false, STRENGTH, STRENGTH),
    ("unbreakable regions", false, FRACTURE_UNBREAKABLE, STRENGTH_UNBREAKABLE),
    ("bonds that soften, in motion", false, FRACTURE_SOFT, STRENGTH_SOFT),
    ("bonds that yield, in motion", false, FRACTURE_PLASTIC, STRENGTH_PLASTIC),
    ("bonds that break, in equilibrium", true, "fracture = { energy = \"5 J/m2\" }", STRENGTH),
    ("bonds that soften, in equilibrium", true, FRACTURE_SOFT, STRENGTH_SOFT),
    ("bonds that yield, in equilibrium", true, FRACTURE_PLASTIC, STRENGTH_PLASTIC),
    ("contact of sites without a bond", false, CONTACT, CONTACT),
    ("contact in equilibrium", true, CONTACT, CONTACT),
    ("periodic axes", false, "grid: periodic = [\"y\"]", "body: "),
    ("a cell driven by strain rates and stresses", false, SERVO, SERVO_CELL),
    ("tractions on faces", false, TRACTION, TRACTION),
];

const REGIONS: &str = "material: region = [{ name = \"a\", material = \"Si\", density = \"2330 kg/m3\", solid = { box = { max = \
                       \"3, 6, 6 mm\", min = \"0, 0, 0 mm\" } } }, { name = \"b\", material = \"Pyroceram\", density = \"2600 kg/m3\" }]";
const GRAINS: &str = "material: region = [{ name = \"g\", material = \"Si\", density = \"2330 kg/m3\", grains = { number = 3, seed = 1 } }]";
const LAYERS: &str = "material: region = [{ name = \"l\", layers = { axis = \"z\", layup = [{ thickness = \"3 mm\", material = \"Si\", \
                      density = \"2330 kg/m3\" }, { thickness = \"3 mm\", material = \"Pyroceram\", density = \"2600 kg/m3\" }] } }]";
const CRACK: &str = "crack = [{ line = { from = \"-1, 3 mm\", to = \"3, 3 mm\" } }]";
const STRENGTH: &str = "strength = { tension = \"5 MPa\", cohesion = \"10 MPa\", friction_angle = 30 }";
const FRACTURE_UNBREAKABLE: &str =
    "fracture = { energy = \"5 J/m2\" }\nunbreakable = [{ on = \"x-min\", thickness = 2 }]";
const STRENGTH_UNBREAKABLE: &str =
    "strength = { tension = \"5 MPa\" }\nunbreakable = [{ on = \"x-min\", thickness = 2 }]";
const FRACTURE_SOFT: &str = "fracture = { energy = \"5 J/m2\" }\nmodel = { softening = { linear = 3 } }";
const STRENGTH_SOFT: &str = "strength = { tension = \"5 MPa\" }\nmodel = { softening = { linear = 3 } }";
const FRACTURE_PLASTIC: &str =
    "fracture = { energy = \"5 J/m2\" }\nmodel = { plastic = { hardening = 0.1, ductility = 5 } }";
const STRENGTH_PLASTIC: &str =
    "strength = { tension = \"5 MPa\" }\nmodel = { plastic = { hardening = 0.1, ductility = 5 } }";
const CONTACT: &str = "contact = { friction = 0.3 }";
const SERVO: &str = "servo = { zz = { strain_rate = \"1 1/s\" } }";
const SERVO_CELL: &str = "body: \nservo = { zz = { strain_rate = \"1 1/s\" } }";
const TRACTION: &str = "condition = [{ on = \"x-max\", traction = \"1, 0, 0 MPa\" }]";

/// A case with something added.
fn case(lattice: &str, schedule: &str, added: &str) -> String {
    let mut parts = [SOLID.to_string(), BODY.into(), lattice.into(), schedule.into()];
    let mut more = String::new();
    for line in added.lines() {
        let into = |part: &mut String, keys: &str| *part = part.replace('@', keys);
        match line.split_once(": ") {
            Some(("material", keys)) => parts[0] = format!("{keys}\n"),
            Some(("body", keys)) => parts[1] = format!("{keys}\n"),
            Some(("packing", keys)) => into(&mut parts[2], keys),
            Some(("grid", keys)) => parts[2] = parts[2].replace(" }", &format!(", {keys} }}")),
            Some(("motion" | "equilibrium", keys)) => into(&mut parts[3], keys),
            _ => more += &format!("{line}\n"),
        }
    }
    (parts.concat() + &more).replace(", @", "").replace('@', "")
}

/// `yes`, or why not: the problem that the program names, without its place and its remedy.
fn tried(lattice: &str, schedule: &str, added: &str) -> String {
    let parsed = CaseFile::parse(&case(lattice, schedule, added), "case.toml", &[]);
    let begun = match lattice == GRID {
        true => parsed.and_then(|c| c.problem()).and_then(Simulation::new).and_then(|mut run| run.advance()),
        false => {
            parsed.and_then(|c| c.packing_problem()).and_then(PackingSimulation::new).and_then(|mut run| run.advance())
        }
    };
    let said = match begun {
        Ok(()) => return "yes".into(),
        Err(e) => e.to_string(),
    };
    let problem = said.rsplit_once("; ").map_or(said.as_str(), |(problem, _)| problem);
    format!("no: {}", problem.rsplit_once(": ").map_or(problem, |(_, why)| why))
}

/// The table in docs/capabilities.md, between its heading and the next paragraph, is what cases can do.
#[test]
fn the_table_of_capabilities_is_what_cases_can_do() {
    let mut table = String::from("| | grid | packing |\n|---|---|---|\n");
    for (name, rests, grid, packing) in CAPABILITIES {
        let schedule = if rests { RESTING } else { MOVING };
        table += &format!("| {name} | {} | {} |\n", tried(GRID, schedule, grid), tried(PACKING, schedule, packing));
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/capabilities.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let stands: String = page.lines().filter(|line| line.starts_with('|')).map(|line| format!("{line}\n")).collect();
    assert!(stands == table, "docs/capabilities.md should have this table:\n{table}");
}
