//! The page of a ranking: which materials which model carries, to sort and to filter, with histograms and figures.

use serde_json::{Value, json};

use super::whole;
use crate::rank::Ranking;

/// One self-contained page; `command` is what was typed, empty where it is not known.
pub fn rank_page(title: &str, ranking: &Ranking, order: &str, command: &str) -> String {
    let models: Vec<&str> = ranking.settings.models.iter().map(|model| model.name()).collect();
    let warnings: Vec<Value> = ranking
        .rows
        .iter()
        .flat_map(|row| row["warnings"].as_array().into_iter().flatten().map(|w| json!([row["id"], w])))
        .collect();
    let data = json!({
        "title": title,
        "kind": "Which materials which model carries",
        "version": env!("CARGO_PKG_VERSION"),
        "command": command,
        "models": models,
        "metric": ranking.settings.metric,
        "within": ranking.settings.within,
        "neighbourhood": ranking.neighbourhood,
        "all": ranking.all,
        "order": order,
        "rows": ranking.rows.iter().map(|row| brief(row, &models)).collect::<Vec<_>>(),
        "failed": ranking.failed,
        "doubts": warnings,
    });
    whole("", concat!(include_str!("rank.js"), "\nrankPage();"), &data.to_string())
}

/// What the page shows of a row.
fn brief(row: &Value, models: &[&str]) -> Value {
    let mut value = json!({
        "id": row["id"], "material": row["material"], "carried_by": row["carried_by"], "cauchy_gap": row["cauchy_gap"],
        "universal_anisotropy": row["universal_anisotropy"], "poisson": row["poisson"],
    });
    for model in models {
        for key in ["relative_error", "largest_energy_error", "reaches_model_limit"] {
            value[format!("{model}.{key}")] = row[*model][key].clone();
        }
    }
    value
}
