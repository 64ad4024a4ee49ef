//! Sweeps: a table of parameters, one job per row, results in one file.
//!
//! [`ParameterTable`] (what to compute) → [`run_sweep`] (over the cores) → [`Store`] (one SQLite file, every finished
//! job committed at once) → CSV. A sweep that is too large for one machine is split by [`Shard`] and merged again.

mod bounded;
mod chart;
mod combinations;
mod compound;
mod job;
mod log;
mod merge;
mod record;
mod run;
mod sheet;
mod slurm;
mod store;
mod table;

pub use chart::sweep_chart;
pub use job::{Job, Value};
pub use log::JobLog;
pub use merge::merge;
pub use record::{Counts, Record, State};
pub use run::{Options, Progress, Summary, run_sweep};
pub use slurm::{SlurmScript, slurm_script};
pub use store::{Shard, Store};
pub use table::ParameterTable;
