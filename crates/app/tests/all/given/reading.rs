//! Materials that tests of reading write down in many ways.
#![allow(dead_code)] // each test file uses its own part

use std::path::PathBuf;

use anisobond::tensor::{Material, Stiffness};
use anisobond_formats::parse_material;
use nalgebra::Matrix6;

pub const ROCK: &str = r#"
name = "my rock"
unit = "MPa"
class = "transversely-isotropic"
c11 = 130
c33 = 55
c13 = 28
c12 = 40
c44 = 32.25
"#;

/// Šmilauer's rock, from first principles.
pub fn rock() -> Stiffness {
    let (c11, c33, c13, c12, c44) = (130e6, 55e6, 28e6, 40e6, 32.25e6);
    let mut voigt = Matrix6::from_diagonal(&[c11, c11, c33, c44, c44, (c11 - c12) / 2.0].into());
    for (a, b, value) in [(0, 1, c12), (0, 2, c13), (1, 2, c13)] {
        voigt[(a, b)] = value;
        voigt[(b, a)] = value;
    }
    Stiffness::from_voigt(&voigt).unwrap()
}

/// A positive definite tensor without symmetry (Pa), repeatable.
pub fn generic() -> Stiffness {
    let m = Matrix6::from_fn(|a, b| ((5 * a + b) as f64).sin() + ((5 * b + a) as f64).sin());
    Stiffness::from_mandel((m * 8.0 + Matrix6::identity() * 100.0) * 1e9)
}

pub fn read(text: &str) -> Material {
    parse_material(text, "rock.toml").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

pub fn message(text: &str) -> String {
    match parse_material(text, "rock.toml") {
        Ok(material) => panic!("accepted as {material:?}:\n{text}"),
        Err(e) => e.to_string(),
    }
}

pub fn assert_same(a: &Stiffness, b: &Stiffness, what: &str) {
    assert!(a.relative_error(b) < 1e-12, "{what}: {:e}", a.relative_error(b));
}

/// The upper triangle of the Voigt matrix in GPa as ragged rows.
pub fn rows(m: &Matrix6<f64>, unit: f64, columns: impl Fn(usize) -> std::ops::Range<usize>) -> String {
    let row = |a: usize| columns(a).map(|b| format!("{:e}", m[(a, b)] / unit)).collect::<Vec<_>>().join(", ");
    format!("[{}]", (0..6).map(|a| format!("[{}]", row(a))).collect::<Vec<_>>().join(",\n  "))
}

pub fn list(values: impl Iterator<Item = f64>) -> String {
    format!("[{}]", values.map(|v| format!("{v:e}")).collect::<Vec<_>>().join(", "))
}

/// A folder of its own that is removed at the end.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("anisobond-reading-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    pub fn file(&self, name: &str, content: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, content).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

// ------------------------------------------------------------------------------------------------------------- no panics

/// The first row of a table.
pub const HEADER: &str =
    "material_id,formula,c11,c12,c13,c14,c15,c16,c22,c23,c24,c25,c26,c33,c34,c35,c36,c44,c45,c46,c55,c56,c66";

/// Its numbers of a cubic crystal.
pub const GOOD: &str = "270,100,100,0,0,0,270,100,0,0,0,270,0,0,0,85,0,0,85,0,85";
