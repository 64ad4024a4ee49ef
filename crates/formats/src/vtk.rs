//! VTK XML files (`.vtp`) for ParaView, VisIt and PyVista.

use std::fmt::{Display, Write};
use std::path::Path;

use crate::bonds::{BondModuli, length};
use crate::write_atomically;
use anisobond::Result;
use anisobond::lattice::Neighbourhood;

/// A neighbourhood as VTK XML PolyData: a vertex at every ξ (m) with the point data `micromodulus` (N/m⁶), where there
/// are tangential bonds `tangential_micromodulus` (N/m⁶), `influence` (–), `stiffness_share` (m⁴), `length` (m) and
/// `offset` (–, three integers). Numbers are text that reads back to the same bits.
///
/// # Errors
/// Another number of micromoduli than bonds, or one that is not finite.
pub fn neighbourhood_vtp(neighbourhood: &Neighbourhood, moduli: &BondModuli) -> Result<String> {
    moduli.check(neighbourhood)?;
    let bonds = neighbourhood.bonds();
    let mut file = String::with_capacity(200 * bonds.len() + 2000);
    file.push_str("<?xml version=\"1.0\"?>\n");
    file.push_str("<!-- Bonds of one grid node; SI units: points and length m, micromodulus N/m^6, ");
    file.push_str("stiffness_share m^4. -->\n");
    file.push_str("<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\">\n<PolyData>\n");
    let _ = writeln!(
        file,
        "<Piece NumberOfPoints=\"{0}\" NumberOfVerts=\"{0}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"0\">",
        bonds.len()
    );
    file.push_str("<PointData Scalars=\"micromodulus\">\n");
    array(&mut file, "Float64", "micromodulus", 1, moduli.normal.iter().map(exact));
    if let Some(c) = moduli.tangential {
        array(&mut file, "Float64", "tangential_micromodulus", 1, c.iter().map(exact));
    }
    array(&mut file, "Float64", "influence", 1, bonds.iter().map(|b| exact(&b.influence)));
    array(&mut file, "Float64", "stiffness_share", 1, bonds.iter().map(|b| exact(&neighbourhood.stiffness_share(b))));
    array(&mut file, "Float64", "length", 1, bonds.iter().map(|b| exact(&length(neighbourhood, b))));
    array(&mut file, "Int32", "offset", 3, bonds.iter().flat_map(|b| b.offset));
    file.push_str("</PointData>\n<Points>\n");
    array(&mut file, "Float64", "Points", 3, bonds.iter().flat_map(|b| [b.xi.x, b.xi.y, b.xi.z]).map(|x| exact(&x)));
    file.push_str("</Points>\n<Verts>\n");
    array(&mut file, "Int64", "connectivity", 1, 0..bonds.len());
    array(&mut file, "Int64", "offsets", 1, 1..=bonds.len());
    file.push_str("</Verts>\n</Piece>\n</PolyData>\n</VTKFile>\n");
    Ok(file)
}

/// Writes [`neighbourhood_vtp`], whole or not at all.
///
/// # Errors
/// As [`neighbourhood_vtp`]; a file that cannot be written.
pub fn write_vtp(path: impl AsRef<Path>, neighbourhood: &Neighbourhood, moduli: &BondModuli) -> Result<()> {
    write_atomically(path, neighbourhood_vtp(neighbourhood, moduli)?)
}

/// The shortest text that reads back to the same number.
pub(super) fn exact(value: &f64) -> String {
    format!("{value:?}")
}

/// One `DataArray` in text, a tuple of `components` numbers per line.
pub(super) fn array<T: Display>(
    file: &mut String,
    kind: &str,
    name: &str,
    components: usize,
    values: impl Iterator<Item = T>,
) {
    let _ = writeln!(
        file,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">"
    );
    for (index, value) in values.enumerate() {
        let _ = write!(file, "{value}{}", if (index + 1) % components == 0 { '\n' } else { ' ' });
    }
    file.push_str("</DataArray>\n");
}

#[cfg(test)]
mod tests {
    use super::*;
    use anisobond::Error;
    use anisobond::lattice::Influence;

    /// The numbers of a named array.
    fn numbers(file: &roxmltree::Document, name: &str) -> Vec<f64> {
        let array = file.descendants().find(|node| node.attribute("Name") == Some(name)).unwrap();
        array.text().unwrap().split_whitespace().map(|word| word.parse().unwrap()).collect()
    }

    #[test]
    fn the_file_holds_the_neighbourhood() {
        let neighbourhood = Neighbourhood::sphere(3.0, 0.7e-3, Influence::Inverse).unwrap();
        let c: Vec<f64> = (0..122).map(|b| 1e21 * (1.0 + b as f64).ln()).collect();
        let across: Vec<f64> = c.iter().rev().copied().collect();
        let text =
            neighbourhood_vtp(&neighbourhood, &BondModuli { tangential: Some(&across), ..BondModuli::central(&c) })
                .unwrap();
        let file = roxmltree::Document::parse(&text).unwrap();
        let piece = file.descendants().find(|node| node.has_tag_name("Piece")).unwrap();
        assert_eq!((piece.attribute("NumberOfPoints"), piece.attribute("NumberOfVerts")), (Some("122"), Some("122")));
        let bonds = neighbourhood.bonds();
        assert_eq!(numbers(&file, "micromodulus"), c);
        assert_eq!(numbers(&file, "tangential_micromodulus"), across);
        assert_eq!(numbers(&file, "influence"), bonds.iter().map(|b| b.influence).collect::<Vec<_>>());
        let shares: Vec<_> = bonds.iter().map(|b| neighbourhood.stiffness_share(b)).collect();
        assert_eq!(numbers(&file, "stiffness_share"), shares);
        assert_eq!(numbers(&file, "Points"), bonds.iter().flat_map(|b| [b.xi.x, b.xi.y, b.xi.z]).collect::<Vec<_>>());
        assert_eq!(numbers(&file, "offset"), bonds.iter().flat_map(|b| b.offset.map(f64::from)).collect::<Vec<_>>());
        for (length, bond) in numbers(&file, "length").iter().zip(bonds) {
            assert!((length - bond.xi.norm()).abs() < 1e-15);
        }
        assert_eq!(numbers(&file, "connectivity").last(), Some(&121.0));
        assert_eq!(numbers(&file, "offsets").last(), Some(&122.0));
    }

    #[test]
    fn wrong_input_and_paths_are_refused() {
        let neighbourhood = Neighbourhood::sphere(1.0, 1.0, Influence::Constant).unwrap();
        assert!(matches!(neighbourhood_vtp(&neighbourhood, &BondModuli::central(&[1.0])), Err(Error::Failure { .. })));
        assert!(matches!(
            neighbourhood_vtp(&neighbourhood, &BondModuli::central(&[f64::INFINITY; 6])),
            Err(Error::Failure { .. })
        ));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing").join("a.vtp");
        assert!(matches!(write_vtp(&path, &neighbourhood, &BondModuli::central(&[1.0; 6])), Err(Error::File { .. })));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
