//! What a file says of spheres, and the packing that it makes once its unit is settled and its spheres are looked at.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::{PackingColumn, PackingOptions, PackingReading};
use crate::units::Dimension;
use crate::words::number;
use anisobond::lattice::Packing;
use anisobond::{Error, Result, Wording};

/// Radii from here on (m) are asked back where nothing names their unit.
const LARGE: f64 = 0.5;

/// Part of the smallest radius within which two centres are one.
const SAME: f64 = 1e-7;

/// The unit of a file's lengths.
pub(super) enum Lengths {
    /// The file names it: its name and its size (m).
    Named(String, f64),
    /// The columns name theirs, and are in m already: names and sizes (m).
    InHeadings(Vec<(String, f64)>),
    /// Metres by the custom of a program.
    Custom(&'static str),
    /// Nothing names it.
    Open,
    /// The file says that it has none.
    Reduced,
}

impl Lengths {
    /// Of headings that may name units.
    pub fn of_headings(units: Vec<(String, f64)>, otherwise: Lengths) -> Self {
        if units.is_empty() { otherwise } else { Lengths::InHeadings(units) }
    }
}

/// Where spheres stand in their file.
pub(super) enum Places {
    Lines(Vec<usize>),
    /// By their number from 1: "point 3".
    Points,
}

impl Places {
    fn of(&self, sphere: usize) -> String {
        match self {
            Places::Lines(lines) => format!("line {}", lines.get(sphere).copied().unwrap_or(0)),
            Places::Points => format!("point {}", sphere + 1),
        }
    }
}

/// What a reader found.
pub(super) struct Found {
    /// Format, and what was taken from it.
    pub format: String,
    pub columns: Vec<PackingColumn>,
    /// x, y, z and r as they stand.
    pub spheres: Vec<[f64; 4]>,
    pub places: Places,
    /// Edges of the periodic cell, and its lower corner.
    pub cell: Option<Vector3<f64>>,
    pub corner: Vector3<f64>,
    pub lengths: Lengths,
    pub notes: Vec<String>,
    /// Whether the file has the frames and the types that options may choose among.
    pub frames: bool,
    pub types: bool,
    /// Whether radii are in m whatever the other lengths are in, for they were given beside the file.
    pub own_radii: bool,
}

impl Found {
    pub fn new(format: impl Into<String>, lengths: Lengths) -> Self {
        Found {
            format: format.into(),
            columns: Vec::new(),
            spheres: Vec::new(),
            places: Places::Lines(Vec::new()),
            cell: None,
            corner: Vector3::zeros(),
            lengths,
            notes: Vec::new(),
            frames: false,
            types: false,
            own_radii: false,
        }
    }

    /// One more sphere of a line.
    pub fn push(&mut self, line: usize, sphere: [f64; 4]) {
        self.spheres.push(sphere);
        if let Places::Lines(lines) = &mut self.places {
            lines.push(line);
        }
    }

    /// The packing, in m.
    pub fn reading(mut self, options: &PackingOptions) -> Result<PackingReading> {
        self.refuse_unneeded(options)?;
        for (n, [.., r]) in self.spheres.iter().enumerate() {
            if *r <= 0.0 {
                let problem = format!("the radius of sphere {} is {}", n + 1, number(*r));
                let error = Error::input(problem, "give positive radii, or leave the sphere out");
                return Err(error.at(self.places.of(n)));
            }
        }
        let (scale, words) = self.settled(options)?;
        let unit_assumed = matches!(self.lengths, Lengths::Open) && options.length_unit.is_none();
        let scale_of_radii = if self.own_radii { 1.0 } else { scale };
        let centre = |s: &[f64; 4]| (Vector3::new(s[0], s[1], s[2]) - self.corner) * scale;
        let centres: Vec<_> = self.spheres.iter().map(centre).collect();
        let radii: Vec<f64> = self.spheres.iter().map(|s| s[3] * scale_of_radii).collect();
        let cell = self.cell.map(|edges| edges * scale);
        let outside = cell.and_then(|edges| self.outside(&centres, &edges));
        let wide = cell.is_some_and(|edges| 2.0 * radii.iter().fold(0.0, |m: f64, r| m.max(*r)) > edges.min());
        let packing = Packing::new(cell, centres, radii)?;
        self.refuse_twins(&packing)?;
        self.notes.extend(outside);
        if wide {
            self.notes.push("the largest sphere is wider than the cell: have both the same unit?".into());
        }
        Ok(PackingReading {
            packing,
            read_as: format!("{}, {words}", self.format),
            columns: self.columns,
            notes: self.notes,
            unit_assumed,
        })
    }

    fn refuse_unneeded(&self, options: &PackingOptions) -> Result<()> {
        let leave = |name: &'static str, problem: String| {
            Err(Error::input(problem, Wording::from("leave out ").choice(name, "")))
        };
        match options {
            PackingOptions { frame: Some(frame), .. } if !self.frames => {
                leave("frame", format!("the time step {frame} is asked for, and the file has no time steps"))
            }
            PackingOptions { type_radii, .. } if !type_radii.is_empty() && !self.types => {
                leave("type_radii", "radii of types are given, and the file has the radii of its spheres".into())
            }
            _ => Ok(()),
        }
    }

    /// The size of the unit (m), and the words of it.
    fn settled(&mut self, options: &PackingOptions) -> Result<(f64, String)> {
        let asked = options.length_unit.as_deref();
        let asked = asked.map(|name| Dimension::Length.unit(name).map(|size| (name.trim().to_string(), size)));
        let same = |size: f64, asked: f64| (size / asked - 1.0).abs() < 1e-12;
        let contradicts = |own: &str, asked: &str| {
            let problem = format!("the file is in {own}, and the unit asked for is {asked}");
            Err(Error::input(
                problem,
                Wording::from("leave out ").choice("length_unit", "").words(": the file names it"),
            ))
        };
        match (&self.lengths, asked.transpose()?) {
            (Lengths::Named(name, size), Some(asked)) if !same(*size, asked.1) => contradicts(name, &asked.0),
            (Lengths::Named(name, size), _) => Ok((*size, format!("lengths in {name}"))),
            (Lengths::InHeadings(units), asked) => {
                let names: Vec<&str> = units.iter().map(|unit| unit.0.as_str()).collect();
                let names = names.join(" and ");
                match asked {
                    Some(asked) if units.iter().any(|unit| !same(unit.1, asked.1)) => contradicts(&names, &asked.0),
                    _ => Ok((1.0, format!("lengths in {names}, as the headings have them"))),
                }
            }
            (_, Some((name, size))) => Ok((size, format!("lengths in {name}, as asked for"))),
            (Lengths::Custom(program), None) => Ok((1.0, format!("lengths in m, by the custom of {program}"))),
            (Lengths::Reduced, None) => Err(self.ask("the file's lengths have no unit (units lj)")),
            (Lengths::Open, None) if self.largest() >= LARGE => Err(self.ask("no unit of length is named")),
            (Lengths::Open, None) => {
                self.notes.push("no unit of length is named: the lengths were taken to be in m".into());
                Ok((1.0, "lengths in m, for none is named".into()))
            }
        }
    }

    /// The largest radius, or what is known of the size of things where radii were given beside the file.
    fn largest(&self) -> f64 {
        let of = |n: usize| self.spheres.iter().map(|s| s[n].abs()).fold(0.0, f64::max);
        if self.own_radii { (0..3).map(of).fold(0.0, f64::max) } else { of(3) }
    }

    /// What the lengths would be in each of two units.
    fn ask(&self, problem: &str) -> Error {
        let (what, largest) = (if self.own_radii { "coordinate" } else { "radius" }, self.largest());
        let text = format!(
            "{problem}: the largest {what}, {}, would be {} m in m and {} m in mm",
            number(largest),
            number(largest),
            number(largest * 1e-3)
        );
        let remedy =
            Wording::from("name it with ").choice("length_unit", "mm").words(", or in headings such as x [mm]");
        Error::input(text, remedy)
    }

    /// What is said of centres outside the cell.
    fn outside(&self, centres: &[Vector3<f64>], edges: &Vector3<f64>) -> Option<String> {
        let is_outside = |x: &Vector3<f64>| x.iter().zip(edges).any(|(x, edge)| !(0.0..=*edge).contains(x));
        let mut all = centres.iter().enumerate().filter(|(_, x)| is_outside(x));
        let first = all.next()?.0;
        let count = 1 + all.count();
        let (of, they) = (centres.len(), if count == 1 { "it is" } else { "they are" });
        Some(format!(
            "{count} of {of} centres outside the cell, the first in {}: {they} taken to the periodic image inside",
            self.places.of(first)
        ))
    }

    /// Refuses two spheres at one place.
    fn refuse_twins(&self, packing: &Packing) -> Result<()> {
        let step = SAME * packing.radii().iter().fold(f64::INFINITY, |m, r| m.min(*r));
        let mut seen: HashMap<[u64; 3], usize> = HashMap::with_capacity(packing.len());
        for (n, x) in packing.centres().iter().enumerate() {
            // −0 is 0; steps that are lost beside the coordinates count nothing.
            let counted = |x: f64| Some((x / step).round()).filter(|steps| steps.is_finite()).unwrap_or(x) + 0.0;
            let key = [x.x, x.y, x.z].map(|x| counted(x).to_bits());
            if let Some(first) = seen.insert(key, n) {
                let problem = format!("the sphere has the same centre as that in {}", self.places.of(first));
                let error = Error::input(problem, "remove one of the two, for no bond is between them");
                return Err(error.at(self.places.of(n)));
            }
        }
        Ok(())
    }
}

/// The unit of length that words name in brackets or behind "unit", as "(mm)", "[m]", "units = si": its name and its size (m).
pub(super) fn unit_in_words(text: &str) -> Option<(String, f64)> {
    let known = |name: &str| {
        // Among words these two are mostly none.
        let name = name.trim().trim_end_matches(['.', ',', ';']);
        let name = Some(name).filter(|name| !["A", "in"].contains(name))?;
        Dimension::Length.unit(name).ok().map(|size| (name.to_string(), size))
    };
    let bracketed = text.split(['(', '[']).skip(1).find_map(|piece| known(piece.split([')', ']']).next()?));
    let behind = || {
        let at = text.to_lowercase().find("unit").filter(|at| text.is_char_boundary(*at))?;
        let rest = text.get(at + 4..)?.trim_start_matches(['s', 'S', ' ', ':', '=']);
        known(rest.split_whitespace().next()?)
    };
    bracketed.or_else(behind)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_stand_in_comments() {
        let size = |text: &str| unit_in_words(text).map(|unit| unit.1);
        assert_eq!(size("Spheres: centre and radius (m)"), Some(1.0));
        assert_eq!(size("positions [mm], radii"), Some(1e-3));
        assert_eq!(size("Units: um"), Some(1e-6));
        assert_eq!(size("made in a hurry, as is usual"), None);
        assert_eq!(size("sample (dry)"), None);
        assert_eq!(size("sample (A)"), None);
    }
}
