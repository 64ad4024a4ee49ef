//! The case that tests of case files add to and replace in.
#![allow(dead_code)] // each test file uses its own part

use std::path::{Path, PathBuf};

use anisobond::experiment::Problem;
use anisobond::lattice::generate::{Crystal, crystal};
use anisobond_app::CaseFile;
use anisobond_formats::{PackingFormat, packing_text};
use nalgebra::Vector3;

/// A small block of everything that a case needs; the tests add to it and replace in it.
pub const BLOCK: &str = r#"
material = "Pyroceram"
density = "2600 kg/m3"

[body]
box = { min = "0, 0, 0 mm", max = "10, 6, 4 mm" }

[grid]
spacing = "1 mm"

[motion]
duration = "1 us"
"#;

pub fn case(text: &str) -> CaseFile {
    CaseFile::parse(text, "block.toml", &[]).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

pub fn problem(text: &str) -> Problem {
    case(text).problem().unwrap_or_else(|e| panic!("{e}\n{text}"))
}

pub fn with(more: &str) -> Problem {
    problem(&format!("{BLOCK}\n{more}"))
}

/// The message of a case that is refused, while parsed or while resolved.
pub fn message(text: &str) -> String {
    match CaseFile::parse(text, "block.toml", &[]).and_then(|c| c.problem()) {
        Ok(_) => panic!("accepted:\n{text}"),
        Err(e) => e.to_string(),
    }
}

/// The files that examples refer to.
pub fn files() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    write("part.stl", &binary_stl(&ball(3)));
    write("orientations.csv", b"phi1,Phi,phi2\n10,20,30\n40,50,60\n");
    write("energies.csv", b"n1,n2,n3,G\n0,0,1,3.8\n1,0,0,10\n");
    write("load.csv", b"t,value\n0,0\n0.001,1\n");
    write(
        "rock.toml",
        b"unit = 'MPa'\nclass = 'transversely-isotropic'\nc11 = 130\nc33 = 55\nc13 = 28\nc12 = 40\nc44 = 32.25\n",
    );
    write("influence.csv", b"0,1\n1,0.5\n");
    let spheres = crystal(Crystal::Fcc, 1e-3, [4, 4, 4], 0.0, 0).unwrap();
    write("spheres.txt", packing_text(&spheres, PackingFormat::of_name("spheres.txt").unwrap()).as_bytes());
    folder
}

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A ball of triangles on a sphere of radius 1, from an octahedron split `times` over.
pub fn ball(times: usize) -> Vec<[Vector3<f64>; 3]> {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let mut triangles = Vec::new();
    for (a, b, c) in [(x, y, z), (y, -x, z), (-x, -y, z), (-y, x, z)] {
        triangles.push([a, b, c]);
        triangles.push([b, a, -c]);
    }
    // Coordinates as an STL file holds them, so that corners are the same points.
    let round = |v: Vector3<f64>| v.normalize().map(|c| f64::from(c as f32));
    for _ in 0..times {
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) = (round(a + b), round(b + c), round(c + a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    triangles
}

pub fn binary_stl(triangles: &[[Vector3<f64>; 3]]) -> Vec<u8> {
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for t in triangles {
        bytes.extend([0; 12]);
        t.iter()
            .flat_map(|p| p.iter().copied().collect::<Vec<_>>())
            .for_each(|x| bytes.extend((x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}
