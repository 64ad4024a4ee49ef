//! VTK XML PolyData in text: a vertex per sphere with its radius, and the cell as field data.

use std::fmt::Write;

use nalgebra::Vector3;
use roxmltree::{Document, Node};

use super::{Spheres, edges, number};
use crate::vtk::{array, exact};
use anisobond::lattice::Packing;
use anisobond::{Error, Result};

pub(super) fn written(packing: &Packing) -> String {
    let number = packing.len();
    let mut file = String::with_capacity(120 * number + 2000);
    file.push_str("<?xml version=\"1.0\"?>\n<!-- Spheres; centres, radius and edges of the periodic cell in m. -->\n");
    file.push_str("<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\">\n<PolyData>\n");
    if let Some(cell) = packing.cell() {
        file.push_str("<FieldData>\n");
        let [a, b, c] = cell.into();
        let _ = writeln!(
            file,
            "<DataArray type=\"Float64\" Name=\"cell\" NumberOfTuples=\"3\" format=\"ascii\">\n{a:?} {b:?} {c:?}\n</DataArray>"
        );
        file.push_str("</FieldData>\n");
    }
    let _ = writeln!(
        file,
        "<Piece NumberOfPoints=\"{number}\" NumberOfVerts=\"{number}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"0\">"
    );
    file.push_str("<PointData Scalars=\"radius\">\n");
    array(&mut file, "Float64", "radius", 1, packing.radii().iter().map(exact));
    file.push_str("</PointData>\n<Points>\n");
    let coordinates = packing.centres().iter().flat_map(|x| [x.x, x.y, x.z]);
    array(&mut file, "Float64", "Points", 3, coordinates.map(|x| exact(&x)));
    file.push_str("</Points>\n<Verts>\n");
    array(&mut file, "Int64", "connectivity", 1, 0..number);
    array(&mut file, "Int64", "offsets", 1, 1..=number);
    file.push_str("</Verts>\n</Piece>\n</PolyData>\n</VTKFile>\n");
    file
}

pub(super) fn parse(text: &str) -> Result<Packing> {
    let document = Document::parse(text).map_err(|error| {
        Error::input(format!("the file is not XML: {error}"), "write VTK XML PolyData (.vtp) in text, not in binary")
    })?;
    let root = document.root_element();
    if root.attribute("type") != Some("PolyData") {
        return Err(Error::input("the file is not VTK PolyData", "save the spheres as PolyData (.vtp)"));
    }
    let points = child_array(&root, "Points", None)?.ok_or_else(|| missing("Points"))?;
    let radii = child_array(&root, "PointData", Some("radius"))?.ok_or_else(|| missing("radius"))?;
    if points.len() != 3 * radii.len() {
        return Err(Error::input(
            format!("{} coordinates but {} radii", points.len(), radii.len()),
            "give three coordinates and one radius per point",
        ));
    }
    let mut spheres = Spheres { cell: cell(&root)?, ..Spheres::default() };
    for (x, r) in points.chunks_exact(3).zip(&radii) {
        spheres.push([x[0], x[1], x[2], *r])?;
    }
    spheres.packing()
}

fn missing(name: &str) -> Error {
    Error::input(format!("there is no array {name}"), "write Points and the point data radius (m), in one piece")
}

fn cell(root: &Node) -> Result<Option<Vector3<f64>>> {
    let Some(values) = child_array(root, "FieldData", Some("cell"))? else { return Ok(None) };
    let words: Vec<String> = values.iter().map(|x| format!("{x:?}")).collect();
    edges(&words.iter().map(String::as_str).collect::<Vec<_>>()).map(Some)
}

/// The numbers of the first array of a name (any name if none is given) in an element.
fn child_array(root: &Node, element: &str, name: Option<&str>) -> Result<Option<Vec<f64>>> {
    let arrays = root.descendants().filter(|node| node.has_tag_name("DataArray"));
    let inside = |node: &Node| node.parent().is_some_and(|parent| parent.has_tag_name(element));
    let named = |node: &Node| name.is_none() || node.attribute("Name") == name;
    let Some(array) = arrays.into_iter().find(|node| inside(node) && named(node)) else { return Ok(None) };
    let line = array.document().text_pos_at(array.range().start).row;
    let place = format!("line {line}, array {}", name.unwrap_or(element));
    if array.attribute("format") != Some("ascii") {
        return Err(Error::input("the array is binary", "save the file in text (data mode ascii)").at(place));
    }
    let numbers = array.text().unwrap_or("").split_whitespace().map(number);
    numbers.collect::<Result<Vec<f64>>>().map(Some).map_err(|error| error.at(place))
}
