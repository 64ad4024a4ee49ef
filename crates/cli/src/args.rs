//! Flags and their help; what they mean is in the library.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

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
    Verify(Verify),
    Materials(Materials),
    Completions(Completions),
}

/// Say everything of a stiffness tensor that needs no lattice: definiteness, moduli, extremes, waves, symmetry class,
/// and what central bonds can reach of it
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond tensor KIO3
  anisobond tensor rock.toml --json
  anisobond tensor Si --density '2330 kg/m3' --direction 1,1,1
  anisobond tensor crystals.csv --row mp-149 --tolerance 0.01")]
pub struct Tensor {
    /// Built-in name (see `anisobond materials`) or the path of a material file
    pub material: String,
    #[command(flatten)]
    pub table: TableArgs,
    /// Largest relative distance at which a symmetry counts as present
    #[arg(long, default_value_t = anisobond::tensor::SYMMETRY_TOLERANCE, allow_negative_numbers = true)]
    pub tolerance: f64,
    /// Density, as '2650 kg/m3' (over the file's own)
    #[arg(long, allow_hyphen_values = true)]
    pub density: Option<String>,
    /// Also give Young's modulus, compressibility and waves along x,y,z (repeatable)
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub direction: Vec<String>,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}

/// Calibrate the bonds of a regular grid to a stiffness tensor: least-norm non-negative micromoduli, with the evidence
/// of how good they are and, where they are not, why
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond calibrate KIO3
  anisobond calibrate rock.toml --horizon 3 --spacing '2 mm' -o rock
  anisobond calibrate Te2W --shape ellipsoid --semi-axes 4,5,6 --influence constant --json
  anisobond calibrate Pyroceram --influence constant --lower-bound max
  anisobond calibrate crystals.csv --horizon 3 -o crystals     # a table: interrupted, it goes on where it was
  anisobond calibrate crystals.csv --jsonl > crystals.jsonl

Exit codes: 0 done, 2 bad input, 3 --require-exact asked and not reached, 130 interrupted.")]
pub struct Calibrate {
    /// Built-in name, material file (TOML, JSON) or table of materials (CSV, JSON list, JSON Lines)
    #[arg(value_name = "MATERIAL|TABLE")]
    pub material: String,
    #[command(flatten)]
    pub table: TableArgs,
    #[command(flatten)]
    pub neighbourhood: NeighbourhoodArgs,
    /// Least micromodulus of every bond (N/m⁶), or `max` for the largest that is feasible
    #[arg(long, default_value = "0", value_name = "X|max", allow_hyphen_values = true)]
    pub lower_bound: String,
    /// Exit with code 3 unless the bonds reach the target to this relative error
    #[arg(long, value_name = "ERROR", num_args = 0..=1, default_missing_value = "1e-9", require_equals = true)]
    pub require_exact: Option<f64>,
    /// Folder for the results: bonds, report, VTK file and pictures; of a table, one CSV
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Normal x,y,z of a cut in the picture (repeatable) [default: 0,-1,0 and 0,0,1]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub cut: Vec<String>,
    /// Print one JSON document
    #[arg(long, conflicts_with = "jsonl")]
    pub json: bool,
    /// Print one JSON line per row of a table, in its order
    #[arg(long)]
    pub jsonl: bool,
}

/// How rows of a table are read.
#[derive(Args)]
pub struct TableArgs {
    /// Row of a table, by identifier
    #[arg(long, value_name = "ID")]
    pub row: Option<String>,
    /// Unit of a table that names none [default: GPa]
    #[arg(long)]
    pub unit: Option<String>,
}

/// Which grid points are bonded, and how much each bond counts.
#[derive(Args)]
#[command(next_help_heading = "Neighbourhood")]
pub struct NeighbourhoodArgs {
    /// Horizon δ in grid spacings, or a length as '6 mm' [default: 6, or the longest semi-axis]
    #[arg(long, allow_hyphen_values = true)]
    pub horizon: Option<String>,
    /// Shape
    #[arg(long, value_enum, default_value_t = ShapeName::Sphere)]
    pub shape: ShapeName,
    /// Semi-axes a,b,c of a cuboid or an ellipsoid, in grid spacings [default: 4δ/6, 5δ/6, δ]
    #[arg(long, value_name = "A,B,C", allow_hyphen_values = true)]
    pub semi_axes: Option<String>,
    /// Influence function: constant, inverse (δ/r), hat (1 − r/δ), power (1 − (r/δ)^1.5), or a CSV file of r/δ, ω
    #[arg(long, default_value = "inverse", value_name = "NAME|FILE")]
    pub influence: String,
    /// Grid spacing Δ in m, or a length as '2 mm'
    #[arg(long, default_value = "1", allow_hyphen_values = true)]
    pub spacing: String,
    /// Turn or mirror the neighbourhood: axis:0,0,1,60 · bunge:10,20,30 · xyz:30,30,30 · mirror:1,0,0 · … (degrees;
    /// repeatable, applied in order)
    #[arg(long, value_name = "FORM:NUMBERS")]
    pub rotate: Vec<String>,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum ShapeName {
    Sphere,
    Cube,
    Cuboid,
    Ellipsoid,
}

/// Recompute the printed values of a document and compare
#[derive(Args)]
#[command(after_help = "\
Exit codes: 0 every value of ours is the corrected reference, 1 one is not, 2 unknown suite.")]
pub struct Verify {
    /// Suite: prakash (the peridynamics document) [default: all]
    pub suite: Option<String>,
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
