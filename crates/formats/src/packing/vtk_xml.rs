//! VTK XML, PolyData and UnstructuredGrid, as text, base64 or appended, compressed by zlib or not: a point per sphere with its
//! size, and the cell as field data.

use std::fmt::Write;
use std::io::Read;

use flate2::read::ZlibDecoder;
use roxmltree::{Document, Node};

use super::Source;
use super::columns::Role;
use super::found::{Found, unit_in_words};
use super::numbers::{edges, number};
use super::vtk_arrays::{Arrays, numbers};
use crate::vtk::{array, exact};
use crate::words::quoted;
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

/// Data sets whose points may be spheres.
const SETS: [&str; 2] = ["PolyData", "UnstructuredGrid"];

/// Most bytes that an array is unpacked to.
const MOST_BYTES: u64 = 1 << 30;

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    let bytes = source.bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(source.bytes).trim_ascii_start();
    bytes.starts_with(b"<").then(|| file(bytes))
}

/// A file: its XML, and the bytes that are appended to it.
struct File<'f> {
    /// What each header of an array is made of: 4 or 8 bytes.
    header: usize,
    big_endian: bool,
    compressed: bool,
    appended: &'f [u8],
    /// Whether the appended bytes are base64.
    encoded: bool,
}

fn file(bytes: &[u8]) -> Result<Found> {
    let mark = b"<AppendedData";
    let cut = bytes.windows(mark.len()).position(|window| window == mark);
    let text = std::str::from_utf8(&bytes[..cut.unwrap_or(bytes.len())]);
    let text =
        text.map_err(|_| Error::input("the file is not XML: bytes that are no text", "save it as .vtp or .vtu"))?;
    let text = if cut.is_some() { format!("{text}</VTKFile>") } else { text.to_string() };
    let document = Document::parse(&text)
        .map_err(|error| Error::input(format!("the file is not XML: {error}"), "write VTK XML, as .vtp or .vtu"))?;
    let root = document.root_element();
    let set = root.attribute("type").unwrap_or("");
    if !SETS.contains(&set) {
        let problem = format!("the file is not VTK PolyData or UnstructuredGrid but {}", quoted(set));
        return Err(Error::input(problem, "save the spheres as PolyData (.vtp), in one file"));
    }
    let rest = cut.map_or(&[][..], |cut| &bytes[cut..]);
    let tag = rest.iter().position(|b| *b == b'>').map_or(&[][..], |end| &rest[..end]);
    let start = rest.iter().skip(tag.len()).position(|b| *b == b'_').map_or(rest.len(), |n| tag.len() + n + 1);
    let compressor = root.attribute("compressor").unwrap_or("");
    if !matches!(compressor, "" | "vtkZLibDataCompressor") {
        let problem = format!("the arrays are compressed by {}", quoted(compressor));
        return Err(Error::input(problem, "save the file compressed by zlib, or not at all"));
    }
    let file = File {
        header: if root.attribute("header_type") == Some("UInt64") { 8 } else { 4 },
        big_endian: root.attribute("byte_order") == Some("BigEndian"),
        compressed: !compressor.is_empty(),
        appended: &rest[start..],
        encoded: String::from_utf8_lossy(tag).contains("base64"),
    };
    let mut arrays = Arrays::default();
    let comments = document.root().children().filter(Node::is_comment);
    let named = |text: &str| {
        text.contains("edges of the periodic cell in m").then(|| ("m".to_string(), 1.0)).or(unit_in_words(text))
    };
    arrays.unit = comments.filter_map(|comment| named(comment.text()?)).next();
    let pieces: Vec<Node> = root.descendants().filter(|node| node.has_tag_name("Piece")).collect();
    for piece in &pieces {
        let Some(points) = arrays_of(piece, "Points").next() else { return Err(missing("Points")) };
        arrays.points.extend(file.numbers(&points)?);
        for array in arrays_of(piece, "PointData") {
            let name = array.attribute("Name").unwrap_or("");
            // What is no size is only named.
            let size = super::columns::column(0, name).ok().flatten().and_then(|column| Role::size(column.role));
            let values = if size.is_some() { file.numbers(&array)? } else { Vec::new() };
            match arrays.data.iter_mut().find(|(known, _)| known == name) {
                Some((_, known)) => known.extend(values),
                None => arrays.data.push((name.to_string(), values)),
            }
        }
    }
    if pieces.is_empty() {
        return Err(missing("Points"));
    }
    if let Some(cell) = arrays_of(&root, "FieldData").find(|array| array.attribute("Name") == Some("cell")) {
        let words: Vec<String> = file.numbers(&cell)?.iter().map(|x| format!("{x:?}")).collect();
        arrays.cell = Some(edges(&words.iter().map(String::as_str).collect::<Vec<_>>())?);
    }
    arrays.found(&format!("VTK {set}"))
}

fn missing(name: &str) -> Error {
    Error::input(format!("there is no array {name}"), "write Points and the point data radius")
}

/// The arrays directly in the elements of a name.
fn arrays_of<'n>(node: &Node<'n, 'n>, element: &'static str) -> impl Iterator<Item = Node<'n, 'n>> {
    let inside = move |array: &Node| array.parent().is_some_and(|parent| parent.has_tag_name(element));
    node.descendants().filter(|node| node.has_tag_name("DataArray")).filter(inside)
}

impl File<'_> {
    /// The numbers of an array.
    fn numbers(&self, array: &Node) -> Result<Vec<f64>> {
        let line = array.document().text_pos_at(array.range().start).row;
        let place = format!("line {line}, array {}", array.attribute("Name").unwrap_or("of points"));
        let kind = array.attribute("type").unwrap_or("Float32");
        let text = array.text().unwrap_or("");
        let bytes = match array.attribute("format") {
            Some("binary") => from_base64(text.trim().as_bytes()).and_then(|bytes| self.unpacked(&bytes)),
            Some("appended") => self.appended(array.attribute("offset").unwrap_or("")),
            _ => return text.split_whitespace().map(number).collect::<Result<_>>().map_err(|error| error.at(place)),
        };
        bytes.and_then(|bytes| numbers(&bytes, kind, self.big_endian)).map_err(|error| error.at(place))
    }

    fn appended(&self, offset: &str) -> Result<Vec<u8>> {
        let from = offset.trim().parse::<usize>().ok().and_then(|offset| self.appended.get(offset..));
        let from = from.ok_or_else(|| {
            Error::input(format!("offset {} is not in the appended data", quoted(offset)), "is the file cut off?")
        })?;
        if !self.encoded {
            return self.unpacked(from);
        }
        let end = from.iter().position(|b| *b == b'<').unwrap_or(from.len());
        from_base64(&from[..end]).and_then(|bytes| self.unpacked(&bytes))
    }

    /// A number of a header.
    fn size(&self, bytes: &[u8], n: usize) -> Result<usize> {
        let at = n.saturating_mul(self.header);
        let kind = if self.header == 8 { "UInt64" } else { "UInt32" };
        let own = bytes.get(at..at.saturating_add(self.header)).ok_or_else(cut_off)?;
        Ok(numbers(own, kind, self.big_endian)?.first().map_or(0, |size| *size as usize))
    }

    /// The bytes behind a header, unpacked where they are compressed.
    fn unpacked(&self, bytes: &[u8]) -> Result<Vec<u8>> {
        if !self.compressed {
            let size = self.size(bytes, 0)?;
            return bytes.get(self.header..self.header.saturating_add(size)).map(<[u8]>::to_vec).ok_or_else(cut_off);
        }
        // The number of blocks, two sizes of them unpacked, and the sizes of all packed.
        let blocks = self.size(bytes, 0)?;
        let mut at = blocks.saturating_add(3).saturating_mul(self.header);
        let mut all = Vec::new();
        for block in 0..blocks {
            let size = self.size(bytes, 3 + block)?;
            let packed = bytes.get(at..at.saturating_add(size)).ok_or_else(cut_off)?;
            let left = MOST_BYTES.saturating_sub(all.len() as u64);
            ZlibDecoder::new(packed).take(left).read_to_end(&mut all).map_err(|e| {
                Error::input(format!("a compressed block cannot be unpacked: {e}"), "is the file damaged?")
            })?;
            at = at.saturating_add(size);
        }
        Ok(all)
    }
}

fn cut_off() -> Error {
    Error::input("the bytes of the array end before all are there", "is the file cut off?")
}

/// Bytes of base64, of which several pieces may stand one behind the other.
fn from_base64(text: &[u8]) -> Result<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0u32, 0);
    for letter in text.iter().filter(|b| !b.is_ascii_whitespace()) {
        let value = match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            // The end of a piece: what is left over of it is no byte.
            b'=' => {
                count = 0;
                continue;
            }
            _ => return Err(Error::input("the array is not base64", "is the file damaged?")),
        };
        (bits, count) = (bits << 6 | u32::from(value), count + 6);
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_of_base64_are_joined() {
        assert_eq!(from_base64(b"aGVsbG8=").unwrap(), b"hello");
        assert_eq!(from_base64(b"aGVsbG8=d29y\nbGQ=").unwrap(), b"helloworld");
        assert_eq!(from_base64(b"aA==Yg==").unwrap(), b"hb");
        assert!(from_base64(b"a.b").is_err());
    }
}
