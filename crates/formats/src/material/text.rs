//! A material as the text of a material file.

use std::fmt::Write;

use anisobond::tensor::Material;

/// The TOML of a material: its name, source and density, and its stiffness as a matrix in Pa (Voigt), with all digits.
/// [`super::parse_material`] reads it back.
pub fn material_text(material: &Material) -> String {
    let mut text = format!("name = {}\n", quoted(&material.name));
    if !material.source.is_empty() {
        let _ = writeln!(text, "source = {}", quoted(&material.source));
    }
    if let Some(density) = material.density {
        let _ = writeln!(text, "density = \"{density:?} kg/m3\"");
    }
    text += "unit = \"Pa\"\nstiffness = [               # Voigt: 11 22 33 23 13 12\n";
    for row in material.stiffness.voigt_rows() {
        let _ = writeln!(text, "  [{}],", row.map(|c| format!("{c:?}")).join(", "));
    }
    text + "]\n"
}

/// A basic string of TOML.
fn quoted(text: &str) -> String {
    let escaped = text.chars().flat_map(|c| match c {
        '"' | '\\' => vec!['\\', c],
        c if c.is_control() => vec![' '],
        c => vec![c],
    });
    format!("\"{}\"", escaped.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse_material;

    #[test]
    fn every_built_in_material_is_read_back() {
        for name in Material::builtin_names() {
            let mut material = Material::builtin(name).unwrap();
            material.name = format!("{name} \"a\\b\"\n'");
            material.density = Some(2650.125);
            let read = parse_material(&material_text(&material), "material.toml").unwrap();
            assert_eq!(read.name, format!("{name} \"a\\b\" '"));
            assert_eq!((read.density, &read.source), (Some(2650.125), &material.source));
            assert!(read.stiffness.relative_error(&material.stiffness) < 1e-15);
        }
    }
}
