//! Spheres in VTK's files: text and binary of both generations.

use std::io::Write;

use anisobond_formats::{PackingOptions, parse_packing};
use flate2::Compression;
use flate2::write::ZlibEncoder;

const POINTS: [[f64; 3]; 2] = [[0.25, 0.5, 0.75], [1.5, 1.25, 2.5]];
const RADII: [f64; 2] = [0.125, 0.25];

fn check(file: &[u8], words: &[&str]) {
    let reading = parse_packing(file, &PackingOptions::default())
        .unwrap_or_else(|e| panic!("{e}\n{}", String::from_utf8_lossy(file)));
    for ((x, r), (point, radius)) in
        reading.packing.centres().iter().zip(reading.packing.radii()).zip(POINTS.iter().zip(RADII))
    {
        assert_eq!(([x.x, x.y, x.z], *r), (*point, radius));
    }
    assert_eq!(reading.packing.len(), 2);
    for word in words {
        assert!(reading.read_as.contains(word), "{}", reading.read_as);
    }
}

fn refused(file: &[u8], part: &str) {
    let said = parse_packing(file, &PackingOptions::default()).unwrap_err().to_string();
    assert!(said.contains(part), "wanted {part:?} in {said:?}");
}

/// Text of numbers.
fn texts(numbers: impl IntoIterator<Item = f64>) -> String {
    numbers.into_iter().map(|x| format!("{x} ")).collect()
}

fn flat() -> Vec<f64> {
    POINTS.concat()
}

#[test]
fn legacy_files() {
    for (set, cells) in
        [("POLYDATA", "VERTICES 2 4\n1 0\n1 1\n"), ("UNSTRUCTURED_GRID", "CELLS 2 4\n1 0\n1 1\nCELL_TYPES 2\n1\n1\n")]
    {
        let head = format!(
            "# vtk DataFile Version 3.0\nspheres\nASCII\nDATASET {set}\nPOINTS 2 double\n{}\n{cells}",
            texts(flat())
        );
        let scalars = format!(
            "{head}POINT_DATA 2\nSCALARS mass float\nLOOKUP_TABLE default\n1 2\nSCALARS Radius float 1\nLOOKUP_TABLE default\n{}\n",
            texts(RADII)
        );
        check(scalars.as_bytes(), &["legacy VTK", set, "in text", "radius from the point data \"Radius\""]);
        let field = format!(
            "{head}POINT_DATA 2\nFIELD FieldData 2\nvelocity 3 2 float\n0 0 0 1 1 1\nDiameter 1 2 double\n{}\n",
            texts(RADII.map(|r| 2.0 * r))
        );
        check(field.as_bytes(), &["diameter from the point data"]);
        refused(head.as_bytes(), "the points have no data");
        refused(
            scalars.replace("Radius", "mass2").as_bytes(),
            "no array radius or diameter among \"mass\" and \"mass2\"",
        );
        refused(scalars.replace("0.125", "nan").as_bytes(), "SCALARS at byte");
        refused(&scalars.as_bytes()[..scalars.len() - 8], "the numbers end before all are there");
    }
    let mut binary = b"# vtk DataFile Version 4.2\nspheres (mm)\nBINARY\nDATASET POLYDATA\nPOINTS 2 double\n".to_vec();
    flat().iter().for_each(|x| binary.extend((1e3 * x).to_be_bytes()));
    binary.extend(b"\nVERTICES 2 4\n");
    [1i32, 0, 1, 1].iter().for_each(|n| binary.extend(n.to_be_bytes()));
    binary.extend(b"\nPOINT_DATA 2\nSCALARS radii float 1\nLOOKUP_TABLE default\n");
    RADII.iter().for_each(|r| binary.extend((1e3 * *r as f32).to_be_bytes()));
    binary.extend(b"\n");
    let reading = parse_packing(&binary, &PackingOptions::default()).unwrap();
    assert!((reading.packing.radii()[1] - 0.25).abs() < 1e-9 && (reading.packing.centres()[1].x - 1.5).abs() < 1e-12);
    assert!(reading.read_as.contains("in binary") && reading.read_as.contains("lengths in mm"), "{}", reading.read_as);
    refused(&binary[..binary.len() - 5], "the numbers end before all are there");
    refused(
        b"# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\n",
        "the data set is \"STRUCTURED_POINTS\"",
    );
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let one = |chunk: &[u8]| {
        let bits = chunk.iter().fold(0u32, |bits, b| bits << 8 | u32::from(*b)) << (8 * (3 - chunk.len()));
        (0..4)
            .map(|n| if n <= chunk.len() { LETTERS[(bits >> (18 - 6 * n) & 63) as usize] as char } else { '=' })
            .collect::<String>()
    };
    bytes.chunks(3).map(one).collect()
}

/// The header and the data of an array.
fn packed(bytes: &[u8], wide: bool, compressed: bool) -> (Vec<u8>, Vec<u8>) {
    let size = |n: usize| if wide { (n as u64).to_le_bytes().to_vec() } else { (n as u32).to_le_bytes().to_vec() };
    if !compressed {
        return (size(bytes.len()), bytes.to_vec());
    }
    let blocks: Vec<Vec<u8>> = bytes
        .chunks(16)
        .map(|block| {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
            encoder.write_all(block).unwrap();
            encoder.finish().unwrap()
        })
        .collect();
    let mut header = [size(blocks.len()), size(16), size(bytes.len() % 16)].concat();
    blocks.iter().for_each(|block| header.extend(size(block.len())));
    (header, blocks.concat())
}

#[test]
fn xml_files_in_every_encoding() {
    let bytes = |numbers: &[f64]| numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let single: Vec<u8> = RADII.iter().flat_map(|r| (*r as f32).to_le_bytes()).collect();
    let arrays = [("Points", "Float64", 3, bytes(&flat())), ("radii", "Float32", 1, single)];
    for set in ["PolyData", "UnstructuredGrid"] {
        for (wide, compressed, way) in [
            (false, false, "binary"),
            (true, false, "binary"),
            (false, true, "binary"),
            (true, true, "raw"),
            (true, false, "raw"),
            (false, true, "base64"),
        ] {
            let mut appended: Vec<u8> = Vec::new();
            let mut written = Vec::new();
            for (name, kind, each, bytes) in &arrays {
                let (header, data) = packed(bytes, wide, compressed);
                let tag = format!("<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{each}\"");
                let encoded = base64(&header) + &base64(&data);
                written.push(match way {
                    "binary" => format!("{tag} format=\"binary\">\n  {encoded}\n</DataArray>"),
                    _ => format!("{tag} format=\"appended\" offset=\"{}\"/>", appended.len()),
                });
                match way {
                    "raw" => appended.extend([header, data].concat()),
                    _ => appended.extend(encoded.bytes()),
                }
            }
            let header = if wide { "UInt64" } else { "UInt32" };
            let compressor = if compressed { " compressor=\"vtkZLibDataCompressor\"" } else { "" };
            let mut file = format!(
                "<?xml version=\"1.0\"?>\n<VTKFile type=\"{set}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"{header}\"{compressor}>\n\
                 <{set}><Piece NumberOfPoints=\"2\"><PointData>{}</PointData><Points>{}</Points></Piece></{set}>\n",
                written[1], written[0]
            )
            .into_bytes();
            if way != "binary" {
                file.extend(format!("<AppendedData encoding=\"{way}\">\n_").bytes());
                file.extend(&appended);
                file.extend(b"\n</AppendedData>\n");
            }
            file.extend(b"</VTKFile>\n");
            check(&file, &["VTK", set, "radius from the point data \"radii\""]);
            let lz4 = String::from_utf8_lossy(&file).replace("vtkZLib", "vtkLZ4");
            if compressed && way == "binary" {
                refused(lz4.as_bytes(), "compressed by \"vtkLZ4DataCompressor\"; save the file compressed by zlib");
            }
        }
    }
    refused(b"<VTKFile type=\"ImageData\"/>", "not VTK PolyData or UnstructuredGrid but \"ImageData\"");
    refused(b"<VTKFile type=\"PolyData\"/>", "there is no array Points");
    refused(b"<a", "the file is not XML");
}
