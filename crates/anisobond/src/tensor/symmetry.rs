//! The symmetry class of a tensor in an arbitrary orientation: its distance to each class, the axes that achieve it and
//! the closest tensor of the class.

use std::sync::OnceLock;

use nalgebra::{Matrix3, Matrix6, Rotation3, UnitVector3, Vector3};
use serde::{Serialize, Serializer};

use super::class::{SymmetryClass, closure};
use super::noise::{Noise, named};
use super::stiffness::Stiffness;
use super::turning::{
    Local, Mandel, View, array_of, descend, dot, eigenframes, frame_of, half_sphere, seen_from, special_directions,
};

/// How close a tensor is to one symmetry class.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClassFit {
    /// The class.
    pub class: SymmetryClass,
    /// Number of independent constants of the class.
    pub constants: usize,
    /// ‖C − C_class‖/‖C‖ with the closest tensor of the class in its best orientation.
    pub distance: f64,
    /// Rotation whose columns are the class's axes e₁ e₂ e₃ in the given frame; of all that are equivalent, the one
    /// nearest to the identity (in JSON: three rows, one axis each).
    #[serde(serialize_with = "axes_as_rows")]
    pub axes: Matrix3<f64>,
    /// The closest tensor of the class, in the given frame (in JSON: Voigt rows, Pa).
    #[serde(serialize_with = "voigt_as_rows")]
    pub closest: Stiffness,
}

/// The symmetry of a tensor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Symmetry {
    /// The class with the fewest constants within the tolerance; of tetragonal and trigonal (6 each) the nearer.
    pub class: SymmetryClass,
    /// Largest distance accepted for that class.
    pub tolerance: f64,
    /// Relative noise of the whole tensor that the distance to the class shows; `None` where the tolerance was given.
    pub noise: Option<f64>,
    /// All eight classes, from most to least symmetric. Distances never grow from a class to one that contains it.
    pub fits: [ClassFit; 8],
}

impl Symmetry {
    /// The fit of one class.
    pub fn fit(&self, class: SymmetryClass) -> &ClassFit {
        // ALL, and so `fits`, is in the order of the enum.
        &self.fits[class as usize]
    }

    /// The fit of the detected class.
    pub fn detected(&self) -> &ClassFit {
        self.fit(self.class)
    }
}

impl Stiffness {
    /// The symmetry of C in whatever orientation: min over rotations Q of ‖C − Q·P(QᵀC)‖/‖C‖ for each class, P the
    /// projection on the class in its own axes ([`SymmetryClass::project`]), and the most symmetric class within
    /// `tolerance`.
    ///
    /// The isotropic fit is a closed form. The others maximise ‖P(QᵀC)‖, which is smooth (harmonics of Q up to degree
    /// eight), globally: a covering of the frames, the eigenframes of C_ijkk and C_ikjk, and the best axes of the
    /// classes contained in it, each refined by Newton's method. An exactly symmetric tensor gets a distance of
    /// rounding, about 10⁻¹⁵.
    pub fn symmetry(&self, tolerance: f64) -> Symmetry {
        self.symmetry_within(Some(tolerance))
    }

    /// As [`Stiffness::symmetry`], with the tolerance that the noise of the tensor suggests, which its own misfits show: the most
    /// symmetric class of which the distance is at most half a percent, or what noise of up to 3 % of the norm leaves (noise of
    /// 2 % of each component leaves that) while no class that contains it fits better than by chance. Exact tensors of a lower
    /// class are told from noisy ones of a higher class down to a distance of about 1 %.
    pub fn symmetry_by_noise(&self) -> Symmetry {
        self.symmetry_within(None)
    }

    fn symmetry_within(&self, tolerance: Option<f64>) -> Symmetry {
        let fits = fits(self);
        let named = named(&Noise::NORM, &fits.map(|fit| fit.distance), tolerance);
        Symmetry { class: named.class, tolerance: named.tolerance, noise: named.noise, fits }
    }
}

/// The fits of the eight classes.
fn fits(c: &Stiffness) -> [ClassFit; 8] {
    // Isotropic tensors belong to every class in every orientation: only the rest is searched, scaled to one.
    let rest = c.mandel() - SymmetryClass::Isotropic.project(c).mandel();
    let size = rest.norm();
    let searched = size > 1e-15 * c.norm();
    let rest = array_of(&(rest / if searched { size } else { 1.0 }));
    let starts = if searched { covering(c, &rest) } else { Default::default() };

    let mut found: Vec<ClassFit> = Vec::with_capacity(8);
    for class in SymmetryClass::ALL {
        let axes = match class {
            SymmetryClass::Isotropic | SymmetryClass::Triclinic => Matrix3::identity(),
            _ => {
                let inherited = found.iter().flat_map(|smaller| inherited_axes(smaller.class, class, &smaller.axes));
                let starts: Vec<Matrix3<f64>> = starts[class as usize].iter().copied().chain(inherited).collect();
                nearest_to_identity(class, &best_axes(class, &rest, &starts))
            }
        };
        found.push(fit(class, c, axes));
    }
    std::array::from_fn(|k| found[k])
}

/// The fit of a class with given axes.
fn fit(class: SymmetryClass, c: &Stiffness, axes: Matrix3<f64>) -> ClassFit {
    let closest = match class {
        SymmetryClass::Triclinic => *c,
        SymmetryClass::Isotropic => class.project(c),
        _ => {
            let p = Invariants::of(class);
            let projected = p.project(&seen_from(&array_of(c.mandel()), &axes));
            Stiffness::from_mandel(Matrix6::from_fn(|a, b| projected[a][b])).rotated(&axes)
        }
    };
    let distance = if c.norm() > 0.0 { c.relative_error(&closest) } else { 0.0 };
    ClassFit { class, constants: class.constants(), distance, axes, closest }
}

/// The best of the starts after refinement; among equals (equivalent axes) the one nearest to the identity.
fn best_axes(class: SymmetryClass, rest: &Mandel, starts: &[Matrix3<f64>]) -> Matrix3<f64> {
    let p = Invariants::of(class);
    let mut best = (f64::INFINITY, Matrix3::identity());
    for start in starts {
        let (value, axes) = descend(rest, start, |view| p.misfit(view));
        // The value is half the squared distance: compare distances, for their rounding is that of the input.
        let (new, old) = ((2.0 * value).sqrt(), (2.0 * best.0).sqrt());
        let as_good = new <= old + 1e-14 && axes.trace() > best.1.trace();
        if new < old - 1e-14 || !old.is_finite() || as_good {
            best = (value, axes);
        }
    }
    best.1
}

/// Directions e₃ of the covering of frames: about 8° apart on the half sphere.
const DIRECTIONS: usize = 320;
/// Turns about e₃ in a quarter: 9° apart.
const SPINS: usize = 10;
/// Starts refined for each class.
const STARTS: usize = 12;
/// Starts have axes e₃ at least 12° apart.
const NEAR_COSINE: f64 = 0.978;

/// Starting frames of each class (in the order of [`SymmetryClass::ALL`]): the best of a covering of the frames, with
/// axes e₃ well apart. A quarter turn about e₃ covers every class, for each has a normaliser that contains one or has a
/// period of 60°.
fn covering(c: &Stiffness, rest: &Mandel) -> [Vec<Matrix3<f64>>; 8] {
    let mut axes: Vec<Vector3<f64>> = special_directions(c);
    axes.extend(half_sphere(DIRECTIONS));
    let mut frames: Vec<Matrix3<f64>> = axes.iter().map(frame_of).collect();
    frames.extend(eigenframes(c).iter().flat_map(|q| (0..3).map(|k| cycled(q, k))));

    // Per class: projected norm and frame, the best spin of each e₃.
    let mut best: [Vec<(f64, Matrix3<f64>)>; 8] = Default::default();
    for frame in &frames {
        let mut here = [(f64::NEG_INFINITY, *frame); 8];
        for spin in 0..SPINS {
            let angle = spin as f64 * std::f64::consts::FRAC_PI_2 / SPINS as f64;
            let q = frame * Rotation3::from_axis_angle(&Vector3::z_axis(), angle).matrix();
            let seen = seen_from(rest, &q);
            for class in SEARCHED {
                let value = Invariants::of(class).norm_squared(&seen);
                if value > here[class as usize].0 {
                    here[class as usize] = (value, q);
                }
            }
        }
        for class in SEARCHED {
            best[class as usize].push(here[class as usize]);
        }
    }
    best.map(|mut candidates| {
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut starts: Vec<Matrix3<f64>> = Vec::with_capacity(STARTS);
        for (_, q) in candidates {
            if !starts.iter().any(|s| s.column(2).dot(&q.column(2)).abs() > NEAR_COSINE) {
                starts.push(q);
            }
            if starts.len() == STARTS {
                break;
            }
        }
        starts
    })
}

/// Classes whose axes are searched.
const SEARCHED: [SymmetryClass; 6] = [
    SymmetryClass::Cubic,
    SymmetryClass::TransverselyIsotropic,
    SymmetryClass::Tetragonal,
    SymmetryClass::Trigonal,
    SymmetryClass::Orthotropic,
    SymmetryClass::Monoclinic,
];

/// The same frame with its axes renamed in a cycle, so that axis k becomes e₃.
fn cycled(q: &Matrix3<f64>, k: usize) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| q[(i, (j + k + 1) % 3)])
}

/// Axes of `class` in which every tensor of the class `smaller`, of given axes, belongs to it; none unless `smaller` is
/// directly contained in `class`.
pub(super) fn inherited_axes(smaller: SymmetryClass, class: SymmetryClass, axes: &Matrix3<f64>) -> Vec<Matrix3<f64>> {
    use SymmetryClass::{Cubic, Monoclinic, Orthotropic, Tetragonal, TransverselyIsotropic, Trigonal};
    match (smaller, class) {
        (Cubic, Tetragonal) | (Tetragonal, Orthotropic) => (0..3).map(|k| cycled(axes, k)).collect(),
        (TransverselyIsotropic, Tetragonal | Trigonal) => vec![*axes],
        (Orthotropic, Monoclinic) => (0..3).map(|k| cycled(axes, k)).collect(),
        // Threefold axis along a body diagonal, e₁ along a twofold axis across it.
        (Cubic, Trigonal) => [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
            .map(|(x, y)| {
                let (e1, e3) = (Vector3::new(y, -x, 0.0).normalize(), Vector3::new(x, y, 1.0).normalize());
                axes * Matrix3::from_columns(&[e1, e3.cross(&e1), e3])
            })
            .to_vec(),
        // The mirror of a trigonal tensor is normal to e₁, that of a monoclinic one to e₃.
        (Trigonal, Monoclinic) => vec![cycled(axes, 0)],
        _ => vec![],
    }
}

/// Of all axes that give the same closest tensor, those nearest to the identity: the class's normaliser turns axes into
/// equivalent ones; of an axis of revolution, and of a mirror's normal, only e₃ counts.
fn nearest_to_identity(class: SymmetryClass, axes: &Matrix3<f64>) -> Matrix3<f64> {
    let turn = |axis, fold: f64| *Rotation3::from_axis_angle(&axis, std::f64::consts::TAU / fold).matrix();
    let (x, z): (UnitVector3<f64>, UnitVector3<f64>) = (Vector3::x_axis(), Vector3::z_axis());
    let normaliser = match class {
        SymmetryClass::Isotropic | SymmetryClass::Triclinic => return Matrix3::identity(),
        SymmetryClass::TransverselyIsotropic | SymmetryClass::Monoclinic => {
            let n = axes.column(2).into_owned();
            let n = if n[2] < -1e-12 || (n[2].abs() <= 1e-12 && n[0] + n[1] < 0.0) { -n } else { n };
            // A right angle at most, so the shortest turn is unique.
            return Rotation3::rotation_between(&z, &n).map_or(Matrix3::identity(), |q| *q.matrix());
        }
        SymmetryClass::Cubic | SymmetryClass::Orthotropic => closure(&[turn(z, 4.0), turn(x, 4.0)]),
        SymmetryClass::Tetragonal => closure(&[turn(z, 8.0), turn(x, 2.0)]),
        SymmetryClass::Trigonal => closure(&[turn(z, 6.0), turn(x, 2.0)]),
    };
    normaliser.iter().map(|g| axes * g).max_by(|a, b| a.trace().total_cmp(&b.trace())).unwrap_or(*axes)
}

/// An orthonormal basis of a class's invariant tensors in its own axes.
pub(super) struct Invariants {
    /// Of each basis tensor the components (row, column, value) that are not zero.
    basis: Vec<Vec<(usize, usize, f64)>>,
}

impl Invariants {
    /// The basis of a class, made once.
    pub(super) fn of(class: SymmetryClass) -> &'static Invariants {
        static ALL: OnceLock<Vec<Invariants>> = OnceLock::new();
        &ALL.get_or_init(|| SymmetryClass::ALL.map(Invariants::new).into())[class as usize]
    }

    /// Gram-Schmidt on the projections of the 21 coordinate tensors.
    fn new(class: SymmetryClass) -> Self {
        let mut basis: Vec<Matrix6<f64>> = Vec::with_capacity(class.constants());
        for (a, b) in (0..6).flat_map(|a| (a..6).map(move |b| (a, b))) {
            let mut unit = Matrix6::zeros();
            unit[(a, b)] = 1.0;
            unit[(b, a)] = 1.0;
            let mut v = *class.project(&Stiffness::from_mandel(unit)).mandel();
            // Twice, against rounding.
            for _ in 0..2 {
                for e in &basis {
                    v -= e * e.dot(&v);
                }
            }
            if v.norm() > 1e-6 {
                basis.push(v.normalize());
            }
        }
        let sparse = |e: &Matrix6<f64>| {
            (0..36).map(|n| (n / 6, n % 6, e[(n / 6, n % 6)])).filter(|c| c.2.abs() > 1e-12).collect()
        };
        Invariants { basis: basis.iter().map(sparse).collect() }
    }

    /// The basis tensors.
    pub(super) fn tensors(&self) -> Vec<Matrix6<f64>> {
        let dense = |e: &Vec<(usize, usize, f64)>| {
            let mut m = Matrix6::zeros();
            e.iter().for_each(|&(a, b, value)| m[(a, b)] = value);
            m
        };
        self.basis.iter().map(dense).collect()
    }

    /// The orthogonal projection of a tensor on the class.
    fn project(&self, c: &Mandel) -> Mandel {
        let mut out = [[0.0; 6]; 6];
        for e in &self.basis {
            let coordinate = coordinate(e, c);
            for &(a, b, value) in e {
                out[a][b] += coordinate * value;
            }
        }
        out
    }

    /// ‖P C‖².
    fn norm_squared(&self, c: &Mandel) -> f64 {
        self.basis.iter().map(|e| coordinate(e, c).powi(2)).sum()
    }

    /// C − P C.
    fn residual(&self, c: &Mandel) -> Mandel {
        let p = self.project(c);
        std::array::from_fn(|a| std::array::from_fn(|b| c[a][b] - p[a][b]))
    }

    /// ½‖r‖² with r = C′ − P C′, from the residual itself so that an exact symmetry gives zero to rounding squared.
    /// Gradient r·∂C′; second derivatives (∂r)·(∂r) + r·∂²C′.
    fn misfit(&self, view: &View) -> Local {
        let r = self.residual(&view.c);
        let dr: [Mandel; 3] = std::array::from_fn(|k| self.residual(&view.d[k]));
        Local {
            value: 0.5 * dot(&r, &r),
            gradient: Vector3::from_fn(|k, _| dot(&r, &view.d[k])),
            hessian: Matrix3::from_fn(|k, l| {
                dot(&dr[k], &dr[l]) + 0.5 * (dot(&r, &view.dd[k][l]) + dot(&r, &view.dd[l][k]))
            }),
        }
    }
}

/// Coordinate of a tensor along a basis tensor.
fn coordinate(e: &[(usize, usize, f64)], c: &Mandel) -> f64 {
    e.iter().map(|&(a, b, value)| value * c[a][b]).sum()
}

pub(super) fn axes_as_rows<S: Serializer>(axes: &Matrix3<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    let rows: [[f64; 3]; 3] = std::array::from_fn(|k| std::array::from_fn(|i| axes[(i, k)]));
    rows.serialize(serializer)
}

pub(super) fn voigt_as_rows<S: Serializer>(c: &Stiffness, serializer: S) -> Result<S::Ok, S::Error> {
    c.voigt_rows().serialize(serializer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::SYMMETRY_TOLERANCE;

    #[test]
    fn bases_have_the_class_dimension_and_project_as_the_group_does() {
        let c = Matrix6::from_fn(|a, b| ((3 * a + 7 * b) as f64).sin() + ((7 * a + 3 * b) as f64).sin());
        for class in SymmetryClass::ALL {
            let p = Invariants::of(class);
            assert_eq!(p.basis.len(), class.constants(), "{class:?}");
            let expected = class.project(&Stiffness::from_mandel(c));
            let found = p.project(&array_of(&c));
            assert!((Matrix6::from_fn(|a, b| found[a][b]) - expected.mandel()).norm() < 1e-13, "{class:?}");
        }
    }

    /// A tensor of the smaller class belongs to the larger one in the inherited axes.
    #[test]
    fn inherited_axes_contain_the_smaller_class() {
        let c = Matrix6::from_fn(|a, b| ((3 * a + 7 * b) as f64).sin() + ((7 * a + 3 * b) as f64).sin());
        let axes = *Rotation3::from_euler_angles(0.3, 0.8, -1.3).matrix();
        let mut inclusions = 0;
        for smaller in SymmetryClass::ALL {
            let tensor = smaller.project(&Stiffness::from_mandel(c)).rotated(&axes);
            for class in SymmetryClass::ALL {
                for q in inherited_axes(smaller, class, &axes) {
                    assert!((q.determinant() - 1.0).abs() < 1e-14);
                    assert!(fit(class, &tensor, q).distance < 1e-14, "{smaller:?} {class:?}");
                    inclusions += 1;
                }
            }
        }
        assert_eq!(inclusions, 3 + 3 + 2 + 3 + 4 + 1);
    }

    /// Equivalent axes project equally.
    #[test]
    fn renaming_axes_keeps_the_closest_tensor() {
        let c = Stiffness::from_mandel(Matrix6::from_fn(|a, b| {
            ((2 * a + 5 * b) as f64).sin() + ((5 * a + 2 * b) as f64).sin()
        }));
        let axes = *Rotation3::from_euler_angles(2.3, 0.8, -1.3).matrix();
        for class in SEARCHED {
            let near = nearest_to_identity(class, &axes);
            assert!((near.determinant() - 1.0).abs() < 1e-14);
            assert!(fit(class, &c, axes).closest.relative_error(&fit(class, &c, near).closest) < 1e-13, "{class:?}");
            assert!(near.trace() >= axes.trace() - 1e-12);
        }
    }

    #[test]
    fn the_zero_tensor_is_isotropic() {
        let found = Stiffness::from_mandel(Matrix6::zeros()).symmetry(SYMMETRY_TOLERANCE);
        assert_eq!(found.class, SymmetryClass::Isotropic);
        assert!(found.fits.iter().all(|f| f.distance == 0.0));
    }
}
