//! The eight classes of elastic symmetry and the tensors each of them allows.

use nalgebra::{Matrix3, Matrix6, Rotation3, Unit, Vector3};
use serde::Serialize;

use super::stiffness::{Stiffness, mandel_rotation};

/// One of the eight elastic symmetry classes (Chadwick, Vianello & Cowin 2001), from most to least symmetric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SymmetryClass {
    /// Every rotation; 2 constants.
    Isotropic,
    /// Three fourfold axes e₁ e₂ e₃; 3 constants.
    Cubic,
    /// Every rotation about e₃ (hexagonal crystals, layered rock); 5 constants.
    TransverselyIsotropic,
    /// Fourfold axis e₃ and mirrors normal to e₁ e₂; 6 constants.
    Tetragonal,
    /// Threefold axis e₃ and a mirror normal to e₁ (c14 = −c24 = c56); 6 constants.
    Trigonal,
    /// Mirrors normal to e₁ e₂ e₃; 9 constants.
    Orthotropic,
    /// One mirror, normal to e₃ (c16 c26 c36 c45); 13 constants.
    Monoclinic,
    /// No symmetry; 21 constants.
    Triclinic,
}

impl SymmetryClass {
    /// All classes, from most to least symmetric.
    pub const ALL: [SymmetryClass; 8] = [
        SymmetryClass::Isotropic,
        SymmetryClass::Cubic,
        SymmetryClass::TransverselyIsotropic,
        SymmetryClass::Tetragonal,
        SymmetryClass::Trigonal,
        SymmetryClass::Orthotropic,
        SymmetryClass::Monoclinic,
        SymmetryClass::Triclinic,
    ];

    /// The name used in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            SymmetryClass::Isotropic => "isotropic",
            SymmetryClass::Cubic => "cubic",
            SymmetryClass::TransverselyIsotropic => "transversely-isotropic",
            SymmetryClass::Tetragonal => "tetragonal",
            SymmetryClass::Trigonal => "trigonal",
            SymmetryClass::Orthotropic => "orthotropic",
            SymmetryClass::Monoclinic => "monoclinic",
            SymmetryClass::Triclinic => "triclinic",
        }
    }

    /// Number of independent constants in the class's own axes.
    pub fn constants(self) -> usize {
        match self {
            SymmetryClass::Isotropic => 2,
            SymmetryClass::Cubic => 3,
            SymmetryClass::TransverselyIsotropic => 5,
            SymmetryClass::Tetragonal | SymmetryClass::Trigonal => 6,
            SymmetryClass::Orthotropic => 9,
            SymmetryClass::Monoclinic => 13,
            SymmetryClass::Triclinic => 21,
        }
    }

    /// Whether tensors of another class are tensors of this one in some axes; a class contains itself.
    pub fn contains(self, smaller: SymmetryClass) -> bool {
        use SymmetryClass::{
            Cubic, Isotropic, Monoclinic, Orthotropic, Tetragonal, TransverselyIsotropic, Triclinic, Trigonal,
        };
        match self {
            Isotropic => smaller == Isotropic,
            Cubic | TransverselyIsotropic => smaller == self || smaller == Isotropic,
            Tetragonal | Trigonal => smaller == self || smaller < Tetragonal,
            Orthotropic => smaller <= Tetragonal || smaller == self,
            Monoclinic => smaller != Triclinic,
            Triclinic => true,
        }
    }

    /// The finite group (up to inversion, which no elastic tensor sees) whose invariant tensors are those of the class
    /// in its own axes. Transverse isotropy is that of a sixfold axis (Hermann's theorem: a five- or more-fold axis acts
    /// on a fourth-order tensor as an axis of revolution); isotropy is handled in [`SymmetryClass::project`].
    pub fn group(self) -> Vec<Matrix3<f64>> {
        let turn = |axis: Vector3<f64>, fold: u32| {
            *Rotation3::from_axis_angle(&Unit::new_normalize(axis), std::f64::consts::TAU / fold as f64).matrix()
        };
        let (x, z) = (Vector3::x(), Vector3::z());
        let generators = match self {
            SymmetryClass::Isotropic | SymmetryClass::Cubic => vec![turn(z, 4), turn(x, 4)],
            SymmetryClass::TransverselyIsotropic => vec![turn(z, 6), turn(x, 2)],
            SymmetryClass::Tetragonal => vec![turn(z, 4), turn(x, 2)],
            SymmetryClass::Trigonal => vec![turn(z, 3), turn(x, 2)],
            SymmetryClass::Orthotropic => vec![turn(z, 2), turn(x, 2)],
            SymmetryClass::Monoclinic => vec![turn(z, 2)],
            SymmetryClass::Triclinic => vec![],
        };
        closure(&generators)
    }

    /// The closest tensor of the class in its own axes (e₃ the principal axis): the orthogonal projection, which is the
    /// mean over the class's group.
    pub fn project(self, c: &Stiffness) -> Stiffness {
        if self == SymmetryClass::Isotropic {
            // λ and G from the two invariants of isotropy, C_iikk and C_ikik.
            let m = c.mandel();
            let trace = m.trace();
            let dilatation: f64 = (0..3).flat_map(|a| (0..3).map(move |b| m[(a, b)])).sum();
            let three_k = dilatation / 3.0;
            let two_g = (trace - three_k) / 5.0;
            return Stiffness::isotropic((three_k - two_g) / 3.0, 0.5 * two_g);
        }
        project(&self.group(), c)
    }
}

/// The mean of a tensor over a finite group: its orthogonal projection on the tensors the group leaves unchanged.
pub fn project(group: &[Matrix3<f64>], c: &Stiffness) -> Stiffness {
    let sum: Matrix6<f64> = group
        .iter()
        .map(|q| {
            let k = mandel_rotation(q);
            k * c.mandel() * k.transpose()
        })
        .sum();
    Stiffness::from_mandel(sum / group.len() as f64)
}

/// All products of the generators.
pub fn closure(generators: &[Matrix3<f64>]) -> Vec<Matrix3<f64>> {
    let mut group = vec![Matrix3::identity()];
    let mut next = 0;
    while next < group.len() {
        for g in generators {
            let product = g * group[next];
            if group.iter().all(|q| (q - product).norm() > 1e-9) {
                group.push(product);
            }
        }
        next += 1;
    }
    group
}

#[cfg(test)]
mod tests {
    use super::*;

    fn generic() -> Stiffness {
        let m = Matrix6::from_fn(|a, b| ((3 * a + 7 * b) as f64).sin() + ((7 * a + 3 * b) as f64).sin());
        Stiffness::from_mandel(m)
    }

    /// The projector's trace over the 21 coordinates is the dimension of the class.
    #[test]
    fn every_class_has_its_number_of_constants() {
        for class in SymmetryClass::ALL {
            let mut dimension = 0.0;
            for a in 0..6 {
                for b in a..6 {
                    let mut unit = Matrix6::zeros();
                    let value = if a == b { 1.0 } else { std::f64::consts::FRAC_1_SQRT_2 };
                    unit[(a, b)] = value;
                    unit[(b, a)] = value;
                    dimension += class.project(&Stiffness::from_mandel(unit)).mandel().dot(&unit);
                }
            }
            assert!((dimension - class.constants() as f64).abs() < 1e-9, "{class:?}: {dimension}");
        }
    }

    #[test]
    fn projection_is_idempotent_and_a_sixfold_axis_is_an_axis_of_revolution() {
        for class in SymmetryClass::ALL {
            let once = class.project(&generic());
            assert!(once.relative_error(&class.project(&once)) < 1e-12);
        }
        let ti = SymmetryClass::TransverselyIsotropic.project(&generic());
        let q = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.377);
        assert!(ti.relative_error(&ti.rotated(q.matrix())) < 1e-12);
    }
}
