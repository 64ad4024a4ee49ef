//! `anisobond sweep`.

use std::path::Path;

use anisobond::io::element_sweep::{ElementSweep, contact_radius_chart};
use anisobond::io::sweep::{Options, ParameterTable, Shard, SlurmScript, Store, merge, run_sweep, slurm_script};
use anisobond::{Error, Result};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;

use crate::{Ending, args, interrupt, report, text};

pub fn run(args: &args::Sweep) -> Result<Ending> {
    let results = args.output.join("results.sqlite");
    if let Some(shards) = args.slurm {
        return text::print(&script(args, shards)?).map(|()| Ending::Done);
    }
    let table = ParameterTable::read(&args.table)?;
    let settings = json!({ "experiment": "element-test" });
    if let Some(count) = args.merge {
        let shards: Vec<_> = (0..count).map(|index| Shard { index, count }.store(&results)).collect();
        let store = merge(&results, &shards)?;
        return finish(args, &store, &[], false);
    }
    let sweep = ElementSweep::new(&table)?;
    let shard = args.shard.as_deref().map(Shard::parse).transpose()?;
    let path = shard.map_or(results.clone(), |shard| shard.store(&results));
    let store = Store::open(path, &table, shard, &settings)?;
    let stop = interrupt::flag();
    let progress = ProgressBar::new(table.jobs().len() as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} jobs, {eta} left  {msg}") {
        progress.set_style(style);
    }
    let options = Options { retry: args.retry, logs: args.output.join("logs") };
    let summary = run_sweep(
        &table,
        &store,
        &options,
        stop,
        |job, log| sweep.job(job, log),
        |p| {
            progress.set_length(p.counts.all as u64);
            progress.set_position((p.counts.done + p.counts.failed) as u64);
            if let Some((title, _)) = p.last {
                progress.set_message(title);
            }
        },
    )?;
    progress.finish_and_clear();
    if summary.interrupted {
        let done = summary.counts.done + summary.counts.failed;
        let message = format!(
            "{done} of {} jobs are finished and kept in {}; run the same command to go on",
            summary.counts.all,
            store.path().display()
        );
        return Err(Error::Interrupted { message });
    }
    finish(args, &store, &summary.failed, shard.is_some())
}

/// Results as CSV and charts, and what failed.
fn finish(args: &args::Sweep, store: &Store, failed: &[(String, String)], of_shard: bool) -> Result<Ending> {
    let counts = store.counts()?;
    let csv = store.path().with_extension("csv");
    store.write_csv(&csv)?;
    let mut wrote = vec![name(&csv)];
    if !of_shard && let Some(chart) = contact_radius_chart(store)? {
        chart.write(args.output.join("stiffness.svg"))?;
        chart.write(args.output.join("stiffness.png"))?;
        wrote.extend(["stiffness.svg", "stiffness.png", "stiffness.csv"].map(String::from));
    }
    eprintln!("wrote {} in {}", wrote.join(", "), args.output.display());
    report::beside(args.report, &args.output)?;
    if args.json {
        let records = store.records()?;
        let jobs: Vec<_> = records
            .iter()
            .map(|r| json!({"title": r.title, "parameters": r.parameters, "result": r.result, "error": r.message}))
            .collect();
        text::print_json(&json!({"jobs": counts.all, "done": counts.done, "failed": counts.failed, "results": jobs}))?;
    } else {
        text::print(&format!("{} of {} jobs done, {} failed\n", counts.done, counts.all, counts.failed))?;
    }
    for (title, message) in failed {
        eprintln!("  {title}: {message}");
    }
    if !failed.is_empty() {
        eprintln!("{} failed jobs are tried again with --retry", failed.len());
    }
    if counts.done == 0 {
        return Err(Error::input("no job of the table is done", "see the messages of its jobs"));
    }
    Ok(Ending::Done)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn script(args: &args::Sweep, shards: usize) -> Result<String> {
    if shards == 0 {
        return Err(Error::input("--slurm 0", "give at least one shard"));
    }
    let words = |extra: &[&str]| {
        let table = args.table.display().to_string();
        let output = args.output.display().to_string();
        let own = ["anisobond", "sweep", &table, "-o", &output];
        own.iter().chain(extra).map(ToString::to_string).collect::<Vec<_>>()
    };
    Ok(slurm_script(&SlurmScript {
        command: words(&[]),
        merge: words(&["--merge", &shards.to_string()]),
        shards,
        name: format!("anisobond-{}", args.table.file_stem().unwrap_or_default().to_string_lossy()),
        cpus: 4,
        time: "1-00:00:00".into(),
    }))
}
