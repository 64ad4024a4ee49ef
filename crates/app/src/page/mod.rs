//! A folder of results as one self-contained HTML page: what was asked, what was reached, tables, stiffness as heat maps,
//! Young's modulus and the lattice in three dimensions to turn, wave speeds, charts. It needs no network. The same page,
//! with a form, is that of the studio.
//!
//! The page draws itself from the data in it (`*.js`); here the data are gathered.

mod charts;
mod facts;
mod labels;
mod numbers;
mod rank;
mod scene;
mod sweeps;
mod table;
mod tensors;

pub use self::rank::rank_page;

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use serde_json::Value;

use self::charts::Chart;
use self::facts::Section;
use self::scene::Scene;
use self::table::{Columns, TablePart};
use self::tensors::Tensor;
use crate::model_report::ModelReport;
use crate::run::{CASE, stopped_at};
use anisobond::lattice::Neighbourhood;
use anisobond::tensor::Material;
use anisobond::{Error, Result};
use anisobond_formats::bonds::{BondModuli, BondTable, bonds_csv};
use anisobond_formats::tree::read_text;

/// What the page draws.
#[derive(Default, Serialize)]
struct Page {
    title: String,
    kind: &'static str,
    /// Of the program that writes the page.
    version: &'static str,
    /// What was typed; empty where it is not known.
    command: String,
    warnings: Vec<String>,
    /// Sections of labels and values.
    facts: Vec<Section>,
    tensors: Vec<Tensor>,
    /// Density (kg/m³), for wave speeds.
    density: Option<f64>,
    scene: Option<Scene>,
    charts_title: &'static str,
    charts: Vec<Chart>,
    /// What is not drawn, and why; empty if nothing.
    charts_note: String,
    cracks: Vec<Chart>,
    pictures: Vec<Picture>,
    table: Option<TablePart>,
}

#[derive(Serialize)]
struct Picture {
    name: String,
    caption: String,
    /// A data URL.
    data: String,
}

/// The kinds of folders, by the file that tells them.
const KINDS: [(&str, &str); 7] = [
    ("calibration.json", CALIBRATION),
    ("element-test.json", "Element test"),
    ("lattice.json", "Lattice on a packing"),
    ("summary.json", "Run of a body"),
    ("results.csv", "Sweep"),
    ("calibrations.csv", "Calibration of a table"),
    ("probes.csv", UNFINISHED),
];

const CALIBRATION: &str = "Calibration of a grid";
const UNFINISHED: &str = "Run of a body, not finished";

/// The page of a folder that `calibrate`, `lattice`, `element-test`, `sweep` or `run` wrote. `command` is what was typed,
/// empty where it is not known.
///
/// # Errors
/// A folder without results, or with files that cannot be read.
pub fn report_page(folder: impl AsRef<Path>, command: &str) -> Result<String> {
    let folder = folder.as_ref();
    let Some((file, kind)) = KINDS.into_iter().find(|(file, _)| folder.join(file).is_file()) else {
        return Err(Error::input(
            format!("{} holds no results", folder.display()),
            "give a folder that calibrate, lattice, element-test, sweep or run wrote",
        ));
    };
    let report = if file.ends_with(".json") { read_json(folder, file)? } else { Value::Null };
    let case = if folder.join(CASE).is_file() { read_json(folder, CASE)? } else { Value::Null };
    let name = folder.file_name().map_or_else(|| "results".into(), |n| n.to_string_lossy().into_owned());
    let named = ["material", "case"].iter().find_map(|key| report[*key].as_str()).or(case["name"].as_str());
    let read = |name: &str| Columns::read(&folder.join(name));
    let (probes, results, cracks) = (read("probes.csv")?, read("results.csv")?, read("crack.csv")?);
    let (charts_title, (charts, charts_note)) = match (&probes, &results) {
        (Some(probes), _) => ("History", (charts::history(probes), String::new())),
        (None, Some(results)) => ("Results over the parameters", sweeps::sweep(results)),
        _ => ("Charts", Default::default()),
    };
    let mut page = of_report(named.unwrap_or(&name), kind, &report);
    let asked = if let Some(results) = &results { sweeps::asked(results) } else { facts::asked(&case) };
    page.facts.splice(0..0, asked);
    if kind == UNFINISHED {
        page.warnings.push(unfinished(folder));
    }
    let shown = [
        ("Results", results),
        ("Calibrations", read("calibrations.csv")?),
        ("Probes", probes),
        ("Bonds", read("bonds.csv")?),
    ];
    let page = Page {
        command: command.into(),
        scene: scene::of_folder(folder)?,
        charts_title,
        charts,
        charts_note,
        cracks: cracks.map_or(Vec::new(), |tips| charts::cracks(&tips)),
        pictures: pictures(folder, &case)?,
        table: shown.into_iter().find_map(|(title, table)| Some(table?.part(title))),
        ..page
    };
    Ok(calibration_page(&json(&page)?))
}

/// A JSON file of a folder.
fn read_json(folder: &Path, file: &str) -> Result<Value> {
    serde_json::from_str(&read_text(&folder.join(file))?)
        .map_err(|e| Error::input(format!("{file} is damaged: {e}"), "write the folder again").at(folder.display()))
}

/// How far a run is that has no summary.
fn unfinished(folder: &Path) -> String {
    stopped_at(folder).map_or_else(
        || "This run is not finished, and there is no checkpoint to go on from.".into(),
        |[step, steps]| {
            format!("This run stopped at step {step} of {steps}: run the same command with --resume to go on.")
        },
    )
}

/// The data of a calibration's page, as JSON. `command` is what would be typed for it.
///
/// # Errors
/// Moduli that are not those of the neighbourhood.
pub fn calibration_page_data(
    material: &Material,
    report: &ModelReport,
    neighbourhood: &Neighbourhood,
    moduli: &BondModuli,
    command: &str,
) -> Result<String> {
    let report = serde_json::to_value(report).map_err(|e| Error::file("write", "the report", e.into()))?;
    let bonds = Columns::parse(&bonds_csv(neighbourhood, moduli, &material.name)?)?;
    json(&Page {
        command: command.into(),
        scene: Some(scene::neighbourhood(&BondTable::new(neighbourhood, moduli)?)),
        table: Some(bonds.part("Bonds")),
        ..of_report(&material.name, CALIBRATION, &report)
    })
}

/// The page of the data that [`calibration_page_data`] made.
pub fn calibration_page(data: &str) -> String {
    whole("", "showPage();", data)
}

/// The page of the studio: a form, and room for what its server answers. `start` is what the form knows, as JSON.
pub fn studio_page(start: &Value) -> String {
    let script = concat!(include_str!("tensor_text.js"), include_str!("studio.js"));
    whole(include_str!("studio.html"), script, &start.to_string())
}

/// What any report says of itself.
fn of_report(title: &str, kind: &'static str, report: &Value) -> Page {
    let tensors = tensors::tensors(report);
    Page {
        title: title.into(),
        kind,
        version: env!("CARGO_PKG_VERSION"),
        warnings: tensors::warnings(report, &tensors),
        facts: facts::sections(report),
        tensors,
        density: report["density"].as_f64().filter(|d| *d > 0.0),
        ..Page::default()
    }
}

fn json(page: &Page) -> Result<String> {
    serde_json::to_string(page).map_err(|e| Error::file("write", "the page", e.into()))
}

/// The page: everything in one file.
fn whole(form: &str, script: &str, data: &str) -> String {
    let scripts = [
        include_str!("page.js"),
        include_str!("tensors.js"),
        include_str!("charts.js"),
        include_str!("moving.js"),
        include_str!("view.js"),
        script,
    ];
    include_str!("page.html")
        .replace("<!--FORM-->", form)
        .replace("/*STYLE*/", include_str!("page.css"))
        .replace("/*SCRIPT*/", &scripts.concat())
        // No text of a file can end the element that holds it.
        .replacen("/*DATA*/", &data.replace('<', "\\u003c"), 1)
}

/// Bytes as base64.
fn encoded(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}

/// Animations of a run, and where there are none its last slices.
fn pictures(folder: &Path, case: &Value) -> Result<Vec<Picture>> {
    let entries = std::fs::read_dir(folder).map_err(|e| Error::file("read", folder, e))?;
    let mut names: Vec<String> =
        entries.filter_map(|e| e.ok()?.file_name().into_string().ok()).filter(|n| n.starts_with("slice-")).collect();
    names.sort();
    let animations: Vec<&String> = names.iter().filter(|n| n.ends_with(".apng")).collect();
    let chosen = if animations.is_empty() {
        names.iter().rfind(|n| n.ends_with(".png")).into_iter().collect()
    } else {
        animations
    };
    chosen
        .into_iter()
        .map(|name| {
            let path = folder.join(name);
            let bytes = std::fs::read(&path).map_err(|e| Error::file("read", &path, e))?;
            let data = format!("data:image/png;base64,{}", encoded(&bytes));
            Ok(Picture { name: name.clone(), caption: caption(name, case), data })
        })
        .collect()
}

/// What a picture of a slice shows: "slice-1.apng" is the first that the case asks for.
fn caption(name: &str, case: &Value) -> String {
    let digits: String = name.chars().skip_while(|c| !c.is_ascii_digit()).take_while(char::is_ascii_digit).collect();
    let slice = digits.parse::<usize>().ok().and_then(|n| n.checked_sub(1)).map(|n| &case["output"]["slices"][n]);
    let text = |key: &str| slice.and_then(|s| s[key].as_str()).map(|s| s.replace('_', " "));
    match (text("field"), text("axis")) {
        (Some(field), Some(axis)) => format!("{field} in a slice across {axis}"),
        _ => format!("slice {digits}"),
    }
}
