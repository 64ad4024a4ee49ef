//! What a run asks of the simulation that it runs, whatever the lattice.

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::summary::RunSummary;
use anisobond::Result;
use anisobond::experiment::{Ledger, Outcome, OutputPlan, Probe, SavedState, Slice, StepLook};
use anisobond_plot::SliceImage;

/// Makes the bytes of a frame's VTK file; on another thread, for compression takes its time.
pub(super) type FrameWork = Box<dyn FnOnce() -> Result<Vec<u8>> + Send>;

/// A file that ends a run: its name and its bytes.
pub(super) type LastFile = (&'static str, Vec<u8>);

/// A simulation as its run sees it: steps, numbers and fields. Grids and packings are two of them.
pub(super) trait Subject {
    /// What a saved state says beside its arrays.
    type Facts: Serialize + DeserializeOwned;

    /// Ending of the names of the frames' VTK files.
    const FRAME: &'static str;

    /// Name of the case.
    fn name(&self) -> &str;
    /// What is written, and how often.
    fn output(&self) -> &OutputPlan;
    /// Do one time step or one load step, which is seen while it goes on.
    fn advance(&mut self, look: StepLook) -> Result<()>;
    /// How the run ended, or that nothing has ended it before its last step.
    fn outcome(&self) -> &Outcome;
    /// Of a body that broke: from its last equilibrium to its last state, for its fields.
    fn show_broken(&mut self);
    /// Steps done.
    fn step(&self) -> u64;
    /// Steps in all.
    fn steps(&self) -> u64;
    /// Time (s) in motion, load factor (–) in equilibrium.
    fn time(&self) -> f64;
    /// Whether it moves.
    fn is_motion(&self) -> bool;
    /// Bonds at the start, each pair once.
    fn bonds(&self) -> u64;
    /// Energies.
    fn ledger(&self) -> &Ledger;
    /// What a user should know.
    fn warnings(&self) -> &[String];
    /// Probes of the case.
    fn probes(&self) -> &[Probe];
    /// The columns of a probe.
    fn measure(&self, probe: &Probe) -> Vec<f64>;
    /// Names of the columns that it has besides energies and probes.
    fn own_columns(&self) -> Vec<&'static str>;
    /// Their values.
    fn own_row(&self) -> Vec<f64>;
    /// Everything that is needed to go on.
    fn save(&self) -> SavedState<Self::Facts>;
    /// Go on from a saved state.
    fn restore(&mut self, state: SavedState<Self::Facts>) -> Result<()>;
    /// The present state as a VTK file.
    fn frame(&self) -> FrameWork;
    /// A slice of the present state.
    fn slice(&self, slice: &Slice) -> SliceImage;
    /// Files of its own that end a run whose files are in a folder.
    fn last_files(&self, folder: &Path) -> Result<Vec<LastFile>>;
    /// What the run came to.
    fn summary(&self, seconds: f64, warnings: Vec<String>) -> RunSummary;
}

/// A time or load factor as people read it.
pub(super) fn time_text(time: f64, motion: bool) -> String {
    if !motion {
        return format!("load factor {time:.3}");
    }
    let (scale, unit) = match time {
        t if t < 1e-6 => (1e9, "ns"),
        t if t < 1e-3 => (1e6, "µs"),
        t if t < 1.0 => (1e3, "ms"),
        _ => (1.0, "s"),
    };
    format!("t = {:.3} {unit}", time * scale)
}
