//! What goes wrong with `anisobond run`, as a user meets it: bad cases, full disks, damaged files, kills, numbers that are
//! none.

use crate::common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use common::torn::{checkpoint_exists, results, signal, start, torn, torn_packing};
use common::{anisobond, folder, json, refused, write};

/// The run whose results every disturbed one must have.
fn undisturbed(dir: &tempfile::TempDir, case: &str) -> PathBuf {
    let out = dir.path().join("undisturbed");
    json(&["run", case, "-o", out.to_str().unwrap(), "--json"]);
    out
}

fn resume(case: &str, out: &Path) -> Output {
    anisobond(&["run", case, "-o", out.to_str().unwrap(), "--resume"])
}

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Checkpoints after every step.
fn often(text: &str) -> String {
    text.replace("checkpoint = '20 ms'", "checkpoint = '1 us'")
}

/// A run stopped once it has two checkpoints.
fn stopped(case: &str, out: &Path) {
    let mut child = start(case, out, false);
    let began = Instant::now();
    while !out.join("checkpoint-before.safetensors").exists() {
        assert!(child.try_wait().unwrap().is_none() && began.elapsed() < Duration::from_secs(60), "no checkpoints");
        std::thread::sleep(Duration::from_millis(2));
    }
    signal(&child, "-INT");
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

/// Turn a bit in the middle of a file.
fn damage(path: &Path) {
    let mut bytes = std::fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn bad_cases_are_refused_by_name() {
    let dir = folder();
    let out = dir.path().join("out");
    let motion = torn("5 us");
    let rigid = "name = 'rigid'\nmaterial = 'Pyroceram'\n[body]\nbox = { size = '8, 6, 4 mm' }\n[grid]\nspacing = '1 mm'\n\
        horizon = 2\n[[condition]]\non = 'x-max'\ntraction = '0, -1, 0 MPa'\n[equilibrium]\n";
    let regions = |second: &str| {
        let two = format!(
            "[solids.left]\nbox = {{ min = '-10, -3, -2 mm', max = '2, 3, 2 mm' }}\n[solids.right]\nbox = {{ {second} }}\n\
             [[region]]\nname = 'a'\nsolid = 'left'\nmaterial = 'Pyroceram'\n\
             [[region]]\nname = 'b'\nsolid = 'right'\nmaterial = 'Pyroceram'\n[[condition]]\nname"
        );
        motion.replacen("[[condition]]\nname", &two, 1)
    };
    for (name, text, fragments) in [
        ("key", motion.replace("horizon", "horizn"), &["did you mean horizon"][..]),
        ("section", motion.replace("[grid]", "[gird]"), &["gird", "did you mean grid"]),
        ("unit", motion.replace("'1 mm'", "'1 mmm'"), &["grid.spacing", "mmm"]),
        ("nodes", motion.replace("'20, 6, 4 mm'", "'0.1, 0.1, 0.1 mm'"), &["nodes"]),
        (
            "outside",
            motion
                .replace("on = 'x-max'\nthickness = 2", "on = { box = { min = '40, 0, 0 mm', max = '50, 1, 1 mm' } }"),
            &["condition"],
        ),
        ("overlap", regions("min = '0, -3, -2 mm', max = '10, 3, 2 mm'"), &["\"b\" overlaps region \"a\" in 48 nodes"]),
        ("empty", regions("min = '20, 20, 20 mm', max = '21, 21, 21 mm'"), &["region \"b\" has no nodes"]),
        ("rigid", rigid.to_string(), &["translation along y", "rotation about z"]),
        ("step", format!("{motion}step = '1 us'\n"), &["above the stable one"]),
        ("model", motion.replace("[output]", "[model]\nbonds = 'micropolar'\n[output]"), &["micropolar"]),
        ("density", motion.replace("density = '2600 kg/m3'\n", ""), &["density"]),
    ] {
        let case = write(&dir, &format!("{name}.toml"), &text);
        let folder = out.join(name);
        let message = refused(&["run", &case, "-o", folder.to_str().unwrap()], 2);
        assert!(fragments.iter().all(|f| message.contains(f)), "{name}: {message}");
        assert!(!folder.exists(), "{name} leaves a folder");
    }
}

/// A step above the stable one that is forced ends with the place, and with the last good checkpoint.
#[test]
fn a_motion_that_explodes_stops_a_run() {
    let dir = folder();
    let text = format!("{}step = '1 us'\nforce_step = true\n", often(&torn("100 ms")));
    let case = write(&dir, "blown.toml", &text.replace("stretch = 2e-3", "stretch = 1e300"));
    let out = dir.path().join("out");
    let first = message(&anisobond(&["run", &case, "-o", out.to_str().unwrap()]));
    assert!(first.contains("the motion explodes at (") && first.contains("torn, step "), "{first}");
    assert!(first.contains("the last good checkpoint is kept in"), "{first}");
    // What is kept is good: gone on with, the run comes to the same place.
    let again = resume(&case, &out);
    assert!(!again.status.success() && message(&again).contains("the motion explodes at ("), "{}", message(&again));
    assert!(!message(&again).contains("damaged"), "{}", message(&again));
}

/// Spheres that a step above the stable one throws out, likewise.
#[test]
fn spheres_that_are_thrown_out_stop_a_run() {
    let dir = folder();
    let text = often(&torn_packing("200 us"));
    let strength = &text[text.find("[strength]").unwrap()..text.find("[contact]").unwrap()];
    let case = write(&dir, "blown.toml", &format!("{}step = '2 us'\nforce_step = true\n", text.replace(strength, "")));
    let out = dir.path().join("out");
    let first = message(&anisobond(&["run", &case, "-o", out.to_str().unwrap()]));
    assert!(first.contains("has been thrown out at") && first.contains("torn, step "), "{first}");
    assert!(first.contains("the last good checkpoint is kept in"), "{first}");
    let again = resume(&case, &out);
    assert!(!again.status.success() && message(&again).contains("has been thrown out at"), "{}", message(&again));
}

#[cfg(unix)]
#[test]
fn kills_while_checkpoints_are_written_lose_nothing() {
    killed(&torn("30 us"));
    killed(&torn_packing("60 us"));
}

/// Killed again and again while a checkpoint is written after every step.
#[cfg(unix)]
fn killed(text: &str) {
    let dir = folder();
    let case = write(&dir, "torn.toml", &often(text));
    let undisturbed = undisturbed(&dir, &case);
    let out = dir.path().join("out");
    let mut kills = 0;
    for round in 0u64.. {
        let mut child = start(&case, &out, checkpoint_exists(&out));
        let began = Instant::now();
        // At another moment every time, and never again after some.
        let wait = Duration::from_millis(if round < 12 { 15 + 37 * round % 60 } else { 60_000 });
        while child.try_wait().unwrap().is_none() && began.elapsed() < wait {
            std::thread::sleep(Duration::from_millis(1));
        }
        if child.try_wait().unwrap().is_none() {
            signal(&child, "-KILL");
            kills += 1;
        }
        let output = child.wait_with_output().unwrap();
        if output.status.success() {
            break;
        }
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code().is_none(), "{message}");
        if !checkpoint_exists(&out) {
            std::fs::remove_dir_all(&out).ok();
        }
    }
    assert!(kills > 2, "the run was too short to be killed");
    assert!(results(&out) == results(&undisturbed));
}

#[cfg(unix)]
#[test]
fn damaged_checkpoints_are_seen() {
    damaged(&torn("60 us"));
    damaged(&torn_packing("120 us"));
}

/// The newest checkpoint damaged: the one before is used, and that is said. Both damaged: one message, naming both.
#[cfg(unix)]
fn damaged(text: &str) {
    let dir = folder();
    let case = write(&dir, "torn.toml", &often(text));
    let undisturbed = undisturbed(&dir, &case);
    let out = dir.path().join("out");
    stopped(&case, &out);
    damage(&out.join("checkpoint.safetensors"));
    let both = dir.path().join("both");
    std::fs::create_dir(&both).unwrap();
    for file in std::fs::read_dir(&out).unwrap().map(|f| f.unwrap()) {
        std::fs::copy(file.path(), both.join(file.file_name())).unwrap();
    }
    damage(&both.join("checkpoint-before.safetensors"));
    let text = refused(&["run", &case, "-o", both.to_str().unwrap(), "--resume"], 2);
    for fragment in ["both checkpoints are damaged", "checkpoint.safetensors", "checkpoint-before.safetensors", "anew"]
    {
        assert!(text.contains(fragment), "{text}");
    }
    let output = resume(&case, &out);
    assert!(output.status.success(), "{}", message(&output));
    assert!(
        message(&output).contains("the newest checkpoint was damaged, the one before is used"),
        "{}",
        message(&output)
    );
    assert!(results(&out) == results(&undisturbed));
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_named_and_survived() {
    full(&torn("60 us"));
    full(&torn_packing("120 us"));
}

/// A file that can grow no more, as on a full disk: it is named, nothing is half written, and once there is room the run
/// goes on to the same results.
#[cfg(unix)]
fn full(text: &str) {
    let dir = folder();
    let text = text.replace("probe_every = 10", "probe_every = 1").replace("'20 ms'", "'2 ms'");
    let case = write(&dir, "torn.toml", &text);
    let undisturbed = undisturbed(&dir, &case);
    let size = |name: &str| std::fs::metadata(undisturbed.join(name)).map_or(0, |m| m.len());
    let out = dir.path().join("out");
    // Half of the table of probes, in the shell's units of 512 bytes; checkpoints are smaller.
    let limit = size("probes.csv") / 2 / 512;
    let script = format!(
        "trap '' XFSZ; ulimit -f {limit} && exec {} run {case} -o {}",
        env!("CARGO_BIN_EXE_anisobond"),
        out.to_str().unwrap()
    );
    let output = Command::new("sh").args(["-c", &script]).output().unwrap();
    let text = message(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("probes.csv") && text.contains("large"), "{text}");
    let names: Vec<String> =
        std::fs::read_dir(&out).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap()).collect();
    assert!(!names.iter().any(|n| n.starts_with(".anisobond-") || n == "summary.json"), "{names:?}");
    assert!(checkpoint_exists(&out), "{names:?}: the limit of {limit} blocks was too low");
    let output = resume(&case, &out);
    assert!(output.status.success() && !message(&output).contains("damaged"), "{}", message(&output));
    assert!(results(&out) == results(&undisturbed));
}

/// Numbers beyond what can be computed, or held, are refused at once by the key that has them.
#[test]
fn numbers_beyond_all_bounds_are_refused_at_once() {
    let dir = folder();
    let case = write(&dir, "torn.toml", &torn("5 us"));
    for (set, part) in [
        ("grid.spacing=1e300 m", "too large for a length"),
        ("grid.spacing=1e-300 m", "too small for a length"),
        ("grid.spacing=1e-300 nm", "too small for a length"),
        ("grid.spacing=1e-9 m", "nodes"),
        ("grid.spacing=0.05 um", "nodes"),
        ("body.box.size=1e18, 1e18, 1e18 m", "nodes"),
        ("body.box.size=1e30, 1, 1 m", "too large for a length"),
        ("motion.duration=1e29 s", "time steps"),
        ("motion.duration=1e300 s", "too large for a time"),
        ("motion.step=1e-29 s", "time steps"),
        ("density=1e31 kg/m3", "too large for a density"),
        ("output.frames=1e15", "frames are too many"),
        ("output.frames=1e300", "not a whole number"),
        ("grid.horizon=1e18", "use at most 20"),
        ("fracture={energy='1e300 J/m2'}", "too large for an energy per area"),
        ("condition.0.velocity=['1e31 m/s',0,0]", "too large for a velocity"),
    ] {
        let began = Instant::now();
        for command in ["check", "run"] {
            let message = refused(&[command, &case, "--set", set], 2);
            assert!(message.contains(part), "{set}: {message}");
        }
        assert!(began.elapsed() < Duration::from_secs(60), "{set}");
    }
    for args in [
        &["calibrate", "Si", "--spacing", "1e300 m"][..],
        &["calibrate", "Si", "--horizon", "1e300"],
        &["calibrate", "Si", "--spacing", "1e-300"],
        &["element-test", "Si", "--grid", "1000000000,1000000000,1000000000"],
        &["pack", "--number", "18446744073709551615"],
        &["pack", "--crystal", "fcc", "--cells", "4294967296,4294967296,4294967296"],
        &["pack", "--cell", "1e300,1e300,1e300", "--radius", "1 mm"],
    ] {
        refused(args, 2);
    }
}

/// A second signal ends a program that does not come to hear the first.
#[cfg(unix)]
#[test]
fn a_second_signal_ends_a_run_at_once() {
    let dir = folder();
    // A body so large that its preparation takes long; it is begun when the folder is locked.
    let text = torn("5 us").replace("'20, 6, 4 mm'", "'300, 200, 200 mm'");
    let case = write(&dir, "large.toml", &text);
    let out = dir.path().join("out");
    let mut child = start(&case, &out, false);
    while !out.join(".anisobond.lock").exists() {
        assert!(child.try_wait().unwrap().is_none(), "it has ended before it began");
        std::thread::sleep(Duration::from_millis(1));
    }
    for name in ["-TERM", "-INT"] {
        assert!(child.try_wait().unwrap().is_none(), "it has ended before it was told to");
        signal(&child, name);
        std::thread::sleep(Duration::from_millis(50));
    }
    let began = Instant::now();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(began.elapsed() < Duration::from_secs(20));
}
