//! What columns of spheres are taken for, by their headings.

use super::PackingColumn;
use crate::units::Dimension;
use crate::words::{enumeration, nearest, quoted};
use anisobond::{Error, Result};

/// What a column is taken for that is not needed.
pub(super) const NOTHING: &str = "nothing";

/// Headings of a coordinate, after its letter or the number of its component, in small letters without marks.
const OF_LETTER: [&str; 8] = ["", "pos", "position", "coord", "coordinate", "centre", "center", "c"];
const OF_NUMBER: [&str; 8] =
    ["points", "point", "position", "positions", "coordinates", "coords", "centers", "centres"];

/// Headings of sizes.
const RADIUS: [&str; 4] = ["r", "rad", "radius", "radii"];
const DIAMETER: [&str; 7] = ["d", "dia", "diam", "diameter", "diameters", "size", "particlesize"];

/// What a column may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Of a centre, along the axis 0, 1 or 2.
    Centre(usize),
    Radius,
    Diameter,
}

impl Role {
    fn words(self) -> &'static str {
        match self {
            Role::Centre(axis) => ["x", "y", "z"][axis],
            Role::Radius => "radius",
            Role::Diameter => "diameter",
        }
    }

    /// Itself, where it is a size.
    pub(super) fn size(self) -> Option<Self> {
        matches!(self, Role::Radius | Role::Diameter).then_some(self)
    }

    /// By a name in any letter case, with any marks.
    pub(super) fn of(name: &str) -> Option<Self> {
        let name: String = name.to_lowercase().chars().filter(|c| !" _-.:\"'".contains(*c)).collect();
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let lettered = |word: &&str| {
                name.strip_prefix(word).is_some_and(|rest| rest == letter)
                    || name.strip_suffix(word).is_some_and(|rest| rest == letter)
            };
            let numbered = |word: &&str| name.strip_prefix(word).is_some_and(|rest| rest == ["0", "1", "2"][axis]);
            if OF_LETTER.iter().any(lettered) || OF_NUMBER.iter().any(numbered) {
                return Some(Role::Centre(axis));
            }
        }
        let of = |names: &[&str]| names.contains(&name.as_str());
        if of(&RADIUS) { Some(Role::Radius) } else { of(&DIAMETER).then_some(Role::Diameter) }
    }
}

/// A heading that is needed: what it is, and its unit (name, size in m).
pub(super) struct Column {
    pub at: usize,
    pub role: Role,
    pub unit: Option<(String, f64)>,
}

/// "x [mm]", "radius (um)", "d/mm", "x_mm": the name and the unit.
fn named(text: &str) -> (&str, Option<&str>) {
    let text = text.trim().trim_matches('"').trim();
    if let Some((name, unit)) = text.split_once(['(', '[', '{']) {
        return (name, Some(unit.trim_end().trim_end_matches([')', ']', '}']).trim()));
    }
    if Role::of(text).is_none()
        && let Some((name, unit)) = text.rsplit_once(['/', '_', ' ', ','])
        && Role::of(name).is_some()
        && Dimension::Length.unit(unit).is_ok()
    {
        return (name, Some(unit));
    }
    (text, None)
}

/// The role of a heading, with its unit.
///
/// # Errors
/// A unit that is none of length.
pub(super) fn column(at: usize, text: &str) -> Result<Option<Column>> {
    let (name, unit) = named(text);
    let Some(role) = Role::of(name) else { return Ok(None) };
    let place = |e: Error| e.at(format!("column {}", quoted(text)));
    let unit = unit.filter(|unit| !matches!(*unit, "" | "-"));
    let unit = unit.map(|unit| Ok((unit.to_string(), Dimension::Length.unit(unit)?))).transpose().map_err(place)?;
    Ok(Some(Column { at, role, unit }))
}

/// Where headings have what is needed of a sphere.
pub(super) struct Columns {
    pub centre: [Column; 3],
    /// A radius, a diameter, or both.
    pub size: Vec<Column>,
    headings: Vec<String>,
}

impl Columns {
    /// Of the headings of a table.
    ///
    /// # Errors
    /// A coordinate or a size that is missing or there twice, with the headings; units of some columns and not of others.
    pub fn of(headings: &[String]) -> Result<Self> {
        let (mut centre, mut size) = ([None, None, None], Vec::<Column>::new());
        for (at, text) in headings.iter().enumerate() {
            let Some(column) = column(at, text)? else { continue };
            let before = match column.role {
                Role::Centre(axis) => centre[axis].replace(column),
                role => {
                    let before = size.iter().position(|c| c.role == role);
                    size.push(column);
                    before.map(|n| size.remove(n))
                }
            };
            if let Some(before) = before {
                let both = [quoted(&headings[before.at]), quoted(text)];
                let problem = format!("columns {} may both be {}", enumeration(&both), before.role.words());
                return Err(Error::input(problem, "rename or remove the one that is not meant"));
            }
        }
        let missing = |name: &str, remedy: &str| {
            let near = nearest(name, headings.iter().map(String::as_str));
            let remedy = near.map_or(remedy.to_string(), |near| format!("is {} meant?", quoted(near)));
            let shown: Vec<String> = headings.iter().take(12).map(|h| quoted(h)).collect();
            Error::input(format!("there is no column {} among {}", quoted(name), enumeration(&shown)), remedy)
        };
        let all = "name the columns x,y,z,r in the first line";
        let [Some(x), Some(y), Some(z)] = centre else {
            let axis = centre.iter().position(Option::is_none).unwrap_or(0);
            return Err(missing(Role::Centre(axis).words(), all));
        };
        if size.is_empty() {
            return Err(missing("radius", "give a column r, radius, d or diameter"));
        }
        let columns = Columns { centre: [x, y, z], size, headings: headings.to_vec() };
        columns.refuse_half_named()?;
        Ok(columns)
    }

    /// Whether a line names at least the centre.
    pub fn are_in(headings: &[String]) -> bool {
        (0..3).all(|axis| headings.iter().any(|h| Role::of(named(h).0) == Some(Role::Centre(axis))))
    }

    fn all(&self) -> impl Iterator<Item = &Column> {
        self.centre.iter().chain(&self.size)
    }

    fn refuse_half_named(&self) -> Result<()> {
        let named = self.all().find(|c| c.unit.is_some());
        let bare = self.all().find(|c| c.unit.is_none());
        let (Some(named), Some(bare)) = (named, bare) else { return Ok(()) };
        let [named, bare] = [named, bare].map(|c| quoted(&self.headings[c.at]));
        let problem = format!("{bare} may have the unit of {named}, or metres");
        Err(Error::input(problem, "name the unit in all four headings, or in none"))
    }

    /// The units that the headings name (name, size in m), each once.
    pub fn units(&self) -> Vec<(String, f64)> {
        let mut units: Vec<(String, f64)> = Vec::new();
        for unit in self.all().filter_map(|c| c.unit.clone()) {
            if units.iter().all(|known| known.1 != unit.1) {
                units.push(unit);
            }
        }
        units
    }

    /// What each column is taken for.
    pub fn said(&self) -> Vec<PackingColumn> {
        let taken = |at: usize| {
            let column = self.all().find(|c| c.at == at)?;
            let unit = column.unit.as_ref().map_or(String::new(), |(name, _)| format!(" ({name})"));
            Some(format!("{}{unit}", column.role.words()))
        };
        said(&self.headings, taken)
    }

    /// A sphere (x, y, z, r) of the numbers of a row, in the units that the headings name.
    ///
    /// # Errors
    /// A radius and a diameter that are not of one sphere.
    pub fn sphere(&self, value: impl Fn(usize) -> Result<f64>) -> Result<[f64; 4]> {
        let of = |column: &Column| -> Result<f64> {
            let size = column.unit.as_ref().map_or(1.0, |unit| unit.1);
            let value = value(column.at).map_err(|e| e.at(format!("column {}", self.headings[column.at])))?;
            Ok(value * size)
        };
        let radius = |column: &Column| of(column).map(|v| if column.role == Role::Diameter { 0.5 * v } else { v });
        let [x, y, z] = &self.centre;
        let r = radius(&self.size[0])?;
        if let Some(other) = self.size.get(1) {
            let other = radius(other)?;
            if (other - r).abs() > 1e-4 * r.abs() {
                let problem = format!("radius and diameter are of two spheres, of radius {r} and of {other}");
                return Err(Error::input(problem, "remove the column that is not meant"));
            }
        }
        Ok([of(x)?, of(y)?, of(z)?, r])
    }
}

/// What each heading is taken for.
pub(super) fn said(headings: &[String], taken: impl Fn(usize) -> Option<String>) -> Vec<PackingColumn> {
    let one = |(at, column): (usize, &String)| PackingColumn {
        column: column.clone(),
        taken_for: taken(at).unwrap_or_else(|| NOTHING.into()),
    };
    headings.iter().enumerate().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_of_every_hand() {
        for (name, role) in [
            ("X", Role::Centre(0)),
            ("pos_y", Role::Centre(1)),
            ("Z position", Role::Centre(2)),
            ("Points:0", Role::Centre(0)),
            ("Points_2", Role::Centre(2)),
            ("R", Role::Radius),
            ("Radii", Role::Radius),
            ("DIAMETER", Role::Diameter),
            ("size", Role::Diameter),
        ] {
            assert_eq!(Role::of(name), Some(role), "{name}");
        }
        for name in ["vx", "fx", "id", "type", "xs", "omega_x", "", "density", "radius2"] {
            assert_eq!(Role::of(name), None, "{name}");
        }
        for (text, unit) in
            [("x [mm]", Some(1e-3)), ("x_mm", Some(1e-3)), ("d/um", Some(1e-6)), ("r (m)", Some(1.0)), ("pos_x", None)]
        {
            assert_eq!(column(0, text).unwrap().unwrap().unit.map(|u| u.1), unit, "{text}");
        }
        assert!(column(0, "x (GPa)").is_err_and(|e| e.to_string().contains("a length is needed")));
    }
}
