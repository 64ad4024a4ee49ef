//! What a case's file says that no matter has, and bonds of a case that are closest in the sense of energy.

use crate::given::case as case_common;

use anisobond::experiment::Simulation;
use anisobond::tensor::{Material, Metric};
use anisobond_app::{CaseFile, RankSettings, rank};
use anisobond_formats::parse_table;
use case_common::{BLOCK, case, message, problem};
use nalgebra::Vector3;

use crate::common::jittered;

#[test]
fn sizes_and_densities_that_no_matter_has_are_noted() {
    assert!(case(BLOCK).notes().is_empty());
    let note = |from: &str, to: &str| {
        assert!(BLOCK.contains(from), "{from}");
        let notes = case(&BLOCK.replace(from, to)).notes();
        assert_eq!(notes.len(), 1, "{notes:?}");
        notes[0].clone()
    };
    let light = note("\"2600 kg/m3\"", "\"2.6 kg/m3\"");
    assert!(light.starts_with("region ") && light.contains("1000 times that is 2600 kg/m³"), "{light}");
    let small = note("\"1 mm\"", "\"1e-12 mm\"");
    assert!(small.contains("grid.spacing") && small.contains("smaller than an atom"), "{small}");
    let soft = note("\"Pyroceram\"", "{ unit = \"Pa\", engineering = { e = 80, nu = 0.25 } }");
    assert!(soft.contains("is the unit GPa?"), "{soft}");
}

/// A run's bonds are those of the metric that its case names.
#[test]
fn a_case_takes_the_metric() {
    let energy = problem(&format!("{BLOCK}\n[model]\nmetric = \"energy\"\n").replace("Pyroceram", "Te2W"));
    let norm = problem(&BLOCK.replace("Pyroceram", "Te2W"));
    assert_eq!((energy.metric, norm.metric), (Metric::Energy, Metric::Norm));
    let largest = |problem| {
        let simulation = Simulation::new(problem).unwrap();
        let [least, most] = simulation.regions()[0].energy_error.unwrap();
        least.abs().max(most.abs())
    };
    assert!(largest(energy) < 0.8 * largest(norm));
    let hybrid = message(&format!("{BLOCK}\n[model]\nmetric = \"energy\"\nbonds = \"hybrid\"\n"));
    assert!(hybrid.contains("model.metric") && hybrid.contains("reaches every tensor"), "{hybrid}");
    let wrong = message(&format!("{BLOCK}\n[model]\nmetric = \"enrgy\"\n"));
    assert!(wrong.contains("model.metric") && wrong.contains("energy"), "{wrong}");
    assert!(CaseFile::parse(&format!("{BLOCK}\n[model]\nmetric = \"norm\"\n"), "block.toml", &[]).is_ok());
}

/// A row's numbers do not depend on the others, and broken rows are kept apart.
#[test]
fn a_ranking_is_that_of_its_rows() {
    let row = |name: &str| {
        let c = Material::builtin(name).unwrap().stiffness.voigt();
        let all: Vec<String> =
            (0..6).flat_map(|a| (a..6).map(move |b| (a, b))).map(|i| (1e-9 * c[i]).to_string()).collect();
        format!("{name},{}", all.join(","))
    };
    let names: Vec<String> = (1..=6).flat_map(|a| (a..=6).map(move |b| format!("c{a}{b}"))).collect();
    let header = format!("id,{}", names.join(","));
    let builtin = Material::builtin_names();
    let rows: Vec<String> = builtin.iter().map(|name| row(name)).collect();
    let text = format!("{header}\n{}\nbroken{}\n", rows.join("\n"), ",x".repeat(21));
    let settings =
        || RankSettings { models: vec![anisobond::calibration::Model::Central], metric: Metric::Norm, within: 0.01 };
    let grid = anisobond::lattice::Neighbourhood::sphere(6.0, 1.0, anisobond::lattice::Influence::Inverse).unwrap();
    let mut all = rank(&parse_table(&text, "t.csv", None).unwrap(), &grid, settings()).unwrap();
    assert_eq!((all.rows.len(), all.failed.len(), all.all), (8, 1, 9));
    for (name, found) in builtin.iter().zip(&all.rows) {
        let c = Material::builtin(name).unwrap().stiffness;
        let gap = found["central"]["relative_error"].as_f64().unwrap();
        assert!((gap - c.cauchy_gap()).abs() < 1e-9, "{name}");
        let alone =
            rank(&parse_table(&format!("{header}\n{}\n", row(name)), "t.csv", None).unwrap(), &grid, settings());
        assert_eq!(found["central"], alone.unwrap().rows[0]["central"], "{name}");
    }
    all.sort("-central.relative_error").unwrap();
    assert_eq!(all.rows[0]["id"], "Te2W");
    assert_eq!(all.rows[7]["carried_by"], "central");
    all.keep("carried_by=central").unwrap();
    assert_eq!((all.rows.len(), all.rows[0]["id"].as_str()), (1, Some("Pyroceram")));
    assert!(all.csv().unwrap().contains("broken"));
}

/// Lattices of packings and sweeps over them: closest in energy in that metric, and refused where nothing would feel it.
#[test]
fn packings_and_sweeps_take_the_metric() {
    use anisobond::calibration::Model;
    use anisobond::experiment::element_test::ElementTest;
    use anisobond::experiment::{CorrectionChoice, LatticePlan, LatticeStudy};
    use anisobond_app::element_sweep::ElementSweep;
    use anisobond_app::sweep::ParameterTable;

    let packing = jittered(8, 3, 0.2);
    let c = Material::builtin("Te2W").unwrap().stiffness;
    let study = |metric, correct| {
        let plan = LatticePlan { metric, ..LatticePlan::new(Model::Central, correct, ElementTest::default()) };
        LatticeStudy::planned(packing.clone(), &c, &Vector3::z(), 1.6, &plan)
    };
    let distance = |metric| c.energy_distance(&study(metric, None).unwrap().summed()).unwrap();
    assert!(distance(Metric::Energy) < distance(Metric::Norm));
    assert!(study(Metric::Energy, Some(CorrectionChoice::General)).unwrap_err().to_string().contains("metric"));

    let folder = tempfile::tempdir().unwrap();
    anisobond_formats::write_packing(folder.path().join("p.txt"), &packing).unwrap();
    let sweep = |more: &str| {
        let text = format!(
            "packing = \"p.txt\"\nmaterial = \"Te2W\"\ncontact_radius = 1.6\n{more}\n[parameters]\ndip = [0]\nstrike = [0]\n"
        );
        let file = folder.path().join("table.toml").display().to_string();
        ElementSweep::new(&ParameterTable::parse(&text, &file).unwrap()).map(|_| ()).map_err(|e| e.to_string())
    };
    sweep("model = \"central\"\nmetric = \"energy\"").unwrap();
    assert!(sweep("metric = \"energy\"").unwrap_err().contains("central bonds without correction"));
    assert!(sweep("model = \"central\"\nmetric = \"length\"").unwrap_err().contains("use norm or energy"));
}
