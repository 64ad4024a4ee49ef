//! What is wrong in a case file is said with its place and a remedy, whatever the file holds.

use crate::given::case as case_common;

use anisobond::experiment::{Condition, History};
use anisobond_app::{CaseFile, starter_case};
use case_common::{BLOCK, message, problem};
use proptest::prelude::*;

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
        (add("[model]\nsoftening = { linear = 2, exponential = 1 }\n"), &["model.softening"]),
        (add("[model]\nsoftening = { exponential = 0 }\n"), &["model.softening.exponential", "give a positive number"]),
        (
            add("[model]\nsoftening = { table = [[0, 0], [1, 1]] }\n"),
            &["model.softening.table", "begins with the force 0"],
        ),
        (
            add("[model]\nsoftening = { table = [[1, 1], [2, 0.5]] }\n"),
            &["model.softening.table", "ends with the force 0.5"],
        ),
        (add("[model]\nsoftening = { table = [[1, 1, 1]] }\n"), &["model.softening.table.0", "two numbers are needed"]),
        (
            add("[model]\nsoftening = { linear = 2 }\nplastic = { ductility = 5 }\n"),
            &["model.plastic", "bonds that soften do not yield too"],
        ),
        (add("[model]\nplastic = { hardening = 0.1 }\n"), &["model.plastic", "not said when bonds yield and break"]),
        (add("[model]\nplastic = { ductility = 1 }\n"), &["model.plastic", "1 times the stretch"]),
        (add("[model]\nplastic = { ductility = 4, hardening = 1 }\n"), &["model.plastic", "a hardening of 1"]),
        (add("[model]\nplastic = { ductility = 4 }\n"), &["model.plastic", "not said at which stretch bonds yield"]),
        (
            add("[model]\nplastic = { yield_stretch = 0.1, breaking_stretch = 0.05 }\n"),
            &["model.plastic.breaking_stretch", "above yield_stretch"],
        ),
        (
            add(
                "[model]\nplastic = { yield_stretch = 0.01, breaking_stretch = 0.05 }\n[fracture]\nenergy = \"3 J/m2\"\n",
            ),
            &["model.plastic.yield_stretch", "both yield_stretch and fracture"],
        ),
        (
            add("[model]\nbonds = \"hybrid\"\nplastic = { yield_stretch = 0.01, breaking_stretch = 0.05 }\n"),
            &["model.plastic", "its nodal term does not"],
        ),
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
