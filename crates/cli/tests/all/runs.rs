//! `anisobond run` as a user runs it: files, interruptions, and what goes wrong.

use crate::common;

use std::time::Duration;

use common::torn::{checkpoint_exists, results, signal, start, torn, torn_packing};
use common::{folder, json, refused, stdout, write};

#[cfg(unix)]
#[test]
fn interrupted_runs_end_like_undisturbed_ones() {
    interrupted(&torn("200 us"));
}

/// While bonds of spheres break and spheres touch.
#[cfg(unix)]
#[test]
fn interrupted_runs_on_packings_end_like_undisturbed_ones() {
    interrupted(&torn_packing("300 us"));
}

/// Interrupted by Ctrl-C and by kill -9, and gone on with: the same results as undisturbed.
#[cfg(unix)]
fn interrupted(text: &str) {
    let dir = folder();
    let case = write(&dir, "torn.toml", text);
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
                // What the folder has so far has a page, written elsewhere.
                let page = dir.path().join("stopped.html");
                stdout(&["report", out.to_str().unwrap(), "-o", page.to_str().unwrap()]);
                let page = std::fs::read_to_string(page).unwrap();
                assert!(page.contains("This run stopped at step") && page.contains("--resume"));
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
    // A finished run cannot be gone on with, and is not said to be.
    for more in [&[][..], &["--resume"]] {
        let message = refused(&[&["run", &case, "-o", out], more].concat(), 2);
        assert!(message.contains("already has results") && message.contains("finished"), "{message}");
        assert!(message.contains("another folder") && !message.contains("--resume"), "{message}");
    }
    let empty = dir.path().join("empty");
    let message = refused(&["run", &case, "-o", empty.to_str().unwrap(), "--resume"], 2);
    assert!(message.contains("no checkpoint") && message.contains("leave --resume"), "{message}");
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

/// A run is known by what its case and its files hold: another place is the same, another content is not, and is named.
#[cfg(unix)]
#[test]
fn a_run_goes_on_with_the_same_contents_only() {
    let dir = folder();
    let material =
        |young: &str| format!("class = 'isotropic'\nunit = 'GPa'\nengineering = {{ e = {young}, nu = 0.2 }}\n");
    let stone = write(&dir, "stone.toml", &material("20"));
    let text =
        torn("400 us").replace("'Pyroceram'", "'stone.toml'").replace("checkpoint = '20 ms'", "checkpoint = '1 us'");
    let case = write(&dir, "torn.toml", &text);
    let out = dir.path().join("out");
    let mut child = start(&case, &out, false);
    while !checkpoint_exists(&out) {
        assert!(child.try_wait().unwrap().is_none(), "no checkpoint");
        std::thread::sleep(Duration::from_millis(2));
    }
    // While it runs nobody else writes the folder, and who does is named.
    let message = refused(&["run", &case, "-o", out.to_str().unwrap()], 2);
    assert!(message.contains(&format!("is being written by process {}", child.id())), "{message}");
    let message = refused(&["calibrate", "KIO3", "-o", out.to_str().unwrap()], 2);
    assert!(message.contains("is being written by"), "{message}");
    signal(&child, "-KILL");
    child.wait().unwrap();
    std::fs::write(out.join(".anisobond-killed"), "half").unwrap();
    let resumed =
        |more: &[&str]| refused(&[&["run", &case, "-o", out.to_str().unwrap(), "--resume"], more].concat(), 2);
    std::fs::write(&stone, material("21")).unwrap();
    let message = resumed(&[]);
    assert!(message.contains("since changed") && message.contains("stone.toml has changed"), "{message}");
    std::fs::write(&stone, material("20")).unwrap();
    let message = resumed(&["--set", "grid.horizon=3"]);
    assert!(message.contains("grid in ") && message.contains("torn.toml has changed"), "{message}");
    // A damaged table of probes is not gone on with.
    let probes = std::fs::read_to_string(out.join("probes.csv")).unwrap();
    std::fs::write(out.join("probes.csv"), probes.replacen("0.0", "0.1", 1)).unwrap();
    assert!(resumed(&[]).contains("is damaged, or was changed"));
    std::fs::write(out.join("probes.csv"), probes).unwrap();
    // The same in another place, with a remark; the leftover of the kill is gone afterwards.
    let moved = dir.path().join("moved");
    std::fs::create_dir(&moved).unwrap();
    std::fs::copy(&stone, moved.join("stone.toml")).unwrap();
    let case = moved.join("torn.toml");
    std::fs::write(&case, format!("# the same\n{text}")).unwrap();
    stdout(&["run", case.to_str().unwrap(), "-o", out.to_str().unwrap(), "--resume"]);
    let names: Vec<String> =
        std::fs::read_dir(&out).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap()).collect();
    assert!(!names.iter().any(|name| name.starts_with('.')), "{names:?}");
}

/// Killed before its first checkpoint, a run of the same case is begun anew; of another it is not.
#[test]
fn a_run_without_a_checkpoint_is_begun_anew() {
    let dir = folder();
    let case = write(&dir, "torn.toml", &torn("5 us"));
    let out = dir.path().join("out");
    let out_text = out.to_str().unwrap();
    let first = json(&["run", &case, "-o", out_text, "--json"]);
    std::fs::remove_file(out.join("summary.json")).unwrap();
    let message = refused(&["run", &case, "-o", out_text, "--resume", "--set", "grid.horizon=3"], 2);
    assert!(message.contains("ended before its first checkpoint"), "{message}");
    assert!(refused(&["run", &case, "-o", out_text], 2).contains("--force"));
    let mut again = json(&["run", &case, "-o", out_text, "--resume", "--json"]);
    again["seconds"] = first["seconds"].clone();
    assert_eq!(again, first);
    // Replaced whole: what the new run does not write is gone, other files are not.
    std::fs::write(out.join("mine.txt"), "kept").unwrap();
    json(&["run", &case, "-o", out_text, "--force", "--set", "output.frames=0", "--json"]);
    assert!(out.join("mine.txt").exists() && !out.join("frame-00000.vti").exists());
}

/// A folder holds one result: another is refused, or replaces it whole.
#[test]
fn folders_hold_one_result() {
    let dir = folder();
    let out = dir.path().join("out");
    let out_text = out.to_str().unwrap();
    let calibrate = ["calibrate", "KIO3", "--horizon", "3", "-o", out_text];
    stdout(&calibrate);
    stdout(&calibrate);
    let message = refused(&["calibrate", "KIO3", "--horizon", "4", "-o", out_text], 2);
    assert!(message.contains("a calibration, another one") && message.contains("--force"), "{message}");
    let case = write(&dir, "torn.toml", &torn("5 us"));
    for other in [&["run", &case, "-o", out_text][..], &["calibrate", &common::table_rows(&dir), "-o", out_text]] {
        let message = refused(other, 2);
        assert!(message.contains("holds results of a calibration (calibration.json)"), "{message}");
    }
    json(&["run", &case, "-o", out_text, "--force", "--json"]);
    assert!(!out.join("calibration.json").exists() && !out.join("bonds.csv").exists());
    assert!(refused(&calibrate, 2).contains("holds results of a run"));
}
