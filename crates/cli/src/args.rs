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
    Advise(Advise),
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
/// of how good they are and, where they are not, why; and whether the grid's waves are stable
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond calibrate KIO3
  anisobond calibrate rock.toml --horizon 3 --spacing '2 mm' -o rock
  anisobond calibrate Te2W --shape ellipsoid --semi-axes 4,5,6 --influence constant --json
  anisobond calibrate Pyroceram --influence constant --lower-bound max
  anisobond calibrate Te2W --model hybrid --horizon 3 -o te2w  # exact and stable: bonds and a nodal term
  anisobond calibrate Si --model micropolar --promise free-rotations
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
    /// What the grid is made of; `anisobond advise` says which one a material needs
    #[arg(long, value_enum, default_value_t = ModelName::Central)]
    pub model: ModelName,
    /// How hybrid shares the tensor between bonds and nodal term [default: remainder where its waves are stable, else
    /// stable]
    #[arg(long, value_enum)]
    pub form: Option<FormName>,
    /// Which tensor micropolar bonds bring onto the target: their sum, or what free node rotations leave of it
    /// [default: sum]
    #[arg(long, value_enum)]
    pub promise: Option<PromiseName>,
    /// Least micromodulus of every bond (N/m⁶), or `max` for the largest that is feasible; central only [default: 0]
    #[arg(long, value_name = "X|max", allow_hyphen_values = true)]
    pub lower_bound: Option<String>,
    /// Exit with code 3 unless the model promises the target to this relative error
    #[arg(long, value_name = "ERROR", num_args = 0..=1, default_missing_value = "1e-9", require_equals = true)]
    pub require_exact: Option<f64>,
    /// Folder for the results: bonds, report, VTK file and pictures; of a table, one CSV
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Also write DIR/report.html, one page of all of it (see `anisobond report`)
    #[arg(long, requires = "output")]
    pub report: bool,
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

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ModelName {
    /// Normal bonds: Cauchy-symmetric tensors
    Central,
    /// Normal and tangential bonds, node rotations free
    Micropolar,
    /// Normal bonds and a nodal term: every positive definite tensor
    Hybrid,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum FormName {
    /// The central bonds; the nodal term is what they leave
    Remainder,
    /// A positive nodal term of least trace, bonds above a positive floor
    Stable,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum PromiseName {
    /// The sum over bonds at uniform strain without node rotations
    Sum,
    /// What an element test of the perfect grid measures
    FreeRotations,
}

/// Say which model a stiffness tensor needs: what each reaches, how stable it is and what it costs
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond advise KIO3
  anisobond advise rock.toml --json
  anisobond advise crystals.csv --row mp-149")]
pub struct Advise {
    /// Built-in name or the path of a material file
    pub material: String,
    #[command(flatten)]
    pub table: TableArgs,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
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

/// Make a packing of spheres, or read one; say how dense it is, and write it
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond pack --number 2500 --radius '30 mm' --porosity 0.5 -o sample.txt
  anisobond pack --number 5000 --radius '1 mm' --fuzz 0.3 --coordination 22 --contact-radius 1.8 --seed 7 -o a.csv
  anisobond pack --crystal fcc --cells 4,4,4 --radius '1 mm' -o fcc.data
  anisobond pack sample.txt --contact-radius 1.8                # statistics of a packing
  anisobond pack sample.txt -o sample.vtp                       # another format: .txt .csv .vtp .data

Exit codes: 0 done, 2 bad input, 3 the target porosity or coordination was not reached.")]
pub struct Pack {
    /// Packing to read, instead of making one
    #[arg(conflicts_with_all = ["number", "cell", "crystal"])]
    pub packing: Option<PathBuf>,
    /// Number of spheres of a random packing
    #[arg(long, conflicts_with_all = ["cell", "crystal"])]
    pub number: Option<usize>,
    /// Edges a,b,c of the periodic cell of a random packing (m, or with units)
    #[arg(long, value_name = "A,B,C", conflicts_with = "crystal")]
    pub cell: Option<String>,
    /// A crystal of touching spheres
    #[arg(long, value_enum)]
    pub crystal: Option<CrystalName>,
    /// Unit cells of the crystal along x,y,z
    #[arg(long, value_name = "I,J,K", default_value = "4,4,4")]
    pub cells: String,
    /// Random displacement of a crystal's spheres, in radii
    #[arg(long, default_value_t = 0.0)]
    pub perturb: f64,
    /// Radius (m, or with a unit); mean with --fuzz, median with --deviation
    #[arg(long, default_value = "1 mm", allow_hyphen_values = true)]
    pub radius: String,
    /// Radii evenly within radius·(1 ± fuzz)
    #[arg(long, conflicts_with_all = ["deviation", "radii"])]
    pub fuzz: Option<f64>,
    /// Log-normal radii: standard deviation of ln r, clipped at a third and at three times the median
    #[arg(long, conflicts_with = "radii")]
    pub deviation: Option<f64>,
    /// CSV file of radius (m), fraction by number
    #[arg(long, value_name = "FILE")]
    pub radii: Option<PathBuf>,
    /// Share of the volume that is empty [default: 0.45]
    #[arg(long, conflicts_with = "coordination")]
    pub porosity: Option<f64>,
    /// Mean number of contacts per sphere at the contact radius
    #[arg(long)]
    pub coordination: Option<f64>,
    /// Contact radius I_R at which contacts are counted
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    pub contact_radius: f64,
    /// Packings of equal seeds are equal
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// File to write; its ending says the format (.txt, .csv, .vtp, .data)
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum CrystalName {
    Sc,
    Bcc,
    Fcc,
    Hcp,
}

/// How a packing's bonds are made.
#[derive(Args)]
pub struct BondArgs {
    /// Contact radius I_R: bonds where |x₁ − x₂| ≤ I_R (r₁ + r₂)
    #[arg(long, default_value_t = 1.8, allow_negative_numbers = true)]
    pub contact_radius: f64,
    /// Turn the material until its anisotropy axis lies along x,y,z, or strike-dip:α,β in degrees
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub axis: Option<String>,
    /// central: normal bonds; micropolar: normal and tangential bonds, nodes that rotate; hybrid: normal bonds and a
    /// nodal term [default: micropolar on packings, central on grids]
    #[arg(long, value_enum)]
    pub model: Option<LatticeModelName>,
    /// Correct the bonds by their own element test until the measured tensor is the target: the four elliptic moduli, or
    /// everything the model controls, for any positive definite tensor [default: general]
    #[arg(long, value_enum, value_name = "FORM", num_args = 0..=1, default_missing_value = "general")]
    pub correct: Option<CorrectName>,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum LatticeModelName {
    Central,
    Micropolar,
    Hybrid,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum CorrectName {
    General,
    Elliptic,
}

/// Assign orientation-dependent stiffnesses to the bonds of a packing, and sum them up
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond lattice sample.txt cases/materials/rock.toml --contact-radius 1.8
  anisobond lattice sample.txt rock.toml --axis strike-dip:270,25 -o lattice   # bonds, VTK, pictures
  anisobond lattice sample.txt rock.toml --contact-radius 1.4 --correct -o lattice
  anisobond lattice sample.txt Si --model hybrid --correct --json")]
pub struct Lattice {
    /// Periodic packing (.txt, .csv, .vtp, .data)
    pub packing: PathBuf,
    /// Built-in name or material file; transversely isotropic, unless another model or --correct general is asked for
    pub material: String,
    #[command(flatten)]
    pub bonds: BondArgs,
    /// Folder for bonds (CSV), report and pictures
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Also write DIR/report.html, one page of all of it (see `anisobond report`)
    #[arg(long, requires = "output")]
    pub report: bool,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}

/// Measure the stiffness of a packing's lattice, or of a cell of a grid, by element tests
#[derive(Args)]
#[command(
    allow_missing_positional = true,
    mut_arg("contact_radius", |a| a.conflicts_with("grid")),
    mut_arg("axis", |a| a.conflicts_with("grid")),
    mut_arg("horizon", |a| a.conflicts_with("packing")),
    mut_arg("shape", |a| a.conflicts_with("packing")),
    mut_arg("semi_axes", |a| a.conflicts_with("packing")),
    mut_arg("influence", |a| a.conflicts_with("packing")),
    mut_arg("spacing", |a| a.conflicts_with("packing")),
    mut_arg("rotate", |a| a.conflicts_with("packing")),
    after_help = "\
Examples:
  anisobond element-test sample.txt cases/materials/rock.toml --contact-radius 1.8
  anisobond element-test sample.txt rock.toml --rotations blocked --json
  anisobond element-test sample.txt rock.toml -o tested      # report and directional stiffness as pictures
  anisobond element-test sample.txt Te2W --model hybrid --correct
  anisobond element-test KIO3 --grid 6 --horizon 3 --model micropolar
  anisobond element-test KIO3 --grid 8,8,6 --horizon 3 --missing 0.1 --displaced 0.2 --void 2 --seed 7 -o cell"
)]
pub struct ElementTest {
    /// Periodic packing (.txt, .csv, .vtp, .data); not with --grid
    #[arg(conflicts_with = "grid", required_unless_present = "grid")]
    pub packing: Option<PathBuf>,
    /// Built-in name or material file
    pub material: String,
    #[command(flatten)]
    pub bonds: BondArgs,
    #[command(flatten)]
    pub grid: GridArgs,
    /// Whether nodes rotate so that their moments balance
    #[arg(long, value_enum, default_value_t = RotationsName::Free)]
    pub rotations: RotationsName,
    /// static: small strain, periodic homogenisation; dynamic: the document's servo-controlled test at finite strain
    #[arg(long, value_enum, default_value_t = MethodName::Static)]
    pub method: MethodName,
    /// Logarithmic strain of the dynamic test
    #[arg(long, default_value_t = -0.01, allow_negative_numbers = true)]
    pub strain: f64,
    /// Folder for report, pictures and bonds (CSV)
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Also write DIR/report.html, one page of all of it (see `anisobond report`)
    #[arg(long, requires = "output")]
    pub report: bool,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub neighbourhood: NeighbourhoodArgs,
}

/// A periodic cell of a grid, perfect or with defects.
#[derive(Args)]
#[command(next_help_heading = "Grid cell")]
pub struct GridArgs {
    /// Test a cell of N×N×N or N₁×N₂×N₃ nodes instead of a packing
    #[arg(long, value_name = "N[,N,N]")]
    pub grid: Option<String>,
    /// Share of the nodes that is missing, chosen by --seed
    #[arg(long, value_name = "SHARE", conflicts_with = "packing", allow_negative_numbers = true)]
    pub missing: Option<f64>,
    /// Largest displacement of a node along each axis, in grid spacings
    #[arg(long, value_name = "SPACINGS", conflicts_with = "packing", allow_negative_numbers = true)]
    pub displaced: Option<f64>,
    /// Spherical void: its radius in grid spacings around the cell's middle, or x,y,z,radius in places along the grid's
    /// axes (repeatable)
    #[arg(long, value_name = "R|X,Y,Z,R", conflicts_with = "packing", allow_hyphen_values = true)]
    pub void: Vec<String>,
    /// Cells of equal seeds are equal
    #[arg(long, conflicts_with = "packing")]
    pub seed: Option<u64>,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum RotationsName {
    Free,
    Blocked,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum MethodName {
    Static,
    Dynamic,
}

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

/// Run an element test for every job of a parameter table, over the cores, and keep the results as they come
#[derive(Args)]
#[command(after_help = "\
A table is TOML (lists and ranges, every combination), CSV, XLS or XLSX (`=` repeats the cell above), with the parameters
packing, contact_radius, material or c11 c33 c13 c12, axis or strike and dip, rotations, method, strain, model, correct.

Examples:
  anisobond sweep cases/contact-radius.toml -o radius      # results.sqlite, results.csv, stiffness.svg/png, logs
  anisobond sweep cases/contact-radius.toml -o radius      # again: goes on where it was stopped
  anisobond sweep table.xlsx -o out --retry                # failed jobs too
  anisobond sweep table.toml -o out --shard 0/4            # a quarter of the jobs; then --merge 4
  anisobond sweep table.toml -o out --slurm 16 > job.sh    # a Slurm array of 16 shards")]
pub struct Sweep {
    /// Parameter table (.toml, .csv, .tsv, .xls, .xlsx, .ods)
    pub table: PathBuf,
    /// Folder for the store, its CSV, logs and charts
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Also write DIR/report.html, one page of all of it (see `anisobond report`)
    #[arg(long, conflicts_with_all = ["shard", "slurm"])]
    pub report: bool,
    /// Try failed jobs again
    #[arg(long)]
    pub retry: bool,
    /// Run every n-th job from the i-th only (i from 0), into a store of its own
    #[arg(long, value_name = "I/N")]
    pub shard: Option<String>,
    /// Merge the stores of N shards
    #[arg(long, value_name = "N", conflicts_with = "shard")]
    pub merge: Option<usize>,
    /// Print a Slurm script that runs N shards
    #[arg(long, value_name = "N", conflicts_with_all = ["shard", "merge"])]
    pub slurm: Option<usize>,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}

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
    /// Go on from the last checkpoint in the folder
    #[arg(long)]
    pub resume: bool,
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
