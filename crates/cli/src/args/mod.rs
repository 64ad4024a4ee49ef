//! Flags and their help; what they mean is in the library.

mod case;
mod grid;
mod packing;
mod results;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

pub use case::*;
pub use grid::*;
pub use packing::*;
pub use results::*;

/// From an elastic stiffness tensor to the bonds of a discrete model.
#[derive(Parser)]
#[command(name = "anisobond", version, max_term_width = 110, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
    /// Threads to use [default: one per core]
    #[arg(long, global = true, value_name = "N")]
    pub threads: Option<usize>,
}

#[derive(Subcommand)]
pub enum Command {
    Tensor(Tensor),
    Calibrate(Calibrate),
    Advise(Advise),
    Rank(Rank),
    Pack(Pack),
    Lattice(Lattice),
    ElementTest(ElementTest),
    Sweep(Sweep),
    Run(Run),
    Check(CheckCase),
    New(New),
    Export(Export),
    Report(Report),
    Studio(Studio),
    Verify(Verify),
    Materials(Materials),
    Completions(Completions),
}

/// Recompute the printed values of a document and compare
#[derive(Args)]
#[command(after_help = "\
Exit codes: 0 every value of ours is the corrected reference, 1 one is not, 2 unknown suite.")]
pub struct Verify {
    /// Suite: prakash (the peridynamics document), smilauer (the cross-anisotropy document), cavity (its last section, run
    /// on a grid and on a packing) [default: all but cavity]
    pub suite: Option<String>,
    /// The cross-anisotropy document's packing of 2556 spheres
    #[arg(long, value_name = "FILE")]
    pub packing: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// Print only what the document has wrong and what deviates
    #[arg(long)]
    pub brief: bool,
}

/// List the built-in materials
#[derive(Args)]
pub struct Materials {
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}

/// Print a completion script for a shell
#[derive(Args)]
#[command(after_help = "Example:\n  anisobond completions bash > /etc/bash_completion.d/anisobond")]
pub struct Completions {
    pub shell: clap_complete::Shell,
}
