//! `anisobond calibrate TABLE`: progress, interruption, and the table's results.

use anisobond::calibration::ModelCalibrator;
use anisobond::{Error, Result};
use anisobond_app::{FolderLock, TableResults, calibrate_table, table_journal};
use anisobond_formats::read_table;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;

use crate::{Ending, args, interrupt, report, text};

pub fn run(args: &args::Calibrate, calibrator: &ModelCalibrator) -> Result<Ending> {
    let table = read_table(&args.material, args.table.unit.as_deref())?;
    for repeated in table.repeated().iter().take(MOST_SHOWN) {
        eprintln!("note: {repeated}; each has its line in the results");
    }
    let _lock = args.output.as_ref().map(FolderLock::alone).transpose()?;
    let mut journal = args.output.as_ref().map(|folder| table_journal(folder, args.force)).transpose()?;
    let stop = interrupt::flag();
    let progress = ProgressBar::new(table.rows.len() as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} rows, {per_sec}, {eta} left") {
        progress.set_style(style);
    }
    let results =
        calibrate_table(&table, calibrator, journal.as_mut(), stop, |done| progress.set_position(done as u64))?;
    progress.finish_and_clear();
    results.notes().iter().for_each(|note| eprintln!("note: {note}"));
    let all = table.rows.len();
    if results.finished() < all {
        let rest = match &args.output {
            Some(folder) => format!("they are kept in {}; run the same again to go on", folder.display()),
            None => "they are lost; with -o DIR finished rows are kept".into(),
        };
        return Err(Error::Interrupted {
            message: format!("{} of {all} rows are done; {rest}", results.finished()).into(),
        });
    }
    finish(args, &results)
}

fn finish(args: &args::Calibrate, results: &TableResults) -> Result<Ending> {
    let mut failed = Vec::new();
    let (mut not_exact, mut not_converged) = (0, 0);
    let mut warnings = Vec::new();
    let mut lines = String::new();
    for row in results.values() {
        let id = row["id"].as_str().unwrap_or("").to_string();
        match row["error"].as_str() {
            Some(error) => {
                lines += &format!("{id:16} {error}\n");
                failed.push(format!("{id}: {error}"));
            }
            None => {
                let error = row["relative_error"].as_f64().unwrap_or(f64::NAN);
                not_exact += usize::from(args.require_exact.is_some_and(|e| error.is_nan() || error > e));
                not_converged += usize::from(row["outcome"] == "not-converged");
                let doubts = row["warnings"].as_array().into_iter().flatten().filter_map(|w| w.as_str());
                warnings.extend(doubts.map(|w| format!("{id}: {w}")));
                lines += &format!(
                    "{id:16} {:16} error {:>10} %  gap {:>10} %  {}{}{}\n",
                    row["material"].as_str().unwrap_or(""),
                    text::percent(error),
                    text::percent(row["cauchy_gap"].as_f64().unwrap_or(f64::NAN)),
                    match (row["outcome"] == "not-converged", row["reaches_model_limit"] == true) {
                        (true, _) => "not converged",
                        (_, true) => "the least of the model",
                        (_, false) => "short of the model's least",
                    },
                    match (row["stable"] == true, row["stability"]["evidence"].as_str().unwrap_or("")) {
                        (true, evidence) => format!(", stable ({evidence})"),
                        (false, _) => ", not stable".into(),
                    },
                    row["form"].as_str().map_or(String::new(), |form| format!(", {form}")),
                );
            }
        }
    }
    text::warn(&warnings[..warnings.len().min(MOST_SHOWN)]);
    if warnings.len() > MOST_SHOWN {
        eprintln!("warning: {} more; each is in its row's `warnings`", warnings.len() - MOST_SHOWN);
    }
    if let Some(folder) = &args.output {
        results.write_csv(folder.join("calibrations.csv"))?;
        eprintln!("wrote calibrations.csv in {}", folder.display());
        report::locked(args.report, folder)?;
    }
    if args.jsonl {
        text::print(&results.json_lines())?;
    } else if args.json {
        text::print_json(&json!({ "rows": results.values().collect::<Vec<_>>() }))?;
    } else if args.output.is_none() {
        text::print(&lines)?;
    }
    let all = results.finished();
    eprintln!("{} of {all} rows calibrated, {} failed", all - failed.len(), failed.len());
    if args.output.is_some() || args.json || args.jsonl {
        failed.iter().take(MOST_SHOWN).for_each(|f| eprintln!("  {f}"));
        if failed.len() > MOST_SHOWN {
            eprintln!("  … and {} more; each is in its row's `error`", failed.len() - MOST_SHOWN);
        }
    }
    if failed.len() == all {
        return Err(Error::input("no row of the table could be calibrated", "see the errors of its rows"));
    }
    if not_converged > 0 {
        eprintln!("{not_converged} did not converge: each says so in its `outcome`");
    }
    Ok(match (not_exact, not_converged) {
        (1.., _) => Ending::NotExact,
        _ if !failed.is_empty() => Ending::RowsFailed,
        (0, 0) => Ending::Done,
        (0, _) => Ending::NotConverged,
    })
}

/// Failed rows listed one by one on stderr.
const MOST_SHOWN: usize = 20;
