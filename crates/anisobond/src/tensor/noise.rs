//! The symmetry class of a tensor whose numbers are noisy: how much noise there is, its own misfits say.
//!
//! A class is fitted with its constants and the angles of its axes; what is left over, 21 less their number, is noise where the
//! class is the true one. A class is taken for true where its misfit per number left over is not larger than noise may be, and
//! none of the classes that contain it fits so much better that chance would hardly do it (an F test). Where the numbers are
//! exact, the larger classes fit exactly, and so nothing but the true class passes.

use super::class::SymmetryClass;

/// Distance up to which a tensor is said to have a symmetry whatever else fits: stiffnesses are measured or computed to about
/// half a percent (tables rounded to 1 GPa lie within it for all but the softest crystals).
pub const SYMMETRY_TOLERANCE: f64 = 5e-3;

/// What may be noise: relative sizes, √21 of it over a tensor of independent components.
pub(super) struct Noise {
    /// What larger classes are not asked to fit better than: noise of one component may be zero by chance or by the table's
    /// making.
    least: f64,
    /// Beyond this it is no noise.
    most: f64,
}

impl Noise {
    /// Of distances in the norm.
    pub const NORM: Noise = Noise { least: 0.008, most: 0.03 };
    /// Of distances in the sense of energy, where noise of stiff directions counts more on soft ones.
    pub const ENERGY: Noise = Noise { least: 0.008, most: 0.05 };
}

/// About the quantile of F for one case in several thousands, with two to nine over m degrees of freedom, m = 6 … 15.
fn quantile(m: f64) -> f64 {
    12.0 * (1.0 + 8.0 / m)
}

/// Numbers of a tensor that a class cannot fit: 21 less its constants and the angles of its axes.
fn left_over(class: SymmetryClass) -> f64 {
    let adjusted = match class {
        SymmetryClass::Isotropic => 2,
        SymmetryClass::Cubic => 3 + 3,
        SymmetryClass::TransverselyIsotropic => 5 + 2,
        SymmetryClass::Tetragonal | SymmetryClass::Trigonal => 6 + 3,
        SymmetryClass::Orthotropic => 9 + 3,
        // Of its 13 constants one goes with the turn about the mirror's normal.
        SymmetryClass::Monoclinic => 13 + 2,
        SymmetryClass::Triclinic => 21,
    };
    f64::from(21 - adjusted)
}

/// A class that is named, and why.
pub(super) struct Named {
    /// The class.
    pub class: SymmetryClass,
    /// Largest distance accepted for it.
    pub tolerance: f64,
    /// Relative noise of the whole tensor that its distance shows; `None` where a tolerance was given.
    pub noise: Option<f64>,
}

/// The class of the fewest constants within a tolerance, or without one within what may be noise; of tetragonal and trigonal
/// (6 each) the nearer. `distances` are those of all classes, from most to least symmetric.
pub(super) fn named(noise: &Noise, distances: &[f64; 8], tolerance: Option<f64>) -> Named {
    let distance = |class: SymmetryClass| distances[class as usize];
    let passes = |class: &SymmetryClass| match tolerance {
        Some(tolerance) => distance(*class) <= tolerance,
        None => distance(*class) <= SYMMETRY_TOLERANCE || is_noise(noise, *class, &distance),
    };
    let passing = SymmetryClass::ALL.into_iter().filter(passes);
    let order = |a: &SymmetryClass, b: &SymmetryClass| {
        a.constants().cmp(&b.constants()).then(distance(*a).total_cmp(&distance(*b)))
    };
    let class = passing.min_by(order).unwrap_or(SymmetryClass::Triclinic);
    let free = left_over(class);
    let shown = if free > 0.0 { distance(class) * (21.0 / free).sqrt() } else { 0.0 };
    Named {
        class,
        tolerance: tolerance.unwrap_or_else(|| distance(class).max(SYMMETRY_TOLERANCE)),
        noise: tolerance.is_none().then_some(shown),
    }
}

/// Whether the distance to a class may be noise.
fn is_noise(noise: &Noise, class: SymmetryClass, distance: &impl Fn(SymmetryClass) -> f64) -> bool {
    let free = left_over(class);
    if free == 0.0 {
        return true;
    }
    let misfit = distance(class).powi(2);
    let larger = SymmetryClass::ALL.into_iter().filter(|other| *other != class && other.contains(class));
    misfit / free <= noise.most.powi(2) / 21.0
        && larger.filter(|other| left_over(*other) > 0.0).all(|other| {
            let (rest, own) = (left_over(other), distance(other).powi(2));
            let scatter = (own / rest).max(noise.least.powi(2) / 21.0);
            (misfit - own) / (free - rest) <= quantile(rest) * scatter
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distances from isotropic to triclinic.
    fn class_of(distances: [f64; 8]) -> SymmetryClass {
        named(&Noise::NORM, &distances, None).class
    }

    #[test]
    fn a_jump_of_the_misfit_tells_the_class() {
        // Trigonal with noise of 1 %, then the same without noise, then one of no class.
        assert_eq!(class_of([0.32, 0.12, 0.23, 0.12, 0.0075, 0.09, 0.005, 0.0]), SymmetryClass::Trigonal);
        assert_eq!(class_of([0.32, 0.12, 0.23, 0.12, 0.0, 0.09, 0.0, 0.0]), SymmetryClass::Trigonal);
        assert_eq!(class_of([0.4, 0.35, 0.3, 0.14, 0.28, 0.11, 0.067, 0.0]), SymmetryClass::Triclinic);
        // Exact numbers: two percent from tetragonal is not noise, for orthotropic is exact.
        assert_eq!(class_of([0.2, 0.18, 0.1, 0.02, 0.1, 0.0, 0.0, 0.0]), SymmetryClass::Orthotropic);
        // The nearer of two with as many constants.
        assert_eq!(class_of([0.1, 0.1, 0.1, 4e-3, 3e-3, 1e-3, 0.0, 0.0]), SymmetryClass::Trigonal);
    }

    #[test]
    fn a_tolerance_that_is_given_is_kept_to() {
        let distances = [0.32, 0.12, 0.23, 0.12, 0.0075, 0.09, 0.005, 0.0];
        let strict = named(&Noise::NORM, &distances, Some(0.001));
        assert_eq!((strict.class, strict.tolerance, strict.noise), (SymmetryClass::Triclinic, 0.001, None));
        let own = named(&Noise::NORM, &distances, None);
        assert_eq!(own.tolerance, 0.0075);
        assert!((own.noise.unwrap() - 0.0075 * (21.0f64 / 12.0).sqrt()).abs() < 1e-15);
    }
}
