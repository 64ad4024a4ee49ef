//! Models, corrections and grid cells as a user runs them.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn anisobond(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_anisobond")).args(args).output().unwrap()
}

/// stdout of a run that must succeed.
fn stdout(args: &[&str]) -> String {
    let output = anisobond(args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn json(args: &[&str]) -> Value {
    serde_json::from_str(&stdout(args)).unwrap()
}

/// stderr of a run that must end with code 2, printing nothing on stdout.
fn refused(args: &[&str]) -> String {
    let output = anisobond(args);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    assert!(output.stdout.is_empty() && !message.contains("panicked"), "{args:?}: {message}");
    message
}

/// A packing and two materials in a folder of their own.
struct Files {
    folder: tempfile::TempDir,
    packing: String,
    rock: String,
    triclinic: String,
}

fn files() -> Files {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_string()
    };
    let rock = write(
        "rock.toml",
        "name = \"rock\"\nunit = \"MPa\"\nclass = \"transversely-isotropic\"\naxis = [0, 0, 1]\n\
         c11 = 130\nc33 = 55\nc13 = 28\nc12 = 40\nc44 = 32.25\n",
    );
    // Isotropic with ν = 0.2, and normal bonds along an odd direction.
    let triclinic = write(
        "triclinic.toml",
        "name = \"triclinic\"\nunit = \"MPa\"\nclass = \"triclinic\"\nstiffness = [\n[170, 33, 36, 3, -2, -1],\n\
         [33, 160, 36, 6, -2, 1],\n[36, 36, 175, 11, -6, -3],\n[3, 6, 11, 68, -3, -1],\n[-2, -2, -6, -3, 67, 4],\n\
         [-1, 1, -3, -1, 4, 63],\n]\n",
    );
    let packing = folder.path().join("sample.txt").to_str().unwrap().to_string();
    let pack = ["pack", "--number", "150", "--radius", "1 mm", "--porosity", "0.5", "--seed", "3", "-o", &packing];
    stdout(&pack);
    Files { packing, rock, triclinic, folder }
}

fn exists(folder: &Path, names: &[&str]) {
    for name in names {
        assert!(folder.join(name).metadata().unwrap().len() > 500, "{name}");
    }
}

#[test]
fn four_moduli_are_corrected() {
    let f = files();
    let plain = json(&["element-test", &f.packing, &f.rock, "--contact-radius", "1.6", "--json"]);
    assert!(plain.get("correction").is_none() && plain["relative_error"].as_f64().unwrap() > 0.02);
    let out = f.folder.path().join("tested");
    let output = out.to_str().unwrap();
    let test = ["element-test", &f.packing, &f.rock, "--contact-radius", "1.6", "--correct", "elliptic"];
    let args = [&test[..], &["--json", "-o", output]].concat();
    let r = json(&args);
    assert_eq!(r["correction"]["form"], "elliptic");
    assert_eq!(r["correction"]["converged"], true);
    assert!(r["correction"]["corrections"].as_u64().unwrap() <= 6);
    assert!(r["correction"]["error"].as_f64().unwrap() <= 1e-4);
    assert!(r["correction"]["smallest_tangential"].as_f64().unwrap() > 0.0);
    assert_eq!(r["correction"]["remaining"].as_array().unwrap().len(), 6);
    assert!((r["measured"][2][2].as_f64().unwrap() / 55e6 - 1.0).abs() < 1e-3);
    assert_ne!(r["microplane_moduli"], plain["microplane_moduli"]);
    exists(&out, &["element-test.json", "bonds.csv", "directional.svg"]);
    // The lattice command writes the same bonds.
    let lattice = f.folder.path().join("lattice");
    let output = lattice.to_str().unwrap();
    let args = ["lattice", &f.packing, &f.rock, "--contact-radius", "1.6", "--correct", "elliptic", "-o", output];
    let text = stdout(&args);
    assert!(text.contains("corrected") && text.contains("elliptic moduli"), "{text}");
    let read = |folder: &Path| std::fs::read_to_string(folder.join("bonds.csv")).unwrap();
    assert_eq!(read(&lattice), read(&out));
}

#[test]
fn a_general_correction_takes_any_tensor() {
    let f = files();
    let r = json(&["element-test", &f.packing, &f.triclinic, "--contact-radius", "1.8", "--correct", "--json"]);
    assert_eq!(r["correction"]["form"], "general");
    assert!(r["relative_error"].as_f64().unwrap() <= 1e-4, "{}", r["correction"]);
    assert!(r.get("axis").is_none() && r["correction"]["shortfall"].is_null());
    let r = json(&["lattice", &f.packing, &f.rock, "--contact-radius", "1.8", "--correct", "general", "--json"]);
    assert_eq!(r["correction"]["form"], "general");
    // Out of reach: said, with what is nearest.
    let steel = f.folder.path().join("steel.toml");
    std::fs::write(&steel, "name = \"s\"\nunit = \"GPa\"\nclass = \"isotropic\"\nc11 = 6\nc12 = 4\n").unwrap();
    let steel = steel.to_str().unwrap();
    let r = json(&["lattice", &f.packing, steel, "--contact-radius", "1.8", "--correct", "--json"]);
    assert_eq!((&r["correction"]["converged"], &r["correction"]["out_of_reach"]), (&false.into(), &true.into()));
    assert!(r["correction"]["shortfall"].as_str().unwrap().contains("nearest"), "{}", r["correction"]["shortfall"]);
    // What bonds cannot, the nodal term can.
    let r = json(&[
        "element-test",
        &f.packing,
        steel,
        "--contact-radius",
        "1.8",
        "--model",
        "hybrid",
        "--correct",
        "--json",
    ]);
    assert!(r["relative_error"].as_f64().unwrap() <= 1e-4);
    assert_eq!(r["nodal_term"], r["correction"]["nodal"]["stiffness"]);
    assert_eq!(r["solver"]["negative_curvature"], false);
}

#[test]
fn models_on_packings() {
    let f = files();
    let test = |model: &str, more: &[&str]| {
        let mut args =
            vec!["element-test", &f.packing, &f.triclinic, "--contact-radius", "2", "--model", model, "--json"];
        args.extend(more);
        json(&args)
    };
    let central = test("central", &[]);
    assert_eq!(central["model"], "central");
    assert!(central["relative_error"].as_f64().unwrap() > 0.02 && central.get("nodal_term").is_none());
    let corrected = test("central", &["--correct"]);
    assert_eq!(corrected["correction"]["form"], "central");
    assert_eq!(corrected["correction"]["largest_tangential"], 0.0);
    assert!(corrected["correction"]["converged"] == true && !corrected["correction"]["shortfall"].is_null());
    assert!(corrected["relative_error"].as_f64() < central["relative_error"].as_f64());
    let hybrid = test("hybrid", &[]);
    assert!(hybrid["nodal_term"].is_array());
    let error = |r: &Value| r["relative_error"].as_f64().unwrap();
    assert!(error(&hybrid) < error(&central) && error(&test("hybrid", &["--correct"])) <= 1e-4);
}

#[test]
fn cells_of_a_grid() {
    let f = files();
    for model in ["central", "micropolar", "hybrid"] {
        let r = json(&["element-test", "KIO3", "--grid", "4,3,5", "--horizon", "3", "--model", model, "--json"]);
        assert_eq!(r["model"], model);
        assert!(r["relative_error"].as_f64().unwrap() < 1e-8, "{model}: {}", r["relative_error"]);
        assert_eq!((&r["cell"]["nodes"], &r["cell"]["bonds"]), (&60.into(), &(60 * 61).into()));
        assert!(r["stable"] == true);
    }
    let out = f.folder.path().join("cell");
    let output = out.to_str().unwrap();
    #[rustfmt::skip]
    let defects = [
        "element-test", "KIO3", "--grid", "6", "--horizon", "2", "--model", "hybrid", "--missing", "0.1",
        "--displaced", "0.2", "--void", "1", "--seed", "7", "--json", "-o", output,
    ];
    let r = json(&defects);
    assert!(r["cell"]["missing"].as_u64().unwrap() >= 22 && r["relative_error"].as_f64().unwrap() > 0.05);
    exists(&out, &["element-test.json", "bonds.csv", "directional.svg", "directional.csv", "directional.png"]);
    let again = json(&defects);
    assert_eq!(again["measured"], r["measured"]);
    let mut corrected = defects[..defects.len() - 2].to_vec();
    corrected.push("--correct");
    let r = json(&corrected);
    assert!(r["target_error"].as_f64().unwrap() <= 1e-4, "{}", r["correction"]);
    let text = stdout(&["element-test", "Si", "--grid", "3", "--horizon", "2"]);
    assert!(text.contains("model central") && text.contains("promised"), "{text}");
}

#[test]
fn flags_that_do_not_go_together_are_told() {
    let f = files();
    for (args, fragment) in [
        (&["element-test", &f.packing, "KIO3", "--grid", "4"][..], "--grid"),
        (&["element-test", "KIO3"], "PACKING"),
        (&["element-test", &f.packing, &f.rock, "--horizon", "3"], "--horizon"),
        (&["element-test", &f.packing, &f.rock, "--missing", "0.1"], "--missing"),
        (&["element-test", "KIO3", "--grid", "4", "--contact-radius", "2"], "--contact-radius"),
        (&["element-test", "KIO3", "--grid", "4,4"], "--grid 4,4"),
        (&["element-test", "KIO3", "--grid", "0"], "0 × 0 × 0"),
        (&["element-test", "KIO3", "--grid", "4", "--missing", "2"], "--missing"),
        (&["element-test", "KIO3", "--grid", "4", "--displaced", "0.7"], "0.7"),
        (&["element-test", "KIO3", "--grid", "4", "--void", "1,2"], "--void"),
        (&["element-test", "KIO3", "--grid", "4", "--method", "dynamic"], "dynamic"),
        (&["element-test", "KIO3", "--grid", "4", "--correct", "elliptic"], "elliptic"),
        (&["lattice", &f.packing, &f.rock, "--model", "hybrid", "--correct", "elliptic"], "tangential"),
        (&["element-test", &f.packing, &f.rock, "--model", "hybrid", "--method", "dynamic"], "nodal term"),
    ] {
        let message = refused(args);
        assert!(message.contains(fragment), "{args:?}: {message}");
    }
}

#[test]
fn sweeps_take_models_and_corrections() {
    let f = files();
    std::fs::write(
        f.folder.path().join("table.csv"),
        "packing,material,contact_radius,model,correct\nsample.txt,rock.toml,1.6,micropolar,elliptic\n=,=,=,hybrid,general\n",
    )
    .unwrap();
    let path = |name: &str| f.folder.path().join(name).to_str().unwrap().to_string();
    let r = json(&["sweep", &path("table.csv"), "-o", &path("out"), "--json"]);
    assert_eq!((&r["done"], &r["failed"]), (&2.into(), &0.into()));
    std::fs::write(
        f.folder.path().join("bad.csv"),
        "packing,material,contact_radius,model\nsample.txt,rock.toml,1.6,x\n",
    )
    .unwrap();
    assert!(refused(&["sweep", &path("bad.csv"), "-o", &path("never")]).contains("model"));
}
