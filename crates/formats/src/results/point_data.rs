//! VTK XML poly data (`.vtp`): a point with a vertex per particle.

use nalgebra::Vector3;

use super::appended::{Appended, FieldArray};
use anisobond::Result;

/// A `.vtp` file: particles as points (m) with a vertex at each, for viewers draw cells, and fields in single precision,
/// appended and compressed with zlib. Draw them as point Gaussians, or as glyphs of the array `radius (m)`.
///
/// # Errors
/// An array whose length is not that of the points.
pub fn point_data(points: &[Vector3<f64>], arrays: &[FieldArray]) -> Result<Vec<u8>> {
    let n = points.len();
    let mut file = Appended::new("PolyData");
    file.lines(&format!(
        "<PolyData>\n<Piece NumberOfPoints=\"{n}\" NumberOfVerts=\"{n}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"0\">\n<PointData>"
    ));
    file.fields(n, arrays)?;
    file.lines("</PointData>\n<Points>");
    let places: Vec<f32> = points.iter().flat_map(|x| [x.x as f32, x.y as f32, x.z as f32]).collect();
    file.array("Points", &["x", "y", "z"], &places);
    file.lines("</Points>\n<Verts>");
    file.array("connectivity", &[], &(0..n as i64).collect::<Vec<_>>());
    file.array("offsets", &[], &(1..=n as i64).collect::<Vec<_>>());
    file.lines("</Verts>\n</Piece>");
    Ok(file.finish())
}

#[cfg(test)]
mod tests {
    use super::super::appended::tests::{unpack, unpack_whole};
    use super::*;

    #[test]
    fn points_and_values_come_back() {
        for n in [1usize, 100, 70_000] {
            let points: Vec<_> = (0..n).map(|i| Vector3::new(i as f64, -0.5, (i as f64).sin())).collect();
            let radii: Vec<f32> = (0..n).map(|i| 1.0 / (1.0 + i as f32)).collect();
            let array = FieldArray { name: "radius (m)".into(), components: &[], values: radii.clone() };
            let file = point_data(&points, &[array]).unwrap();
            assert_eq!(unpack(&file, "radius (m)"), radii);
            let places: Vec<f32> = points.iter().flat_map(|x| [x.x as f32, x.y as f32, x.z as f32]).collect();
            assert_eq!(unpack(&file, "Points"), places);
            assert_eq!(unpack_whole(&file, "connectivity"), (0..n as i64).collect::<Vec<_>>());
            assert_eq!(unpack_whole(&file, "offsets"), (1..=n as i64).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_wrong_length_is_refused() {
        let array = FieldArray { name: "u".into(), components: &["x", "y", "z"], values: vec![0.0; 4] };
        assert!(point_data(&[Vector3::zeros()], &[array]).is_err());
    }
}
