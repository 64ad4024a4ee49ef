//! Models of a grid through the program: contracts of JSON, folders, tables, advice, refusals.

use crate::common;

use anisobond_formats::read_bonds;
use common::{anisobond, ended, folder, json, refused, stdout, table_rows, write};
use serde_json::Value;

const CRYSTALS: [&str; 8] = ["KIO3", "CoTeO4", "Te2W", "Ta2C", "Si", "MoN", "Spinel", "Pyroceram"];

fn number(r: &Value, path: &str) -> f64 {
    r.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} of {r}"))
}

/// What every model says, of whatever material.
fn check(r: &Value, model: &str) {
    assert_eq!(r["model"], model);
    let keys = ["stable", "smallest_at_phases", "sampled_waves", "long_wave_order", "reached", "target", "dual"];
    assert!(keys.iter().all(|key| !r[*key].is_null()), "{r}");
    assert!(
        r["cauchy_gap"].is_number() && r["universal_anisotropy"].is_number() && r["solver"]["residual"].is_number()
    );
    // Never stable with a wave that costs nothing.
    let stable = r["stable"].as_bool().unwrap();
    assert_eq!(stable, number(r, "/smallest_eigenvalue") > 1e-9 * number(r, "/target/0/0"), "{r}");
    // Nor without saying how that is known, and by what margin.
    let evidence = r["stability"]["evidence"].as_str().unwrap();
    assert!(evidence == "proved" || (stable && evidence == "sampled"), "{r}");
    assert_eq!(
        stable && evidence == "proved",
        r["stability"]["bound"].as_f64().is_some_and(|bound| bound > 0.0),
        "{r}"
    );
    assert!(number(r, "/stability/margin") < 1.0 && r["stability"]["at"] == r["smallest_at_phases"], "{r}");
    assert!(
        r["outcome"] != "not-converged" && (r["outcome"] == "feasible") == (r["reaches_model_limit"] == true),
        "{r}"
    );
    if !r["long_wave_order_of_reached"].is_null() && number(r, "/long_wave_error_of_reached") < 0.05 {
        assert!((number(r, "/long_wave_order_of_reached") - 2.0).abs() < 0.2, "{r}");
    }
}

#[test]
fn every_model_says_model_stable_and_smallest_eigenvalue() {
    for name in CRYSTALS {
        let run = |model: &[&str]| {
            let args = ["calibrate", name, "--horizon", "3", "--json"];
            json(&[&args, model].concat())
        };
        let central = run(&[]);
        check(&central, "central");
        assert_eq!(run(&["--model", "central"]), central);
        let sum = run(&["--model", "micropolar"]);
        check(&sum, "micropolar");
        assert!(sum["promise"] == "sum" && sum["relative_error"] == sum["sum_error"] && sum["reached"] == sum["sum"]);
        assert!(number(&sum, "/relative_error") <= number(&central, "/relative_error") + 1e-12);
        let free = run(&["--model", "micropolar", "--promise", "free-rotations"]);
        check(&free, "micropolar");
        assert!(free["relative_error"] == free["relaxed_error"] && free["reached"] == free["relaxed"]);
        for form in [None, Some("stable"), Some("remainder")] {
            let flags: Vec<&str> =
                ["--model", "hybrid"].into_iter().chain(form.iter().flat_map(|f| ["--form", f])).collect();
            let hybrid = run(&flags);
            check(&hybrid, "hybrid");
            assert!(number(&hybrid, "/relative_error") <= 1e-10 && hybrid["reaches_model_limit"] == true);
            assert!(form != Some("remainder") || hybrid["form"] == "remainder");
            assert!(form == Some("remainder") || hybrid["stable"] == true, "{name} {form:?}");
        }
    }
}

/// The errors of the document's materials at horizon 6 (Voigt-hypothesis sums).
#[test]
fn errors_with_tangential_bonds() {
    for (name, central, micropolar) in [("KIO3", 3.187, 1.874), ("Si", 3.863, 2.231), ("Ta2C", 2.632, 2.632)] {
        let percent =
            |model| 100.0 * number(&json(&["calibrate", name, "--json", "--model", model]), "/relative_error");
        assert!((percent("central") - central).abs() < 6e-4 && (percent("micropolar") - micropolar).abs() < 6e-4);
        assert!(percent("hybrid") < 1e-8);
    }
}

#[test]
fn folders_of_every_model_read_back() {
    let dir = folder();
    for (model, files) in [("central", 5), ("micropolar", 7), ("hybrid", 5)] {
        let out = dir.path().join(model);
        let folder = out.to_str().unwrap();
        let text = stdout(&["calibrate", "Si", "--horizon", "3", "--spacing", "2 mm", "--model", model, "-o", folder]);
        assert!(text.contains("stable           yes") && text.contains("long waves"), "{text}");
        assert_eq!(std::fs::read_dir(&out).unwrap().count(), files);
        let report: Value = serde_json::from_slice(&std::fs::read(out.join("calibration.json")).unwrap()).unwrap();
        check(&report, model);
        let bonds = read_bonds(out.join("bonds.csv")).unwrap();
        assert_eq!(bonds.len(), 122);
        // The written bonds, their tangential parts and the nodal term add up to the reached tensor: C11.
        let share = |b: usize| 0.5 * bonds.influence[b] * bonds.length[b] * 0.002f64.powi(3);
        let sum = (0..122).map(|b| {
            let n1 = bonds.xi[b].x / bonds.length[b];
            let across = bonds.tangential.as_ref().map_or(0.0, |t| t.micromodulus[b] * (n1 * n1 - n1.powi(4)));
            share(b) * (bonds.micromodulus[b] * n1.powi(4) + across)
        });
        let nodal = report.pointer("/nodal_term/0/0").and_then(Value::as_f64).unwrap_or(0.0);
        let c11 = sum.sum::<f64>() + nodal;
        assert!((c11 / number(&report, "/reached/0/0") - 1.0).abs() < 1e-12, "{model} {c11:e}");
        assert_eq!(bonds.tangential.is_some(), model == "micropolar");
        let vtp = std::fs::read_to_string(out.join("neighbourhood.vtp")).unwrap();
        assert_eq!(vtp.contains("tangential_micromodulus"), model == "micropolar");
    }
    // No tangential bond at all still makes a picture.
    let out = dir.path().join("bare");
    stdout(&["calibrate", "Ta2C", "--horizon", "3", "--model", "micropolar", "-o", out.to_str().unwrap()]);
    assert!(out.join("neighbourhood-tangential.png").exists());
}

#[test]
fn required_errors_are_those_of_the_promise() {
    let code = |args: &[&str]| anisobond(&[&["calibrate", "Si", "--horizon", "3"], args].concat()).status.code();
    assert_eq!(code(&["--model", "hybrid", "--require-exact"]), Some(0));
    assert_eq!(code(&["--model", "micropolar", "--require-exact=0.02"]), Some(3));
    assert_eq!(code(&["--model", "micropolar", "--require-exact=0.03"]), Some(0));
    assert_eq!(code(&["--model", "central", "--require-exact=0.03"]), Some(3));
    let dir = folder();
    let table = table_rows(&dir);
    let table_code =
        |model| anisobond(&["calibrate", &table, "--horizon", "3", "--model", model, "--require-exact"]).status.code();
    assert_eq!((table_code("hybrid"), table_code("central")), (Some(5), Some(3)));
}

#[test]
fn tables_have_the_columns_of_the_model_and_notice_another() {
    let dir = folder();
    let table = table_rows(&dir);
    let out = dir.path().join("out");
    let run = |flags: &[&str]| {
        ended(&[&["calibrate", &table, "--horizon", "3", "-o", out.to_str().unwrap()], flags].concat(), 5);
        std::fs::read_to_string(out.join("calibrations.csv")).unwrap()
    };
    let journal = || std::fs::read_to_string(out.join("journal.jsonl")).unwrap().lines().count();
    let columns = |csv: &str| csv.lines().next().unwrap().split(',').map(String::from).collect::<Vec<_>>();
    let central = run(&[]);
    assert_eq!(journal(), 12);
    let has = |csv: &str, names: &[&str]| names.iter().all(|name| columns(csv).iter().any(|c| c == name));
    assert!(has(&central, &["model", "stable", "smallest_eigenvalue", "long_wave_error", "sampled_waves"]));
    let hybrid = run(&["--model", "hybrid"]);
    assert_eq!(journal(), 24);
    assert!(has(&hybrid, &["model", "form", "nodal_share", "nodal_term.c11", "stable", "smallest_eigenvalue"]));
    run(&["--model", "hybrid", "--form", "stable"]);
    assert_eq!(journal(), 36);
    let micropolar = run(&["--model", "micropolar"]);
    assert!(has(&micropolar, &["promise", "sum_error", "relaxed_error", "tangential_micromodulus.max", "stable"]));
    let free = run(&["--model", "micropolar", "--promise", "free-rotations"]);
    assert!(journal() == 60 && free != micropolar);
    // Each is found again.
    assert_eq!((run(&["--model", "hybrid"]), run(&[]), journal()), (hybrid, central, 60));
    let lines = ended(&["calibrate", &table, "--horizon", "3", "--model", "hybrid", "--jsonl"], 5);
    for (i, line) in lines.lines().enumerate() {
        let row: Value = serde_json::from_str(line).unwrap();
        match i {
            3 | 7 => assert!(row["error"].is_string()),
            _ => assert!(row["stable"] == true && number(&row, "/relative_error") <= 1e-10 && row["model"] == "hybrid"),
        }
    }
    // Where the form is chosen, a proof chooses it; a form that is asked for is proved on demand.
    let hybrid = ["calibrate", &table, "--horizon", "3", "--model", "hybrid"];
    for (more, says) in [
        (&[][..], ", stable (proved), remainder"),
        (&["--form", "remainder"], ", stable (sampled), remainder"),
        (&["--form", "remainder", "--prove"], ", stable (proved), remainder"),
    ] {
        let text = ended(&[&hybrid, more].concat(), 5);
        assert!(text.contains(says), "{text}");
    }
}

#[test]
fn advice_before_any_lattice() {
    for name in CRYSTALS {
        let r = json(&["advise", name, "--json"]);
        assert_eq!(r["recommended"], if name == "Pyroceram" { "central" } else { "hybrid" });
        assert!(r["reason"].as_str().unwrap().len() > 20 && r["defect_eigenvalues"].as_array().unwrap().len() == 3);
        for (m, model) in r["models"].as_array().unwrap().iter().zip(["central", "micropolar", "hybrid"]) {
            assert_eq!(m["model"], model);
            assert!(m["explanation"].is_string() && m["stability"].is_string() && m["flops_per_bond"].is_number());
        }
        // What was tried is not better than the bounds (those of the sum do not hold where nodes rotate, but central bonds
        // are among what is tried there), and hybrid closes the gap.
        let tried = r["reference"]["models"].as_array().unwrap();
        let least = |i: usize| number(&r, &format!("/models/{i}/least_error"));
        for (t, bound) in tried.iter().zip([least(0), least(1), 0.0, 0.0]) {
            assert!(number(t, "/promised_error") >= bound - 1e-9, "{name} {t}");
        }
        assert!(number(&tried[2], "/measured_error") <= number(&tried[0], "/measured_error") + 1e-9, "{name}");
        assert!(number(&tried[3], "/promised_error") < 1e-10 && tried[3]["stable"] == true, "{name}");
        assert!(number(&tried[2], "/measured_error") <= number(&tried[1], "/measured_error") + 1e-9, "{name}");
    }
    let low = "unit = \"GPa\"\n[engineering]\ne = 50\nnu = 0.1\n";
    let dir = folder();
    let r = json(&["advise", &write(&dir, "low.toml", low), "--json"]);
    assert_eq!(r["recommended"], "micropolar");
    // An isotropic material has tangential bonds alike in all directions: free rotations cost nothing.
    assert!(number(&r["reference"]["models"][1], "/measured_error") < 1e-10);
    let text = stdout(&["advise", "KIO3"]);
    for fragment in
        ["recommended      hybrid", "triangle test failed", "1.874", "free node rotations relax", "stability"]
    {
        assert!(text.contains(fragment), "{fragment}: {text}");
    }
    assert!(stdout(&["advise", &table_rows(&dir), "--row", "x-5"]).contains("recommended"));
}

#[test]
fn wrong_combinations_get_one_message() {
    let dir = folder();
    let unstable = "unit = \"GPa\"\nclass = \"cubic\"\nc11 = 10\nc12 = 20\nc44 = 5\n";
    let unstable = write(&dir, "unstable.toml", unstable);
    for (args, fragments) in [
        (&["calibrate", "Si", "--model", "hybrd"][..], &["hybrid"][..]),
        (&["calibrate", "Si", "--form", "stable"], &["--model hybrid"]),
        (&["calibrate", "Si", "--model", "micropolar", "--form", "stable"], &["--model hybrid"]),
        (&["calibrate", "Si", "--promise", "sum"], &["--model micropolar"]),
        (&["calibrate", "Si", "--model", "hybrid", "--promise", "sum"], &["--model micropolar"]),
        (&["calibrate", "Si", "--model", "micropolar", "--lower-bound", "1"], &["--lower-bound", "central"]),
        (&["calibrate", "Si", "--model", "hybrid", "--lower-bound", "max"], &["--lower-bound", "--form stable"]),
        (&["calibrate", "Si", "--model", "hybrid", "--form", "stable", "--horizon", "1"], &["horizon"]),
        (
            &["calibrate", "Si", "--model", "hybrid", "--shape", "cuboid", "--semi-axes", "2,2,0.5", "--horizon", "2"],
            &["plane"],
        ),
        (&["calibrate", &unstable], &["eigenvalue -1.000000e10", "eigentensor"]),
        (&["calibrate", &unstable, "--model", "micropolar"], &["eigenvalue -1.000000e10", "eigentensor"]),
        (&["calibrate", &unstable, "--model", "hybrid"], &["eigenvalue -1.000000e10", "eigentensor"]),
        (&["advise", &unstable], &["eigenvalue -1.000000e10", "eigentensor"]),
        (&["advise", "KIO4"], &["did you mean KIO3"]),
    ] {
        let message = refused(args, 2);
        assert!(fragments.iter().all(|f| message.contains(f)), "{args:?}: {message}");
    }
}
