//! Two columns of numbers: a user's influence function, or a distribution of radii.

use std::path::Path;

use crate::tree::read_text;
use anisobond::lattice::Influence;
use anisobond::{Error, Result};

/// Read an influence function, a table of (r/δ, ω); see [`read_pairs`]. Between its points the function is linear.
///
/// # Errors
/// As [`read_pairs`], or what [`Influence::table`] refuses.
pub fn read_influence(path: impl AsRef<Path>) -> Result<Influence> {
    let path = path.as_ref();
    let points = read_pairs(path, "r/δ and ω, as 0.5, 1.25")?;
    Influence::table(points).map_err(|e| e.at(path.display()))
}

/// An influence function by its name, or from a CSV file ([`read_influence`]).
///
/// # Errors
/// Neither a name nor a file; what the reader refuses.
pub fn find_influence(name_or_path: &str) -> Result<Influence> {
    Ok(match name_or_path {
        "constant" => Influence::Constant,
        "inverse" => Influence::Inverse,
        "hat" => Influence::Hat,
        "power" => Influence::Power,
        file if Path::new(file).is_file() => read_influence(file)?,
        other => {
            return Err(Error::input(
                format!("{other} is neither an influence function nor a file"),
                "use constant, inverse, hat, power, or a CSV file of r/δ, ω",
            ));
        }
    })
}

/// Read pairs of numbers, one pair a line, separated by a comma, semicolon, tab or spaces. Lines that begin with `#` and
/// one heading line are left out. `what` names a pair for messages.
///
/// # Errors
/// A file that cannot be read, or a line that is not two numbers.
pub fn read_pairs(path: impl AsRef<Path>, what: &str) -> Result<Vec<(f64, f64)>> {
    let path = path.as_ref();
    let mut points = Vec::new();
    for (number, line) in read_text(path)?.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let fields: Vec<&str> = line.split([',', ';', '\t', ' ']).filter(|f| !f.is_empty()).collect();
        let numbers: Vec<f64> = fields.iter().filter_map(|f| f.parse().ok()).collect();
        match numbers[..] {
            [x, y] if fields.len() == 2 => points.push((x, y)),
            [] if points.is_empty() => {}
            _ => {
                let place = format!("{}, line {}", path.display(), number + 1);
                return Err(Error::input(format!("{line:?} is not two numbers"), format!("write {what}")).at(place));
            }
        }
    }
    Ok(points)
}
