//! `rank`.

use anisobond::calibration::Model;
use anisobond::tensor::{Metric, NOTICEABLE_MISS};
use anisobond_app::{RankSettings, rank_page, write_files};
use anisobond_formats::FlatTable;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::convert;
use crate::neighbourhood::{Neighbourhood, chosen};
use crate::report::table_of;
use crate::work::background;

/// Which materials of a table which model carries, and by what error in the norm and in energy, as `anisobond rank`: a `Table`
/// with a row for each that is kept, failed rows last with their `error`.
///
/// `model` is central, micropolar, or None for both; `metric` norm or energy. A model carries a material of which it misses the
/// energy of no strain by more than `within`. `sort` is a column, with - before it from large to small; `where` a list of
/// conditions as "central.relative_error<5%". With a folder `output` the page rank.html, rank.csv and rank.json are written there;
/// other results there are refused, or replaced with `force`. `unit` is that of a table that names none. Other keywords are those of a
/// `Neighbourhood`.
#[pyfunction]
#[pyo3(signature = (table, neighbourhood=None, *, model=None, metric=None, within=NOTICEABLE_MISS, sort=None, r#where=None,
                    unit=None, output=None, force=false, **keywords))]
#[allow(clippy::too_many_arguments)] // They are keywords.
pub fn rank<'py>(
    py: Python<'py>,
    table: &Bound<'py, PyAny>,
    neighbourhood: Option<&Bound<'py, Neighbourhood>>,
    model: Option<&str>,
    metric: Option<&str>,
    within: f64,
    sort: Option<String>,
    r#where: Option<Vec<String>>,
    unit: Option<String>,
    output: Option<&Bound<'py, PyAny>>,
    force: bool,
    keywords: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let models = match model {
        None => vec![Model::Central, Model::Micropolar],
        Some(name) => {
            vec![convert::choice(name, "model", &[("central", Model::Central), ("micropolar", Model::Micropolar)])?]
        }
    };
    let metrics = [("norm", Metric::Norm), ("energy", Metric::Energy)];
    let metric = convert::choice(metric.unwrap_or("norm"), "metric", &metrics)?;
    let path = convert::path(table)?;
    let grid = chosen(py, "rank", neighbourhood, keywords)?.get().grid.clone();
    let output = output.map(convert::path).transpose()?;
    let name = format!("ranking of {}", path.display());
    let found = background(py, move || {
        let rows = anisobond_formats::read_table(&path, unit.as_deref())?;
        let mut ranking = anisobond_app::rank(&rows, &grid, RankSettings { models, metric, within })?;
        let order = sort.unwrap_or_else(|| ranking.usual_order());
        if !ranking.rows.is_empty() {
            ranking.sort(&order)?;
        }
        r#where.iter().flatten().try_for_each(|condition| ranking.keep(condition))?;
        if let Some(folder) = &output {
            let title = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
            let files = [
                ("rank.json", anisobond_formats::json_text(&ranking.json())?.into_bytes()),
                ("rank.csv", ranking.csv()?.into_bytes()),
                ("rank.html", rank_page(&title, &ranking, &order, "").into_bytes()),
            ];
            write_files(folder, &files, force)?;
        }
        Ok(FlatTable::of(ranking.rows.iter().chain(&ranking.failed)))
    })?;
    table_of(py, &name, &found)
}
