//! `bonds.csv`: the calibrated bonds of a neighbourhood as a table, out and in.

use std::fmt::Write;
use std::path::Path;

use nalgebra::Vector3;

use crate::csv_text::in_comment;
use crate::tree::read_text;
use crate::write_atomically;
use anisobond::calibration::ModelCalibration;
use anisobond::lattice::{Bond, Neighbourhood};
use anisobond::tensor::Stiffness;
use anisobond::{Error, Result};

/// The columns of the table, in the order of [`BondTable`].
const COLUMNS: [&str; 10] = ["i", "j", "k", "xi_x", "xi_y", "xi_z", "length", "influence", "micromodulus", "k_n"];

/// The columns that tangential bonds add.
const TANGENTIAL: [&str; 2] = ["tangential_micromodulus", "k_t"];

/// What a model gives the bonds of a node, and the node itself.
#[derive(Clone, Copy, Debug)]
pub struct BondModuli<'a> {
    /// Micromodulus c, or c_n, of every bond (N/m⁶), in the neighbourhood's order.
    pub normal: &'a [f64],
    /// Tangential micromodulus c_t of every bond (N/m⁶), where the model has one.
    pub tangential: Option<&'a [f64]>,
    /// The nodal term Z (Pa), where the model has one.
    pub nodal: Option<&'a Stiffness>,
}

impl<'a> BondModuli<'a> {
    /// Normal bonds alone, of these micromoduli (N/m⁶).
    pub fn central(micromodulus: &'a [f64]) -> Self {
        BondModuli { normal: micromodulus, tangential: None, nodal: None }
    }

    /// What a calibration found.
    pub fn of(r: &'a ModelCalibration) -> Self {
        BondModuli { normal: r.normal(), tangential: r.tangential(), nodal: r.nodal() }
    }

    /// One finite number per bond in each list, or an error.
    pub(super) fn check(&self, neighbourhood: &Neighbourhood) -> Result<()> {
        check_micromodulus(neighbourhood, self.normal)?;
        self.tangential.map_or(Ok(()), |c| check_micromodulus(neighbourhood, c))
    }
}

/// The columns of `bonds.csv`; one entry per bond in each, in the neighbourhood's order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BondTable {
    /// Grid offset of the neighbour (–).
    pub offset: Vec<[i32; 3]>,
    /// Bond vector ξ (m).
    pub xi: Vec<Vector3<f64>>,
    /// |ξ| (m).
    pub length: Vec<f64>,
    /// Influence ω (–).
    pub influence: Vec<f64>,
    /// Micromodulus c (N/m⁶).
    pub micromodulus: Vec<f64>,
    /// Stiffness k_n = ω c ΔV²/|ξ| (N/m) of the spring between two nodes of volume ΔV.
    pub spring_stiffness: Vec<f64>,
    /// Tangential micromodulus c_t (N/m⁶) and stiffness k_t = ω c_t ΔV²/|ξ| (N/m), where there are any.
    pub tangential: Option<TangentialColumns>,
}

/// The columns of tangential bonds; one entry per bond in each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TangentialColumns {
    /// Micromodulus c_t (N/m⁶).
    pub micromodulus: Vec<f64>,
    /// Stiffness k_t = ω c_t ΔV²/|ξ| (N/m) of the spring across the bond between two nodes of volume ΔV.
    pub spring_stiffness: Vec<f64>,
}

impl BondTable {
    /// The table of a neighbourhood with the moduli of its bonds.
    ///
    /// # Errors
    /// Another number of micromoduli than bonds, or one that is not finite.
    pub fn new(neighbourhood: &Neighbourhood, moduli: &BondModuli) -> Result<Self> {
        moduli.check(neighbourhood)?;
        let volume = neighbourhood.spacing().powi(3);
        // k = ω c ΔV² / |ξ| (P eqs 5, 14, summed over two node volumes).
        let spring = |(bond, c): (&Bond, &f64)| bond.influence * c * volume * volume / length(neighbourhood, bond);
        let springs = |c: &[f64]| neighbourhood.bonds().iter().zip(c).map(spring).collect();
        let mut table = BondTable {
            micromodulus: moduli.normal.to_vec(),
            spring_stiffness: springs(moduli.normal),
            tangential: moduli
                .tangential
                .map(|c| TangentialColumns { micromodulus: c.to_vec(), spring_stiffness: springs(c) }),
            ..BondTable::default()
        };
        for bond in neighbourhood.bonds() {
            table.offset.push(bond.offset);
            table.xi.push(bond.xi);
            table.length.push(length(neighbourhood, bond));
            table.influence.push(bond.influence);
        }
        Ok(table)
    }

    /// Number of bonds.
    pub fn len(&self) -> usize {
        self.offset.len()
    }

    /// Whether there is no bond.
    pub fn is_empty(&self) -> bool {
        self.offset.is_empty()
    }
}

/// |ξ| (m), from the integers, so that equal lengths are equal numbers however the neighbourhood is turned.
pub(super) fn length(neighbourhood: &Neighbourhood, bond: &Bond) -> f64 {
    let squared: i64 = bond.offset.iter().map(|&x| i64::from(x) * i64::from(x)).sum();
    neighbourhood.spacing() * (squared as f64).sqrt()
}

/// One finite micromodulus (N/m⁶) per bond, or an error.
pub fn check_micromodulus(neighbourhood: &Neighbourhood, micromodulus: &[f64]) -> Result<()> {
    let bonds = neighbourhood.bonds().len();
    if micromodulus.len() != bonds {
        return Err(Error::input(
            format!("{} micromoduli for a neighbourhood of {bonds} bonds", micromodulus.len()),
            "give one micromodulus per bond, in the neighbourhood's order",
        ));
    }
    match micromodulus.iter().position(|c| !c.is_finite()) {
        Some(bond) => Err(Error::input(
            format!("the micromodulus of bond {} is {}", bond + 1, micromodulus[bond]),
            "give finite micromoduli (N/m⁶)",
        )),
        None => Ok(()),
    }
}

/// The text of `bonds.csv`. Every number reads back to the same bits.
///
/// # Errors
/// As [`BondTable::new`].
pub fn bonds_csv(neighbourhood: &Neighbourhood, moduli: &BondModuli, material: &str) -> Result<String> {
    let table = BondTable::new(neighbourhood, moduli)?;
    let comments = comments(neighbourhood, moduli, material);
    // The line of column names comes after the comments.
    let (before_names, before_numbers) = (comments.len() + 4, comments.len() + 5);
    let mut text = String::with_capacity(200 * (table.len() + before_numbers));
    for line in &comments {
        let _ = writeln!(text, "# {line}");
    }
    text.push_str("# Read: pandas.read_csv(\"bonds.csv\", comment=\"#\")\n");
    text.push_str("#       (before pandas 3, for the last bit: float_precision=\"round_trip\")\n");
    let numpy = "numpy.genfromtxt(\"bonds.csv\", delimiter=\",\", names=True, skip_header";
    let _ = writeln!(text, "#   or: {numpy}={before_names})");
    let _ = writeln!(text, "#   or: numpy.loadtxt(\"bonds.csv\", delimiter=\",\", skiprows={before_numbers})");
    let more: &[&str] = if table.tangential.is_some() { &TANGENTIAL } else { &[] };
    let _ = writeln!(text, "{}", [&COLUMNS, more].concat().join(","));
    for b in 0..table.len() {
        let ([i, j, k], xi) = (table.offset[b], table.xi[b]);
        let _ = write!(
            text,
            "{i},{j},{k},{:?},{:?},{:?},{:?},{:?},{:?},{:?}",
            xi.x, xi.y, xi.z, table.length[b], table.influence[b], table.micromodulus[b], table.spring_stiffness[b]
        );
        if let Some(t) = &table.tangential {
            let _ = write!(text, ",{:?},{:?}", t.micromodulus[b], t.spring_stiffness[b]);
        }
        text.push('\n');
    }
    Ok(text)
}

/// What the reader of the file needs to know before the first number.
fn comments(neighbourhood: &Neighbourhood, moduli: &BondModuli, material: &str) -> Vec<String> {
    let material = in_comment(material);
    let spacing = neighbourhood.spacing();
    let mut lines = vec![
        format!("Bonds of the neighbourhood of one grid node, calibrated by anisobond {}.", env!("CARGO_PKG_VERSION")),
        format!(
            "Material: {material}. Shape: {}, horizon {} spacings of {spacing:?} m, {} bonds.",
            neighbourhood.shape().name(),
            neighbourhood.horizon(),
            neighbourhood.bonds().len()
        ),
        "i, j, k        grid offset of the neighbour (before any rotation of the grid)".into(),
        "xi_x,y,z (m)   bond vector ξ from the node to the neighbour".into(),
        "length (m)     |ξ|".into(),
        "influence (–)  ω".into(),
        "micromodulus (N/m⁶)  c".into(),
        format!("k_n (N/m)      ω c ΔV²/|ξ|, spring between two nodes of volume ΔV = {:?} m³", spacing.powi(3)),
        "Force density on the node (N/m⁶): f = ω c s n; stretch s = η·n/|ξ|, n = ξ/|ξ|, η = u(x + ξ) − u(x).".into(),
        "Force between two nodes (N): f ΔV² = k_n (η·n) n. The node has ξ and −ξ; a pair of nodes has one spring."
            .into(),
    ];
    if moduli.tangential.is_some() {
        lines.push(
            "tangential_micromodulus (N/m⁶)  c_t; k_t (N/m)  ω c_t ΔV²/|ξ|, the same spring's across the bond".into(),
        );
        lines.push(
            "With rotations θ of both nodes η = u(x + ξ) − u(x) + ½ ξ×(θ(x) + θ(x + ξ)), and the force between".into(),
        );
        lines.push("two nodes is k_n (η·n) n + k_t (η − (η·n) n); its moment about each node ½ ξ × force.".into());
    }
    if let Some(z) = moduli.nodal {
        lines.push(
            "The bonds are not all: a node has the energy density ½ ε̄:Z:ε̄ of its average strain ε̄ besides,".into(),
        );
        lines.push("ε̄ = sym Σ η⊗(ω K⁻¹ξ), K = Σ ω ξ⊗ξ. Z (Pa, Voigt, order 11 22 33 23 13 12):".into());
        lines.extend(z.voigt_rows().iter().map(|row| format!("  {}", row.map(|x| format!("{x:?}")).join(" "))));
    }
    lines
}

/// Writes `bonds.csv`, whole or not at all.
///
/// # Errors
/// As [`BondTable::new`]; a file that cannot be written.
pub fn write_bonds(
    path: impl AsRef<Path>,
    neighbourhood: &Neighbourhood,
    moduli: &BondModuli,
    material: &str,
) -> Result<()> {
    write_atomically(path, bonds_csv(neighbourhood, moduli, material)?)
}

/// Reads a table as [`write_bonds`] writes it. Lines that start with `#` and empty lines are skipped; columns are found
/// by name, so their order is free and further columns are ignored. Tangential columns may be absent.
///
/// # Errors
/// A file that cannot be read; a missing column or a wrong entry, with the file's name and the line.
pub fn read_bonds(path: impl AsRef<Path>) -> Result<BondTable> {
    let path = path.as_ref();
    let text = read_text(path)?;
    parse_bonds(&text).map_err(|error| error.at(path.display()))
}

fn parse_bonds(text: &str) -> Result<BondTable> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (number, names) = lines.next().ok_or_else(|| {
        Error::input("there is no line of column names", format!("start the table with {}", COLUMNS.join(",")))
    })?;
    let names: Vec<&str> = names.split(',').map(str::trim).collect();
    let places = columns(&names).map_err(|error| error.at(format!("line {number}")))?;
    let mut table =
        BondTable { tangential: places.tangential.map(|_| TangentialColumns::default()), ..BondTable::default() };
    for (number, line) in lines {
        let entries: Vec<&str> = line.split(',').map(str::trim).collect();
        push_row(&mut table, &entries, &places, names.len()).map_err(|error| error.at(format!("line {number}")))?;
    }
    Ok(table)
}

/// Where each of [`COLUMNS`] stands in the file, and each of [`TANGENTIAL`] where they are there.
struct Places {
    all: [usize; 10],
    tangential: Option<[usize; 2]>,
}

fn columns(names: &[&str]) -> Result<Places> {
    let place = |wanted: &str| names.iter().position(|name| *name == wanted);
    let missing = |wanted: &str, columns: &[&str]| {
        Error::input(format!("there is no column \"{wanted}\""), format!("name the columns {}", columns.join(",")))
    };
    let mut all = [0; 10];
    for (found, wanted) in all.iter_mut().zip(COLUMNS) {
        *found = place(wanted).ok_or_else(|| missing(wanted, &COLUMNS))?;
    }
    let tangential = match TANGENTIAL.map(place) {
        [None, None] => None,
        [Some(c), Some(k)] => Some([c, k]),
        [c, _] => return Err(missing(TANGENTIAL[usize::from(c.is_some())], &TANGENTIAL)),
    };
    Ok(Places { all, tangential })
}

fn push_row(table: &mut BondTable, entries: &[&str], places: &Places, columns: usize) -> Result<()> {
    if entries.len() != columns {
        return Err(Error::input(
            format!("{} entries for {columns} columns", entries.len()),
            "give one entry per column, separated by commas",
        ));
    }
    let integer = |column: usize| {
        let entry = entries[places.all[column]];
        entry.parse::<i32>().map_err(|_| {
            Error::input(format!("{} = \"{entry}\" is not a grid offset", COLUMNS[column]), "give an integer")
        })
    };
    let number = |place: usize, name: &str| match entries[place].parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(Error::input(
            format!("{name} = \"{}\" is not a finite number", entries[place]),
            "give a number such as 1.5e9",
        )),
    };
    let real = |column: usize| number(places.all[column], COLUMNS[column]);
    let offset = [integer(0)?, integer(1)?, integer(2)?];
    let xi = Vector3::new(real(3)?, real(4)?, real(5)?);
    let [length, influence, micromodulus, spring_stiffness] = [real(6)?, real(7)?, real(8)?, real(9)?];
    if let (Some(t), Some([c, k])) = (&mut table.tangential, places.tangential) {
        t.micromodulus.push(number(c, TANGENTIAL[0])?);
        t.spring_stiffness.push(number(k, TANGENTIAL[1])?);
    }
    table.offset.push(offset);
    table.xi.push(xi);
    table.length.push(length);
    table.influence.push(influence);
    table.micromodulus.push(micromodulus);
    table.spring_stiffness.push(spring_stiffness);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use anisobond::lattice::Influence;
    use nalgebra::Rotation3;

    /// Numbers that test the formatting: tiny, huge, no short decimal, both zeros.
    fn awkward(bonds: usize) -> Vec<f64> {
        let special = [0.0, -0.0, 1.0 / 3.0, 5e-324, f64::MIN_POSITIVE, 1.7e300, 1e21, 0.1 + 0.2];
        (0..bonds).map(|b| if b < 8 { special[b] } else { 1e9 * (b as f64).sin().exp() }).collect()
    }

    fn bits(table: &BondTable) -> Vec<u64> {
        let xi = table.xi.iter().flat_map(|x| [x.x, x.y, x.z]);
        let none = TangentialColumns::default();
        let across = table.tangential.as_ref().unwrap_or(&none);
        let rest = [&table.length, &table.influence, &table.micromodulus, &table.spring_stiffness];
        let rest = rest.into_iter().chain([&across.micromodulus, &across.spring_stiffness]);
        xi.chain(rest.flatten().copied()).map(f64::to_bits).collect()
    }

    #[test]
    fn a_table_reads_back_to_the_same_bits() {
        let turn = Rotation3::from_euler_angles(0.3, -0.2, 1.0);
        let neighbourhood =
            Neighbourhood::sphere(3.0, 0.0013, Influence::Inverse).unwrap().rotated(turn.matrix()).unwrap();
        let c = awkward(122);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bonds.csv");
        let across: Vec<f64> = c.iter().rev().copied().collect();
        let nodal = Stiffness::isotropic(1.0 / 3.0, 1e9);
        for (tangential, nodal) in [(None, None), (Some(&across[..]), None), (None, Some(&nodal))] {
            let moduli = BondModuli { normal: &c, tangential, nodal };
            write_bonds(&path, &neighbourhood, &moduli, "KIO₃,\n# \"tricky\"").unwrap();
            let (written, read) = (BondTable::new(&neighbourhood, &moduli).unwrap(), read_bonds(&path).unwrap());
            assert_eq!(written.offset, read.offset);
            assert_eq!(bits(&written), bits(&read));
            assert_eq!(read.tangential.map(|t| t.micromodulus.len()), tangential.map(|_| 122));
        }
    }

    /// A pair of nodes pulled apart by η along the bond: the spring's force is the force density on both volumes.
    #[test]
    fn the_spring_is_the_force_density_times_both_volumes() {
        let spacing: f64 = 0.02;
        let neighbourhood = Neighbourhood::sphere(2.0, spacing, Influence::Inverse).unwrap();
        let c = vec![3e15; neighbourhood.bonds().len()];
        let table = BondTable::new(&neighbourhood, &BondModuli::central(&c)).unwrap();
        let stretch = 1e-3;
        for (b, bond) in neighbourhood.bonds().iter().enumerate() {
            let density = bond.influence * c[b] * stretch;
            let force = table.spring_stiffness[b] * stretch * bond.xi.norm();
            assert!((force - density * spacing.powi(6)).abs() <= 1e-12 * force);
            // C = (1/ΔV) Σ over bonds counted once of ℓ² k_n N = ½ Σ ω c |ξ| N ΔV.
            let share = 0.5 * table.length[b].powi(2) * table.spring_stiffness[b] / spacing.powi(3);
            assert!((share - c[b] * neighbourhood.stiffness_share(bond)).abs() <= 1e-12 * share);
        }
    }

    #[test]
    fn the_skipped_lines_are_counted_right() {
        let neighbourhood = Neighbourhood::sphere(1.0, 1.0, Influence::Constant).unwrap();
        let text = bonds_csv(&neighbourhood, &BondModuli::central(&[1.0; 6]), "rock").unwrap();
        let names = text.lines().position(|line| line.starts_with("i,j,k")).unwrap();
        assert!(text.contains(&format!("skip_header={names})")) && text.contains(&format!("skiprows={})", names + 1)));
        assert!(text.lines().take(names).all(|line| line.starts_with('#')));
        assert_eq!(text.lines().count(), names + 1 + 6);
    }

    #[test]
    fn wrong_tables_are_placed() {
        let names = COLUMNS.join(",");
        let row = "1,0,0,1.0,0.0,0.0,1.0,1.0,2.0,2.0";
        let good = format!("\u{feff}# note\r\n\r\n{names}\r\n {row}\r\n# end\r\n{row}\r\n");
        assert_eq!(parse_bonds(&good).unwrap().len(), 2);
        let swapped =
            parse_bonds("note,k_n,micromodulus,influence,length,xi_z,xi_y,xi_x,k,j,i\nx,2,3,1,1,0,0,1,0,0,1\n");
        assert_eq!(swapped.unwrap().micromodulus, [3.0]);
        for (text, place, problem) in [
            (String::new(), "", "no line of column names"),
            (format!("# a\n{}", names.replace("k_n", "kn")), "line 2", "no column \"k_n\""),
            (format!("{names}\n{row}\n# c\n1,2\n"), "line 4", "2 entries for 10 columns"),
            (format!("{names}\n{}\n", row.replacen('1', "1.5", 1)), "line 2", "i = \"1.5\""),
            (format!("{names}\n{}\n", row.replacen("2.0", "NaN", 1)), "line 2", "micromodulus = \"NaN\""),
            (format!("{names}\n{}\n", row.replacen("2.0", "2,0", 1)), "line 2", "11 entries"),
            (format!("{names},k_t\n{row},1\n"), "line 1", "no column \"tangential_micromodulus\""),
            (format!("{names},tangential_micromodulus\n{row},1\n"), "line 1", "no column \"k_t\""),
            (format!("{names},tangential_micromodulus,k_t\n{row},1,x\n"), "line 2", "k_t = \"x\""),
        ] {
            let error = parse_bonds(&text).unwrap_err().to_string();
            assert!(error.starts_with(place) && error.contains(problem), "{error}");
        }
    }

    #[test]
    fn wrong_micromoduli_and_paths_are_refused() {
        let neighbourhood = Neighbourhood::sphere(1.0, 1.0, Influence::Constant).unwrap();
        assert!(matches!(bonds_csv(&neighbourhood, &BondModuli::central(&[1.0; 5]), "x"), Err(Error::Failure { .. })));
        let holed = [1.0, 2.0, f64::NAN, 1.0, 1.0, 1.0];
        assert!(
            bonds_csv(&neighbourhood, &BondModuli::central(&holed), "x")
                .unwrap_err()
                .to_string()
                .contains("bond 3 is NaN")
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing").join("bonds.csv");
        assert!(matches!(
            write_bonds(&path, &neighbourhood, &BondModuli::central(&[1.0; 6]), "x"),
            Err(Error::File { .. })
        ));
        assert!(matches!(read_bonds(&path), Err(Error::File { action: "read", .. })));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
