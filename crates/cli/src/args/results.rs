//! Words of `export`, `report` and `studio`: what becomes of results.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// Write calibrated bonds for an engine, with an input that performs the engine's own element test
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond calibrate KIO3 --horizon 3 -o kio3 && anisobond export kio3 --to lammps
  cd kio3/lammps && lmp -in in.element_test      # measured.csv is expected.csv
  anisobond lattice sample.txt rock.toml --model central -o lattice && anisobond export lattice --to calculix
  anisobond export kio3 --to numpy --nodes 10,10,12 -o arrays
  anisobond calibrate Pyroceram --horizon 4 -o glass && anisobond export glass --to peridigm --within 0.02")]
pub struct Export {
    /// Folder that `anisobond calibrate -o` or `anisobond lattice -o` wrote
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Engine or format
    #[arg(long, value_enum, value_name = "ENGINE")]
    pub to: EngineName,
    /// Nodes of a grid's periodic block along each axis [default: the fewest that bonds do not meet themselves in, and one]
    #[arg(long, value_name = "N[,N,N]")]
    pub nodes: Option<String>,
    /// Peridigm and PeriLab: how far the tensor of their one micromodulus may be from the calibrated one, as a share
    #[arg(long, value_name = "SHARE", default_value_t = 1e-6)]
    pub within: f64,
    /// Folder for the files [default: DIR/ENGINE]
    #[arg(short, long, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Replace other results in the folder: they are removed first
    #[arg(long)]
    pub force: bool,
}

/// Write one self-contained HTML page of a folder of results: tables, evidence, pictures to turn
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond calibrate KIO3 -o kio3 && anisobond report kio3     # kio3/report.html; needs no network
  anisobond run cases/wave.toml -o wave && anisobond report wave -o wave.html")]
pub struct Report {
    /// Folder that calibrate, lattice, element-test, sweep or run wrote
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// File to write [default: DIR/report.html]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// Open a form in the browser: type a tensor, see calibration, evidence and picture change, take the bonds away
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond studio --open
  anisobond studio -o mine          # with a button that saves everything below the folder

Only this computer can reach it. Ctrl-C ends it.")]
pub struct Studio {
    /// Port on 127.0.0.1 [default: one that is free]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub port: Option<u16>,
    /// Start a browser with it
    #[arg(long)]
    pub open: bool,
    /// Folder below which its button saves; without, nothing is written
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum EngineName {
    /// Data file of harmonic bonds, and input
    Lammps,
    /// Truss elements
    Abaqus,
    /// Springs
    Calculix,
    /// Spheres, bonds and a script
    Yade,
    /// Spheres, bonds and a script
    Woo,
    /// Decks of one micromodulus, where that comes --within
    Peridigm,
    /// Decks of one micromodulus, where that comes --within
    #[value(name = "perilab")]
    PeriLab,
    /// The linear system of the element test, and Python that solves it
    MatrixMarket,
    /// Arrays of nodes and bonds
    Numpy,
}
