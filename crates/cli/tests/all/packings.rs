//! Packings run as grids do: files, the same case on either lattice, regions, and what goes wrong.

use crate::common;

use std::path::Path;

use common::torn::{PACKING, torn_packing};
use common::{anisobond, folder, json, refused, stdout, write};

/// A run's folder: frames with their list, pictures, an animation, probes.
#[test]
fn a_run_has_its_files() {
    let dir = folder();
    let case = write(&dir, "torn.toml", &torn_packing("40 us"));
    let out = dir.path().join("out");
    let r = json(&["run", &case, "-o", out.to_str().unwrap(), "--json"]);
    assert!(r["nodes"].as_u64().unwrap() > 50 && r["relative_drift"].as_f64().unwrap() < 0.1, "{r}");
    let names = ["frame-00000.vtp", "frame-00003.vtp", "frames.pvd", "slice-1-00003.png", "slice-1.apng", "probes.csv"];
    names.iter().for_each(|name| assert!(out.join(name).metadata().unwrap().len() > 100, "{name}"));
    let probes = std::fs::read_to_string(out.join("probes.csv")).unwrap();
    assert!(probes.starts_with("time_s,kinetic_J,") && probes.contains("pull_Fx_N"), "{probes}");
    assert!(std::fs::read_to_string(out.join("frames.pvd")).unwrap().contains("frame-00003.vtp"));
    let message = refused(&["run", &case, "-o", out.to_str().unwrap()], 2);
    assert!(message.contains("already has results"), "{message}");
}

/// One file with both lattices: a bar pulled at its ends is held by the same force on either, and stretches alike.
#[test]
fn the_same_case_on_either_lattice() {
    let dir = folder();
    let text = "lattice = 'grid'\nmaterial = { class = 'isotropic', unit = 'GPa', engineering = { e = 20, nu = 0.2 } }\n\
        [body]\nbox = { size = '40, 12, 12 mm' }\n[grid]\nspacing = '2 mm'\n[model]\nbonds = 'hybrid'\n\
        [packing]\nradius = '1 mm'\nnumber = 150\nseed = 2\ncontact_radius = 1.8\ncorrect = true\n\
        [[condition]]\nname = 'left'\non = 'x-min'\ndisplacement = [0, 0, 0]\n\
        [[condition]]\nname = 'pull'\non = 'x-max'\ntraction = ['10 MPa', 0, 0]\n[equilibrium]\n\
        [[probe]]\nname = 'right'\nquantity = 'displacement'\non = 'x-max'\n\
        [[probe]]\nname = 'hold'\nquantity = 'reaction'\ncondition = 'left'\n[output]\nframes = 0\n";
    let case = write(&dir, "bar.toml", text);
    let mut stretch = Vec::new();
    for lattice in ["grid", "packing"] {
        let out = dir.path().join(lattice);
        json(&["run", &case, "-o", out.to_str().unwrap(), "--set", &format!("lattice={lattice}"), "--json"]);
        let probes = std::fs::read_to_string(out.join("probes.csv")).unwrap();
        let names: Vec<&str> = probes.lines().next().unwrap().split(',').collect();
        let last: Vec<f64> = probes.lines().last().unwrap().split(',').map(|x| x.parse().unwrap()).collect();
        let value = |name: &str| last[names.iter().position(|n| *n == name).unwrap()];
        // 10 MPa on 144 mm², to the accuracy of the solve.
        assert!((value("hold_Fx_N") + 1440.0).abs() < 1e-3, "{lattice}: {}", value("hold_Fx_N"));
        // The work of the traction is twice the energy.
        let (work, energy) = (value("external_J"), value("strain_J"));
        assert!((work / energy - 1.0).abs() < 1e-6, "{lattice}: {work} {energy}");
        stretch.push(value("right_ux_m"));
    }
    // σ L/E = 20 µm, less the held layer; a packing's surfaces have lost bonds and are not calibrated, which makes a bar of six
    // diameters softer by a third.
    assert!((17e-6..20e-6).contains(&stretch[0]) && (20e-6..27e-6).contains(&stretch[1]), "{stretch:?}");
}

/// Two materials in one packing: a bar in series stretches as its halves do, and weighs what they weigh.
#[test]
fn regions_have_their_own_materials() {
    let dir = folder();
    let bar = |regions: &str| {
        format!(
            "density = '2600 kg/m3'\nmaterial = {{ class = 'isotropic', unit = 'GPa', engineering = {{ e = 20, nu = 0.2 }} }}\n\
             [solids.half]\nbox = {{ min = '0, -6, -6 mm', max = '20, 6, 6 mm' }}\n{regions}\
             [body]\nbox = {{ size = '40, 12, 12 mm' }}\n\
             [packing]\nradius = '1 mm'\nnumber = 150\nseed = 2\ncontact_radius = 1.8\n\
             [[condition]]\nname = 'left'\non = 'x-min'\ndisplacement = [0, 0, 0]\n\
             [[condition]]\nname = 'pull'\non = 'x-max'\ntraction = ['10 MPa', 0, 0]\n[equilibrium]\n\
             [[probe]]\nname = 'right'\nquantity = 'displacement'\non = 'x-max'\n\
             [output]\nframes = 0\n"
        )
    };
    let stiff = "density = '7800 kg/m3'\n\
        material = { class = 'isotropic', unit = 'GPa', engineering = { e = 60, nu = 0.2 } }\n";
    let half = format!("[[region]]\nname = 'hard'\nsolid = 'half'\n{stiff}[[region]]\nname = 'soft'\n");
    let whole = format!("[[region]]\nname = 'hard'\n{stiff}");
    let stretch = |name: &str, regions: &str| {
        let case = write(&dir, &format!("{name}.toml"), &bar(regions));
        let mass = json(&["check", &case, "--json"])["mass"].as_f64().unwrap();
        let out = dir.path().join(name);
        json(&["run", &case, "-o", out.to_str().unwrap(), "--json"]);
        let probes = std::fs::read_to_string(out.join("probes.csv")).unwrap();
        let at = probes.lines().next().unwrap().split(',').position(|n| n == "right_ux_m").unwrap();
        (probes.lines().last().unwrap().split(',').nth(at).unwrap().parse::<f64>().unwrap(), mass)
    };
    let (soft, light) = stretch("soft", "");
    let (hard, heavy) = stretch("hard", &whole);
    let (both, between) = stretch("both", &half);
    assert!((soft / hard - 3.0).abs() < 1e-6 && (heavy / light - 3.0).abs() < 1e-9, "{soft} {hard}");
    let mean = 0.5 * (soft + hard);
    assert!((both / mean - 1.0).abs() < 0.05, "{soft} {both} {hard}");
    assert!((between / (2.0 * light) - 1.0).abs() < 0.05, "{light} {between} {heavy}");
    let overlapping = format!("{half}solid = 'half'\n");
    let case = write(&dir, "overlapping.toml", &bar(&overlapping));
    let message = refused(&["check", &case], 2);
    assert!(message.contains("overlaps region \"hard\" in") && message.contains("spheres"), "{message}");
}

/// A periodic packing under the servo: confined, strained, its bonds failing; curve, peak and stresses are there.
#[test]
fn a_triaxial_test_has_a_peak() {
    let dir = folder();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/triaxial.toml");
    let case = write(&dir, "triaxial.toml", &std::fs::read_to_string(root).unwrap());
    let out = dir.path().join("out");
    let mut args = vec!["run", &case, "-o", out.to_str().unwrap(), "--json"];
    for set in ["packing.number=60", "motion.duration=1.2 ms", "servo.zz.strain_rate=-20 1/s", "output.frames=1"] {
        args.extend(["--set", set]);
    }
    let r = json(&args);
    let peak = &r["packing"]["peak"];
    let (differential, strain) = (peak["differential"].as_f64().unwrap(), peak["strain"].as_f64().unwrap());
    assert_eq!(peak["axis"], 2);
    assert!(differential > 10e6 && strain < 0.0, "{peak}");
    assert!(r["packing"]["broken_bonds"].as_u64().unwrap() > 0);
    assert!(out.join("stress-strain.png").exists());
    let probes = std::fs::read_to_string(out.join("probes.csv")).unwrap();
    let names: Vec<&str> = probes.lines().next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let rows: Vec<Vec<f64>> =
        probes.lines().skip(1).map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    // When the axial strain begins, all three stresses are those of the confinement.
    let confined = rows.iter().rev().find(|row| row[0] <= 0.2e-3).unwrap();
    for name in ["stress_xx_Pa", "stress_yy_Pa", "stress_zz_Pa"] {
        assert!((confined[column(name)] + 5e6).abs() < 0.5e6, "{name}: {}", confined[column(name)]);
    }
    // The axial strain is what its rate makes of the time that is left.
    let last = rows.last().unwrap();
    let strained = last[column("strain_zz")] - confined[column("strain_zz")];
    assert!((strained + 20.0 * (last[0] - confined[0])).abs() < 1e-3, "{strained}");
}

#[test]
fn bad_cases_are_refused_by_name() {
    let dir = folder();
    let out = dir.path().join("out");
    let good = torn_packing("5 us");
    let with = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        good.replace(from, to)
    };
    let still = |text: &str| text.replace("[motion]\nduration = '5 us'\ndamping = '1000 1/s'\n", "[equilibrium]\n");
    for (text, parts) in [
        (with("contact_radius", "contact_radus"), ["packing.contact_radus", "did you mean contact_radius"]),
        (with("contact_radius = 1.6\n", ""), ["packing", "has no contact_radius"]),
        (with("radius = '1 mm'\n", "file = 'none.txt'\n"), ["packing.number", "read from a file"]),
        (with("radius = '1 mm'\nnumber = 60\nseed = 5\n", "file = 'none.txt'\n"), ["cannot read", "none.txt"]),
        (with("number = 60\n", ""), ["packing", "has no size"]),
        (with("seed = 5\n", "seed = 5\nporosity = 0.1\n"), ["packing.radius", "porosity"]),
        (with("seed = 5\n", "repeat = [1, 1, 1]\n"), ["packing.repeat", "tiled packing only"]),
        (with("seed = 5\n", "periodic = ['x']\n"), ["body", "the periodic packing"]),
        (with("seed = 5\n", "local_damping = 1.5\n"), ["packing.local_damping", "out of range"]),
        (with("seed = 5\n", "rotations = 'fre'\n"), ["packing.rotations", "did you mean free"]),
        (with("'18, 8, 8 mm'", "'18, 8 mm'"), ["body", "endless along z"]),
        (with("'18, 8, 8 mm'", "'0.01, 0.01, 0.01 mm'"), ["body", "holds no sphere"]),
        (with("friction_angle = 20", "friction_angle = 95"), ["strength.friction_angle", "out of range"]),
        (with("tension = '20 MPa'", "tension = '20 mm'"), ["strength.tension", "mm"]),
        (with("friction = 0.5", "friction = -0.5"), ["contact.friction", "negative"]),
        (with("density = '2600 kg/m3'\n", ""), ["density", "which motion needs"]),
        (with("[contact]", "[servo]\nxx = { stress = '-1 MPa' }\n[contact]"), ["servo", "periodic along all axes"]),
        (with("[contact]", "[servo]\nxx = { strain = 0.1, stress = '1 Pa' }\n[contact]"), ["servo.xx", "after"]),
        (with("[strength]", "[region]\n[strength]"), ["region", "a list is needed"]),
        (with("on = 'x-min'\n", "on = 'x-min'\nthickness = '-1 mm'\n"), ["condition.0.thickness", "not positive"]),
        (with("[model]", "[grid]\nspacing = '1 mm'\n[model]"), ["a grid and a packing", "lattice ="]),
        (still(&good), ["a velocity", "equilibrium"]),
        (with(PACKING, ""), ["no grid and no packing", "add [grid]"]),
        (with("duration = '5 us'", "duration = '5 us'\nstep = '5 us'"), ["above the stable one", "step"]),
        (with("nu = 0.2", "nu = 0.45"), ["packing", "correct = true"]),
    ] {
        let case = write(&dir, "bad.toml", &text);
        let message = refused(&["run", &case, "-o", out.to_str().unwrap()], 2);
        assert!(parts.iter().all(|part| message.contains(part)), "{parts:?}: {message}");
        assert!(!out.exists(), "{parts:?} left a folder");
    }
}

/// A step above the stable one that is forced throws spheres out; the run names one and ends.
#[test]
fn an_exploding_step_is_named() {
    let dir = folder();
    let text = torn_packing("200 us")
        .replace("[strength]\ntension = '20 MPa'\ncohesion = '20 MPa'\nfriction_angle = 20\n", "");
    let case = write(&dir, "blown.toml", &format!("{text}step = '2 us'\nforce_step = true\n"));
    let out = dir.path().join("out");
    let output = anisobond(&["run", &case, "-o", out.to_str().unwrap()]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("has been thrown out at") && message.contains("smaller time step"), "{message}");
}

/// Spheres without bonds are named before the run, spheres that fly off after it.
#[test]
fn floaters_and_leavers_are_named() {
    let dir = folder();
    let case =
        write(&dir, "loose.toml", &torn_packing("20 us").replace("contact_radius = 1.6", "contact_radius = 1.02"));
    let plan = json(&["check", &case, "--json"]);
    assert!(plan["warnings"].to_string().contains("spheres have no bond"), "{plan}");
    let out = dir.path().join("out");
    let output = anisobond(&["run", &case, "-o", out.to_str().unwrap()]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.success() && message.contains("spheres have no bond") && message.contains("the first is sphere"),
        "{message}"
    );
    let text = torn_packing("600 us").replace("-4 m/s", "-60 m/s").replace("frames = 3", "frames = 0");
    let case = write(&dir, "flying.toml", &text);
    let out = dir.path().join("flying");
    let output = anisobond(&["run", &case, "-o", out.to_str().unwrap()]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.success() && message.contains("have left the body's box; the first seen is sphere"),
        "{message}"
    );
    let summary: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    let leavers = &summary["packing"]["leavers"];
    assert!(leavers["number"].as_u64().unwrap() > 0 && leavers["place"].is_array(), "{leavers}");
}

/// The plan of a run on a packing: its particles, step and time.
#[test]
fn check_names_spheres_step_and_time() {
    let dir = folder();
    let case = write(&dir, "torn.toml", &torn_packing("5 us"));
    let plan = json(&["check", &case, "--json"]);
    let number = |key: &str| plan[key].as_f64().unwrap();
    assert!(number("stable_step_s") > 0.0 && number("step_s") < number("stable_step_s"));
    assert!(number("particles") > 50.0 && number("bonds") > number("particles") && number("memory") > 1e4);
    // The rock that the spheres stand for fills the bar, but for the raggedness of its sides.
    assert!((number("volume") / 1152e-9 - 1.0).abs() < 0.15, "{}", number("volume"));
    assert!((number("mass") - 2600.0 * number("volume")).abs() < 1e-12);
}

/// A rock that the lattice misses is told of wherever its stiffness is, and the material stays what was asked for.
#[test]
fn a_lattice_that_misses_its_material_says_so() {
    let dir = folder();
    // r2: C44 of the elliptic form is not the rock's; shale: tangential bonds cannot give ν′ = ¼ of so soft a shear.
    let rock = |nu: f64, g: f64| {
        format!(
            "unit = 'GPa'\ndensity = '2500 kg/m3'\n[engineering]\nex = 60\nez = 30\nnu_xy = 0.15\nnu_zx = {nu}\ngyz = {g}\n"
        )
    };
    let r2 = write(&dir, "r2.toml", &rock(0.1, 16.0));
    let shale = write(&dir, "shale.toml", &rock(0.25, 12.0).replace("0.15", "0.2"));
    let packing = dir.path().join("packing.txt");
    let packing = packing.to_str().unwrap();
    stdout(&["pack", "--number", "120", "--radius", "1 mm", "--seed", "2", "-o", packing]);
    let case = write(
        &dir,
        "case.toml",
        "material = 'r2.toml'\n[body]\nbox = { size = '14, 14, 14 mm' }\n[packing]\nfile = 'packing.txt'\ncontact_radius = 1.8\n\
         [[condition]]\non = 'x-min'\ndisplacement = [0, 0, 0]\n[equilibrium]\n[output]\nframes = 0\n",
    );
    let told = |r: &serde_json::Value| {
        let warnings = r["warnings"].as_array().unwrap();
        let miss = warnings.iter().filter_map(|w| w.as_str()).find(|w| w.contains("the energy of a strain is off by"));
        miss.unwrap_or_else(|| panic!("{warnings:?}")).to_string()
    };
    let c44 = |r: &serde_json::Value, key: &str| r[key][3][3].as_f64().unwrap();
    let plan = json(&["check", &case, "--json"]);
    assert!(told(&plan).contains("C44 = ") && told(&plan).contains("follows from them"), "{}", told(&plan));
    let out = dir.path().join("out");
    let run = json(&["run", &case, "-o", out.to_str().unwrap(), "--json"]);
    assert_eq!(told(&run), told(&plan));
    let lattice = &run["packing"]["lattice"][0];
    assert!(
        (c44(lattice, "prescribed") - 16e9).abs() < 1.0 && (c44(lattice, "elliptic") - 16e9).abs() > 1e9,
        "{lattice}"
    );
    let [least, largest] = [0, 1].map(|i| lattice["energy_error"][i].as_f64().unwrap());
    assert!(least < largest && largest.abs().max(least.abs()) > 0.01 && lattice["measured"].is_array());
    for command in ["lattice", "element-test"] {
        let r = json(&[command, packing, &r2, "--json"]);
        told(&r);
        assert!((c44(&r, "prescribed") - 16e9).abs() < 1.0 && r["energy_error"].is_array(), "{command}");
        let words = stdout(&[command, packing, &r2]);
        assert!(words.contains("energy of a strain off by") && words.contains("elliptic"), "{words}");
    }
    // Corrected it is reached, and nothing is said.
    let r = json(&["element-test", packing, &r2, "--correct", "--json"]);
    assert!(r["warnings"].as_array().unwrap().is_empty() && r["energy_error"][1].as_f64().unwrap() < 0.01, "{r}");
    // Out of reach even then: said. Without correction it is refused, in the words of the rock.
    let set = format!("material={shale}");
    let plan = json(&["check", &case, "--json", "--set", &set, "--set", "packing.correct=true"]);
    assert!(["C44", "C55", "C13"].iter().any(|c| told(&plan).contains(c)), "{}", told(&plan));
    let message = refused(&["check", &case, "--set", &set], 2);
    for part in ["E (ex) = 60", "E′ (ez) = 30", "ν′ (nu_zx) = 0.25", "correct = true", "hybrid", "between"] {
        assert!(message.contains(part), "{part}: {message}");
    }
}

/// Keys of the other lattice: refused where the case has only one, named and set apart where it has both.
#[test]
fn keys_that_do_nothing_are_refused_or_named() {
    let dir = folder();
    let case = write(&dir, "torn.toml", &torn_packing("5 us"));
    for (set, parts) in [
        ("model.bonds=hybrid", ["model.bonds", "packing.bonds says"]),
        ("model.plastic={ yield_stretch = 0.01, breaking_stretch = 0.1 }", ["model.plastic", "tensile strength says"]),
        ("model.surface_calibration=false", ["model.surface_calibration", "not calibrated"]),
        ("fracture={ energy = '3 J/m2' }", ["fracture", "[strength]"]),
        ("motion.force_step=true", ["motion.force_step", "no step is given"]),
    ] {
        let message = refused(&["check", &case, "--set", set], 2);
        assert!(parts.iter().all(|part| message.contains(part)), "{set}: {message}");
    }
    // Both lattices in one file.
    let text = torn_packing("5 us")
        .replace("kinematics = 'finite'", "kinematics = 'linear'\nbonds = 'hybrid'")
        .replace("[body]", "lattice = 'packing'\nfracture = { stretch = 1e-3 }\n[body]")
        + "[grid]\nspacing = '1 mm'\n";
    let both = write(&dir, "both.toml", &text);
    for (lattice, idle, used) in [
        ("packing", ["model.bonds", "fracture", "grid"], "strength"),
        ("grid", ["strength", "contact", "packing"], "grid"),
    ] {
        let set = format!("lattice={lattice}");
        let plan = json(&["check", &both, "--json", "--set", &set]);
        let note = plan["warnings"][0].as_str().unwrap();
        assert!(note.contains("not used on") && idle[..2].iter().all(|key| note.contains(key)), "{note}");
        let out = dir.path().join(lattice);
        let run = json(&["run", &both, "-o", out.to_str().unwrap(), "--json", "--set", &set]);
        assert_eq!(run["warnings"][0].as_str().unwrap(), note);
        let asked: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("case.json")).unwrap()).unwrap();
        assert!(idle.iter().all(|key| !asked["not used"][*key].is_null()), "{asked}");
        assert!(asked[used].is_object() && idle.iter().all(|key| asked[*key].is_null()), "{asked}");
    }
}

/// Contacts are counted at the radius that bonds will have.
#[test]
fn pack_counts_bonds() {
    let dir = folder();
    let packing = dir.path().join("p.txt");
    let packing = packing.to_str().unwrap();
    let made = json(&["pack", "--number", "120", "--radius", "1 mm", "-o", packing, "--json"]);
    let lattice = json(&["lattice", packing, "Pyroceram", "--correct", "--json"]);
    assert_eq!(made["bonds"]["contacts"], lattice["contacts"]);
    assert_eq!(made["bonds"]["contact_radius"], lattice["contact_radius"]);
    let chosen = json(&["pack", packing, "--contact-radius", "1.4", "--json"]);
    assert!(chosen["bonds"].is_null() && chosen["statistics"]["contact_radius"] == 1.4, "{chosen}");
}
