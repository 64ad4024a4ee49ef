//! Elastic moduli along a direction, and their extremes over all directions.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::stiffness::{PAIRS, Stiffness, mandel_weight};
use super::turning::{
    Local, Mandel, View, array_of, descend, eigen3, frame_of, frame_of_pair, half_sphere, special_directions,
    starts_apart,
};
use crate::{Error, Result};

/// One extreme value and a direction (or pair of directions) where it is taken; symmetry may give others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Extreme {
    /// The value, in the unit of the quantity.
    pub value: f64,
    /// Unit direction n, its first component that is not zero positive.
    pub direction: [f64; 3],
    /// Unit direction m orthogonal to n, for quantities of a pair of directions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transverse: Option<[f64; 3]>,
}

/// The smallest and the largest value of a quantity over all directions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Extremes {
    /// The smallest value.
    pub min: Extreme,
    /// The largest value.
    pub max: Extreme,
}

/// Extremes of the directional moduli of a tensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DirectionalExtremes {
    /// Young's modulus E(n) (Pa).
    pub young: Extremes,
    /// Linear compressibility β(n) (1/Pa).
    pub linear_compressibility: Extremes,
    /// Shear modulus G(n, m) (Pa).
    pub shear: Extremes,
    /// Poisson's ratio ν(n, m).
    pub poisson: Extremes,
}

/// Directional moduli of one tensor: its compliance S, ready to be contracted with directions.
///
/// Directions need not be unit vectors, and of m only the part orthogonal to n counts; a zero n, or an m along n, gives
/// NaN.
#[derive(Clone, Copy, Debug)]
pub struct DirectionalModuli {
    /// Kelvin-Mandel compliance divided by `scale`.
    s: Mandel,
    /// Norm of the compliance (1/Pa).
    scale: f64,
    /// S_ijkk (1/Pa).
    compressibility: Matrix3<f64>,
}

impl DirectionalModuli {
    /// From a stiffness.
    ///
    /// # Errors
    /// A stiffness that is not positive definite: its moduli have poles.
    pub fn new(c: &Stiffness) -> Result<Self> {
        c.require_positive_definite()?;
        let s = c.compliance().ok_or_else(|| {
            Error::input("the stiffness is singular", "give a stiffness whose six eigenvalues are not zero")
        })?;
        let scale = s.norm();
        let compressibility = tensor3(&std::array::from_fn(|a| s[(a, 0)] + s[(a, 1)] + s[(a, 2)]));
        Ok(DirectionalModuli { s: array_of(&(s / scale)), scale, compressibility })
    }

    /// E(n) = 1/(S_ijkl n_i n_j n_k n_l) (Pa).
    pub fn young(&self, n: &Vector3<f64>) -> f64 {
        let nn = vector6(&n.normalize(), &n.normalize());
        1.0 / (self.scale * form(&self.s, &nn, &nn))
    }

    /// β(n) = S_ijkk n_i n_j (1/Pa): strain along n per unit of pressure.
    pub fn linear_compressibility(&self, n: &Vector3<f64>) -> f64 {
        let n = n.normalize();
        n.dot(&(self.compressibility * n))
    }

    /// G(n, m) = 1/(4 S_ijkl n_i m_j n_k m_l) (Pa).
    pub fn shear(&self, n: &Vector3<f64>, m: &Vector3<f64>) -> f64 {
        let (n, m) = pair(n, m);
        let nm = vector6(&n, &m);
        1.0 / (4.0 * self.scale * form(&self.s, &nm, &nm))
    }

    /// ν(n, m) = −S_ijkl n_i n_j m_k m_l / (S_pqrs n_p n_q n_r n_s): contraction along m under tension along n.
    pub fn poisson(&self, n: &Vector3<f64>, m: &Vector3<f64>) -> f64 {
        let (n, m) = pair(n, m);
        let (nn, mm) = (vector6(&n, &n), vector6(&m, &m));
        -form(&self.s, &nn, &mm) / form(&self.s, &nn, &nn)
    }

    /// The global extremes of E, β, G and ν with their directions.
    ///
    /// β is a quadratic form: its extremes are eigenvalues. At a fixed n the extremes of G and ν over m are those of a
    /// 2×2 eigenproblem, so that only n is searched: directions over the half sphere, then Newton's method on the
    /// frame (n, m) from the best of them.
    pub fn extremes(&self) -> DirectionalExtremes {
        let stiffness = Stiffness::from_mandel(nalgebra::Matrix6::from_fn(|a, b| self.s[a][b]));
        let mut sections: Vec<Section> = special_directions(&stiffness)
            .into_iter()
            .chain(half_sphere(DIRECTIONS))
            .map(|n| self.section(n))
            .collect();

        let inverse_young = |view: &View| view.component(2, 2);
        let [soft, stiff] = self.search(&sections, |s| [s.inverse_young, s.inverse_young], inverse_young);
        let young = Extremes { min: soft.young(self.scale), max: stiff.young(self.scale) };

        let inverse_shear = |view: &View| view.component(4, 4).times(2.0);
        let [soft, stiff] = self.search(&sections, |s| s.inverse_shear, inverse_shear);
        let shear = Extremes { min: soft.shear(self.scale), max: stiff.shear(self.scale) };

        // In strongly anisotropic tensors ν peaks sharply about the stiffest direction, where S_nnnn is small.
        let stiffest = Vector3::from(young.max.direction);
        sections.extend(RINGS.iter().flat_map(|&angle| ring(&stiffest, angle)).map(|n| self.section(n)));
        let poisson = |view: &View| view.component(2, 0).times(-1.0).over(view.component(2, 2));
        let [most, least] = self.search(&sections, |s| s.poisson, poisson);
        let poisson = Extremes { min: least.pair(), max: most.pair() };

        DirectionalExtremes { young, linear_compressibility: self.compressibility_extremes(), shear, poisson }
    }

    /// Extremes of β(n): the eigenvalues of S_ijkk.
    fn compressibility_extremes(&self) -> Extremes {
        let (values, vectors) = eigen3(&self.compressibility);
        let along = |k: usize| Extreme {
            value: values[k],
            direction: oriented(&vectors.column(k).into_owned()),
            transverse: None,
        };
        Extremes { min: along(0), max: along(2) }
    }

    /// All a direction n says: S_nnnn, and the extremes over m ⟂ n of 4 S_nmnm and of −S_nnmm/S_nnnn.
    fn section(&self, n: Vector3<f64>) -> Section {
        let frame = frame_of(&n);
        let (p, q) = (frame.column(0).into_owned(), frame.column(1).into_owned());
        let (nn, np, nq) = (vector6(&n, &n), vector6(&n, &p), vector6(&n, &q));
        let (s_np, s_nq, s_nn) = (times(&self.s, &np), times(&self.s, &nq), times(&self.s, &nn));
        let inverse_young = inner(&nn, &s_nn);
        let a = tensor3(&s_nn);
        let along = |m: Vector3<f64>, value: f64| (value, m);
        let extremes = |xx: f64, xy: f64, yy: f64| {
            let [(low, [lp, lq]), (high, [hp, hq])] = symmetric_2x2(xx, xy, yy);
            [along(hp * p + hq * q, high), along(lp * p + lq * q, low)]
        };
        Section {
            n,
            inverse_young: (inverse_young, p),
            inverse_shear: extremes(4.0 * inner(&np, &s_np), 4.0 * inner(&np, &s_nq), 4.0 * inner(&nq, &s_nq)),
            poisson: extremes(-p.dot(&(a * p)), -p.dot(&(a * q)), -q.dot(&(a * q)))
                .map(|(value, m)| (value / inverse_young, m)),
        }
    }

    /// The largest and the smallest value over all frames: the best sections, refined. `of` gives a section's largest
    /// and smallest value with m, `objective` the same quantity as a function of the frame (m, n×m, n).
    fn search(
        &self,
        sections: &[Section],
        of: impl Fn(&Section) -> [(f64, Vector3<f64>); 2],
        objective: impl Fn(&View) -> Local,
    ) -> [Found; 2] {
        [(0, -1.0), (1, 1.0)].map(|(which, sign)| {
            let samples: Vec<(f64, Vector3<f64>)> = sections.iter().map(|s| (sign * of(s)[which].0, s.n)).collect();
            // Special directions come first, and a later start must be better by more than rounding.
            let starts = starts_apart(&samples, NEAR_COSINE, STARTS);
            let mut best = Found { value: f64::INFINITY, frame: Matrix3::identity() };
            for i in starts {
                let start = frame_of_pair(&sections[i].n, &of(&sections[i])[which].1);
                let (value, frame) = descend(&self.s, &start, |view| objective(view).times(sign));
                if value < best.value - 1e-13 * value.abs() || !best.value.is_finite() {
                    best = Found { value, frame };
                }
            }
            Found { value: sign * best.value, frame: best.frame }
        })
    }
}

/// Directions of the half sphere that are searched: 3° apart.
const DIRECTIONS: usize = 2000;
/// Angles (radians) of the rings about the stiffest direction that are searched too, for ν.
const RINGS: [f64; 7] = [0.0, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1];
/// Starts that are refined.
const STARTS: usize = 32;
/// Starts are at least 3° apart.
const NEAR_COSINE: f64 = 0.9986;

/// Twelve directions at an angle (radians) from n.
fn ring(n: &Vector3<f64>, angle: f64) -> impl Iterator<Item = Vector3<f64>> {
    let frame = frame_of(n);
    let (s, c) = angle.sin_cos();
    (0..12).map(move |k| {
        let (sin, cos) = (k as f64 * std::f64::consts::TAU / 12.0).sin_cos();
        frame * Vector3::new(s * cos, s * sin, c)
    })
}

/// What one direction n says; values with the m where they are taken, largest first.
struct Section {
    n: Vector3<f64>,
    inverse_young: (f64, Vector3<f64>),
    inverse_shear: [(f64, Vector3<f64>); 2],
    poisson: [(f64, Vector3<f64>); 2],
}

/// An optimum over frames (axes m, n×m, n), in units of the scaled compliance.
struct Found {
    value: f64,
    frame: Matrix3<f64>,
}

impl Found {
    fn young(&self, scale: f64) -> Extreme {
        Extreme {
            value: 1.0 / (scale * self.value),
            direction: oriented(&self.frame.column(2).into_owned()),
            transverse: None,
        }
    }

    fn shear(&self, scale: f64) -> Extreme {
        Extreme { value: 1.0 / (scale * self.value), ..self.pair() }
    }

    fn pair(&self) -> Extreme {
        Extreme {
            value: self.value,
            direction: oriented(&self.frame.column(2).into_owned()),
            transverse: Some(oriented(&self.frame.column(0).into_owned())),
        }
    }
}

/// The sign of a direction does not count: the first component that is not zero is made positive.
pub(super) fn oriented(n: &Vector3<f64>) -> [f64; 3] {
    let first = n.iter().find(|x| x.abs() > 1e-9).copied().unwrap_or(1.0);
    let sign = if first < 0.0 { -1.0 } else { 1.0 };
    // Adding zero turns −0 into 0.
    std::array::from_fn(|i| sign * n[i] + 0.0)
}

/// n, and the part of m orthogonal to it, as unit vectors.
fn pair(n: &Vector3<f64>, m: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let n = n.normalize();
    (n, (m - n * n.dot(m)).normalize())
}

/// Kelvin-Mandel coordinates of the symmetric part of a⊗b.
pub(super) fn vector6(a: &Vector3<f64>, b: &Vector3<f64>) -> [f64; 6] {
    std::array::from_fn(|row| {
        let (i, j) = PAIRS[row];
        0.5 * (a[i] * b[j] + a[j] * b[i]) * mandel_weight(row)
    })
}

/// The symmetric 3×3 tensor of Kelvin-Mandel coordinates.
fn tensor3(v: &[f64; 6]) -> Matrix3<f64> {
    let mut m = Matrix3::zeros();
    for (row, &(i, j)) in PAIRS.iter().enumerate() {
        m[(i, j)] = v[row] / mandel_weight(row);
        m[(j, i)] = m[(i, j)];
    }
    m
}

pub(super) fn times(s: &Mandel, v: &[f64; 6]) -> [f64; 6] {
    std::array::from_fn(|a| inner(&s[a], v))
}

pub(super) fn inner(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn form(s: &Mandel, a: &[f64; 6], b: &[f64; 6]) -> f64 {
    inner(a, &times(s, b))
}

/// Eigenvalues, smallest first, with unit eigenvectors of [xx xy; xy yy].
fn symmetric_2x2(xx: f64, xy: f64, yy: f64) -> [(f64, [f64; 2]); 2] {
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let radius = half.hypot(xy);
    let (s, c) = (0.5 * xy.atan2(half)).sin_cos();
    [(mean - radius, [-s, c]), (mean + radius, [c, s])]
}
