//! VTK XML image data (`.vti`): values at the nodes of a grid.

use super::appended::{Appended, FieldArray};
use anisobond::Result;
use anisobond::lattice::Grid;

/// VTK's bits that hide points and cells.
const HIDDEN_POINT: u8 = 2;
const HIDDEN_CELL: u8 = 32;

/// A `.vti` file: nodes as points, fields in single precision, appended and compressed with zlib. Places without a node, and
/// cells that touch one, are hidden (`vtkGhostType`), so that viewers show a hole as a hole.
///
/// # Errors
/// An array whose length is not that of the grid.
pub fn image_data(grid: &Grid, there: &[bool], arrays: &[FieldArray]) -> Result<Vec<u8>> {
    let mut file = Appended::new("ImageData");
    let extent = grid.nodes.map(|n| format!("0 {}", n - 1)).join(" ");
    let [x, y, z]: [f64; 3] = grid.origin.into();
    let d = grid.spacing;
    file.lines(&format!(
        "<ImageData WholeExtent=\"{extent}\" Origin=\"{x:?} {y:?} {z:?}\" Spacing=\"{d:?} {d:?} {d:?}\">\n\
         <Piece Extent=\"{extent}\">\n<PointData>"
    ));
    file.fields(grid.len(), arrays)?;
    let full = there.iter().all(|&t| t);
    if !full {
        let points: Vec<u8> = there.iter().map(|&t| if t { 0 } else { HIDDEN_POINT }).collect();
        file.array("vtkGhostType", &[], &points);
    }
    file.lines("</PointData>");
    if !full {
        file.lines("<CellData>");
        file.array("vtkGhostType", &[], &hidden_cells(grid, there));
        file.lines("</CellData>");
    }
    file.lines("</Piece>");
    Ok(file.finish())
}

/// The bits of cells, which lie between neighbouring nodes; along an axis of one node they are as flat as the grid.
fn hidden_cells(grid: &Grid, there: &[bool]) -> Vec<u8> {
    let cells = grid.nodes.map(|n| (n - 1).max(1));
    let corners = grid.nodes.map(|n| if n > 1 { 2 } else { 1 });
    let places =
        |n: [usize; 3]| (0..n[2]).flat_map(move |z| (0..n[1]).flat_map(move |y| (0..n[0]).map(move |x| [x, y, z])));
    let whole = |cell: [usize; 3]| {
        places(corners).all(|corner| there[grid.index(std::array::from_fn(|a| cell[a] + corner[a]))])
    };
    places(cells).map(|cell| if whole(cell) { 0 } else { HIDDEN_CELL }).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::appended::tests::{bytes, unpack};
    use super::*;

    #[test]
    fn every_value_comes_back() {
        for nodes in [[1, 1, 1], [7, 5, 3], [32, 32, 16], [64, 64, 5]] {
            let grid = Grid::new(nodes, 1e-3, Vector3::new(0.5, -1.0, 2.0), [false; 3]).unwrap();
            let scalar: Vec<f32> = (0..grid.len()).map(|i| (i as f32).sin()).collect();
            let vector: Vec<f32> = (0..3 * grid.len()).map(|i| i as f32).collect();
            let arrays = [
                FieldArray { name: "damage <–>".into(), components: &[], values: scalar.clone() },
                FieldArray { name: "displacement (m)".into(), components: &["x", "y", "z"], values: vector.clone() },
            ];
            let file = image_data(&grid, &vec![true; grid.len()], &arrays).unwrap();
            assert_eq!(unpack(&file, "damage <–>"), scalar);
            assert_eq!(unpack(&file, "displacement (m)"), vector);
            let text = String::from_utf8_lossy(&file);
            assert!(text.contains("ComponentName2=\"Z\"") && !text.contains("vtkGhostType"));
        }
    }

    #[test]
    fn what_is_not_there_is_hidden() {
        let grid = Grid::new([3, 3, 1], 1.0, Vector3::zeros(), [false; 3]).unwrap();
        let mut there = vec![true; 9];
        there[2] = false;
        let file = image_data(&grid, &there, &[]).unwrap();
        assert_eq!(bytes(&file, "vtkGhostType"), [0, 0, 2, 0, 0, 0, 0, 0, 0]);
        assert_eq!(hidden_cells(&grid, &there), [0, 32, 0, 0]);
    }

    #[test]
    fn a_wrong_length_is_refused() {
        let grid = Grid::new([2, 2, 2], 1.0, Vector3::zeros(), [false; 3]).unwrap();
        let array = FieldArray { name: "u".into(), components: &["x", "y", "z"], values: vec![0.0; 8] };
        assert!(image_data(&grid, &[true; 8], &[array]).is_err());
    }
}
