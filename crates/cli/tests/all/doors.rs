//! Every file that a tensor or a packing may stand in, through every door: `tensor`, `calibrate`, `advise`, the studio's box; `pack`,
//! `lattice`, `element-test`.

use crate::common;

use std::path::Path;

use common::{anisobond, folder, json, refused, stdout, write};
use serde_json::Value;

/// The crystal of all samples (GPa).
const C: [[f64; 6]; 6] = [
    [328.01, 69.02, 69.03, 0.0, 0.0, 0.0],
    [69.02, 199.04, 73.05, 0.0, 0.0, 0.0],
    [69.03, 73.05, 235.06, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 66.08, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 81.09, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 80.07],
];

/// Samples of every format: file, row of a table, unit where the file names none.
#[rustfmt::skip]
const SAMPLES: [(&str, Option<&str>, Option<&str>); 45] = [
    ("OUTCAR", None, None), ("lammps.log", None, None), ("vaspkit.in", None, None), ("vaspkit.out", None, None),
    ("triangle.txt", None, Some("GPa")), ("elate.txt", None, Some("GPa")), ("mtex.txt", None, None), ("dpgen.out", None, None),
    ("thermo_pw.out", None, None), ("output_el_cons.dat", None, None), ("ELADAT", None, None), ("castep.elastic", None, None),
    ("crystal.out", None, None), ("elastool.out", None, None), ("aniso.inp", None, None), ("ortho.inp", None, Some("GPa")),
    ("engineering.inp", None, None), ("several.inp", Some("OLIVINE"), None), ("ansys.mac", None, None),
    ("comsol.java", None, None), ("comsol.txt", None, None), ("msat.txt", None, None), ("list.txt", None, None),
    ("matlab.m", None, None), ("fortran.txt", None, None), ("uncertain.txt", None, None),
    ("german-matrix.csv", None, Some("GPa")), ("german.csv", Some("Fo"), None), ("german.csv", None, None),
    ("engineering.csv", Some("Fo"), None), ("pymatgen.json", None, None), ("full.json", None, None),
    ("bare.json", None, Some("GPa")), ("bare-full.json", None, Some("GPa")), ("mp.json", None, None),
    ("list.json", Some("b"), None), ("by-id.json", Some("mp-2"), None), ("matrices.json", Some("Fa"), None),
    ("pandas.json", Some("b"), None), ("split.json", Some("a"), None), ("columns.json", Some("b"), None),
    ("answer.json", None, None), ("jarvis.json", None, None), ("dpgen.json", None, None), ("by-id.json", Some("mp-1"), None),
];

fn sample(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../formats/tests/data/foreign").join(name);
    path.to_str().unwrap().to_string()
}

/// Whether a Voigt matrix (Pa) is the crystal, to the digits of the files.
fn is_crystal(voigt: &Value) -> bool {
    let entry = |a: usize, b: usize| voigt[a][b].as_f64().unwrap_or(f64::NAN);
    (0..6).all(|a| (0..6).all(|b| (entry(a, b) - 1e9 * C[a][b]).abs() < 1e4))
}

#[test]
fn every_tensor_enters_by_every_command() {
    for (name, row, unit) in SAMPLES {
        let path = sample(name);
        let mut words = vec![path.as_str()];
        words.extend(row.iter().flat_map(|row| ["--row", row]));
        words.extend(unit.iter().flat_map(|unit| ["--unit", unit]));
        for (command, more, key) in [
            ("tensor", &["--json"][..], "stiffness"),
            ("calibrate", &["--json", "--horizon", "2", "--model", "hybrid"], "target"),
            ("advise", &["--json"], "stiffness"),
        ] {
            // A table as a whole is calibrated row by row, into a folder.
            if command == "calibrate" && row.is_none() && anisobond_formats::is_table(&path) {
                continue;
            }
            let output = anisobond(&[&[command][..], &words, more].concat());
            let said = String::from_utf8_lossy(&output.stderr);
            let document: Value =
                serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{command} {name}: {e} {said}"));
            assert!(is_crystal(&document[key]), "{command} {name}: {}", document[key]);
            assert!(
                command != "tensor" || document["read_as"].as_str().is_some_and(|words| words.len() > 10),
                "{name}"
            );
        }
    }
}

#[test]
fn every_tensor_enters_by_the_studio_s_box() {
    let studio = super::studio::Studio::start(&[]);
    // The box holds one material with its unit.
    for (name, ..) in SAMPLES.iter().filter(|(_, row, unit)| row.is_none() && unit.is_none()) {
        let text = std::fs::read_to_string(sample(name)).unwrap();
        let answer = studio.post(
            "calibrate",
            &super::studio::question(
                serde_json::json!({ "text": text }),
                serde_json::json!({ "horizon": "2", "model": "hybrid" }),
            ),
        );
        assert!(is_crystal(&answer["page"]["tensors"][0]["voigt"]), "{name}: {answer}");
    }
}

/// A crystal of spheres that nearly touch, written by us and as others write it.
#[test]
fn every_packing_enters_by_every_command() {
    let dir = folder();
    let place = |name: &str| dir.path().join(name).to_str().unwrap().to_string();
    let fcc = ["pack", "--crystal", "fcc", "--cells", "2,2,2", "--radius", "1 mm"];
    stdout(&[&fcc[..], &["-o", &place("own.csv")]].concat());
    let own = std::fs::read_to_string(place("own.csv")).unwrap();
    let edge =
        own.lines().find_map(|line| line.strip_prefix("# cell: ")).unwrap().split(' ').next().unwrap().to_string();
    let rows: Vec<Vec<f64>> =
        own.lines().skip(3).map(|line| line.split(',').map(|x| 1e3 * x.parse::<f64>().unwrap()).collect()).collect();
    let edge = 1e3 * edge.parse::<f64>().unwrap();
    let lines = |row: &dyn Fn(usize, &[f64]) -> String| {
        rows.iter().enumerate().map(|(n, r)| row(n + 1, r) + "\n").collect::<String>()
    };
    let dumped = lines(&|n, r| format!("{n} {} {} {} {}", r[0] / edge, r[1] / edge, r[2] / edge, 2.0 * r[3]));
    let bounds = format!("0 {edge}\n").repeat(3);
    let dump = format!(
        "ITEM: TIMESTEP\n7\nITEM: NUMBER OF ATOMS\n{}\nITEM: BOX BOUNDS pp pp pp\n{bounds}ITEM: ATOMS id xs ys zs diameter\n{dumped}",
        rows.len()
    );
    let german = lines(&|_, r| format!("{};{};{};{}", r[0], r[1], r[2], 2.0 * r[3]).replace('.', ","));
    let german = format!("\u{feff}# cell: {edge:?} {edge:?} {edge:?}\nX (mm);Y (mm);Z (mm);D (mm)\n{german}");
    let woo = lines(&|_, r| format!("{} {} {} {}", 1e-3 * r[0], 1e-3 * r[1], 1e-3 * r[2], 1e-3 * r[3]));
    let woo = format!("##PERIODIC:: {0} {0} {0}\n{woo}", 1e-3 * edge);
    let of = |path: &str, more: &[&str]| json(&[&["lattice", path, "Si", "--json"][..], more].concat());
    let expected = of(&place("own.csv"), &[]);
    let same = |document: &Value, what: &str| {
        for a in 0..6 {
            let value = |d: &Value| d["lattice"][a][a].as_f64().unwrap();
            assert!(
                (value(document) / value(&expected) - 1.0).abs() < 1e-9,
                "{what}: {} {}",
                document["lattice"],
                expected["lattice"]
            );
        }
        assert!((document["packing"]["radius"]["mean"].as_f64().unwrap() / 1e-3 - 1.0).abs() < 1e-9, "{what}");
    };
    for (name, text, more, words) in [
        ("dump.txt", &dump, &["--length-unit", "mm", "--frame", "7"][..], "LAMMPS dump, time step 7, the only one"),
        ("german.dat", &german, &[], "table with headings, decimal commas, lengths in mm"),
        ("woo", &woo, &[], "list of x y z r, the cell in ##PERIODIC::"),
    ] {
        let path = write(&dir, name, text);
        let document = of(&path, more);
        same(&document, name);
        assert!(document["packing_read_as"].as_str().unwrap().starts_with(words), "{}", document["packing_read_as"]);
        let report = json(&[&["pack", &path, "--json"][..], more].concat());
        assert_eq!(report["columns"], document["packing_columns"], "{name}");
        let said = stdout(&[&["element-test", &path, "Si", "--model", "central"][..], more].concat());
        assert!(said.starts_with(&format!("read as           {}", &words[..20])), "{said}");
    }
    let path = place("dump.txt");
    assert!(refused(&["pack", &path], 2).contains("name it with --length-unit mm"));
    let read = json(&["pack", &path, "--unit", "mm", "--json"]);
    assert!((read["statistics"]["radius"]["mean"].as_f64().unwrap() / 1e-3 - 1.0).abs() < 1e-9, "{read}");
    assert!(refused(&["element-test", "Si", "--grid", "4", "--frame", "7"], 2).contains("--frame"));
    // A case needs the unit of its lengths, and a sweep may say it.
    let case = |keys: &str| {
        let text = format!(
            "material = {{ class = 'isotropic', unit = 'GPa', engineering = {{ e = 20, nu = 0.2 }}, density = '2600 kg/m3' }}\n\
             [packing]\nfile = 'bare.txt'\ncontact_radius = 1.8\nbonds = 'central'\n{keys}[motion]\nduration = '1 us'\n"
        );
        write(&dir, "case.toml", &text)
    };
    write(&dir, "bare.txt", &woo.replace("##PERIODIC::", ""));
    let said = refused(&["check", &case("")], 2);
    assert!(said.contains("bare.txt names no unit of length; add length_unit = \"m\""), "{said}");
    let said = refused(&["check", &case("frame = 3\n")], 2);
    assert!(said.contains("the file has no time steps"), "{said}");
    let plan = anisobond(&["check", &case("length_unit = 'mm'\n"), "--json"]);
    let plan: Value = serde_json::from_slice(&plan.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&plan.stderr)));
    assert!((plan["radius"].as_f64().unwrap() / 1e-6 - 1.0).abs() < 1e-9, "{plan}");
    let table = write(
        &dir,
        "jobs.csv",
        "sep=;\npacking;length_unit;frame;contact_radius;material;model\ndump.txt;mm;7;1,8;Si;central\ndump.txt;mm;7;1,4;Si;central\n",
    );
    let out = place("swept");
    stdout(&["sweep", &table, "-o", &out]);
    let results = std::fs::read_to_string(dir.path().join("swept/results.csv")).unwrap();
    assert!(results.contains("1.8") && results.lines().count() == 3, "{results}");
}
