//! `anisobond run` as a user runs it: files, interruptions, and what goes wrong.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use common::{anisobond, folder, json, refused, write};
use serde_json::Value;

/// A bar that is torn, small enough for seconds; `motion` follows.
const TORN: &str = "name = 'torn'\nmaterial = 'Pyroceram'\ndensity = '2600 kg/m3'\n[fracture]\nstretch = 2e-3\n\
    [body]\nbox = { size = '20, 6, 4 mm' }\n[grid]\nspacing = '1 mm'\nhorizon = 2\n\
    [[condition]]\nname = 'left'\non = 'x-min'\nthickness = 2\nvelocity = ['-2 m/s', 0, 0]\n\
    [[condition]]\non = 'x-max'\nthickness = 2\nvelocity = ['2 m/s', 0, 0]\n\
    [[probe]]\nname = 'pull'\nquantity = 'reaction'\ncondition = 'left'\n\
    [output]\nfields = ['displacement', 'damage']\nframes = 5\nprobe_every = 10\ncheckpoint = '20 ms'\n";

fn torn(duration: &str) -> String {
    format!("{TORN}[motion]\nduration = '{duration}'\n")
}

/// What must not depend on interruptions: the summary but for its seconds, the probes and the last frame.
fn results(out: &Path) -> (Value, String, Vec<u8>) {
    let mut summary: Value = serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    summary["seconds"] = Value::Null;
    let mut frames: Vec<PathBuf> = std::fs::read_dir(out)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "vti"))
        .collect();
    frames.sort();
    let probes = std::fs::read_to_string(out.join("probes.csv")).unwrap();
    (summary, probes, std::fs::read(frames.last().unwrap()).unwrap())
}

fn start(case: &str, out: &Path, resume: bool) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_anisobond"));
    command.args(["run", case, "-o", out.to_str().unwrap()]);
    if resume {
        command.arg("--resume");
    }
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

fn checkpoint_exists(out: &Path) -> bool {
    std::fs::read_dir(out)
        .is_ok_and(|files| files.flatten().any(|f| f.file_name().to_string_lossy().starts_with("checkpoint")))
}

#[cfg(unix)]
fn signal(child: &Child, name: &str) {
    assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
}

/// Interrupted by Ctrl-C and by kill -9, and gone on with: the same results as undisturbed.
#[cfg(unix)]
#[test]
fn interrupted_runs_end_like_undisturbed_ones() {
    let dir = folder();
    let case = write(&dir, "torn.toml", &torn("200 us"));
    let undisturbed = dir.path().join("undisturbed");
    let r = json(&["run", &case, "-o", undisturbed.to_str().unwrap(), "--json"]);
    assert!(r["energy"]["broken_bonds"].as_u64().unwrap() > 0, "{r}");
    for how in ["-INT", "-KILL"] {
        let out = dir.path().join(how);
        let mut resume = false;
        let mut interruptions = 0;
        loop {
            let mut child = start(&case, &out, resume);
            let mut running = true;
            // Some time after the first checkpoint of this session.
            for _ in 0..if interruptions < 2 { 20 } else { 100_000 } {
                running = child.try_wait().unwrap().is_none();
                if !running {
                    break;
                }
                std::thread::sleep(Duration::from_millis(if checkpoint_exists(&out) { 10 } else { 2 }));
            }
            if running {
                signal(&child, how);
                interruptions += 1;
            }
            let output = child.wait_with_output().unwrap();
            let message = String::from_utf8(output.stderr).unwrap();
            if output.status.success() {
                break;
            }
            if how == "-INT" {
                assert_eq!(output.status.code(), Some(130), "{message}");
                assert!(message.contains("--resume"), "{message}");
            }
            resume = checkpoint_exists(&out);
            if !resume {
                std::fs::remove_dir_all(&out).ok();
            }
        }
        assert!(interruptions > 0, "{how}: the run was too short to be interrupted");
        assert!(results(&out) == results(&undisturbed), "{how}");
    }
}

#[test]
fn folders_with_results_are_not_overwritten() {
    let dir = folder();
    let case = write(&dir, "torn.toml", &torn("5 us"));
    let out = dir.path().join("out");
    let out = out.to_str().unwrap();
    json(&["run", &case, "-o", out, "--json"]);
    assert!(refused(&["run", &case, "-o", out], 2).contains("already has results"));
    assert!(refused(&["run", &case, "-o", out, "--resume"], 2).contains("no checkpoint"));
}

#[test]
fn bad_cases_are_refused_by_name() {
    let dir = folder();
    let out = dir.path().join("out");
    let motion = torn("5 us");
    let rigid = "name = 'rigid'\nmaterial = 'Pyroceram'\n[body]\nbox = { size = '8, 6, 4 mm' }\n[grid]\nspacing = '1 mm'\n\
        horizon = 2\n[[condition]]\non = 'x-max'\ntraction = '0, -1, 0 MPa'\n[equilibrium]\n";
    for (name, text, fragment) in [
        ("key", motion.replace("horizon", "horizn"), "did you mean horizon"),
        ("nodes", motion.replace("'20, 6, 4 mm'", "'0.1, 0.1, 0.1 mm'"), "nodes"),
        ("rigid", rigid.to_string(), "translation along y"),
        ("step", format!("{motion}step = '1 us'\n"), "above the stable one"),
        ("model", motion.replace("[output]", "[model]\nbonds = 'micropolar'\n[output]"), "micropolar"),
        ("density", motion.replace("density = '2600 kg/m3'\n", ""), "density"),
    ] {
        let case = write(&dir, &format!("{name}.toml"), &text);
        let message = refused(&["run", &case, "-o", out.join(name).to_str().unwrap()], 2);
        assert!(message.contains(fragment), "{name}: {message}");
    }
}

/// A step above the stable one that is forced ends with the place, and with the last good checkpoint.
#[test]
fn numbers_that_are_none_stop_a_run() {
    let dir = folder();
    let case = write(&dir, "blown.toml", &format!("{}step = '1 us'\nforce_step = true\n", torn("100 ms")));
    let out = dir.path().join("out");
    let case = case.as_str();
    let output = anisobond(&["run", case, "-o", out.to_str().unwrap(), "--set", "fracture.stretch=1e300"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && message.contains("no longer a number at ("), "{message}");
}

/// The plan of a run names its stable step, steps and time.
#[test]
fn check_names_the_step_and_the_time() {
    let dir = folder();
    let case = write(&dir, "torn.toml", &torn("5 us"));
    let plan = json(&["check", &case, "--json"]);
    let number = |key: &str| plan[key].as_f64().unwrap();
    assert!(number("stable_step_s") > 0.0 && number("step_s") < number("stable_step_s"));
    assert_eq!(number("steps"), (5e-6 / number("step_s")).round());
    assert!(number("expected_seconds") > 0.0 && number("nodes") == 480.0);
}
