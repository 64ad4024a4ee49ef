//! Words of `tensor`, `calibrate` and `advise`: tensors, and bonds of grids.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// Say everything of a stiffness tensor that needs no lattice: definiteness, moduli, extremes, waves, symmetry class,
/// and what central bonds can reach of it
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond tensor KIO3
  anisobond tensor rock.toml --json
  anisobond tensor Si --density '2330 kg/m3' --direction 1,1,1
  anisobond tensor crystals.csv --row mp-149 --tolerance 0.01
  anisobond tensor OUTCAR --json
  anisobond tensor matrix.txt --unit GPa
  anisobond tensor crystals.csv --json                         # a table: a report for every row

Exit codes: 0 done, 2 bad input, 5 rows of a table failed and the others are done.")]
pub struct Tensor {
    /// Built-in name (see `anisobond materials`) or the path of a file: a material file, a table, or what another program
    /// wrote (VASP, LAMMPS, Abaqus, pymatgen, a 6×6 matrix as text, …)
    pub material: String,
    #[command(flatten)]
    pub table: TableArgs,
    /// Largest relative distance at which a symmetry counts as present [default: what the noise that the tensor shows
    /// suggests, 0.005 at the least]
    #[arg(long, allow_negative_numbers = true)]
    pub tolerance: Option<f64>,
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
  anisobond calibrate Te2W --metric energy                     # strains' energies off by 8 %, not by 17 %
  anisobond calibrate Te2W --model hybrid --horizon 3 -o te2w  # exact and stable: bonds and a nodal term
  anisobond calibrate Si --model micropolar --promise free-rotations
  anisobond calibrate crystals.csv --horizon 3 -o crystals     # a table: interrupted, it goes on where it was
  anisobond calibrate crystals.csv --jsonl > crystals.jsonl

Exit codes: 0 done, 2 bad input, 3 --require-exact asked and not reached, 4 a calibration did not converge, 5 rows of a table
failed and the others are done (3 before 5 before 4), 130 interrupted.")]
pub struct Calibrate {
    /// Built-in name, file of a material (TOML, JSON, what another program wrote) or table of materials (CSV, JSON)
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
    /// In which sense central bonds come closest to a tensor that they do not reach: the norm over all components, or the energy
    /// of strains, which sees soft directions as well as stiff ones; central only [default: norm]
    #[arg(long, value_enum)]
    pub metric: Option<MetricName>,
    /// Prove the stability of every row of a table over the whole Brillouin zone, as that of a single material is;
    /// without it rows whose bonds' signs are not proof enough say `sampled` (model hybrid proves where it chooses its form)
    #[arg(long)]
    pub prove: bool,
    /// Exit with code 3 unless the model promises the target to this relative error
    #[arg(long, value_name = "ERROR", num_args = 0..=1, default_missing_value = "1e-9", require_equals = true)]
    pub require_exact: Option<f64>,
    /// Folder for the results: bonds, report, VTK file and pictures; of a table, one CSV
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Replace other results in the folder: they are removed first
    #[arg(long, requires = "output")]
    pub force: bool,
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

/// Say which materials of a table which model carries, and by what error in the norm and in energy: sorted, filtered, as a page
/// with histograms and figures
#[derive(Args)]
#[command(after_help = "\
Examples:
  anisobond rank crystals.csv --horizon 3
  anisobond rank crystals.csv -o ranked                        # ranked/rank.html, rank.csv, rank.json
  anisobond rank crystals.csv --model central --metric energy --sort -central.largest_energy_error
  anisobond rank crystals.csv --where 'central.relative_error<5%' --where 'carried_by!=central' --csv

Columns are those of --csv: id, material, carried_by, cauchy_gap, universal_anisotropy, poisson, norm, density,
central.relative_error, central.largest_energy_error, central.reaches_model_limit, micropolar.relative_error, …

Exit codes: 0 done, 2 bad input, 5 rows of the table failed, the others are ranked.")]
pub struct Rank {
    /// Table of materials (CSV, JSON)
    #[arg(value_name = "TABLE")]
    pub table: String,
    /// Unit of numbers for which the table names none [default: GPa]
    #[arg(long)]
    pub unit: Option<String>,
    #[command(flatten)]
    pub neighbourhood: NeighbourhoodArgs,
    /// Rank by these bonds: central, micropolar (repeatable) [default: both]; hybrid bonds carry what these do not
    #[arg(long, value_enum)]
    pub model: Vec<ModelName>,
    /// In which sense central bonds come closest [default: norm]
    #[arg(long, value_enum)]
    pub metric: Option<MetricName>,
    /// A model carries a material of which it misses the energy of no strain by more than this share
    #[arg(long, value_name = "SHARE", default_value_t = anisobond::tensor::NOTICEABLE_MISS)]
    pub within: f64,
    /// Column to sort by, with - before it from large to small [default: the first model's largest_energy_error]
    #[arg(long, value_name = "COLUMN", allow_hyphen_values = true)]
    pub sort: Option<String>,
    /// Show only rows of which this holds, as 'central.relative_error<5%' or 'material~Si' (repeatable; < <= > >= = != ~)
    #[arg(long = "where", visible_alias = "filter", value_name = "CONDITION")]
    pub filter: Vec<String>,
    /// Folder for rank.html, rank.csv and rank.json
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Replace other results in the folder: they are removed first
    #[arg(long, requires = "output")]
    pub force: bool,
    /// Print one JSON document
    #[arg(long, conflicts_with = "csv")]
    pub json: bool,
    /// Print a table
    #[arg(long)]
    pub csv: bool,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum FormName {
    /// The central bonds; the nodal term is what they leave
    Remainder,
    /// A positive nodal term of least trace, bonds above a positive floor
    Stable,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum MetricName {
    /// ‖R − C‖
    Norm,
    /// ‖C^(−½)(R − C)C^(−½)‖
    Energy,
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
  anisobond advise crystals.csv --row mp-149
  anisobond advise crystals.csv                                # a table: what the tensors alone say

Exit codes: 0 done, 2 bad input, 5 rows of a table failed and the others are done.")]
pub struct Advise {
    /// Built-in name or the path of a file, as of `anisobond tensor`
    pub material: String,
    #[command(flatten)]
    pub table: TableArgs,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}

/// How the file of a material or of a table is read.
#[derive(Args)]
pub struct TableArgs {
    /// Row of a table, by identifier; ID#2 is the second of several, line:3 that of a line
    #[arg(long, value_name = "ID")]
    pub row: Option<String>,
    /// Unit of numbers for which the file names none, as GPa or kbar [default: GPa in tables, none else]
    #[arg(long)]
    pub unit: Option<String>,
}

impl TableArgs {
    /// The material of a built-in name or of a file, and what the file was taken for.
    ///
    /// # Errors
    /// As [`anisobond_formats::find_reading`].
    pub fn find(&self, material: &str) -> anisobond::Result<anisobond_formats::Reading> {
        anisobond_formats::find_reading(material, self.row.as_deref(), self.unit.as_deref())
    }
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
    /// Turn or mirror the neighbourhood (repeatable, applied in order; angles in degrees or with a unit; turns are right-handed,
    /// counter-clockwise seen from the axis' tip): axis:x,y,z,angle · bunge:φ1,Φ,φ2, about z, the turned x, the turned z ·
    /// xyz:a,b,c, about x, the turned y, the turned z · strike-dip:strike,dip, clockwise from north (y) and down to the right ·
    /// xz:x1,x2,x3,z1,z2,z3, where x and z point · matrix:9 numbers by rows · mirror:x,y,z, the plane's normal ·
    /// prakash:a,b,c, as xyz with y the other way
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
