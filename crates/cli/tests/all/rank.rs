//! Tables asked as a whole: `rank`, `tensor` and `advise`; rows that fail have an exit code of their own.

use crate::common;

use common::{anisobond, ended, folder, json, refused, stdout, table_rows, write};
use serde_json::Value;

/// Three materials that central, micropolar and hybrid bonds carry.
const THREE: &str = "id,class,c11 (GPa),c12,c44
quarter,isotropic,90,30,30
tenth,isotropic,90,10,40
third,isotropic,90,45,22.5
";

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn materials_are_ranked_by_the_model_that_carries_them() {
    let dir = folder();
    let table = write(&dir, "three.csv", THREE);
    let r = json(&["rank", &table, "--horizon", "3", "--json"]);
    let ids: Vec<&str> = r["rows"].as_array().unwrap().iter().map(|row| row["id"].as_str().unwrap()).collect();
    let by: Vec<&str> = r["rows"].as_array().unwrap().iter().map(|row| row["carried_by"].as_str().unwrap()).collect();
    assert_eq!(ids[0], "quarter");
    assert_eq!(
        (by[0], r["carried_by"]["central"].as_u64(), r["carried_by"]["hybrid"].as_u64()),
        ("central", Some(1), Some(1))
    );
    let row = |id: &str| r["rows"].as_array().unwrap().iter().find(|row| row["id"] == id).unwrap();
    assert_eq!(
        (row("tenth")["carried_by"].as_str(), row("third")["carried_by"].as_str()),
        (Some("micropolar"), Some("hybrid"))
    );
    // The numbers are those of calibrate.
    let one = json(&["calibrate", &table, "--row", "tenth", "--horizon", "3", "--json"]);
    assert_eq!(row("tenth")["central"]["relative_error"], one["relative_error"]);
    assert_eq!(row("tenth")["central"]["energy_error"], one["energy_error"]);
    assert!(row("tenth")["central"]["reaches_model_limit"] == true && one["feasible"].is_null());
    let micropolar =
        json(&["calibrate", &table, "--row", "third", "--horizon", "3", "--model", "micropolar", "--json"]);
    assert_eq!(row("third")["micropolar"]["relative_error"], micropolar["relative_error"]);
    assert_eq!(row("third")["micropolar"]["free_rotations_error"], micropolar["relaxed_error"]);
}

#[test]
fn rankings_are_sorted_filtered_and_written() {
    let dir = folder();
    let table = write(&dir, "three.csv", THREE);
    let ids = |args: &[&str]| -> Vec<String> {
        let all: Vec<&str> = ["rank", &table, "--horizon", "2", "--json"].iter().chain(args).copied().collect();
        json(&all)["rows"].as_array().unwrap().iter().map(|row| row["id"].as_str().unwrap().to_string()).collect()
    };
    assert_eq!(ids(&["--sort", "id"]), ["quarter", "tenth", "third"]);
    assert_eq!(ids(&["--sort", "-id"]), ["third", "tenth", "quarter"]);
    assert_eq!(ids(&["--where", "cauchy_gap<1e-6"]), ["quarter"]);
    assert_eq!(ids(&["--filter", "id~th", "--where", "poisson > 0.2", "--sort", "id"]), ["third"]);
    assert_eq!(ids(&["--where", "cauchy_gap>=0%", "--where", "id!=tenth", "--sort", "id"]), ["quarter", "third"]);
    assert!(refused(&["rank", &table, "--sort", "cauchy_gapp"], 2).contains("did you mean cauchy_gap?"));
    assert!(refused(&["rank", &table, "--where", "cauchy_gap"], 2).contains("compares nothing"));
    assert!(refused(&["rank", &table, "--where", "cauchy_gap<much"], 2).contains("is no number"));
    assert!(refused(&["rank", &table, "--model", "hybrid"], 2).contains("reaches every tensor"));

    let out = dir.path().join("out");
    stdout(&["rank", &table, "--horizon", "2", "-o", out.to_str().unwrap()]);
    let page = std::fs::read_to_string(out.join("rank.html")).unwrap();
    let data = page.split_once("id=\"data\">").unwrap().1.split_once("</script>").unwrap().0;
    let data = parsed(&data.replace("\\u003c", "<"));
    assert_eq!((data["title"].as_str(), data["rows"].as_array().unwrap().len()), (Some("three"), 3));
    assert!(page.contains("histogram(") && !page.contains("http://") || page.matches("http").count() <= 2);
    let csv = std::fs::read_to_string(out.join("rank.csv")).unwrap();
    assert!(csv.lines().count() == 4 && csv.lines().next().unwrap().contains("central.largest_energy_error"));
    assert_eq!(parsed(&std::fs::read_to_string(out.join("rank.json")).unwrap())["shown"], 3);
    assert!(refused(&["calibrate", "Si", "-o", out.to_str().unwrap()], 2).contains("a ranking"));
}

/// By energy, no central bonds are further off in energy; by the norm, none in the norm.
#[test]
fn the_metric_is_that_of_the_ranking() {
    let dir = folder();
    let table = table_rows(&dir);
    let rows = |metric: &str| {
        let r = ended(
            &["rank", &table, "--horizon", "3", "--model", "central", "--metric", metric, "--sort", "id", "--json"],
            5,
        );
        parsed(&r)["rows"].as_array().unwrap().clone()
    };
    let mut closer = 0;
    for (norm, energy) in rows("norm").iter().zip(&rows("energy")) {
        let number = |row: &Value, key: &str| row["central"][key].as_f64().unwrap();
        assert_eq!(norm["id"], energy["id"]);
        // One of the rows satisfies Cauchy's relations: there both are rounding.
        assert!(number(norm, "relative_error") <= number(energy, "relative_error") + 1e-12);
        assert!(number(energy, "energy_distance") <= number(norm, "energy_distance") + 1e-12);
        closer += usize::from(number(energy, "energy_distance") < 0.999 * number(norm, "energy_distance"));
    }
    assert!(closer >= 6, "{closer}");
}

/// Rows that fail: the others are done, and the exit code is 5; none that is done: 2.
#[test]
fn failed_rows_have_an_exit_code_of_their_own() {
    let dir = folder();
    let table = table_rows(&dir);
    for command in ["rank", "calibrate", "tensor", "advise"] {
        let horizon: &[&str] = if ["rank", "calibrate"].contains(&command) { &["--horizon", "2"] } else { &[] };
        let args: Vec<&str> = [command, &table, "--json"].iter().chain(horizon).copied().collect();
        let r = parsed(&ended(&args, 5));
        let failed = if command == "rank" { r["failed"].as_array().unwrap().len() } else { 2 };
        let rows = r["rows"].as_array().unwrap();
        let errors = rows.iter().filter(|row| !row["error"].is_null()).count();
        assert_eq!((failed, if command == "rank" { 2 } else { errors }), (2, 2), "{command}");
        let stderr = String::from_utf8(anisobond(&args).stderr).unwrap();
        assert!(stderr.contains("failed"), "{command}: {stderr}");
    }
    let broken = write(&dir, "broken.csv", "id,class,c11,c12,c44\na,cubic,x,1,1\nb,cubic,1,2,3\n");
    for command in ["rank", "calibrate", "tensor", "advise"] {
        assert_eq!(anisobond(&[command, &broken]).status.code(), Some(2), "{command}");
    }
}

#[test]
fn tensor_and_advise_say_of_every_row_what_they_say_of_one() {
    let dir = folder();
    let table = write(&dir, "three.csv", THREE);
    for command in ["tensor", "advise"] {
        let all = json(&[command, &table, "--json"]);
        let one = json(&[command, &table, "--row", "third", "--json"]);
        let row = &all["rows"][2];
        assert_eq!((row["id"].as_str(), row["line"].as_u64()), (Some("third"), Some(4)), "{command}");
        for key in ["stiffness", "symmetry", "cauchy", "read_as", "recommended", "models", "poisson"] {
            if !row[key].is_null() {
                assert_eq!(row[key], one[key], "{command} {key}");
            }
        }
        let words = stdout(&[command, &table]);
        assert!(words.lines().count() == 3 && words.lines().nth(2).unwrap().starts_with("third"), "{words}");
    }
    assert!(refused(&["tensor", &table, "--direction", "1,0,0"], 2).contains("--row"));
}

/// What no matter has is said on the screen, in JSON and in tables, and does not stop anything.
#[test]
fn doubts_are_said_everywhere() {
    let dir = folder();
    let light = write(
        &dir,
        "light.toml",
        "class = \"cubic\"\nunit = \"GPa\"\nc11 = 166\nc12 = 64\nc44 = 80\ndensity = \"2.33 kg/m3\"\n",
    );
    let table = write(
        &dir,
        "light.csv",
        "id,class,c11 (GPa),c12,c44,density (kg/m3)\nSi,cubic,166,64,80,2.33\nGe,cubic,129,48,67,5323\n",
    );
    for args in [&["tensor", &light][..], &["calibrate", &light, "--horizon", "2"], &["advise", &light]] {
        let args: Vec<&str> = args.iter().chain(&["--json"]).copied().collect();
        let output = anisobond(&args);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(stderr.contains("warning: a density of 2.33 kg/m³") && stderr.contains("is it in g/cm³?"), "{stderr}");
        let r = parsed(&String::from_utf8(output.stdout).unwrap());
        assert!(r["warnings"][0].as_str().unwrap().contains("2330 kg/m³"), "{}", r["warnings"]);
    }
    let output = anisobond(&["calibrate", &table, "--horizon", "2", "--json"]);
    assert!(String::from_utf8(output.stderr).unwrap().contains("warning: Si: a density of 2.33"));
    let r = parsed(&String::from_utf8(output.stdout).unwrap());
    assert!(r["rows"][0]["warnings"][0].is_string() && r["rows"][1]["warnings"].as_array().unwrap().is_empty());
    assert!(json(&["tensor", "Si", "--json"])["warnings"].as_array().unwrap().is_empty());
}

/// The class of a noisy crystal, with what it is within; a tolerance that is given is kept to.
#[test]
fn tensor_names_the_class_that_the_noise_allows() {
    let dir = folder();
    // Silicon (cubic) turned, each entry off by about a percent.
    let noisy = write(
        &dir,
        "noisy.toml",
        "unit = \"GPa\"\nstiffness = [[167.6, 64.6, 63.2, 0.9, -0.6, 0.4], [165.1, 63.3, -0.7, 0.5, 0.8], \
         [164.2, 0.3, 0.6, -0.5], [80.4, 0.5, 0.2], [79.1, -0.4], [78.8]]\n",
    );
    let r = json(&["tensor", &noisy, "--json"]);
    assert_eq!(
        (r["symmetry"]["class"].as_str(), r["symmetry_in_energy"]["class"].as_str()),
        (Some("cubic"), Some("cubic"))
    );
    let noise = r["symmetry"]["noise"].as_f64().unwrap();
    assert!(noise > 0.003 && noise < 0.03, "{noise}");
    let fit = &r["symmetry_in_energy"]["fits"][1];
    assert!(fit["closest"][0][0].is_number() && fit["distance"].as_f64().unwrap() < 0.03);
    let strict = json(&["tensor", &noisy, "--tolerance", "0.0001", "--json"]);
    assert_eq!(
        (strict["symmetry"]["class"].as_str(), strict["symmetry"]["noise"].is_null()),
        (Some("triclinic"), true)
    );
    assert!(stdout(&["tensor", &noisy]).contains("symmetry: cubic (within"));
}

/// Closest in the sense of energy, with the numbers of docs/theory.md.
#[test]
fn calibrations_by_energy() {
    let r = json(&["calibrate", "Te2W", "--metric", "energy", "--json"]);
    assert_eq!((r["metric"].as_str(), r["reaches_model_limit"].as_bool()), (Some("energy"), Some(true)));
    let error = |k: usize| 100.0 * r["energy_error"][k].as_f64().unwrap();
    assert!((error(0) + 7.89).abs() < 0.006 && (error(1) - 8.51).abs() < 0.006, "{}", r["energy_error"]);
    assert!(stdout(&["calibrate", "Te2W", "--metric", "energy"]).contains("closest in the sense of energy"));
    assert!(
        refused(&["calibrate", "Te2W", "--model", "hybrid", "--metric", "energy"], 2).contains("belongs to central")
    );
}
