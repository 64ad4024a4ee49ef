//! STL files: surfaces of triangles, as text or binary.

use std::path::Path;

use nalgebra::Vector3;

use crate::inputs::read_bytes;
use anisobond::lattice::solid::Mesh;
use anisobond::{Error, Result};

/// Bytes before the triangles of a binary file, and of one triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// A closed surface from an STL file, text or binary; `unit` is the length (m) of 1 in the file. Normals in the file are
/// not used.
///
/// # Errors
/// A file that cannot be read or is no STL; a surface that is not closed.
pub fn read_stl(path: impl AsRef<Path>, unit: f64) -> Result<Mesh> {
    let path = path.as_ref();
    let bytes = read_bytes(path)?;
    parse_stl(&bytes, unit).map_err(|e| e.at(path.display()))
}

/// A closed surface from the bytes of an STL file. See [`read_stl`].
///
/// # Errors
/// As [`read_stl`].
pub fn parse_stl(bytes: &[u8], unit: f64) -> Result<Mesh> {
    let points = match binary_count(bytes) {
        Some(_) => bytes[HEADER..].chunks_exact(TRIANGLE).flat_map(binary_triangle).collect(),
        None => text_points(bytes)?,
    };
    let corner = |p: &[f64; 3]| Vector3::from(*p) * unit;
    Mesh::new(points.chunks_exact(3).map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])]).collect())
}

/// Number of triangles if the length of the file is that of a binary one (text files may begin with "solid", and binary
/// ones do so too).
fn binary_count(bytes: &[u8]) -> Option<usize> {
    let count = u32::from_le_bytes(bytes.get(80..HEADER)?.try_into().ok()?) as usize;
    (bytes.len() == HEADER + count.checked_mul(TRIANGLE)?).then_some(count)
}

/// Three points; the first twelve bytes are the normal.
fn binary_triangle(bytes: &[u8]) -> [[f64; 3]; 3] {
    let number = |at: usize| f64::from(f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]));
    [12, 24, 36].map(|at| [number(at), number(at + 4), number(at + 8)])
}

/// The points of "vertex x y z" lines, three to a facet.
fn text_points(bytes: &[u8]) -> Result<Vec<[f64; 3]>> {
    let remedy = "export it as STL again, binary or text";
    let text = std::str::from_utf8(bytes)
        .ok()
        .filter(|t| t.trim_start().to_ascii_lowercase().starts_with("solid"))
        .ok_or_else(|| Error::input("this is neither a binary nor a text STL file (it may be cut off)", remedy))?;
    let mut points = Vec::new();
    for (n, line) in text.lines().enumerate() {
        let wrong = |problem: String| Error::input(problem, remedy).at(format!("line {}", n + 1));
        let mut words = line.split_ascii_whitespace();
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("vertex") => {
                let numbers: Vec<f64> = words.filter_map(|w| w.parse().ok()).collect();
                let point: [f64; 3] = numbers
                    .try_into()
                    .map_err(|_| wrong(format!("{:?} is not a vertex of three numbers", line.trim())))?;
                points.push(point);
            }
            Some("endfacet") if !points.len().is_multiple_of(3) => {
                return Err(wrong("the facet has not three vertices".into()));
            }
            _ => {}
        }
    }
    if !points.len().is_multiple_of(3) {
        return Err(Error::input("the last facet has not three vertices (the file may be cut off)", remedy));
    }
    Ok(points)
}
