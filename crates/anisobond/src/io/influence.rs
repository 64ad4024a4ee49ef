//! A user's influence function: a CSV file of r/δ, ω.

use std::path::Path;

use super::tree::read_text;
use crate::lattice::Influence;
use crate::{Error, Result};

/// Read a table of (r/δ, ω), one pair a line, separated by a comma, semicolon, tab or spaces. Lines that begin with `#`
/// and one heading line are left out. Between its points the function is linear.
///
/// # Errors
/// A file that cannot be read, a line that is not two numbers, or what [`Influence::table`] refuses.
pub fn read_influence(path: impl AsRef<Path>) -> Result<Influence> {
    let path = path.as_ref();
    let place = path.display().to_string();
    let mut points = Vec::new();
    for (number, line) in read_text(path)?.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let fields: Vec<&str> = line.split([',', ';', '\t', ' ']).filter(|f| !f.is_empty()).collect();
        let numbers: Vec<f64> = fields.iter().filter_map(|f| f.parse().ok()).collect();
        match numbers[..] {
            [r, w] if fields.len() == 2 => points.push((r, w)),
            [] if points.is_empty() => {}
            _ => {
                let problem = format!("{line:?} is not two numbers");
                return Err(
                    Error::input(problem, "write r/δ and ω, as 0.5, 1.25").at(format!("{place}, line {}", number + 1))
                );
            }
        }
    }
    Influence::table(points).map_err(|e| e.at(place))
}
