//! Cracks as a user sees them: softening bonds, the files of a crack, its length and speed.

use crate::common;

use common::{folder, json, write};

/// A cracked plate pulled apart in motion or equilibrium.
fn plate(schedule: &str) -> String {
    format!(
        r#"
material = {{ class = "isotropic", unit = "GPa", engineering = {{ e = 72, nu = 0.25 }} }}
density = "2440 kg/m3"
fracture = {{ energy = "1 J/m2" }}
body = {{ box = {{ min = "0, -5 mm", max = "12, 5 mm" }} }}
grid = {{ spacing = "0.5 mm", horizon = 2, plane_strain = "z" }}
crack = [{{ line = {{ from = "-1, 0 mm", to = "4, 0 mm" }} }}]
unbreakable = [{{ on = "y-max", thickness = 4 }}, {{ on = "y-min", thickness = 4 }}]
{schedule}
"#
    )
}

/// Bonds that soften break in the end; the energy balances, and the crack's files say where its tips were when.
#[test]
fn softening_plates_are_pulled_apart() {
    let dir = folder();
    for (name, schedule, motion) in [
        (
            "moves",
            r#"
model = { surface_calibration = false, softening = { linear = 2 } }
motion = { duration = "20 us", safety = 0.8 }
condition = [{ on = "y-max", thickness = 3, velocity = [0, "0.1 m/s", 0] }, { on = "y-min", thickness = 3, velocity = [0, "-0.1 m/s", 0] }]
"#,
            true,
        ),
        (
            "rests",
            r#"
model = { surface_calibration = false, softening = { linear = 2 } }
equilibrium = { steps = 4, tolerance = 1e-7 }
condition = [{ on = "y-max", thickness = 3, displacement = [0, "0.8 um", 0] }, { on = "y-min", thickness = 3, displacement = [0, "-0.8 um", 0] }]
"#,
            false,
        ),
    ] {
        let case = write(&dir, &format!("{name}.toml"), &plate(schedule));
        let out = dir.path().join(name);
        let summary = json(&["run", &case, "-o", out.to_str().unwrap(), "--json"]);
        assert!(summary["energy"]["broken_bonds"].as_u64().unwrap() > 50, "{summary}");
        assert!(summary["relative_drift"].as_f64().unwrap() < 1e-5, "{summary}");
        let crack = &summary["cracks"][0];
        assert!(crack["length"].as_f64().unwrap() > 1e-3, "{crack}");
        assert_eq!(crack["tips"][0]["length"], crack["length"]);
        let table = std::fs::read_to_string(out.join("crack.csv")).unwrap();
        let mut lines = table.lines();
        let first = if motion { "time_s" } else { "load_factor" };
        assert_eq!(lines.next().unwrap(), format!("{first},tip,x_m,y_m,z_m,length_m,speed_m_s"));
        let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
        let numbers = |column: usize| rows.iter().map(|row| row[column].parse::<f64>().unwrap()).collect::<Vec<_>>();
        assert!(!rows.is_empty() && numbers(0).windows(2).all(|t| t[0] <= t[1]), "{table}");
        assert_eq!(numbers(5).into_iter().reduce(f64::max), crack["length"].as_f64(), "{table}");
        assert!(motion || rows.iter().all(|row| row[6].is_empty()), "{table}");
        assert!(out.join("crack-nodes.csv").exists());
    }
}
