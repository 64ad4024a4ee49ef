//! `bonds.csv`: the calibrated bonds of a neighbourhood as a table, out and in.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use nalgebra::Vector3;

use super::write_atomically;
use crate::lattice::{Bond, Neighbourhood};
use crate::{Error, Result};

/// The columns of the table, in the order of [`BondTable`].
const COLUMNS: [&str; 10] = ["i", "j", "k", "xi_x", "xi_y", "xi_z", "length", "influence", "micromodulus", "k_n"];

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
}

impl BondTable {
    /// The table of a neighbourhood with one micromodulus (N/m⁶) per bond.
    ///
    /// # Errors
    /// Another number of micromoduli than bonds, or one that is not finite.
    pub fn new(neighbourhood: &Neighbourhood, micromodulus: &[f64]) -> Result<Self> {
        check_micromodulus(neighbourhood, micromodulus)?;
        let volume = neighbourhood.spacing().powi(3);
        let mut table = BondTable::default();
        for (bond, &c) in neighbourhood.bonds().iter().zip(micromodulus) {
            let length = length(neighbourhood, bond);
            table.offset.push(bond.offset);
            table.xi.push(bond.xi);
            table.length.push(length);
            table.influence.push(bond.influence);
            table.micromodulus.push(c);
            // k_n = ω c ΔV² / |ξ| (P eqs 5, 14, summed over two node volumes).
            table.spring_stiffness.push(bond.influence * c * volume * volume / length);
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
pub(super) fn check_micromodulus(neighbourhood: &Neighbourhood, micromodulus: &[f64]) -> Result<()> {
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
pub fn bonds_csv(neighbourhood: &Neighbourhood, micromodulus: &[f64], material: &str) -> Result<String> {
    let table = BondTable::new(neighbourhood, micromodulus)?;
    let comments = comments(neighbourhood, material);
    // The line of column names comes after the comments.
    let (before_names, before_numbers) = (comments.len() + 4, comments.len() + 5);
    let mut text = String::with_capacity(160 * (table.len() + before_numbers));
    for line in &comments {
        let _ = writeln!(text, "# {line}");
    }
    text.push_str("# Read: pandas.read_csv(\"bonds.csv\", comment=\"#\")\n");
    text.push_str("#       (before pandas 3, for the last bit: float_precision=\"round_trip\")\n");
    let numpy = "numpy.genfromtxt(\"bonds.csv\", delimiter=\",\", names=True, skip_header";
    let _ = writeln!(text, "#   or: {numpy}={before_names})");
    let _ = writeln!(text, "#   or: numpy.loadtxt(\"bonds.csv\", delimiter=\",\", skiprows={before_numbers})");
    let _ = writeln!(text, "{}", COLUMNS.join(","));
    for b in 0..table.len() {
        let ([i, j, k], xi) = (table.offset[b], table.xi[b]);
        let _ = writeln!(
            text,
            "{i},{j},{k},{:?},{:?},{:?},{:?},{:?},{:?},{:?}",
            xi.x, xi.y, xi.z, table.length[b], table.influence[b], table.micromodulus[b], table.spring_stiffness[b]
        );
    }
    Ok(text)
}

/// What the reader of the file needs to know before the first number.
fn comments(neighbourhood: &Neighbourhood, material: &str) -> Vec<String> {
    let material = material.replace(char::is_control, " ");
    let spacing = neighbourhood.spacing();
    vec![
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
    ]
}

/// Writes `bonds.csv`, whole or not at all.
///
/// # Errors
/// As [`BondTable::new`]; a file that cannot be written.
pub fn write_bonds(
    path: impl AsRef<Path>,
    neighbourhood: &Neighbourhood,
    micromodulus: &[f64],
    material: &str,
) -> Result<()> {
    write_atomically(path, bonds_csv(neighbourhood, micromodulus, material)?)
}

/// Reads a table as [`write_bonds`] writes it. Lines that start with `#` and empty lines are skipped; columns are found
/// by name, so their order is free and further columns are ignored.
///
/// # Errors
/// A file that cannot be read; a missing column or a wrong entry, with the file's name and the line.
pub fn read_bonds(path: impl AsRef<Path>) -> Result<BondTable> {
    let path = path.as_ref();
    let text = fs::read_to_string(path).map_err(|source| Error::file("read", path, source))?;
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
    let mut table = BondTable::default();
    for (number, line) in lines {
        let entries: Vec<&str> = line.split(',').map(str::trim).collect();
        push_row(&mut table, &entries, &places, names.len()).map_err(|error| error.at(format!("line {number}")))?;
    }
    Ok(table)
}

/// Where each of [`COLUMNS`] stands in the file.
fn columns(names: &[&str]) -> Result<[usize; 10]> {
    let mut places = [0; 10];
    for (place, wanted) in places.iter_mut().zip(COLUMNS) {
        *place = names.iter().position(|name| *name == wanted).ok_or_else(|| {
            Error::input(format!("there is no column \"{wanted}\""), format!("name the columns {}", COLUMNS.join(",")))
        })?;
    }
    Ok(places)
}

fn push_row(table: &mut BondTable, entries: &[&str], places: &[usize; 10], columns: usize) -> Result<()> {
    if entries.len() != columns {
        return Err(Error::input(
            format!("{} entries for {columns} columns", entries.len()),
            "give one entry per column, separated by commas",
        ));
    }
    let integer = |column: usize| {
        let entry = entries[places[column]];
        entry.parse::<i32>().map_err(|_| {
            Error::input(format!("{} = \"{entry}\" is not a grid offset", COLUMNS[column]), "give an integer")
        })
    };
    let real = |column: usize| {
        let entry = entries[places[column]];
        match entry.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(Error::input(
                format!("{} = \"{entry}\" is not a finite number", COLUMNS[column]),
                "give a number such as 1.5e9",
            )),
        }
    };
    let offset = [integer(0)?, integer(1)?, integer(2)?];
    let xi = Vector3::new(real(3)?, real(4)?, real(5)?);
    let [length, influence, micromodulus, spring_stiffness] = [real(6)?, real(7)?, real(8)?, real(9)?];
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
    use crate::lattice::Influence;
    use nalgebra::Rotation3;

    /// Numbers that test the formatting: tiny, huge, no short decimal, both zeros.
    fn awkward(bonds: usize) -> Vec<f64> {
        let special = [0.0, -0.0, 1.0 / 3.0, 5e-324, f64::MIN_POSITIVE, 1.7e300, 1e21, 0.1 + 0.2];
        (0..bonds).map(|b| if b < 8 { special[b] } else { 1e9 * (b as f64).sin().exp() }).collect()
    }

    fn bits(table: &BondTable) -> Vec<u64> {
        let xi = table.xi.iter().flat_map(|x| [x.x, x.y, x.z]);
        let rest = [&table.length, &table.influence, &table.micromodulus, &table.spring_stiffness];
        xi.chain(rest.into_iter().flatten().copied()).map(f64::to_bits).collect()
    }

    #[test]
    fn a_table_reads_back_to_the_same_bits() {
        let turn = Rotation3::from_euler_angles(0.3, -0.2, 1.0);
        let neighbourhood =
            Neighbourhood::sphere(3.0, 0.0013, Influence::Inverse).unwrap().rotated(turn.matrix()).unwrap();
        let c = awkward(122);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bonds.csv");
        write_bonds(&path, &neighbourhood, &c, "KIO₃,\n# \"tricky\"").unwrap();
        let (written, read) = (BondTable::new(&neighbourhood, &c).unwrap(), read_bonds(&path).unwrap());
        assert_eq!(written.offset, read.offset);
        assert_eq!(bits(&written), bits(&read));
    }

    /// A pair of nodes pulled apart by η along the bond: the spring's force is the force density on both volumes.
    #[test]
    fn the_spring_is_the_force_density_times_both_volumes() {
        let spacing: f64 = 0.02;
        let neighbourhood = Neighbourhood::sphere(2.0, spacing, Influence::Inverse).unwrap();
        let c = vec![3e15; neighbourhood.bonds().len()];
        let table = BondTable::new(&neighbourhood, &c).unwrap();
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
        let text = bonds_csv(&neighbourhood, &[1.0; 6], "rock").unwrap();
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
        ] {
            let error = parse_bonds(&text).unwrap_err().to_string();
            assert!(error.starts_with(place) && error.contains(problem), "{error}");
        }
    }

    #[test]
    fn wrong_micromoduli_and_paths_are_refused() {
        let neighbourhood = Neighbourhood::sphere(1.0, 1.0, Influence::Constant).unwrap();
        assert!(matches!(bonds_csv(&neighbourhood, &[1.0; 5], "x"), Err(Error::Input { .. })));
        let holed = [1.0, 2.0, f64::NAN, 1.0, 1.0, 1.0];
        assert!(bonds_csv(&neighbourhood, &holed, "x").unwrap_err().to_string().contains("bond 3 is NaN"));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing").join("bonds.csv");
        assert!(matches!(write_bonds(&path, &neighbourhood, &[1.0; 6], "x"), Err(Error::File { .. })));
        assert!(matches!(read_bonds(&path), Err(Error::File { action: "read", .. })));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
