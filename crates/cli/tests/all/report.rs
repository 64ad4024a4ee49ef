//! Pages of results through the program: whole in one file, their data as the folder says, nothing fetched, nothing that
//! a name in a file could break out of. That they draw and turn is tried in a browser (`verification/pages.sh`).

use crate::common;

use common::{ended, folder, refused, stdout, write};
use serde_json::Value;

const ROCK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/materials/rock.toml");

/// A page and the data in it.
fn page(dir: &str) -> (String, Value) {
    stdout(&["report", dir]);
    let text = std::fs::read_to_string(std::path::Path::new(dir).join("report.html")).unwrap();
    let (_, rest) = text.split_once("<script type=\"application/json\" id=\"data\">").unwrap();
    let data = serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap();
    let addresses = text.split("http").skip(1).filter(|rest| rest.starts_with("://") || rest.starts_with("s://"));
    assert!(addresses.into_iter().all(|rest| rest.starts_with("://www.w3.org/2000/svg")), "a page that fetches");
    assert!(["/*STYLE*/", "/*DATA*/", "/*SCRIPT*/", "src=\"http", "<link"].iter().all(|mark| !text.contains(mark)));
    assert_eq!(text.matches("<script").count(), 2);
    (text, data)
}

/// Numbers of single precision in base64.
fn floats(value: &Value) -> usize {
    let text = value.as_str().unwrap();
    (text.len() / 4 * 3 - text.matches('=').count()) / 4
}

fn names(list: &Value, key: &str) -> Vec<String> {
    list.as_array().unwrap().iter().map(|item| item[key].as_str().unwrap().into()).collect()
}

#[test]
fn a_calibration_shows_its_tensors_and_its_neighbourhood() {
    let folder = folder();
    let dir = folder.path().join("c").display().to_string();
    stdout(&["calibrate", "KIO3", "--horizon", "3", "-o", &dir]);
    let (_, data) = page(&dir);
    let report: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("c/calibration.json")).unwrap()).unwrap();
    assert_eq!(names(&data["tensors"], "name"), ["target", "reached"]);
    assert_eq!((&data["tensors"][0]["voigt"], &data["tensors"][1]["voigt"]), (&report["target"], &report["reached"]));
    assert_eq!(data["title"], "KIO3");
    let scene = &data["scene"];
    assert_eq!((floats(&scene["spheres"]), floats(&scene["quantities"][0]["values"])), (4 * 122, 122));
    assert_eq!((floats(&scene["lines"]), floats(&scene["quantities"][0]["line_values"])), (6 * 122, 122));
    assert_eq!((data["table"]["all"].as_u64(), data["table"]["rows"][0].as_array().unwrap().len()), (Some(122), 10));
    let facts = data["facts"].to_string();
    assert!(["relative error", "smallest eigenvalue", "horizon"].iter().all(|label| facts.contains(label)), "{facts}");
}

#[test]
fn a_lattice_its_element_test_a_sweep_and_a_run_have_pages() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name).display().to_string();
    stdout(&["pack", "--number", "60", "--porosity", "0.4", "--seed", "3", "-o", &path("p.csv")]);
    stdout(&["lattice", &path("p.csv"), ROCK, "--contact-radius", "1.5", "-o", &path("l")]);
    let (_, data) = page(&path("l"));
    assert_eq!(names(&data["tensors"], "name"), ["prescribed", "lattice", "best fit"]);
    assert_eq!((floats(&data["scene"]["spheres"]), data["scene"]["title"].as_str()), (240, Some("Lattice")));
    stdout(&["element-test", &path("p.csv"), ROCK, "--contact-radius", "1.5", "-o", &path("e")]);
    let (_, data) = page(&path("e"));
    assert_eq!(names(&data["tensors"], "name"), ["prescribed", "lattice", "measured", "best fit"]);
    assert_eq!((floats(&data["scene"]["spheres"]), data["scene"]["title"].as_str()), (240, Some("Lattice")));
    let table = format!(
        "[parameters]\ncontact_radius = [1.4, 1.5, 1.6]\n[fixed]\npacking = {:?}\nmaterial = {ROCK:?}\n",
        path("p.csv")
    );
    let sweep = write(&folder, "sweep.toml", &table);
    stdout(&["sweep", &sweep, "-o", &path("s")]);
    let (_, data) = page(&path("s"));
    assert_eq!(data["charts"][0]["x"], "contact radius");
    assert_eq!(data["charts"][0]["series"][0]["points"].as_array().unwrap().len(), 3);
    let asked = data["facts"][0].to_string();
    assert!(asked.contains("1.4, 1.5, 1.6") && asked.contains("packing (fixed)"), "{asked}");
    let case = "material = \"Si\"\ndensity = \"2330 kg/m3\"\nbody = { box = { size = \"6, 6, 6 mm\" } }\n\
                [grid]\nspacing = \"1 mm\"\nhorizon = 2\n[[initial_velocity]]\non = \"x-max\"\nvelocity = \"1, 0, 0 m/s\"\n\
                [motion]\nduration = \"1 us\"\n[[probe]]\nname = \"end\"\nquantity = \"displacement\"\non = \"x-max\"\n\
                [output]\nframes = 3\nslices = [{ axis = \"z\", field = \"velocity\" }]\n";
    let case = write(&folder, "case.toml", case);
    stdout(&["run", &case, "-o", &path("r")]);
    let (_, data) = page(&path("r"));
    assert_eq!(names(&data["pictures"], "name"), ["slice-1.apng"]);
    assert_eq!(names(&data["pictures"], "caption"), ["velocity in a slice across z"]);
    let asked = data["facts"][0].to_string();
    assert!(
        ["grid, spacing", "1 mm", "2330 kg/m3", "on x-max; velocity 1, 0, 0 m/s"].iter().all(|w| asked.contains(w)),
        "{asked}"
    );
    assert!(data["pictures"][0]["data"].as_str().unwrap().starts_with("data:image/png;base64,iVBORw0KGgo"));
    let charts = names(&data["charts"], "title");
    assert!(charts.iter().any(|c| c.contains("energies")) && charts.iter().any(|c| c == "end u (m)"), "{charts:?}");
    let own = data["charts"].as_array().unwrap().iter().find(|c| c["title"] == "end u (m)").unwrap();
    assert_eq!(names(&own["series"], "name"), ["ux", "uy", "uz"]);
}

#[test]
fn names_cannot_break_out_and_folders_without_results_are_refused() {
    let folder = folder();
    let bad = "</script><script>alert(1)</script>";
    let material = format!("name = {bad:?}\nclass = \"cubic\"\nunit = \"GPa\"\nc11 = 200\nc12 = 80\nc44 = 70\n");
    let material = write(&folder, "m.toml", &material);
    let dir = folder.path().join("c").display().to_string();
    stdout(&["calibrate", &material, "--horizon", "2", "-o", &dir]);
    let (text, data) = page(&dir);
    assert!(!text.contains("alert(1)</script>") && data["title"] == bad);
    let message = refused(&["report", &folder.path().display().to_string()], 2);
    assert!(message.contains("holds no results") && message.contains("run wrote"), "{message}");
    let chosen = folder.path().join("page.html").display().to_string();
    stdout(&["report", &dir, "-o", &chosen]);
    assert!(std::path::Path::new(&chosen).is_file());
}

#[test]
fn a_page_is_written_beside_the_results_of_every_command() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let has_page = |name: &str| {
        let text = std::fs::read_to_string(folder.path().join(name).join("report.html")).unwrap();
        assert!(text.contains("id=\"data\""), "{name}");
    };
    stdout(&["calibrate", "Si", "--horizon", "2", "-o", &path("c"), "--report"]);
    stdout(&["pack", "--number", "40", "--porosity", "0.4", "--seed", "3", "-o", &path("p.csv")]);
    stdout(&["lattice", &path("p.csv"), ROCK, "--contact-radius", "1.5", "-o", &path("l"), "--report"]);
    stdout(&["element-test", &path("p.csv"), ROCK, "--contact-radius", "1.5", "-o", &path("e"), "--report"]);
    stdout(&["element-test", "Si", "--grid", "5", "--horizon", "2", "-o", &path("g"), "--report"]);
    let rows = common::table_rows(&folder);
    ended(&["calibrate", &rows, "--horizon", "2", "-o", &path("t"), "--report"], 5);
    let table = format!(
        "[parameters]\ncontact_radius = [1.4, 1.5]\n[fixed]\npacking = {:?}\nmaterial = {ROCK:?}\n",
        path("p.csv")
    );
    stdout(&["sweep", &write(&folder, "sweep.toml", &table), "-o", &path("s"), "--report"]);
    let case = "material = \"Si\"\nbody = { box = { size = \"4, 4, 4 mm\" } }\n[grid]\nspacing = \"1 mm\"\nhorizon = 2\n\
                [[condition]]\non = \"x-min\"\ndisplacement = [0, 0, 0]\n[[condition]]\non = \"x-max\"\n\
                traction = \"1, 0, 0 MPa\"\n[equilibrium]\n";
    stdout(&["run", &write(&folder, "case.toml", case), "-o", &path("r"), "--report"]);
    ["c", "l", "e", "g", "t", "s", "r"].into_iter().for_each(has_page);
    assert!(refused(&["calibrate", "Si", "--report"], 2).contains("--output"));
}

/// Waves are in m/s, whoever writes the page; numbers have units; what free rotations leave and nodal terms are shown.
#[test]
fn densities_units_and_every_tensor_are_shown() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let heavy =
        "name = \"m\"\nclass = \"cubic\"\nunit = \"GPa\"\nc11 = 200\nc12 = 80\nc44 = 70\ndensity = \"2500 kg/m3\"\n";
    let material = write(&folder, "m.toml", heavy);
    stdout(&[
        "calibrate",
        &material,
        "--horizon",
        "3",
        "--spacing",
        "2 mm",
        "--model",
        "micropolar",
        "-o",
        &path("m"),
        "--report",
    ]);
    let text = std::fs::read_to_string(folder.path().join("m/report.html")).unwrap();
    assert!(text.contains("--model micropolar") && text.contains("anisobond calibrate"));
    let (_, data) = page(&path("m"));
    assert_eq!(data["density"], 2500.0);
    assert_eq!(names(&data["tensors"], "name"), ["target", "reached by the sum over bonds", "with free rotations"]);
    let facts = data["facts"].to_string();
    assert!(["2500 kg/m³", "\"2 mm\"", "N/m⁶", " %", " GPa"].iter().all(|unit| facts.contains(unit)), "{facts}");
    let columns = data["table"]["columns"].to_string();
    assert!(columns.contains("c_t (N/m⁶)") && !columns.contains('_') || columns.contains("ξ_x (m)"), "{columns}");
    stdout(&["calibrate", "Te2W", "--horizon", "3", "--model", "hybrid", "-o", &path("h")]);
    let (_, data) = page(&path("h"));
    assert_eq!(names(&data["tensors"], "name"), ["target", "reached", "of it by bonds", "nodal term Z"]);
    assert_eq!(data["density"], Value::Null);
}

/// What a reader must know stands first, and a run that was stopped has a page that says so.
#[test]
fn warnings_and_unfinished_runs() {
    let folder = folder();
    let dir = folder.path().join("k").display().to_string();
    stdout(&["calibrate", "KIO3", "--horizon", "1.5", "-o", &dir]);
    let (_, data) = page(&dir);
    let warnings = data["warnings"].to_string();
    assert!(warnings.contains("out of reach") && warnings.contains("larger horizon"), "{warnings}");
    let run = folder.path().join("r");
    std::fs::create_dir(&run).unwrap();
    std::fs::write(run.join("probes.csv"), "time_s,kinetic_J\n0.0,1.0\n1.0,2.0\n").unwrap();
    let (_, data) = page(&run.display().to_string());
    assert!(data["kind"].as_str().unwrap().contains("not finished"));
    assert!(data["warnings"][0].as_str().unwrap().contains("no checkpoint"));
}
