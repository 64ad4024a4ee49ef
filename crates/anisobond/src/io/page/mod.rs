//! A folder of results as one self-contained HTML page: what was asked, what was reached, tables, stiffness as heat maps,
//! Young's modulus and the lattice in three dimensions to turn, wave speeds, charts. It needs no network.
//!
//! The page draws itself from the data in it (`page.js`); here the data are gathered.

mod facts;
mod scene;

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use serde_json::Value;

use self::scene::Scene;
use super::tree::read_text;
use crate::{Error, Result};

/// Rows of a table that the page shows.
const MOST_ROWS: usize = 2000;

/// Points of a line in a chart; longer ones are thinned.
const MOST_POINTS: usize = 2000;

/// What the page draws.
#[derive(Serialize)]
struct Page {
    title: String,
    kind: &'static str,
    version: &'static str,
    warnings: Vec<String>,
    /// Sections of labels and values.
    facts: Vec<(String, Vec<(String, Value)>)>,
    tensors: Vec<Tensor>,
    /// Density (kg/m³), for wave speeds.
    density: Option<f64>,
    scene: Option<Scene>,
    charts_title: &'static str,
    charts: Vec<Chart>,
    pictures: Vec<Picture>,
    table: Option<TablePart>,
}

#[derive(Serialize)]
struct Tensor {
    name: String,
    /// Pa.
    voigt: Vec<Vec<f64>>,
}

#[derive(Serialize)]
struct Chart {
    title: String,
    x: String,
    y: String,
    series: Vec<Series>,
}

#[derive(Serialize)]
struct Series {
    name: String,
    points: Vec<[f64; 2]>,
}

#[derive(Serialize)]
struct Picture {
    name: String,
    /// A data URL.
    data: String,
}

#[derive(Serialize)]
struct TablePart {
    title: &'static str,
    columns: Vec<String>,
    rows: Vec<Vec<Value>>,
    all: usize,
}

/// The kinds of folders, by the file that tells them.
const KINDS: [(&str, &str); 6] = [
    ("calibration.json", "Calibration of a grid"),
    ("element-test.json", "Element test"),
    ("lattice.json", "Lattice on a packing"),
    ("summary.json", "Run of a body"),
    ("results.sqlite", "Sweep"),
    ("results.csv", "Calibration of a table"),
];

/// The page of a folder that `calibrate`, `lattice`, `element-test`, `sweep` or `run` wrote.
///
/// # Errors
/// A folder without results, or with files that cannot be read.
pub fn report_page(folder: impl AsRef<Path>) -> Result<String> {
    let folder = folder.as_ref();
    let Some((file, kind)) = KINDS.into_iter().find(|(file, _)| folder.join(file).is_file()) else {
        return Err(Error::input(
            format!("{} holds no results", folder.display()),
            "give a folder that calibrate, lattice, element-test, sweep or run wrote with -o",
        ));
    };
    let report = match file.ends_with(".json") {
        true => serde_json::from_str(&read_text(&folder.join(file))?).map_err(|e| {
            Error::input(format!("{file} is damaged: {e}"), "write the folder again").at(folder.display())
        })?,
        false => Value::Null,
    };
    let name = folder.file_name().map_or_else(|| "results".into(), |n| n.to_string_lossy().into_owned());
    let title = ["material", "case"].iter().find_map(|key| report[*key].as_str()).unwrap_or(&name);
    let probes = table(&folder.join("probes.csv"))?;
    let results = table(&folder.join("results.csv"))?;
    let bonds = table(&folder.join("bonds.csv"))?;
    let (charts_title, charts) = match (&probes, &results) {
        (Some(probes), _) => ("History", history(probes)),
        (None, Some(results)) => ("Results over the parameters", sweep_charts(results)),
        _ => ("Charts", Vec::new()),
    };
    let shown = [("Results", results), ("Probes", probes), ("Bonds", bonds)];
    let page = Page {
        title: title.into(),
        kind,
        version: env!("CARGO_PKG_VERSION"),
        warnings: facts::warnings(&report),
        facts: facts::sections(&report),
        tensors: facts::tensors(&report),
        density: facts::density(&report),
        scene: scene::of_folder(folder)?,
        charts_title,
        charts,
        pictures: pictures(folder)?,
        table: shown.into_iter().find_map(|(title, table)| Some(part(title, table?))),
    };
    let data = serde_json::to_string(&page).map_err(|e| Error::file("write", folder, e.into()))?;
    Ok(include_str!("page.html")
        .replace("/*STYLE*/", include_str!("page.css"))
        .replace("/*SCRIPT*/", include_str!("page.js"))
        // No text of a file can end the element that holds it.
        .replacen("/*DATA*/", &data.replace('<', "\\u003c"), 1))
}

/// Bytes as base64.
fn encoded(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}

/// A table of a file: names of columns and rows of numbers or texts.
struct Columns {
    names: Vec<String>,
    rows: Vec<Vec<Value>>,
}

impl Columns {
    fn number(&self, row: usize, column: usize) -> Option<f64> {
        self.rows[row].get(column).and_then(Value::as_f64)
    }

    /// A column over another, where both are numbers; thinned.
    fn points(&self, x: usize, y: usize) -> Vec<[f64; 2]> {
        let step = self.rows.len().div_ceil(MOST_POINTS).max(1);
        let last = self.rows.len().saturating_sub(1);
        let rows = (0..self.rows.len()).filter(|r| r % step == 0 || *r == last);
        rows.filter_map(|r| Some([self.number(r, x)?, self.number(r, y)?])).collect()
    }
}

/// A CSV file with comments, if it is there.
fn table(path: &Path) -> Result<Option<Columns>> {
    if !path.is_file() {
        return Ok(None);
    }
    let at = |e: csv::Error| Error::input(e.to_string(), "write the folder again").at(path.display());
    let text = read_text(path)?;
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).flexible(true).from_reader(text.as_bytes());
    let names = reader.headers().map_err(at)?.iter().map(String::from).collect();
    let value = |word: &str| word.parse::<f64>().map_or_else(|_| word.into(), |x| serde_json::json!(x));
    let rows = reader.records().map(|row| Ok(row.map_err(at)?.iter().map(value).collect())).collect::<Result<_>>()?;
    Ok(Some(Columns { names, rows }))
}

fn part(title: &'static str, table: Columns) -> TablePart {
    let all = table.rows.len();
    TablePart { title, columns: table.names, rows: table.rows.into_iter().take(MOST_ROWS).collect(), all }
}

/// A run's probes over time: energies in one chart, the components of a probe in one each.
fn history(probes: &Columns) -> Vec<Chart> {
    let Some(time) = probes.names.first() else { return Vec::new() };
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    for (column, name) in probes.names.iter().enumerate().skip(1) {
        let group = match name.strip_suffix("_J") {
            Some(_) => "energies (J)",
            None => name.rsplit_once('_').map_or(name.as_str(), |(probe, _)| probe),
        };
        match groups.iter_mut().find(|(known, _)| known == group) {
            Some((_, columns)) => columns.push(column),
            None => groups.push((group.into(), vec![column])),
        }
    }
    let chart = |(title, columns): (String, Vec<usize>)| Chart {
        x: time.clone(),
        y: title.clone(),
        series: columns
            .into_iter()
            .map(|c| Series { name: probes.names[c].clone(), points: probes.points(0, c) })
            .collect(),
        title,
    };
    groups.into_iter().map(chart).filter(|c| c.series.iter().any(|s| s.points.len() > 1)).collect()
}

/// Results of a sweep over the first parameter that varies.
fn sweep_charts(results: &Columns) -> Vec<Chart> {
    let varies = |c: &usize| {
        let points: Vec<f64> = (0..results.rows.len()).filter_map(|r| results.number(r, *c)).collect();
        points.len() > 1 && points.iter().any(|x| (x - points[0]).abs() > 1e-12 * points[0].abs())
    };
    let skipped = |c: &usize| results.names[*c] == "id";
    let columns: Vec<usize> = (0..results.names.len()).filter(|c| !skipped(c) && varies(c)).collect();
    let Some((&x, ys)) = columns.split_first() else { return Vec::new() };
    let chart = |&y: &usize| {
        let mut points = results.points(x, y);
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let name = results.names[y].clone();
        Chart {
            title: name.clone(),
            x: results.names[x].clone(),
            y: name,
            series: vec![Series { name: String::new(), points }],
        }
    };
    ys.iter().take(MOST_CHARTS).map(chart).collect()
}

/// Charts of a sweep.
const MOST_CHARTS: usize = 12;

/// Animations of a run, and where there are none its last slices.
fn pictures(folder: &Path) -> Result<Vec<Picture>> {
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
            Ok(Picture { name: name.clone(), data: format!("data:image/png;base64,{}", encoded(&bytes)) })
        })
        .collect()
}
