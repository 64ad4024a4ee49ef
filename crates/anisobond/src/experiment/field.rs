//! The register of what is measured in a run: fields of its frames and slices, quantities of its probes. Case files, VTK files,
//! pictures and Python read names, units and components here.

use nalgebra::Matrix3;

use crate::tensor::PAIRS;

/// A field that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldName {
    /// Displacement (m).
    Displacement,
    /// Velocity (m/s).
    Velocity,
    /// Bond forces (N).
    Force,
    /// Damage: share of bonds that are broken (–).
    Damage,
    /// Strain-energy density (J/m³).
    Energy,
    /// Strain (–), six components.
    Strain,
    /// Stress C:ε (Pa), six components.
    Stress,
    /// Virial stress of the bonds (Pa), six components.
    Virial,
    /// Von Mises' equivalent of the stress (Pa).
    VonMises,
    /// Principal stresses (Pa), the largest first.
    PrincipalStress,
    /// Largest stretch of a bond (–).
    Stretch,
    /// Mean plastic stretch of bonds (–).
    PlasticStretch,
    /// Number of the region.
    Region,
}

/// What one number of a field with several components is, for a picture that names none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// The field has one number.
    Value,
    /// The length of a vector.
    Length,
    /// The norm of a symmetric tensor, √(σ:σ), off-diagonal components twice.
    Norm,
    /// The first component.
    First,
}

/// What a field is called, and what its numbers mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldAbout {
    /// Name in case files.
    pub key: &'static str,
    /// Name in VTK files and pictures.
    pub title: &'static str,
    /// SI unit; empty of pure numbers.
    pub unit: &'static str,
    /// Names of its components in VTK's order; none of a scalar.
    pub components: &'static [&'static str],
    /// What a picture shows that names no component.
    pub shown: Shown,
    /// What its numbers mean, in one sentence.
    pub meaning: &'static str,
}

const VECTOR: &[&str] = &["x", "y", "z"];
const TENSOR: &[&str] = &["xx", "yy", "zz", "xy", "yz", "xz"];

impl FieldName {
    /// All fields, in the order of the documents.
    pub const ALL: [FieldName; 13] = [
        FieldName::Displacement,
        FieldName::Velocity,
        FieldName::Force,
        FieldName::Damage,
        FieldName::Energy,
        FieldName::Strain,
        FieldName::Stress,
        FieldName::VonMises,
        FieldName::PrincipalStress,
        FieldName::Virial,
        FieldName::Stretch,
        FieldName::PlasticStretch,
        FieldName::Region,
    ];

    /// Its entry in the register.
    pub const fn about(self) -> FieldAbout {
        let (key, title, unit, components, shown, meaning) = match self {
            FieldName::Displacement => {
                ("displacement", "displacement", "m", VECTOR, Shown::Length, "displacement from the start")
            }
            FieldName::Velocity => {
                ("velocity", "velocity", "m/s", VECTOR, Shown::Length, "velocity; zero in equilibrium")
            }
            FieldName::Force => ("force", "force", "N", VECTOR, Shown::Length, "sum of the bonds' forces on a node"),
            FieldName::Damage => {
                ("damage", "damage", "", &[] as &[&str], Shown::Value, "share of a node's bonds that are broken")
            }
            FieldName::Energy => (
                "energy",
                "energy density",
                "J/m³",
                &[] as &[&str],
                Shown::Value,
                "strain energy over volume, half of a bond's at either end",
            ),
            FieldName::Strain => (
                "strain",
                "strain",
                "",
                TENSOR,
                Shown::Norm,
                "least-squares strain of a node's neighbours (Green-Lagrange's at finite kinematics)",
            ),
            FieldName::Stress => (
                "stress",
                "stress",
                "Pa",
                TENSOR,
                Shown::Norm,
                "C:ε of the strain and the stiffness that the lattice has (Cauchy's at finite kinematics)",
            ),
            FieldName::Virial => (
                "virial",
                "virial stress",
                "Pa",
                TENSOR,
                Shown::Norm,
                "what the bonds carry, ½ Σ f⊗ξ over volume; too small at surfaces, where bonds are missing",
            ),
            FieldName::VonMises => (
                "von_mises",
                "von Mises stress",
                "Pa",
                &[] as &[&str],
                Shown::Value,
                "√(3/2 s:s) of the deviator s of the stress",
            ),
            FieldName::PrincipalStress => (
                "principal_stress",
                "principal stress",
                "Pa",
                &["1", "2", "3"] as &[&str],
                Shown::First,
                "principal values of the stress, the largest first; tension is positive",
            ),
            FieldName::Stretch => (
                "stretch",
                "largest bond stretch",
                "",
                &[] as &[&str],
                Shown::Value,
                "the largest elongation over length among a node's unbroken bonds, which is compared with the critical stretch",
            ),
            FieldName::PlasticStretch => (
                "plastic_stretch",
                "plastic stretch",
                "",
                &[] as &[&str],
                Shown::Value,
                "mean over a node's bonds of the stretch at which they are without force, tension or compression",
            ),
            FieldName::Region => (
                "region",
                "region",
                "",
                &[] as &[&str],
                Shown::Value,
                "number of the region from 1; 0 where there is no node",
            ),
        };
        FieldAbout { key, title, unit, components, shown, meaning }
    }

    /// Numbers per node.
    pub const fn numbers(self) -> usize {
        match self.about().components.len() {
            0 => 1,
            n => n,
        }
    }

    /// Its title with its unit, the name of its array in VTK files.
    pub fn labelled(self) -> String {
        let FieldAbout { title, unit, .. } = self.about();
        if unit.is_empty() { title.to_string() } else { format!("{title} ({unit})") }
    }

    /// What a picture shows of it: the name of a component or norm.
    pub fn shown(self, component: Option<usize>) -> String {
        let about = self.about();
        match (component.and_then(|c| about.components.get(c)), about.shown) {
            (Some(component), _) => format!("{} {component}", about.title),
            (None, Shown::Value) => about.title.into(),
            (None, Shown::Length) => format!("length of the {}", about.title),
            (None, Shown::Norm) => format!("norm of the {}", about.title),
            (None, Shown::First) => format!("{} {}", about.title, about.components[0]),
        }
    }

    /// That number of a node's values.
    pub fn number(self, component: Option<usize>, values: &[f32]) -> f32 {
        match (component, self.about().shown, values) {
            (Some(c), _, values) => values[c],
            (None, Shown::Norm, [xx, yy, zz, xy, yz, xz]) => {
                (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
            }
            (None, Shown::Length, vector) => vector.iter().map(|x| x * x).sum::<f32>().sqrt(),
            (None, _, values) => values[0],
        }
    }
}

/// What a probe measures, over its nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Mean displacement (m), three columns.
    Displacement,
    /// Mean velocity (m/s), three columns.
    Velocity,
    /// Sum of the forces that hold the nodes (N), three columns: minus the bonds' forces on them.
    Reaction,
    /// Mean damage (–), one column.
    Damage,
    /// Mean strain (–), six columns.
    Strain,
    /// Mean stress C:ε (Pa), six columns.
    Stress,
}

impl Quantity {
    /// All quantities, by their names in case files.
    pub const NAMES: [(&'static str, Quantity); 6] = [
        ("displacement", Quantity::Displacement),
        ("velocity", Quantity::Velocity),
        ("reaction", Quantity::Reaction),
        ("damage", Quantity::Damage),
        ("strain", Quantity::Strain),
        ("stress", Quantity::Stress),
    ];

    /// Endings of the names of its columns, with their units.
    pub const fn columns(self) -> &'static [&'static str] {
        match self {
            Quantity::Displacement => &["ux_m", "uy_m", "uz_m"],
            Quantity::Velocity => &["vx_m_s", "vy_m_s", "vz_m_s"],
            Quantity::Reaction => &["Fx_N", "Fy_N", "Fz_N"],
            Quantity::Damage => &["damage"],
            Quantity::Strain => &["strain_xx", "strain_yy", "strain_zz", "strain_yz", "strain_xz", "strain_xy"],
            Quantity::Stress => {
                &["stress_xx_Pa", "stress_yy_Pa", "stress_zz_Pa", "stress_yz_Pa", "stress_xz_Pa", "stress_xy_Pa"]
            }
        }
    }
}

/// The six components of a symmetric matrix in VTK's order xx yy zz xy yz xz; of another those of its symmetric part.
pub(super) fn symmetric(m: &Matrix3<f64>) -> [f32; 6] {
    [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|(i, j)| (0.5 * (m[(i, j)] + m[(j, i)])) as f32)
}

/// √(3/2 s:s), s the deviator of a stress.
pub(super) fn von_mises(stress: &Matrix3<f64>) -> f32 {
    let deviator = stress - Matrix3::from_diagonal_element(stress.trace() / 3.0);
    (1.5f64.sqrt() * deviator.norm()) as f32
}

/// Principal values of a stress, the largest first.
pub(super) fn principal(stress: &Matrix3<f64>) -> [f32; 3] {
    let mut values: [f64; 3] = stress.symmetric_eigenvalues().into();
    values.sort_by(|a, b| b.total_cmp(a));
    values.map(|v| v as f32)
}

/// Means of the components 11 22 33 23 13 12 of symmetric matrices; zeros of none.
pub(super) fn mean_components(matrices: impl Iterator<Item = Matrix3<f64>>) -> Vec<f64> {
    let (mut sum, mut count) = (Matrix3::zeros(), 0.0f64);
    matrices.for_each(|m| {
        sum += m;
        count += 1.0;
    });
    PAIRS.iter().map(|&pair| sum[pair] / count.max(1.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_is_in_the_register_once() {
        for (i, a) in FieldName::ALL.iter().enumerate() {
            for b in &FieldName::ALL[..i] {
                assert!(a.about().key != b.about().key && a.labelled() != b.labelled());
            }
            assert_eq!(a.about().components.is_empty(), a.about().shown == Shown::Value);
        }
    }

    #[test]
    fn a_picture_says_what_it_shows() {
        let shown = |field: FieldName, component| (field.shown(component), field.number(component, &[3.0, -4.0, 0.0]));
        assert_eq!(shown(FieldName::Displacement, None), ("length of the displacement".into(), 5.0));
        assert_eq!(shown(FieldName::Displacement, Some(1)), ("displacement y".into(), -4.0));
        assert_eq!(shown(FieldName::PrincipalStress, None), ("principal stress 1".into(), 3.0));
        assert_eq!(shown(FieldName::Damage, None), ("damage".into(), 3.0));
        let tensor = [1.0, 2.0, 2.0, 0.0, 2.0, 2.0];
        assert_eq!(FieldName::Stress.number(None, &tensor), 5.0);
        assert_eq!(FieldName::Stress.number(Some(4), &tensor), 2.0);
        assert_eq!(FieldName::Stress.shown(None), "norm of the stress");
        assert_eq!(FieldName::Strain.shown(Some(3)), "strain xy");
    }
}
