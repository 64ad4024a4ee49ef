//! `anisobond run` as a user runs it: files, interruptions, and what goes wrong.

mod common;

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
