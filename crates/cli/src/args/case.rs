//! Words of `run`, `check` and `new case`: bodies.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// A case file, and values of it replaced.
#[derive(Args)]
pub struct CaseArgs {
    /// Case file (TOML; docs/cases.md)
    pub case: PathBuf,
    /// Replace or add a value of the file: grid.spacing='0.5 mm', condition.0.pressure='2 MPa' (repeatable)
    #[arg(long, value_name = "KEY=VALUE", allow_hyphen_values = true)]
    pub set: Vec<String>,
}

/// Run a case: bodies in motion or in equilibrium, with fracture
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond run cases/wave.toml -o wave
  anisobond run cases/glass-branching.toml --set grid.spacing='0.5 mm' -o fine
  anisobond run cases/glass-branching.toml -o glass --resume      # after Ctrl-C, or after a crash

Exit codes: 0 done, 2 bad input, 130 interrupted (a checkpoint is kept).")]
pub struct Run {
    #[command(flatten)]
    pub case: CaseArgs,
    /// Folder for the results [default: the case's name]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Also write DIR/report.html, one page of all of it (see `anisobond report`)
    #[arg(long)]
    pub report: bool,
    /// Go on from the last checkpoint in the folder, with the same case
    #[arg(long)]
    pub resume: bool,
    /// Replace the results in the folder, finished or not: they are removed first
    #[arg(long, conflicts_with = "resume")]
    pub force: bool,
    /// Print the summary as one JSON document
    #[arg(long)]
    pub json: bool,
}

/// Say what a case would take, without running it: nodes, bonds, memory, regions, conditions with their forces
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond check cases/glass-branching.toml
  anisobond check cases/glass-branching.toml --set grid.spacing='0.5 mm' --json")]
pub struct CheckCase {
    #[command(flatten)]
    pub case: CaseArgs,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}

/// Write a starter
#[derive(Args)]
pub struct New {
    #[command(subcommand)]
    pub what: NewWhat,
}

#[derive(Subcommand)]
pub enum NewWhat {
    /// Write a commented case that runs as it is: NAME.toml
    Case {
        /// Name of the case; a path with folders is one, too
        name: PathBuf,
    },
}
