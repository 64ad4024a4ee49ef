//! Conventions that check themselves: the order of layers, the licences and sources of dependencies.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The crates, each of which uses only those before it.
const CRATES: [&str; 6] = ["anisobond", "formats", "plot", "app", "cli", "python"];

fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name).join("src")
}

/// The modules of a crate's lib.rs in the order in which they stand there.
fn layers(name: &str) -> Vec<String> {
    let lib = std::fs::read_to_string(source(name).join("lib.rs")).unwrap();
    let names = lib.lines().filter_map(|line| {
        let line = line.strip_prefix("pub ").unwrap_or(line);
        line.strip_prefix("mod ")?.strip_suffix(';')
    });
    names.map(String::from).collect()
}

fn rust_files(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// Names of layers used by a text as `crate::layer`, also inside `crate::{…}`.
fn used(text: &str, layers: &[String]) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (start, _) in text.match_indices("crate::") {
        let rest = &text[start + 7..];
        let list = match rest.strip_prefix('{') {
            Some(inside) => &inside[..inside.find(';').unwrap_or(inside.len())],
            None => rest,
        };
        for piece in if list.len() == rest.len() { vec![rest] } else { list.split([',', '{', ' ', '\n']).collect() } {
            let name: String = piece.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            if layers.contains(&name) {
                found.insert(name);
            }
        }
    }
    found
}

#[test]
fn a_module_uses_only_modules_before_it() {
    assert_eq!(layers("anisobond")[..4], ["error", "tensor", "lattice", "calibration"].map(String::from));
    for name in &CRATES[..4] {
        let layers = layers(name);
        for (rank, layer) in layers.iter().enumerate() {
            let mut files = vec![source(name).join(format!("{layer}.rs"))];
            files.retain(|file| file.is_file());
            if source(name).join(layer).is_dir() {
                rust_files(&source(name).join(layer), &mut files);
            }
            for file in files {
                let text = std::fs::read_to_string(&file).unwrap();
                for used in used(&text, &layers) {
                    let other = layers.iter().position(|l| *l == used).unwrap();
                    assert!(other <= rank, "{} uses {used}, which comes after {layer} in lib.rs", file.display());
                }
            }
        }
    }
}

#[test]
fn a_crate_uses_only_crates_before_it() {
    for (rank, name) in CRATES.iter().enumerate() {
        let manifest = std::fs::read_to_string(source(name).join("../Cargo.toml")).unwrap();
        let linked = &manifest[manifest.find("[dependencies]").unwrap()..];
        let linked = &linked[..linked.find("\n[").unwrap_or(linked.len())];
        for other in &CRATES[rank..] {
            let entry = if *other == "anisobond" { "anisobond =".into() } else { format!("anisobond-{other} =") };
            assert!(!linked.contains(&entry), "{name} uses {other}");
        }
    }
    let manifest = std::fs::read_to_string(source("anisobond").join("../Cargo.toml")).unwrap();
    let linked = &manifest[manifest.find("[dependencies]").unwrap()..manifest.find("[dev-dependencies]").unwrap()];
    let names: Vec<&str> = linked.lines().filter_map(|line| line.split_once(" =").map(|(name, _)| name)).collect();
    assert_eq!(names, ["nalgebra", "rayon", "serde", "twox-hash"], "the core stays light");
}

#[test]
fn the_layering_test_sees_violations() {
    let layers: Vec<String> = ["error", "tensor", "io"].map(String::from).to_vec();
    assert_eq!(used("use crate::io::Table;", &layers).len(), 1);
    assert_eq!(used("use crate::{Error, io::Table, tensor::Stiffness};", &layers).len(), 2);
    assert_eq!(used("let x = crate::tensor::row_of(1, 2);", &layers).len(), 1);
    assert!(used("use crate::{Error, Result};", &layers).is_empty());
}

/// Licences that may be linked; a dependency passes if one alternative of its expression is made of these.
const LICENCES: [&str; 12] = [
    "MIT",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "ISC",
    "Zlib",
    "Unlicense",
    "0BSD",
    "CC0-1.0",
    "Unicode-3.0",
    "BSL-1.0",
];

fn permitted(expression: &str) -> bool {
    let plain = expression.replace(['(', ')'], " ").replace('/', " OR ");
    // (A OR B) AND C is read as A OR B AND C: every AND part needs a permitted alternative.
    plain.split(" AND ").all(|part| part.split(" OR ").any(|licence| LICENCES.contains(&licence.trim())))
}

/// What cargo knows of the workspace and its dependencies.
fn metadata() -> serde_json::Value {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../Cargo.toml");
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked", "--all-features", "--manifest-path"])
        .arg(manifest)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn dependencies_are_permissive_and_from_the_registry() {
    let metadata = metadata();
    let packages = metadata["packages"].as_array().unwrap();
    assert!(packages.len() > 20);
    for package in packages {
        let name = package["name"].as_str().unwrap();
        let licence = package["license"].as_str().unwrap_or("");
        assert!(permitted(licence), "{name}: licence {licence:?} is not on the list");
        match package["source"].as_str() {
            None => assert!(name.starts_with("anisobond"), "{name} is a path dependency"),
            Some(source) => assert!(source.starts_with("registry+"), "{name} comes from {source}"),
        }
    }
    assert!(!permitted("GPL-3.0-only") && !permitted("MIT AND GPL-2.0") && permitted("(MIT OR GPL-2.0) AND Zlib"));
}

/// The notices name every crate that is linked or builds the program, with its version and licence.
#[test]
fn third_party_notices_are_complete() {
    let metadata = metadata();
    let notices = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../THIRD-PARTY.md")).unwrap();
    let of = |id: &serde_json::Value| metadata["packages"].as_array().unwrap().iter().find(|p| &p["id"] == id).unwrap();
    let nodes = metadata["resolve"]["nodes"].as_array().unwrap();
    let mut waiting: Vec<&serde_json::Value> = metadata["workspace_members"].as_array().unwrap().iter().collect();
    let mut seen = BTreeSet::new();
    while let Some(id) = waiting.pop() {
        if !seen.insert(id.to_string()) {
            continue;
        }
        let package = of(id);
        let [name, version, licence] = ["name", "version", "license"].map(|key| package[key].as_str().unwrap());
        let line = format!("| {name} | {version} | {licence} |");
        assert!(
            package["source"].is_null() || notices.contains(&line),
            "THIRD-PARTY.md lacks {line}: run verification/third_party.py"
        );
        let node = nodes.iter().find(|n| &n["id"] == id).unwrap();
        let linked = |d: &&serde_json::Value| d["dep_kinds"].as_array().unwrap().iter().any(|k| k["kind"] != "dev");
        waiting.extend(node["deps"].as_array().unwrap().iter().filter(linked).map(|d| &d["pkg"]));
    }
    assert!(seen.len() > 60, "{}", seen.len());
}

/// Relative links of every Markdown file lead somewhere.
#[test]
fn links_of_the_documentation_lead_somewhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut count = 0;
    for folder in [root.clone(), root.join("docs")] {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|e| e != "md") {
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            for (start, _) in text.match_indices("](") {
                let target = text[start + 2..].split([')', '#']).next().unwrap();
                if !target.is_empty() && !target.contains("://") {
                    assert!(folder.join(target).exists(), "{}: {target}", path.display());
                    count += 1;
                }
            }
        }
    }
    assert!(count > 8, "{count}");
}
