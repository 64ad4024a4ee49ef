//! VTK XML poly data (`.vtp`): a point per particle, compressed.

use std::fmt::Write as _;

use nalgebra::Vector3;

use super::image_data::{ImageArray, append, point_arrays, with_appended};
use crate::Result;

/// A `.vtp` file: particles as points (m) with fields in single precision, appended and compressed with zlib. Draw them as
/// point Gaussians, or as glyphs of the array `radius (m)`.
///
/// # Errors
/// An array whose length is not that of the points.
pub fn point_data(points: &[Vector3<f64>], arrays: &[ImageArray]) -> Result<Vec<u8>> {
    let mut header = String::from("<?xml version=\"1.0\"?>\n");
    header.push_str("<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" ");
    header.push_str("compressor=\"vtkZLibDataCompressor\">\n");
    let _ = writeln!(
        header,
        "<PolyData>\n<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"0\">\n<PointData>",
        points.len()
    );
    let mut data = Vec::new();
    point_arrays(&mut header, &mut data, points.len(), arrays)?;
    let _ = writeln!(
        header,
        "</PointData>\n<Points>\n<DataArray type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\" \
         format=\"appended\" offset=\"{}\"/>\n</Points>\n</Piece>\n</PolyData>",
        data.len()
    );
    let places: Vec<f32> = points.iter().flat_map(|x| [x.x as f32, x.y as f32, x.z as f32]).collect();
    append(&mut data, &places);
    Ok(with_appended(header, data))
}

#[cfg(test)]
mod tests {
    use super::super::image_data::tests::unpack;
    use super::*;

    #[test]
    fn points_and_values_come_back() {
        for n in [1usize, 100, 70_000] {
            let points: Vec<_> = (0..n).map(|i| Vector3::new(i as f64, -0.5, (i as f64).sin())).collect();
            let radii: Vec<f32> = (0..n).map(|i| 1.0 / (1.0 + i as f32)).collect();
            let array = ImageArray { name: "radius (m)".into(), components: 1, values: radii.clone() };
            let file = point_data(&points, &[array]).unwrap();
            assert_eq!(unpack(&file, "radius (m)"), radii);
            let places: Vec<f32> = points.iter().flat_map(|x| [x.x as f32, x.y as f32, x.z as f32]).collect();
            assert_eq!(unpack(&file, "Points"), places);
        }
    }

    #[test]
    fn a_wrong_length_is_refused() {
        let array = ImageArray { name: "u".into(), components: 3, values: vec![0.0; 4] };
        assert!(point_data(&[Vector3::zeros()], &[array]).is_err());
    }
}
