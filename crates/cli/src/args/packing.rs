//! Words of `pack`, `lattice`, `element-test` and `sweep`: bonds of packings, and what they measure.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use anisobond_formats::{PackingOptions, PackingReading};

use super::{NeighbourhoodArgs, TableArgs};

/// Contact radius of bonds unless another is asked for.
pub const USUAL_CONTACT_RADIUS: f64 = 1.8;

/// What a file of spheres leaves open.
#[derive(Args)]
pub struct SphereFileArgs {
    /// Unit of lengths of a packing's file that names none, as mm [default: m, asked back from radii of half a metre on]
    #[arg(long, value_name = "UNIT", requires = "packing")]
    pub length_unit: Option<String>,
    /// Time step of a LAMMPS dump [default: the last]
    #[arg(long, value_name = "STEP", requires = "packing")]
    pub frame: Option<u64>,
    /// Radii of the types 1, 2, … of a LAMMPS file without radii, as '1 mm,2 mm'
    #[arg(long, value_name = "R,R,…", requires = "packing")]
    pub type_radii: Option<String>,
}

impl SphereFileArgs {
    /// The packing of a file, and what it was taken for; notes go to the standard error.
    ///
    /// # Errors
    /// As [`anisobond_formats::read_packing_as`].
    pub fn read(&self, path: &std::path::Path) -> anisobond::Result<PackingReading> {
        let mut options =
            PackingOptions { length_unit: self.length_unit.clone(), frame: self.frame, ..PackingOptions::default() };
        if let Some(radii) = &self.type_radii {
            options = options.with_type_radii(radii).map_err(|e| e.at("--type-radii"))?;
        }
        let reading = anisobond_formats::read_packing_as(path, &options)?;
        reading.notes.iter().for_each(|note| eprintln!("note: {}: {note}", path.display()));
        Ok(reading)
    }
}

/// Make a packing of spheres, or read one; say how dense it is, and write it
#[derive(Args)]
#[command(mut_arg("length_unit", |a| a.visible_alias("unit")), after_help = "\
Examples:
  anisobond pack --number 2500 --radius '30 mm' --porosity 0.5 -o sample.txt
  anisobond pack --number 5000 --radius '1 mm' --fuzz 0.3 --coordination 22 --contact-radius 1.8 --seed 7 -o a.csv
  anisobond pack --crystal fcc --cells 4,4,4 --radius '1 mm' -o fcc.data
  anisobond pack sample.txt --contact-radius 1.8                # statistics of a packing
  anisobond pack sample.txt -o sample.vtp                       # another format: .txt .csv .vtp .data
  anisobond pack dump.lammpstrj --frame 5000 --unit mm -o a.csv # one time step of a LAMMPS dump

Exit codes: 0 done, 2 bad input, 3 the target porosity or coordination was not reached.")]
pub struct Pack {
    /// Packing to read, instead of making one: a list or table of x y z r, LAMMPS dump or data, VTK; known by content
    #[arg(conflicts_with_all = ["number", "cell", "crystal"])]
    pub packing: Option<PathBuf>,
    #[command(flatten)]
    pub file: SphereFileArgs,
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
    /// Contact radius I_R at which contacts are counted [default: 1, spheres that touch; and the bonds at 1.8 beside, which is
    /// what `lattice` and `element-test` take]
    #[arg(long, allow_negative_numbers = true)]
    pub contact_radius: Option<f64>,
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
    #[command(flatten)]
    pub table: TableArgs,
    /// Contact radius I_R: bonds where |x₁ − x₂| ≤ I_R (r₁ + r₂)
    #[arg(long, default_value_t = USUAL_CONTACT_RADIUS, allow_negative_numbers = true)]
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
    /// Periodic packing: a list or table of x y z r, LAMMPS dump or data, VTK; known by content
    pub packing: PathBuf,
    #[command(flatten)]
    pub file: SphereFileArgs,
    /// Built-in name or material file; transversely isotropic, unless another model or --correct general is asked for
    pub material: String,
    #[command(flatten)]
    pub bonds: BondArgs,
    /// Folder for bonds (CSV), report and pictures
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Replace other results in the folder: they are removed first
    #[arg(long, requires = "output")]
    pub force: bool,
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
    mut_arg("length_unit", |a| a.conflicts_with("grid")),
    mut_arg("frame", |a| a.conflicts_with("grid")),
    mut_arg("type_radii", |a| a.conflicts_with("grid")),
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
    /// Periodic packing: a list or table of x y z r, LAMMPS dump or data, VTK; known by content; not with --grid
    #[arg(conflicts_with = "grid", required_unless_present = "grid")]
    pub packing: Option<PathBuf>,
    #[command(flatten)]
    pub file: SphereFileArgs,
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
    /// Replace other results in the folder: they are removed first
    #[arg(long, requires = "output")]
    pub force: bool,
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

/// Run an element test for every job of a parameter table, over the cores, and keep the results as they come
#[derive(Args)]
#[command(after_help = "\
A table is TOML (lists and ranges, every combination), CSV, XLS or XLSX (`=` repeats the cell above), with the parameters
packing, length_unit, frame, type_radii, contact_radius, material or c11 c33 c13 c12, axis or strike and dip, rotations,
method, strain, model, correct.

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
    /// Replace the results in the folder, of this sweep or others: they are removed first
    #[arg(long, conflicts_with_all = ["shard", "merge", "slurm"])]
    pub force: bool,
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
