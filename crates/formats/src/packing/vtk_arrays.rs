//! Spheres of VTK data sets: the points, and the point data that are their sizes.

use nalgebra::Vector3;

use super::PackingColumn;
use super::columns::{Column, NOTHING, Role, column};
use super::found::{Found, Lengths, Places};
use crate::words::{enumeration, quoted};
use anisobond::{Error, Result};

/// Arrays of a data set.
#[derive(Default)]
pub(super) struct Arrays {
    /// Three coordinates per point.
    pub points: Vec<f64>,
    /// Point data: name and numbers; those of several components have more numbers than points.
    pub data: Vec<(String, Vec<f64>)>,
    /// Edges of the periodic cell, by the field data `cell`.
    pub cell: Option<Vector3<f64>>,
    /// Unit that words of the file name: its name and its size (m).
    pub unit: Option<(String, f64)>,
}

impl Arrays {
    /// The spheres, of a format in words.
    ///
    /// # Errors
    /// No array that is a size, or several; one of another length than the points.
    pub fn found(self, format: &str) -> Result<Found> {
        let mut sizes: Vec<Column> = Vec::new();
        for (at, (name, _)) in self.data.iter().enumerate() {
            sizes.extend(column(at, name)?.filter(|column| column.role.size().is_some()));
        }
        let names: Vec<String> = self.data.iter().take(12).map(|(name, _)| quoted(name)).collect();
        let size = match &sizes[..] {
            [one] => one,
            [] if names.is_empty() => {
                return Err(Error::input("the points have no data", "save radius or diameter as point data"));
            }
            [] => {
                let problem = format!("there is no array radius or diameter among {}", enumeration(&names));
                return Err(Error::input(problem, "save the size of the spheres as point data radius or diameter"));
            }
            _ => {
                let all: Vec<String> = sizes.iter().map(|size| quoted(&self.data[size.at].0)).collect();
                let problem = format!("the arrays {} may all be the size", enumeration(&all));
                return Err(Error::input(problem, "keep the one that is meant"));
            }
        };
        let (name, numbers) = &self.data[size.at];
        if self.points.len() != 3 * numbers.len() {
            return Err(Error::input(
                format!("{} coordinates but {} numbers in {}", self.points.len(), numbers.len(), quoted(name)),
                "give three coordinates and one size per point",
            ));
        }
        let half = if size.role == Role::Diameter { 0.5 } else { 1.0 };
        let word = if size.role == Role::Diameter { "diameter" } else { "radius" };
        let lengths = match size.unit.clone().or(self.unit) {
            Some((name, size)) => Lengths::Named(name, size),
            None => Lengths::Open,
        };
        let mut found = Found::new(format!("{format}, {word} from the point data {}", quoted(name)), lengths);
        found.places = Places::Points;
        found.cell = self.cell;
        found.columns = vec![PackingColumn { column: "points".into(), taken_for: "x y z".into() }];
        found.columns.extend(self.data.iter().enumerate().map(|(at, (name, _))| PackingColumn {
            column: name.clone(),
            taken_for: if at == size.at { word.into() } else { NOTHING.into() },
        }));
        for (n, (x, size)) in self.points.chunks_exact(3).zip(numbers).enumerate() {
            let sphere = [x[0], x[1], x[2], half * size];
            if !sphere.iter().all(|v| v.is_finite()) {
                let problem = format!("a number of the sphere is not finite: {} {} {}, {}", x[0], x[1], x[2], size);
                return Err(Error::input(problem, "leave the point out").at(format!("point {}", n + 1)));
            }
            found.push(0, sphere);
        }
        Ok(found)
    }
}

/// Types of numbers in binary arrays, by VTK's names of both kinds of file, and their bytes.
const KINDS: [(&[&str], usize); 10] = [
    (&["Int8", "char"], 1),
    (&["UInt8", "unsigned_char", "bit"], 1),
    (&["Int16", "short"], 2),
    (&["UInt16", "unsigned_short"], 2),
    (&["Int32", "int"], 4),
    (&["UInt32", "unsigned_int"], 4),
    (&["Int64", "long", "vtktypeint64", "vtkIdType"], 8),
    (&["UInt64", "unsigned_long"], 8),
    (&["Float32", "float"], 4),
    (&["Float64", "double"], 8),
];

/// Bytes of a number of a kind.
pub(super) fn width(kind: &str) -> Result<usize> {
    let known = KINDS.iter().find(|(names, _)| names.contains(&kind));
    known.map(|(_, width)| *width).ok_or_else(|| {
        Error::input(format!("{} is no type of numbers", quoted(kind)), "save the array as float or double")
    })
}

/// The numbers of bytes; what is left over is not one.
pub(super) fn numbers(bytes: &[u8], kind: &str, big_endian: bool) -> Result<Vec<f64>> {
    let width = width(kind)?;
    let place = KINDS.iter().position(|(names, _)| names.contains(&kind)).unwrap_or(0);
    let one = |chunk: &[u8]| {
        let mut low = [0u8; 8];
        low[..width].copy_from_slice(chunk);
        if big_endian {
            low[..width].reverse();
        }
        let bits = u64::from_le_bytes(low);
        match place {
            0 => f64::from(bits as u8 as i8),
            2 => f64::from(bits as u16 as i16),
            4 => f64::from(bits as u32 as i32),
            6 => bits as i64 as f64,
            8 => f64::from(f32::from_bits(bits as u32)),
            9 => f64::from_bits(bits),
            _ => bits as f64,
        }
    };
    Ok(bytes.chunks_exact(width).map(one).collect())
}
