//! A sweep over the cores of the machine.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use serde_json::Value as Json;

use super::job::Job;
use super::log::JobLog;
use super::record::{Counts, State};
use super::store::Store;
use super::table::ParameterTable;
use anisobond::experiment::batch;
use anisobond::{Error, Result};

/// How a sweep is run.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Whether jobs that failed before are tried again.
    pub retry: bool,
    /// Folder of the logs, one file per job.
    pub logs: PathBuf,
}

/// How far a sweep is, after every finished job.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Jobs of the table (or shard), done and failed, those of earlier runs included.
    pub counts: Counts,
    /// Jobs finished by this run.
    pub finished_now: usize,
    /// Jobs this run has still to do.
    pub left: usize,
    /// Time since this run began.
    pub elapsed: Duration,
    /// Estimate of the time it still needs; none before the first job is finished.
    pub remaining: Option<Duration>,
    /// Title of the job just finished, and why it failed if it did.
    pub last: Option<(String, Option<String>)>,
}

/// How a sweep ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// All jobs, those done and failed.
    pub counts: Counts,
    /// Title and message of every job that failed, in the table's order.
    pub failed: Vec<(String, String)>,
    /// Whether it was stopped before all jobs were tried.
    pub interrupted: bool,
}

impl Summary {
    /// Refuses to go on with a sweep that was stopped.
    ///
    /// # Errors
    /// [`Error::Interrupted`], which says what is kept in the store and how to go on.
    pub fn require_finished(&self, store: &Store) -> Result<()> {
        if !self.interrupted {
            return Ok(());
        }
        let (done, all) = (self.counts.done + self.counts.failed, self.counts.all);
        let kept = store.path().display();
        let message = format!("{done} of {all} jobs are finished and kept in {kept}; run the same again to go on");
        Err(Error::Interrupted { message: message.into() })
    }
}

/// Runs the jobs of a table that its store does not have yet, in parallel; each is kept in the store as it is finished.
/// A job that returns an error or panics has failed: its message is kept and the others go on. When `stop` turns true
/// no further job is begun; one that then returns [`Error::Interrupted`] is not finished.
///
/// # Errors
/// A store or log that cannot be written: nothing further is begun.
pub fn run_sweep(
    table: &ParameterTable,
    store: &Store,
    options: &Options,
    stop: &AtomicBool,
    job: impl Fn(&Job, &mut JobLog) -> Result<Json> + Sync,
    observe: impl Fn(Progress) + Sync + Send,
) -> Result<Summary> {
    let begun = Instant::now();
    let pending = pending(table, store, options.retry)?;
    let mut counts = store.counts()?;
    counts.failed -= if options.retry { counts.failed } else { 0 };
    let mut finished_now = 0;
    let progress = |counts: Counts, finished_now: usize, last| {
        let (elapsed, left) = (begun.elapsed(), pending.len() - finished_now);
        let remaining = (finished_now > 0).then(|| elapsed.mul_f64(left as f64 / finished_now as f64));
        Progress { counts, finished_now, left, elapsed, remaining, last }
    };
    observe(progress(counts, 0, None));
    let work = |index: usize| attempt(&table.jobs()[index], store, options, &job);
    // An error of the store or a log, rather than of the job, ends the run.
    let each = |index: usize, outcome: Result<Option<Finished>>| {
        let Some(finished) = outcome? else { return Ok(()) };
        counts.done += usize::from(finished.is_none());
        counts.failed += usize::from(finished.is_some());
        finished_now += 1;
        observe(progress(counts, finished_now, Some((table.jobs()[index].title.clone(), finished))));
        Ok(())
    };
    batch::run(&pending, stop, work, each)?;
    summary(store, finished_now < pending.len())
}

/// The message of a job that failed; none of one that is done.
type Finished = Option<String>;

/// Indices of the jobs to do.
fn pending(table: &ParameterTable, store: &Store, retry: bool) -> Result<Vec<usize>> {
    let to_do = |state: State| match state {
        State::Pending | State::Started => true,
        State::Failed => retry,
        State::Done => false,
    };
    let records = store.records()?;
    let of_table = |position: usize, id: &str| table.jobs().get(position).is_some_and(|job| job.id == id);
    if let Some(other) = records.iter().find(|r| !of_table(r.position, &r.id)) {
        let problem = format!("the store's job {} is not that of {}", other.title, table.file());
        return Err(Error::input(problem, "open the store with this table").at(store.path().display()));
    }
    Ok(records.iter().filter(|r| to_do(r.state)).map(|r| r.position).collect())
}

/// One job from its beginning to its place in the store; `None` if it was interrupted.
fn attempt(
    job: &Job,
    store: &Store,
    options: &Options,
    work: &(impl Fn(&Job, &mut JobLog) -> Result<Json> + Sync),
) -> Result<Option<Finished>> {
    let mut log = JobLog::open(&options.logs, job)?;
    store.start(&job.id)?;
    let begun = Instant::now();
    let result = match catch_unwind(AssertUnwindSafe(|| work(job, &mut log))) {
        Ok(Err(Error::Interrupted { .. })) => {
            store.reset(&job.id)?;
            log.close("interrupted")?;
            return Ok(None);
        }
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(error.to_string()),
        Err(panic) => Err(format!("the job panicked: {}", words(panic.as_ref()))),
    };
    let failure = result.as_ref().err().cloned();
    log.close(&failure.as_ref().map_or("done".into(), |message| format!("failed: {message}")))?;
    store.finish(&job.id, result, begun.elapsed().as_secs_f64())?;
    Ok(Some(failure))
}

/// What a panic said.
fn words(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("it said nothing")
}

fn summary(store: &Store, interrupted: bool) -> Result<Summary> {
    let failed = store.records()?.into_iter().filter(|r| r.state == State::Failed);
    let failed = failed.map(|r| (r.title, r.message.unwrap_or_default())).collect();
    Ok(Summary { counts: store.counts()?, failed, interrupted })
}
