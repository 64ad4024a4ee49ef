//! A material: a stiffness with a name, and those of the peridynamics document, built in.

use nalgebra::Matrix6;

use super::class::SymmetryClass;
use super::stiffness::Stiffness;

/// A named elastic material.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name as the user knows it.
    pub name: String,
    /// Elastic stiffness (Pa).
    pub stiffness: Stiffness,
    /// Mass density (kg/m³), where known.
    pub density: Option<f64>,
    /// Where the numbers come from; empty if not stated.
    pub source: String,
}

/// A built-in material: name, class as printed, upper triangle of the Voigt matrix (GPa) row by row, source.
struct BuiltIn {
    name: &'static str,
    class: SymmetryClass,
    upper: [f64; 21],
    source: &'static str,
}

/// The eight example materials of P (section 4.1), one per symmetry class.
#[rustfmt::skip]
const BUILT_IN: [BuiltIn; 8] = [
    BuiltIn { name: "KIO3", class: SymmetryClass::Triclinic, source: "Prakash eq (50), from de Jong et al. 2015", upper: [
        43.0, 11.0, 13.0,  1.0, -2.0,  2.0,
              35.0, 12.0,  3.0, -1.0,  3.0,
                    43.0,  2.0, -2.0,  1.0,
                          13.0,  0.0,  0.0,
                                13.0,  1.0,
                                      12.0] },
    BuiltIn { name: "CoTeO4", class: SymmetryClass::Monoclinic, source: "Prakash eq (56), from Trageser & Seleson 2019", upper: [
       135.0, 19.0, 54.0,  0.0,  0.0, 42.0,
              13.0, 15.0,  0.0,  0.0,  6.0,
                   269.0,  0.0,  0.0, 18.0,
                          14.0, 25.0,  0.0,
                                66.0,  0.0,
                                      18.0] },
    BuiltIn { name: "Te2W", class: SymmetryClass::Orthotropic, source: "Prakash eq (62), from Trageser & Seleson 2019", upper: [
       143.0,  1.0, 37.0,  0.0,  0.0,  0.0,
               3.0,  3.0,  0.0,  0.0,  0.0,
                   102.0,  0.0,  0.0,  0.0,
                           2.0,  0.0,  0.0,
                                46.0,  0.0,
                                       1.0] },
    BuiltIn { name: "Ta2C", class: SymmetryClass::Trigonal, source: "Prakash eq (69), from Trageser & Seleson 2019", upper: [
       464.0, 159.0, 141.0, -45.0,   0.0,   0.0,
              464.0, 141.0,  45.0,   0.0,   0.0,
                     493.0,   0.0,   0.0,   0.0,
                            125.0,   0.0,   0.0,
                                   125.0, -45.0,
                                          153.0] },
    BuiltIn { name: "Si", class: SymmetryClass::Tetragonal, source: "Prakash eq (75), from Trageser & Seleson 2019", upper: [
       212.0, 70.0, 58.0,  0.0,  0.0,  0.0,
             212.0, 58.0,  0.0,  0.0,  0.0,
                   179.0,  0.0,  0.0,  0.0,
                          58.0,  0.0,  0.0,
                                58.0,  0.0,
                                      85.0] },
    BuiltIn { name: "MoN", class: SymmetryClass::TransverselyIsotropic, source: "Prakash eq (81), from Trageser & Seleson 2019", upper: [
       499.0, 177.0, 235.0,   0.0,   0.0,   0.0,
              499.0, 235.0,   0.0,   0.0,   0.0,
                     714.0,   0.0,   0.0,   0.0,
                            241.0,   0.0,   0.0,
                                   241.0,   0.0,
                                          161.0] },
    BuiltIn { name: "Spinel", class: SymmetryClass::Cubic, source: "Prakash eq (87), from Trageser & Seleson 2019", upper: [
       252.0, 145.0, 145.0,   0.0,   0.0,   0.0,
              252.0, 145.0,   0.0,   0.0,   0.0,
                     252.0,   0.0,   0.0,   0.0,
                            142.0,   0.0,   0.0,
                                   142.0,   0.0,
                                          142.0] },
    BuiltIn { name: "Pyroceram", class: SymmetryClass::Isotropic, source: "Prakash eq (94), from Trageser & Seleson 2019", upper: [
       103.2, 34.4, 34.4,  0.0,  0.0,  0.0,
             103.2, 34.4,  0.0,  0.0,  0.0,
                   103.2,  0.0,  0.0,  0.0,
                          34.4,  0.0,  0.0,
                                34.4,  0.0,
                                      34.4] },
];

impl Material {
    /// Names of the built-in materials, in the document's order.
    pub fn builtin_names() -> Vec<&'static str> {
        BUILT_IN.iter().map(|m| m.name).collect()
    }

    /// A built-in material by name (letter case does not count); `None` if there is none.
    pub fn builtin(name: &str) -> Option<Material> {
        let found = BUILT_IN.iter().find(|m| m.name.eq_ignore_ascii_case(name))?;
        Some(Material {
            name: found.name.to_string(),
            stiffness: from_upper(&found.upper, 1e9),
            density: None,
            source: found.source.to_string(),
        })
    }

    /// The symmetry class under which the document prints a built-in material.
    pub fn builtin_class(name: &str) -> Option<SymmetryClass> {
        Some(BUILT_IN.iter().find(|m| m.name.eq_ignore_ascii_case(name))?.class)
    }
}

/// From the upper triangle of a Voigt matrix, row by row, times a unit (Pa).
fn from_upper(upper: &[f64; 21], unit: f64) -> Stiffness {
    let mut voigt = Matrix6::zeros();
    let mut next = upper.iter();
    for a in 0..6 {
        for b in a..6 {
            let value = next.next().expect("21 numbers fill the upper triangle") * unit;
            voigt[(a, b)] = value;
            voigt[(b, a)] = value;
        }
    }
    Stiffness::from_voigt(&voigt).expect("built-in matrices are finite and symmetric")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_materials_belong_to_their_class_and_are_positive_definite() {
        for name in Material::builtin_names() {
            let m = Material::builtin(name).unwrap();
            m.stiffness.require_positive_definite().unwrap();
            let class = Material::builtin_class(name).unwrap();
            // Ta2C's c66 is rounded: 153 for 152.5.
            assert!(m.stiffness.relative_error(&class.project(&m.stiffness)) < 1e-3, "{name}");
        }
        assert_eq!(Material::builtin("kio3").unwrap().name, "KIO3");
    }
}
