//! VTK XML image data (`.vti`): one value per node of a grid, compressed.

use std::fmt::Write as _;
use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use crate::lattice::Grid;
use crate::{Error, Result};

/// Bytes before compression of a block; readers unpack block by block.
const BLOCK: usize = 1 << 16;

/// The values of one field.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageArray {
    /// Name shown by viewers, with its unit.
    pub name: String,
    /// Values per node: 1 scalar, 3 vector, 6 symmetric tensor (xx yy zz xy yz xz, VTK's order).
    pub components: usize,
    /// Values, node by node.
    pub values: Vec<f32>,
}

/// A `.vti` file: nodes as points, fields in single precision, appended and compressed with zlib.
///
/// # Errors
/// An array whose length is not that of the grid.
pub fn image_data(grid: &Grid, arrays: &[ImageArray]) -> Result<Vec<u8>> {
    let mut header = String::from("<?xml version=\"1.0\"?>\n");
    header.push_str("<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" ");
    header.push_str("compressor=\"vtkZLibDataCompressor\">\n");
    let extent = grid.nodes.map(|n| format!("0 {}", n - 1)).join(" ");
    let [x, y, z]: [f64; 3] = grid.origin.into();
    let d = grid.spacing;
    let _ = writeln!(
        header,
        "<ImageData WholeExtent=\"{extent}\" Origin=\"{x:?} {y:?} {z:?}\" Spacing=\"{d:?} {d:?} {d:?}\">\n\
         <Piece Extent=\"{extent}\">\n<PointData>"
    );
    let mut data = Vec::new();
    point_arrays(&mut header, &mut data, grid.len(), arrays)?;
    header.push_str("</PointData>\n</Piece>\n</ImageData>\n");
    Ok(with_appended(header, data))
}

/// Headers of arrays of point data, and their values appended.
///
/// # Errors
/// An array whose length is not that of the points.
pub(super) fn point_arrays(
    header: &mut String,
    data: &mut Vec<u8>,
    points: usize,
    arrays: &[ImageArray],
) -> Result<()> {
    for array in arrays {
        if array.values.len() != array.components * points {
            return Err(Error::input(
                format!("{} values of {} for {points} nodes", array.values.len(), array.name),
                format!("give {} per node", array.components),
            ));
        }
        let _ = writeln!(
            header,
            "<DataArray type=\"Float32\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>",
            escaped(&array.name),
            array.components,
            data.len()
        );
        append(data, &array.values);
    }
    Ok(())
}

/// A file of its header and its appended data.
pub(super) fn with_appended(mut header: String, mut data: Vec<u8>) -> Vec<u8> {
    header.push_str("<AppendedData encoding=\"raw\">\n_");
    let mut file = header.into_bytes();
    file.append(&mut data);
    file.extend_from_slice(b"\n</AppendedData>\n</VTKFile>\n");
    file
}

/// One array: number of blocks, block size, size of the last partial block, compressed sizes; then the blocks.
pub(super) fn append(data: &mut Vec<u8>, values: &[f32]) {
    let per_block = BLOCK / size_of::<f32>();
    let blocks: Vec<Vec<u8>> = values.par_chunks(per_block).map(compressed).collect();
    let last = (values.len() % per_block) * size_of::<f32>();
    let numbers = [blocks.len(), BLOCK, last].into_iter().chain(blocks.iter().map(Vec::len));
    numbers.for_each(|n| data.extend_from_slice(&(n as u64).to_le_bytes()));
    blocks.iter().for_each(|block| data.extend_from_slice(block));
}

/// A block packed by zlib, fast.
fn compressed(values: &[f32]) -> Vec<u8> {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    // Writing into memory does not fail.
    let _ = encoder.write_all(&bytes);
    encoder.finish().unwrap_or_default()
}

/// Text inside an XML attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
pub(super) mod tests {
    use std::io::Read;

    use nalgebra::Vector3;

    use super::*;

    /// Unpacks an array as a viewer does, from the file's bytes alone.
    pub(in super::super) fn unpack(file: &[u8], name: &str) -> Vec<f32> {
        let start = file.windows(2).position(|w| w == b"\n_").unwrap() + 2;
        let header = std::str::from_utf8(&file[..start - 1]).unwrap().to_string() + "</AppendedData></VTKFile>";
        let xml = roxmltree::Document::parse(&header).unwrap();
        let array = xml.descendants().find(|n| n.attribute("Name") == Some(name)).unwrap();
        let mut at = start + array.attribute("offset").unwrap().parse::<usize>().unwrap();
        let mut number = || {
            at += 8;
            u64::from_le_bytes(file[at - 8..at].try_into().unwrap()) as usize
        };
        let (blocks, block, last) = (number(), number(), number());
        let sizes: Vec<usize> = (0..blocks).map(|_| number()).collect();
        let mut bytes = Vec::new();
        for (i, size) in sizes.iter().enumerate() {
            let mut out = Vec::new();
            flate2::read::ZlibDecoder::new(&file[at..at + size]).read_to_end(&mut out).unwrap();
            assert_eq!(out.len(), if i + 1 == blocks && last > 0 { last } else { block });
            at += size;
            bytes.append(&mut out);
        }
        bytes.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
    }

    #[test]
    fn every_value_comes_back() {
        for nodes in [[1, 1, 1], [7, 5, 3], [32, 32, 16], [64, 64, 5]] {
            let grid = Grid::new(nodes, 1e-3, Vector3::new(0.5, -1.0, 2.0), [false; 3]).unwrap();
            let scalar: Vec<f32> = (0..grid.len()).map(|i| (i as f32).sin()).collect();
            let vector: Vec<f32> = (0..3 * grid.len()).map(|i| i as f32).collect();
            let arrays = [
                ImageArray { name: "damage <–>".into(), components: 1, values: scalar.clone() },
                ImageArray { name: "displacement (m)".into(), components: 3, values: vector.clone() },
            ];
            let file = image_data(&grid, &arrays).unwrap();
            assert_eq!(unpack(&file, "damage <–>"), scalar);
            assert_eq!(unpack(&file, "displacement (m)"), vector);
        }
    }

    #[test]
    fn a_wrong_length_is_refused() {
        let grid = Grid::new([2, 2, 2], 1.0, Vector3::zeros(), [false; 3]).unwrap();
        let array = ImageArray { name: "u".into(), components: 3, values: vec![0.0; 8] };
        assert!(image_data(&grid, &[array]).is_err());
    }
}
