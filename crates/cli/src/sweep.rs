//! `anisobond sweep`.

use anisobond::{Error, Result};
use anisobond_app::element_sweep::{ElementSweep, store_in, sweep_into, write_sweep};
use anisobond_app::sweep::{ParameterTable, Shard, SlurmScript, Store, merge, slurm_script};
use anisobond_app::{FolderLock, remove_results};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;

use crate::{Ending, args, interrupt, report, text};

pub fn run(args: &args::Sweep) -> Result<Ending> {
    if let Some(shards) = args.slurm {
        return text::print(&script(args, shards)?).map(|()| Ending::Done);
    }
    let table = ParameterTable::read(&args.table)?;
    if let Some(count) = args.merge {
        let shards: Vec<_> = (0..count).map(|index| store_in(&args.output, Some(Shard { index, count }))).collect();
        let _lock = FolderLock::alone(&args.output)?;
        let store = merge(store_in(&args.output, None), &shards)?;
        return finish(args, &store, &[], false);
    }
    let sweep = ElementSweep::new(&table)?;
    let shard = args.shard.as_deref().map(Shard::parse).transpose()?;
    let stop = interrupt::flag();
    let progress = ProgressBar::new(table.jobs().len() as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} jobs, {eta} left  {msg}") {
        progress.set_style(style);
    }
    // Shards share the folder; a whole sweep has it alone.
    let _lock = if shard.is_some() { FolderLock::shared(&args.output) } else { FolderLock::alone(&args.output) }?;
    if args.force {
        remove_results(&args.output)?;
    }
    let (store, summary) = sweep_into(&args.output, &table, &sweep, shard, args.retry, stop, |p| {
        progress.set_length(p.counts.all as u64);
        progress.set_position((p.counts.done + p.counts.failed) as u64);
        if let Some((title, _)) = p.last {
            progress.set_message(title);
        }
    })?;
    progress.finish_and_clear();
    summary.require_finished(&store)?;
    finish(args, &store, &summary.failed, shard.is_some())
}

/// Results as CSV and charts, and what failed.
fn finish(args: &args::Sweep, store: &Store, failed: &[(String, String)], of_shard: bool) -> Result<Ending> {
    store.notes().iter().for_each(|note| eprintln!("note: {note}"));
    let counts = store.counts()?;
    let wrote = write_sweep(&args.output, store, of_shard)?;
    eprintln!("wrote {} in {}", wrote.join(", "), args.output.display());
    report::locked(args.report, &args.output)?;
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
    Ok(if counts.failed > 0 { Ending::RowsFailed } else { Ending::Done })
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
