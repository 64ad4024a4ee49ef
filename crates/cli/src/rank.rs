//! `anisobond rank`.

use anisobond::calibration::Model;
use anisobond::tensor::Metric;
use anisobond::{Error, Result};
use anisobond_app::{RankSettings, Ranking, rank, rank_page};
use anisobond_formats::read_table;

use crate::args::{MetricName, ModelName};
use crate::{Ending, args, calibrate, folder, report, text};

/// Materials that are printed where no file is written.
const MOST_SHOWN: usize = 40;

pub fn run(args: &args::Rank) -> Result<Ending> {
    let neighbourhood = calibrate::neighbourhood(&args.neighbourhood)?;
    let table = read_table(&args.table, args.unit.as_deref())?;
    let models = match &args.model[..] {
        [] => vec![Model::Central, Model::Micropolar],
        given => [(ModelName::Central, Model::Central), (ModelName::Micropolar, Model::Micropolar)]
            .into_iter()
            .filter_map(|(name, model)| given.contains(&name).then_some(model))
            .collect(),
    };
    if args.model.contains(&ModelName::Hybrid) && models.is_empty() {
        return Err(Error::input("--model hybrid reaches every tensor", "rank by central, micropolar, or both"));
    }
    let metric = match args.metric {
        Some(MetricName::Energy) => Metric::Energy,
        _ => Metric::Norm,
    };
    let mut ranking = rank(&table, &neighbourhood, RankSettings { models, metric, within: args.within })?;
    let order = args.sort.clone().unwrap_or_else(|| ranking.usual_order());
    if !ranking.rows.is_empty() {
        ranking.sort(&order).map_err(|e| e.at("--sort"))?;
    }
    for condition in &args.filter {
        ranking.keep(condition).map_err(|e| e.at("--where"))?;
    }
    if let Some(folder) = &args.output {
        let title = std::path::Path::new(&args.table)
            .file_stem()
            .map_or_else(|| args.table.clone(), |s| s.to_string_lossy().into());
        let files = vec![
            ("rank.json", anisobond_formats::json_text(&ranking.json())?.into_bytes()),
            ("rank.csv", ranking.csv()?.into_bytes()),
            ("rank.html", rank_page(&title, &ranking, &order, &report::last_typed()).into_bytes()),
        ];
        folder::write(folder, &files, args.force)?;
    }
    if args.json {
        text::print_json(&ranking.json())?;
    } else if args.csv {
        text::print(&ranking.csv()?)?;
    } else {
        text::print(&describe(&ranking))?;
    }
    ending(&ranking)
}

/// How it ended; failed rows are named on stderr.
fn ending(ranking: &Ranking) -> Result<Ending> {
    for row in ranking.failed.iter().take(MOST_SHOWN) {
        eprintln!("  {}: {}", row["id"].as_str().unwrap_or(""), row["error"].as_str().unwrap_or(""));
    }
    match ranking.failed.len() {
        0 => Ok(Ending::Done),
        failed if failed == ranking.all => {
            Err(Error::input("no row of the table could be ranked", "see the errors of its rows"))
        }
        failed => {
            eprintln!("{failed} of {} rows failed", ranking.all);
            Ok(Ending::RowsFailed)
        }
    }
}

/// The result in words.
fn describe(r: &Ranking) -> String {
    let n = &r.neighbourhood;
    let mut out = format!(
        "{} of {} materials on {} bonds: {}, horizon {} Δ, influence {}\n",
        r.rows.len(),
        r.all,
        n.bonds,
        n.shape,
        text::number(n.horizon),
        n.influence
    );
    let counts: Vec<String> = r.counts().iter().map(|(model, count)| format!("{count} by {model}")).collect();
    out += &format!(
        "carried within {} % of the energy of every strain: {}\n\n",
        text::number(100.0 * r.settings.within),
        counts.join(", ")
    );
    out += &format!("  {:16} {:16} {:12}", "id", "material", "carried by");
    for model in &r.settings.models {
        out += &format!(" {:>26}", format!("{}: energy, norm (%)", model.name()));
    }
    out.push('\n');
    for row in r.rows.iter().take(MOST_SHOWN) {
        let word = |key: &str| row[key].as_str().unwrap_or("").to_string();
        out += &format!("  {:16} {:16} {:12}", word("id"), word("material"), word("carried_by"));
        for model in &r.settings.models {
            let share = |key: &str| text::percent(row[model.name()][key].as_f64().unwrap_or(f64::NAN));
            out += &format!(" {:>13} {:>12}", share("largest_energy_error"), share("relative_error"));
        }
        out.push('\n');
    }
    if r.rows.len() > MOST_SHOWN {
        out += &format!("  … and {} more; --json, --csv or -o DIR have all\n", r.rows.len() - MOST_SHOWN);
    }
    out
}
