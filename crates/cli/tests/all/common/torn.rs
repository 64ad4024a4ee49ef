//! A run that takes a second or two, and what must come of it whatever happens on the way.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use serde_json::Value;

/// A bar that is torn, small enough for seconds; `motion` follows.
pub const TORN: &str = "name = 'torn'\nmaterial = 'Pyroceram'\ndensity = '2600 kg/m3'\n[fracture]\nstretch = 2e-3\n\
    [body]\nbox = { size = '20, 6, 4 mm' }\n[grid]\nspacing = '1 mm'\nhorizon = 2\n\
    [[condition]]\nname = 'left'\non = 'x-min'\nthickness = 2\nvelocity = ['-2 m/s', 0, 0]\n\
    [[condition]]\non = 'x-max'\nthickness = 2\nvelocity = ['2 m/s', 0, 0]\n\
    [[probe]]\nname = 'pull'\nquantity = 'reaction'\ncondition = 'left'\n\
    [output]\nfields = ['displacement', 'damage']\nframes = 5\nprobe_every = 10\ncheckpoint = '20 ms'\n";

pub fn torn(duration: &str) -> String {
    format!("{TORN}[motion]\nduration = '{duration}'\n")
}

/// Spheres small in number, so that a packing is made at once.
pub const PACKING: &str = "[packing]\nradius = '1 mm'\nnumber = 60\nseed = 5\ncontact_radius = 1.6\n";

/// A bar of spheres that is torn; `motion` follows.
pub const TORN_PACKING: &str = "name = 'torn'\nmaterial = { class = 'isotropic', unit = 'GPa', engineering = { e = 20, nu = 0.2 } }\n\
    density = '2600 kg/m3'\n[body]\nbox = { size = '18, 8, 8 mm' }\n\
    [strength]\ntension = '20 MPa'\ncohesion = '20 MPa'\nfriction_angle = 20\n[contact]\nfriction = 0.5\n\
    [model]\nkinematics = 'finite'\n\
    [[condition]]\nname = 'left'\non = 'x-min'\nvelocity = ['-4 m/s', 0, 0]\n\
    [[condition]]\non = 'x-max'\nvelocity = ['4 m/s', 0, 0]\n\
    [[probe]]\nname = 'pull'\nquantity = 'reaction'\ncondition = 'left'\n\
    [output]\nfields = ['displacement', 'damage', 'stress']\nframes = 3\nprobe_every = 10\ncheckpoint = '20 ms'\n\
    slices = [{ axis = 'z', field = 'damage' }]\n";

pub fn torn_packing(duration: &str) -> String {
    format!("{TORN_PACKING}{PACKING}[motion]\nduration = '{duration}'\ndamping = '1000 1/s'\n")
}

/// What must not depend on interruptions: the summary but for its seconds and warnings, the probes and the last frame.
pub fn results(out: &Path) -> (Value, String, Vec<u8>) {
    let mut summary: Value = serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    summary["seconds"] = Value::Null;
    summary["warnings"] = Value::Null;
    let mut frames: Vec<PathBuf> = std::fs::read_dir(out)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "vti" || e == "vtp"))
        .collect();
    frames.sort();
    let probes = std::fs::read_to_string(out.join("probes.csv")).unwrap();
    (summary, probes, std::fs::read(frames.last().unwrap()).unwrap())
}

pub fn start(case: &str, out: &Path, resume: bool) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_anisobond"));
    command.args(["run", case, "-o", out.to_str().unwrap()]);
    if resume {
        command.arg("--resume");
    }
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

pub fn checkpoint_exists(out: &Path) -> bool {
    std::fs::read_dir(out)
        .is_ok_and(|files| files.flatten().any(|f| f.file_name().to_string_lossy().starts_with("checkpoint")))
}

#[cfg(unix)]
pub fn signal(child: &Child, name: &str) {
    assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
}
