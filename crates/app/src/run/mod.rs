//! A run from its statement to its files: probes, frames, checkpoints, summary; interrupted, it goes on where it was.

mod frames;
mod grid;
mod packing;
mod subject;
mod summary;

use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use self::frames::Frames;
use self::subject::Subject;
pub use self::summary::{PackingSummary, RunSummary};
use crate::{CaseFile, FolderLock, LatticeKind, refuse_other_kind, remove_results};
use anisobond::experiment::{
    Ledger, Outcome, PackingProblem, PackingSimulation, Problem, SavedState, Simulation, StepLook, WithinStep,
};
use anisobond::{Error, Result, Wording};
use anisobond_formats::inputs::recorded;
use anisobond_formats::json::non_finite;
use anisobond_formats::results::{Checkpoint, Checkpoints, ProbeTable};
use anisobond_formats::{Inputs, json_file, write_atomically};

/// Time between two words on a load step that goes on.
const PACE: Duration = Duration::from_millis(100);

/// What the user wants of a run.
pub struct RunOptions<'a> {
    /// Folder for the results.
    pub folder: &'a Path,
    /// Go on with the run that the folder's checkpoint is of.
    pub resume: bool,
    /// Remove whatever results the folder holds, and start anew.
    pub force: bool,
    /// Set to stop: motion after the time step that is being computed, equilibrium within its load step, which is then begun anew.
    pub stop: &'a AtomicBool,
}

/// What a run is of.
struct Stated<'a> {
    /// What its case is made of, as far as it is read: a checkpoint is only gone on with by the case that it is of.
    inputs: &'a Inputs,
    /// What the case says.
    asked: Option<&'a serde_json::Value>,
    /// What is to be said of it whatever happens.
    notes: Vec<String>,
}

/// How far a run is.
#[derive(Clone, Copy, Debug, Default)]
pub struct RunProgress {
    /// Steps done, and steps in all.
    pub steps: [u64; 2],
    /// Time (s) or load factor (–).
    pub time: f64,
    /// Steps per second of this session.
    pub steps_per_second: f64,
    /// Bonds updated per second, each pair counted once.
    pub bonds_per_second: f64,
    /// Broken bonds so far.
    pub broken: u64,
    /// Of a load step under way, how far it is.
    pub within: Option<WithinStep>,
}

impl RunProgress {
    /// In a few words.
    pub fn words(&self) -> String {
        let broken = |n: u64| if n > 0 { format!(", {n} bonds broken") } else { String::new() };
        match self.within {
            None => {
                let (steps, bonds) = (self.steps_per_second, self.bonds_per_second);
                format!("{steps:.1} steps/s, {bonds:.2e} bonds/s{}", broken(self.broken))
            }
            Some(step) => format!(
                "equilibrium {}, iteration {}, residual {:.1e}{}",
                step.equilibria + 1,
                step.iterations,
                step.residual,
                broken(self.broken + step.broken)
            ),
        }
    }
}

/// What a checkpoint says of the run beside the arrays of its state.
#[derive(Serialize, Deserialize)]
struct About<F> {
    inputs: Inputs,
    probe_bytes: u64,
    /// Checksum of these bytes.
    probe_sum: String,
    frame_times: Vec<f64>,
    simulation: F,
    seconds: f64,
    /// Steps done, and steps in all.
    #[serde(default)]
    steps: Option<[u64; 2]>,
}

/// The file that says what a run was asked to do: its case, as JSON.
pub(super) const CASE: &str = "case.json";
/// Energies and probes.
const PROBES: &str = "probes.csv";
/// What a finished run came to.
const SUMMARY: &str = "summary.json";

/// Steps done and steps in all of the run whose checkpoint is in a folder; `None` without a checkpoint that says so.
pub(super) fn stopped_at(folder: &Path) -> Option<[u64; 2]> {
    let checkpoints = Checkpoints::in_folder(folder);
    let state = checkpoints.exist().then(|| checkpoints.load().ok()).flatten()?.0;
    serde_json::from_str::<About<serde_json::Value>>(&state.about).ok()?.steps
}

/// Runs a case on its lattice to the end, or until it is stopped. Its folder also has what the case says (`case.json`). The
/// case is known by what it and its files say: with other contents it is another, whatever their names.
///
/// # Errors
/// As [`run_problem`] and [`CaseFile::problem`].
pub fn run_case(case: &CaseFile, options: &RunOptions, progress: impl FnMut(&RunProgress)) -> Result<RunSummary> {
    let stated = Stated { inputs: case.inputs(), asked: Some(case.asked()), notes: case.notes() };
    match case.lattice() {
        LatticeKind::Grid => run(|look| Simulation::new_seen(case.problem()?, look), options, &stated, progress),
        LatticeKind::Packing => {
            run(|look| PackingSimulation::new_seen(case.packing_problem()?, look), options, &stated, progress)
        }
    }
}

/// Runs a problem on a grid to its end, or until it is stopped; `inputs` are what the problem was made of, by which its
/// checkpoints are known.
///
/// # Errors
/// A problem that cannot be run; files that cannot be written; a folder with results, in use by another program, or with a
/// checkpoint of another case; numbers that are none in flight; interruption, with the checkpoint to go on from.
pub fn run_problem(
    problem: Problem,
    inputs: &Inputs,
    options: &RunOptions,
    progress: impl FnMut(&RunProgress),
) -> Result<RunSummary> {
    run(
        |look| Simulation::new_seen(problem, look),
        options,
        &Stated { inputs, asked: None, notes: Vec::new() },
        progress,
    )
}

/// Runs a problem on a packing, as [`run_problem`] does on a grid.
///
/// # Errors
/// As [`run_problem`].
pub fn run_packing_problem(
    problem: PackingProblem,
    inputs: &Inputs,
    options: &RunOptions,
    progress: impl FnMut(&RunProgress),
) -> Result<RunSummary> {
    run(
        |look| PackingSimulation::new_seen(problem, look),
        options,
        &Stated { inputs, asked: None, notes: Vec::new() },
        progress,
    )
}

fn run<S: Subject>(
    prepare: impl FnOnce(StepLook) -> Result<S>,
    options: &RunOptions,
    stated: &Stated,
    mut progress: impl FnMut(&RunProgress),
) -> Result<RunSummary> {
    let _lock = FolderLock::alone(options.folder)?;
    let mut run = {
        let seen = Seen::new(&mut progress, RunProgress::default(), options.stop);
        Run::begin(|| prepare(&|within| seen.look(within)), options, stated)?
    };
    run.warnings.splice(0..0, stated.notes.iter().cloned());
    let (started, first_step) = (Instant::now(), run.simulation.step());
    let mut saved = Instant::now();
    while !run.finished() {
        let seen = Seen::new(&mut progress, run.progress(0.0), options.stop);
        match run.simulation.advance(&|within| seen.look(within)) {
            Err(Error::Interrupted { .. }) => return Err(run.interrupted()?),
            Err(error) => return Err(run.failed(error)),
            Ok(()) => {}
        }
        if *run.simulation.outcome() != Outcome::Completed {
            run.show_broken()?;
            break;
        }
        run.record()?;
        let seconds = started.elapsed().as_secs_f64();
        progress(&run.progress((run.simulation.step() - first_step) as f64 / seconds.max(1e-9)));
        let stop = options.stop.load(Ordering::Relaxed) && !run.finished();
        if stop {
            return Err(run.interrupted()?);
        }
        if saved.elapsed().as_secs_f64() > run.simulation.output().checkpoint_every {
            run.checkpoint()?;
            saved = Instant::now();
        }
    }
    run.finish()
}

/// Shows an equilibrium that is looked for, and ends it.
struct Seen<'a, P> {
    progress: RefCell<&'a mut P>,
    now: RunProgress,
    told: Cell<Instant>,
    stop: &'a AtomicBool,
}

impl<'a, P: FnMut(&RunProgress)> Seen<'a, P> {
    fn new(progress: &'a mut P, now: RunProgress, stop: &'a AtomicBool) -> Self {
        Seen { progress: RefCell::new(progress), now, told: Cell::new(Instant::now()), stop }
    }

    fn look(&self, within: &WithinStep) -> bool {
        if self.told.get().elapsed() > PACE {
            self.told.set(Instant::now());
            (self.progress.borrow_mut())(&RunProgress { within: Some(*within), ..self.now });
        }
        !self.stop.load(Ordering::Relaxed)
    }
}

/// A run under way.
struct Run<S> {
    simulation: S,
    folder: PathBuf,
    inputs: Inputs,
    checkpoints: Checkpoints,
    probes: ProbeTable,
    frames: Frames,
    started: Instant,
    seconds_before: f64,
    warnings: Vec<String>,
}

impl<S: Subject> Run<S> {
    fn begin(prepare: impl FnOnce() -> Result<S>, options: &RunOptions, stated: &Stated) -> Result<Self> {
        let folder = options.folder;
        if options.force {
            remove_results(folder)?;
        }
        refuse_other_kind(folder, "a run")?;
        let checkpoints = Checkpoints::in_folder(folder);
        if options.resume && checkpoints.exist() {
            let saved = checkpoints.load()?;
            let (simulation, inputs) = prepared(prepare, stated)?;
            return Run::resume(simulation, inputs, saved, options);
        }
        refuse_begun(options, &checkpoints, stated)?;
        let (simulation, inputs) = prepared(prepare, stated)?;
        if let Some(asked) = stated.asked {
            write_atomically(folder.join(CASE), json_file(asked)?)?;
        }
        let mut run = Run {
            folder: folder.to_path_buf(),
            inputs,
            checkpoints,
            probes: ProbeTable::create(folder.join(PROBES), &columns(&simulation))?,
            frames: Frames::new(folder, S::FRAME, &[])?,
            started: Instant::now(),
            seconds_before: 0.0,
            warnings: simulation.warnings().to_vec(),
            simulation,
        };
        run.probes.row(&row(&run.simulation))?;
        if run.writes_frames() {
            run.frames.write(&run.simulation)?;
        }
        Ok(run)
    }

    fn resume(
        mut simulation: S,
        inputs: Inputs,
        (kept, damaged): (Checkpoint, Option<String>),
        options: &RunOptions,
    ) -> Result<Self> {
        let about: About<S::Facts> = serde_json::from_str(&kept.about)
            .map_err(|e| Error::input(format!("the checkpoint cannot be read: {e}"), "start anew in another folder"))?;
        if let Some(changed) = inputs.changed_since(&about.inputs) {
            return Err(Error::input(
                format!(
                    "the checkpoint in {} is of another case, or of one since changed: {changed}",
                    options.folder.display()
                ),
                Wording::from("resume with the case as it was, or start anew in another folder or with ")
                    .choice("force", ""),
            ));
        }
        simulation.restore(SavedState { facts: about.simulation, numbers: kept.numbers, words: kept.words })?;
        let mut warnings = simulation.warnings().to_vec();
        warnings.extend(damaged.map(|why| format!("the newest checkpoint was damaged, the one before is used: {why}")));
        Ok(Run {
            folder: options.folder.to_path_buf(),
            inputs,
            checkpoints: Checkpoints::in_folder(options.folder),
            probes: ProbeTable::resume(options.folder.join(PROBES), about.probe_bytes, &about.probe_sum)?,
            frames: Frames::new(options.folder, S::FRAME, &about.frame_times)?,
            started: Instant::now(),
            seconds_before: about.seconds,
            warnings,
            simulation,
        })
    }

    fn finished(&self) -> bool {
        self.simulation.step() >= self.simulation.steps()
    }

    /// Probes and frames of the present step, where they are due.
    fn record(&mut self) -> Result<()> {
        let (step, steps) = (self.simulation.step(), self.simulation.steps());
        let every = self.simulation.output().probe_every as u64;
        if step.is_multiple_of(every.max(1)) || step == steps {
            self.probes.row(&row(&self.simulation))?;
        }
        let frames = self.simulation.output().frames as u64;
        let due = |step: u64| (u128::from(step) * u128::from(frames) / u128::from(steps.max(1))) as u64;
        if self.writes_frames() && due(step) > due(step - 1) {
            self.frames.write(&self.simulation)?;
        }
        Ok(())
    }

    /// The last equilibrium of a body that broke as a frame, unless it is one, and then its last state.
    fn show_broken(&mut self) -> Result<()> {
        let shown = self.frames.times().last() == Some(&self.simulation.time());
        if self.writes_frames() && !shown {
            self.frames.write(&self.simulation)?;
        }
        self.simulation.show_broken();
        if self.writes_frames() {
            self.frames.write(&self.simulation)?;
        }
        Ok(())
    }

    /// How far the run is, at a rate of steps (1/s).
    fn progress(&self, rate: f64) -> RunProgress {
        RunProgress {
            steps: [self.simulation.step(), self.simulation.steps()],
            time: self.simulation.time(),
            steps_per_second: rate,
            bonds_per_second: rate * self.simulation.bonds() as f64,
            broken: self.simulation.ledger().broken_bonds,
            within: None,
        }
    }

    fn writes_frames(&self) -> bool {
        let output = self.simulation.output();
        output.frames > 0 && !(output.fields.is_empty() && output.slices.is_empty())
    }

    fn checkpoint(&mut self) -> Result<()> {
        self.frames.drain()?;
        let SavedState { facts, numbers, words } = self.simulation.save();
        let about = About {
            inputs: self.inputs.clone(),
            probe_bytes: self.probes.flush()?,
            probe_sum: self.probes.checksum(),
            frame_times: self.frames.times(),
            simulation: facts,
            seconds: self.seconds(),
            steps: Some([self.simulation.step(), self.simulation.steps()]),
        };
        let about = serde_json::to_string(&about).map_err(|e| Error::file("write", &self.folder, e.into()))?;
        self.checkpoints.save(&Checkpoint { about, numbers, words })
    }

    fn seconds(&self) -> f64 {
        self.seconds_before + self.started.elapsed().as_secs_f64()
    }

    /// A failure in flight, with what is kept. What an equilibrium that is not found comes after is kept too.
    fn failed(&mut self, mut error: Error) -> Error {
        if !self.simulation.is_motion() && self.simulation.step() > 0 && self.checkpoint().is_err() {
            return error;
        }
        let place = format!("{}, step {}", self.simulation.name(), self.simulation.step());
        if let Error::Failure { remedy, .. } = &mut error
            && self.checkpoints.exist()
        {
            let kept = format!("; the last good checkpoint is kept in {}", self.folder.display());
            *remedy = std::mem::take(remedy).words(kept);
        }
        error.at(place)
    }

    /// The error of a run that was stopped, its last whole step kept.
    fn interrupted(&mut self) -> Result<Error> {
        self.checkpoint()?;
        let (step, steps) = (self.simulation.step(), self.simulation.steps());
        let folder = self.folder.display();
        let message =
            Wording::from(format!("step {step} of {steps} is done and kept in {folder}; the same again with "))
                .choice("resume", "")
                .words(" goes on");
        Ok(Error::Interrupted { message })
    }

    fn finish(mut self) -> Result<RunSummary> {
        self.probes.flush()?;
        let seconds = self.seconds();
        let mut summary = self.simulation.summary(seconds, self.warnings);
        // A run of hours is not lost for one number; that it has none is said.
        if let Some(place) = non_finite(&summary) {
            summary.warnings.push(format!("the summary has a number that is not finite, null in its file: {place}"));
        }
        self.frames.finish(&self.simulation)?;
        for (name, bytes) in self.simulation.last_files(&self.folder)? {
            write_atomically(self.folder.join(name), bytes)?;
        }
        let json = serde_json::to_string_pretty(&summary).map_err(|e| Error::file("write", &self.folder, e.into()))?;
        write_atomically(self.folder.join(SUMMARY), json + "\n")?;
        self.checkpoints.remove();
        Ok(summary)
    }
}

/// The simulation, and all that it was made of: the case, and the files that were read for it just now.
fn prepared<S>(prepare: impl FnOnce() -> Result<S>, stated: &Stated) -> Result<(S, Inputs)> {
    let (simulation, read) = recorded(prepare);
    Ok((simulation?, stated.inputs.clone().with(&read)))
}

/// Refuses a folder that has a run already. One that was killed before its first checkpoint is begun anew by `resume`, if it
/// is of the same case.
fn refuse_begun(options: &RunOptions, checkpoints: &Checkpoints, stated: &Stated) -> Result<()> {
    let folder = options.folder;
    let has = |what: &str| format!("{} already has results of a run, {what}", folder.display());
    // The summary is written when a run ends, before its checkpoints are removed.
    if folder.join(SUMMARY).exists() && !checkpoints.exist() {
        return Err(Error::input(
            has("and it is finished"),
            Wording::from("give another folder for a new one, or ").choice("force", "").words(" to replace it"),
        ));
    }
    if checkpoints.exist() {
        return Err(Error::input(
            has("which is not finished"),
            Wording::from("go on with ").choice("resume", "").words(", or give another folder"),
        ));
    }
    let asked_there = std::fs::read(folder.join(CASE)).ok();
    let same = match (&asked_there, stated.asked) {
        (Some(there), Some(asked)) => *there == json_file(asked)?,
        _ => false,
    };
    if options.resume && same {
        return Ok(());
    }
    if folder.join(PROBES).exists() {
        return Err(Error::input(
            has("which ended before its first checkpoint"),
            Wording::from("start it anew with ")
                .choice("resume", "")
                .words(" if the case is the same, or with ")
                .choice("force", "")
                .words(", or give another folder"),
        ));
    }
    if options.resume {
        return Err(Error::input(
            format!("{} has no checkpoint to resume from", folder.display()),
            Wording::from("leave ").choice("resume", "").words(" out, to start anew"),
        ));
    }
    Ok(())
}

/// Name of the column of time.
fn time_column(motion: bool) -> &'static str {
    if motion { "time_s" } else { "load_factor" }
}

/// Names of the columns of the probes.
fn columns(simulation: &impl Subject) -> Vec<String> {
    let mut columns = vec![time_column(simulation.is_motion()).to_string()];
    columns.extend(Ledger::COLUMNS.map(String::from));
    columns.extend(simulation.own_columns().into_iter().map(String::from));
    for probe in simulation.probes() {
        columns.extend(probe.quantity.columns().iter().map(|c| format!("{}_{c}", probe.name)));
    }
    columns
}

/// A row of the probes.
fn row(simulation: &impl Subject) -> Vec<f64> {
    let mut row = vec![simulation.time()];
    row.extend(simulation.ledger().row());
    row.extend(simulation.own_row());
    simulation.probes().iter().for_each(|probe| row.extend(simulation.measure(probe)));
    row
}
