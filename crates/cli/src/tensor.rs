//! `anisobond tensor`.

use anisobond::tensor::{DirectionalModuli, Extremes, Material, SYMMETRY_TOLERANCE, SymmetryClass};
use anisobond::{Error, Result};
use anisobond_app::TensorReport;
use anisobond_formats::{Reading, json_value, parse_density};
use serde_json::{Value, json};

use crate::{Ending, args, rows, text};

pub fn run(args: &args::Tensor) -> Result<Ending> {
    if let Some(tolerance) = args.tolerance.filter(|t| !(*t >= 0.0 && t.is_finite())) {
        return Err(Error::input(format!("--tolerance {tolerance}"), "give a number ≥ 0, as 0.005"));
    }
    let density = args.density.as_ref().map(|d| parse_density(d).map_err(|e| e.at("--density"))).transpose()?;
    if rows::asked(&args.material, &args.table) {
        if !args.direction.is_empty() {
            return Err(Error::input("--direction, but the file is a table", "choose a row with --row ID"));
        }
        let report = |material: &Material| {
            let density = density.or(material.density);
            TensorReport::new(&Material { density, ..material.clone() }, args.tolerance)
        };
        return rows::run(&args.material, &args.table, args.json, report, brief);
    }
    let Reading { mut material, read_as, .. } = args.table.find(&args.material)?;
    material.density = density.or(material.density);
    let directions = directions(args, &material)?;
    let report = TensorReport::new(&material, args.tolerance)?;
    text::warn(&report.warnings);
    if args.json {
        let mut document = json_value(&report)?;
        document["read_as"] = read_as.into();
        document["directions"] = directions;
        text::print_json(&document)?;
    } else {
        let said = format!("\n{}\n", text::wrapped("read as  ", &read_as).trim_end());
        text::print(&describe(&report, &directions).replacen('\n', &said, 1))?;
    }
    Ok(Ending::Done)
}

/// Moduli and waves along the directions asked for.
fn directions(args: &args::Tensor, material: &Material) -> Result<serde_json::Value> {
    let mut all = Vec::new();
    for asked in &args.direction {
        let n = text::vector(asked, "--direction")?;
        if n.norm() == 0.0 {
            return Err(Error::input("--direction 0,0,0", "give a direction of positive length"));
        }
        material.stiffness.require_positive_definite()?;
        let moduli = DirectionalModuli::new(&material.stiffness)?;
        let waves = material.density.map(|d| material.stiffness.waves(&n, d)).transpose()?;
        let n = n.normalize();
        all.push(json!({
            "direction": [n.x, n.y, n.z], "young": moduli.young(&n),
            "linear_compressibility": moduli.linear_compressibility(&n), "waves": waves,
        }));
    }
    Ok(all.into())
}

/// One row of a table in words.
fn brief(row: &Value) -> String {
    let number = |path: &str| row.pointer(path).and_then(Value::as_f64).unwrap_or(f64::NAN);
    let (unit, name) = text::stress_unit(number("/moduli/hill/bulk").max(number("/moduli/hill/shear")));
    format!(
        "{:24} within {:>8} %  Hill K {} G {} {name}, A^U {}, Cauchy gap {} %",
        row["symmetry"]["class"].as_str().unwrap_or(""),
        text::number(100.0 * number("/symmetry/tolerance")),
        text::number(number("/moduli/hill/bulk") / unit),
        text::number(number("/moduli/hill/shear") / unit),
        text::number(number("/moduli/universal_anisotropy")),
        text::percent(number("/cauchy/gap"))
    )
}

/// The result in words.
pub fn describe(r: &TensorReport, directions: &serde_json::Value) -> String {
    let (unit, name) = text::stress_unit(text::largest(&r.stiffness));
    let stress = |x: f64| format!("{} {name}", text::number(x / unit));
    let mut out = r.material.clone();
    if !r.source.is_empty() {
        out += &format!(" ({})", r.source);
    }
    out += &format!("\n\nstiffness, Voigt ({name}; order 11 22 33 23 13 12)\n");
    for row in text::matrix_rows(&r.stiffness, unit) {
        out += &format!("  {row}\n");
    }
    out += "\npositive definite; Kelvin moduli with eigentensors (11 22 33 23 13 12)\n";
    for (value, e) in r.kelvin_moduli.iter().zip(&r.eigentensors) {
        let e: String = e.iter().map(|x| format!("{x:>8.4}")).collect();
        out += &format!("  {:>12}  {e}\n", stress(*value));
    }
    let m = &r.moduli;
    out += "\naverages            bulk K          shear G\n";
    for (name, k) in [("Voigt", m.voigt), ("Reuss", m.reuss), ("Hill", m.hill)] {
        out += &format!("  {name:12} {:>13}    {:>13}\n", stress(k.bulk), stress(k.shear));
    }
    out += &format!("  Hill: Young {}, Poisson {}\n", stress(m.hill_young), text::number(m.hill_poisson));
    out += &format!("  universal anisotropy A^U = {}\n", text::number(m.universal_anisotropy));
    let e = &r.engineering;
    out += "\nengineering constants in the given axes\n";
    out += &format!("  E1 E2 E3     {}   {}   {}\n", stress(e.e1), stress(e.e2), stress(e.e3));
    out += &format!("  G23 G13 G12  {}   {}   {}\n", stress(e.g23), stress(e.g13), stress(e.g12));
    out += &format!(
        "  ν12 ν13 ν23  {}   {}   {}\n  ν21 ν31 ν32  {}   {}   {}\n",
        text::number(e.nu12),
        text::number(e.nu13),
        text::number(e.nu23),
        text::number(e.nu21),
        text::number(e.nu31),
        text::number(e.nu32)
    );
    let d = &r.directional;
    out += "\nextremes over all directions\n";
    out += &extremes("Young E(n)", &d.young, stress);
    out += &extremes("shear G(n,m)", &d.shear, stress);
    out += &extremes("Poisson ν(n,m)", &d.poisson, text::number);
    out += &extremes("compressibility β(n)", &d.linear_compressibility, |x| {
        format!("{} 1/{name}", text::number(x * unit))
    });
    match &r.waves {
        None => out += "\nwaves: give a density (`density` in the file, or --density '2650 kg/m3')\n",
        Some(w) => {
            let speed = |x: f64| format!("{} m/s", text::number(x));
            out += "\nwave speeds (slowest to fastest)\n";
            for (axis, waves) in [("e1", &w.x), ("e2", &w.y), ("e3", &w.z)] {
                let speeds: Vec<String> = waves.iter().map(|w| speed(w.speed)).collect();
                out += &format!("  along {axis}    {}\n", speeds.join("   "));
            }
            for (name, e) in
                [("slow", &w.extremes.slow), ("middle", &w.extremes.intermediate), ("fast", &w.extremes.fast)]
            {
                out += &extremes(name, e, speed);
            }
        }
    }
    if let Some(asked) = directions.as_array().filter(|a| !a.is_empty()) {
        out += "\nalong the directions asked for\n";
        for d in asked {
            let n: Vec<f64> = (0..3).filter_map(|i| d["direction"][i].as_f64()).collect();
            let young = d["young"].as_f64().unwrap_or(f64::NAN);
            out += &format!("  ({:.4}, {:.4}, {:.4})  E = {}", n[0], n[1], n[2], stress(young));
            if let Some(waves) = d["waves"].as_array() {
                let speeds: Vec<String> = waves.iter().filter_map(|w| w["speed"].as_f64()).map(text::number).collect();
                out += &format!("  waves {} m/s", speeds.join(", "));
            }
            out += "\n";
        }
    }
    out += &format!("\ncentral bonds: Cauchy gap {} %", text::number(100.0 * r.cauchy.gap));
    out += if r.cauchy.reachable {
        " (their least error on any neighbourhood)\n"
    } else {
        " at least; the Cauchy part has a negative Kelvin modulus, so that no bonds c ≥ 0 reach even that\n"
    };
    out += &format!("  defect D, what they cannot see ({name}): D11 = C44 − C23, D12 = C36 − C45, …\n");
    for row in &r.cauchy.defect {
        out += &format!("  {}\n", row.iter().map(|x| text::entry(x / unit)).collect::<String>());
    }
    let s = &r.symmetry;
    let why = s.noise.map_or(String::new(), |noise| match s.tolerance > SYMMETRY_TOLERANCE {
        true => format!(", with noise of about {} % of the norm", text::number(100.0 * noise)),
        false => String::new(),
    });
    out += &format!("\nsymmetry: {} (within {} %{why})\n", s.class.name(), text::number(100.0 * s.tolerance));
    let in_energy = r.symmetry_in_energy.as_ref();
    out += "                                          distance in the norm, in energy\n";
    for fit in &s.fits {
        let mark = if fit.class == s.class { "→" } else { " " };
        let axis = match fit.class {
            // Every axis, and none.
            SymmetryClass::Isotropic | SymmetryClass::Triclinic => String::new(),
            _ => format!("   e3 {}", text::direction(&[fit.axes[(0, 2)], fit.axes[(1, 2)], fit.axes[(2, 2)]])),
        };
        let share = |x: f64| if x < 1e-12 { "0".into() } else { text::number(100.0 * x) };
        out += &format!(
            "  {mark} {:24} {:>2} constants  {:>10} % {:>10} %{axis}\n",
            fit.class.name(),
            fit.constants,
            share(fit.distance),
            in_energy.map_or("–".into(), |e| share(e.fit(fit.class).distance)),
        );
    }
    if let Some(other) = in_energy.filter(|e| e.class != s.class) {
        out += &format!("  in the sense of energy it is {}\n", other.class.name());
    }
    out
}

fn extremes(name: &str, e: &Extremes, show: impl Fn(f64) -> String) -> String {
    let one = |x: &anisobond::tensor::Extreme| {
        let transverse = x.transverse.map_or(String::new(), |m| format!(", m = {}", text::direction(&m)));
        format!("{:>14} at n = {}{transverse}", show(x.value), text::direction(&x.direction))
    };
    format!("  {name:22} min {}\n  {:22} max {}\n", one(&e.min), "", one(&e.max))
}
