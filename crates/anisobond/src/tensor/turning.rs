//! A tensor seen from a turned frame, how it changes as the frame turns, and descent over frames.
//!
//! Plain arrays: these are the inner loops of the searches over directions and axes.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::stiffness::{Stiffness, mandel_rotation};

/// A symmetric 6×6 Kelvin-Mandel matrix.
pub(super) type Mandel = [[f64; 6]; 6];

/// The Kelvin-Mandel matrix as an array.
pub(super) fn array_of(m: &nalgebra::Matrix6<f64>) -> Mandel {
    std::array::from_fn(|a| std::array::from_fn(|b| m[(a, b)]))
}

/// Components C′ = Kᵀ C K in the frame whose axes are the columns of Q (K the Kelvin-Mandel matrix of Q).
pub(super) fn seen_from(c: &Mandel, q: &Matrix3<f64>) -> Mandel {
    let k = array_of(&mandel_rotation(q));
    let mut ck = [[0.0; 6]; 6];
    for a in 0..6 {
        for m in 0..6 {
            for b in 0..6 {
                ck[a][b] += c[a][m] * k[m][b];
            }
        }
    }
    let mut out = [[0.0; 6]; 6];
    for m in 0..6 {
        for a in 0..6 {
            for b in 0..6 {
                out[a][b] += k[m][a] * ck[m][b];
            }
        }
    }
    out
}

/// ∂C/∂ω_k = L_k C − C L_k: the change of a tensor turned about axis k, L_k the antisymmetric 6×6 generator of
/// ε → Wε − εW, W the cross product with e_k.
pub(super) fn turned_about(k: usize, c: &Mandel) -> Mandel {
    let (p, q) = ((k + 1) % 3, (k + 2) % 3);
    let (pq, qk, pk) = (3 + k, 3 + p, 3 + q);
    let root2 = std::f64::consts::SQRT_2;
    let mut lc = [[0.0; 6]; 6];
    for b in 0..6 {
        lc[p][b] = -root2 * c[pq][b];
        lc[q][b] = root2 * c[pq][b];
        lc[pq][b] = root2 * (c[p][b] - c[q][b]);
        lc[qk][b] = c[pk][b];
        lc[pk][b] = -c[qk][b];
    }
    let mut out = lc;
    for a in 0..6 {
        for b in 0..6 {
            out[a][b] += lc[b][a];
        }
    }
    out
}

/// Σ_ab A_ab B_ab.
pub(super) fn dot(a: &Mandel, b: &Mandel) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()).sum()
}

/// A tensor in a turned frame with its first and second derivatives under further turns ω (rotation vector).
pub(super) struct View {
    /// C′.
    pub c: Mandel,
    /// ∂C′/∂ω_k.
    pub d: [Mandel; 3],
    /// Before symmetrisation: [L_k, [L_l, C′]]; ∂²C′/∂ω_k∂ω_l is the mean of kl and lk.
    pub dd: [[Mandel; 3]; 3],
}

impl View {
    fn new(c: &Mandel, q: &Matrix3<f64>) -> Self {
        let c = seen_from(c, q);
        let d: [Mandel; 3] = std::array::from_fn(|k| turned_about(k, &c));
        let dd = std::array::from_fn(|k| std::array::from_fn(|l| turned_about(k, &d[l])));
        View { c, d, dd }
    }

    /// One component C′_ab and its derivatives.
    pub fn component(&self, a: usize, b: usize) -> Local {
        Local {
            value: self.c[a][b],
            gradient: Vector3::from_fn(|k, _| self.d[k][a][b]),
            hessian: Matrix3::from_fn(|k, l| 0.5 * (self.dd[k][l][a][b] + self.dd[l][k][a][b])),
        }
    }
}

/// A function of the frame at one frame: value, gradient and second derivatives under a further turn ω.
#[derive(Clone, Copy)]
pub(super) struct Local {
    pub value: f64,
    pub gradient: Vector3<f64>,
    pub hessian: Matrix3<f64>,
}

impl Local {
    /// The function times a number.
    pub fn times(self, factor: f64) -> Self {
        Local { value: factor * self.value, gradient: factor * self.gradient, hessian: factor * self.hessian }
    }

    /// f = N/D: f′ = (N′ − f D′)/D, f″ = (N″ − f D″ − f′D′ᵀ − D′f′ᵀ)/D.
    pub fn over(self, d: Local) -> Self {
        let value = self.value / d.value;
        let gradient = (self.gradient - value * d.gradient) / d.value;
        let cross = gradient * d.gradient.transpose();
        let hessian = (self.hessian - value * d.hessian - cross - cross.transpose()) / d.value;
        Local { value, gradient, hessian }
    }
}

/// Longest turn of one step (radians).
const LONGEST_STEP: f64 = 0.3;
/// A step shorter than this (radians) has converged.
const SHORTEST_STEP: f64 = 1e-15;
/// Curvatures below this fraction of the objective's scale are flat: no step along them.
const FLAT: f64 = 1e-11;
/// Steps before giving up; Newton's method needs about six.
const MOST_STEPS: usize = 60;

/// A local minimum over frames by Newton's method, from the frame `start` (columns are axes): uphill curvatures are
/// turned downhill, a step that does not descend is halved. Never ends above its start.
///
/// `c` and the objective should be of order one, so that flat directions (a circle of optima) are recognised.
pub(super) fn descend(c: &Mandel, start: &Matrix3<f64>, objective: impl Fn(&View) -> Local) -> (f64, Matrix3<f64>) {
    let mut q = *start;
    let mut here = objective(&View::new(c, &q));
    for _ in 0..MOST_STEPS {
        let mut step = newton_step(&here);
        if step.norm() <= SHORTEST_STEP {
            break;
        }
        let mut moved = false;
        for _ in 0..12 {
            // C′(ω) = exp(ω) C′ is the tensor seen from axes turned the other way.
            let next_q = q * Rotation3::from_scaled_axis(-step).matrix();
            let next = objective(&View::new(c, &next_q));
            if next.value < here.value {
                (q, here, moved) = (next_q, next, true);
                break;
            }
            step *= 0.5;
        }
        if !moved {
            break;
        }
    }
    (here.value, orthonormal(&q))
}

/// −Σ v (v·g)/|h| over the eigenpairs (h, v) of the second derivatives that are not flat.
fn newton_step(here: &Local) -> Vector3<f64> {
    if !here.hessian.iter().chain(here.gradient.iter()).all(|x| x.is_finite()) {
        return Vector3::zeros();
    }
    let (curvatures, vectors) = eigen3(&here.hessian);
    let flat = FLAT * curvatures.amax().max(f64::MIN_POSITIVE);
    let mut step = Vector3::zeros();
    for k in 0..3 {
        let (h, v) = (curvatures[k].abs(), vectors.column(k));
        if h > flat {
            step -= v * (v.dot(&here.gradient) / h);
        }
    }
    let length = step.norm();
    if length > LONGEST_STEP { step * (LONGEST_STEP / length) } else { step }
}

/// The rotation nearest to a matrix that is one but for rounding (Gram-Schmidt).
pub(super) fn orthonormal(q: &Matrix3<f64>) -> Matrix3<f64> {
    let z = q.column(2).normalize();
    let x = (q.column(0) - z * z.dot(&q.column(0))).normalize();
    Matrix3::from_columns(&[x, z.cross(&x), z])
}

/// Eigenvalues, ascending, and unit eigenvectors as columns of a symmetric 3×3 matrix, by Jacobi's rotations: each makes
/// one off-diagonal entry zero. The number of sweeps is bounded whatever the matrix holds, and small eigenvalues of
/// graded matrices keep their digits.
pub(super) fn eigen3(m: &Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let mut a = *m;
    let mut v = Matrix3::identity();
    for _ in 0..30 {
        if a[(0, 1)] == 0.0 && a[(0, 2)] == 0.0 && a[(1, 2)] == 0.0 {
            break;
        }
        for (p, q, r) in [(0, 1, 2), (0, 2, 1), (1, 2, 0)] {
            let apq = a[(p, q)];
            if apq.abs() <= 1e-18 * (a[(p, p)].abs() + a[(q, q)].abs()) {
                (a[(p, q)], a[(q, p)]) = (0.0, 0.0);
                continue;
            }
            // t = tan φ, the smaller root of t² + 2θt − 1 = 0.
            let theta = (a[(q, q)] - a[(p, p)]) / (2.0 * apq);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = t.hypot(1.0).recip();
            let s = t * c;
            a[(p, p)] -= t * apq;
            a[(q, q)] += t * apq;
            (a[(p, q)], a[(q, p)]) = (0.0, 0.0);
            let (arp, arq) = (a[(r, p)], a[(r, q)]);
            a[(r, p)] = c * arp - s * arq;
            a[(r, q)] = s * arp + c * arq;
            (a[(p, r)], a[(q, r)]) = (a[(r, p)], a[(r, q)]);
            for i in 0..3 {
                let (vp, vq) = (v[(i, p)], v[(i, q)]);
                v[(i, p)] = c * vp - s * vq;
                v[(i, q)] = s * vp + c * vq;
            }
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[(i, i)].total_cmp(&a[(j, j)]));
    (Vector3::from_fn(|k, _| a[(order[k], order[k])]), Matrix3::from_fn(|i, k| v[(i, order[k])]))
}

/// A right-handed frame with third axis n (unit).
pub(super) fn frame_of(n: &Vector3<f64>) -> Matrix3<f64> {
    let least = n.iamin();
    let e = Vector3::from_fn(|i, _| if i == least { 1.0 } else { 0.0 });
    let x = (e - n * n.dot(&e)).normalize();
    Matrix3::from_columns(&[x, n.cross(&x), *n])
}

/// The frame of n (unit) and m (unit, orthogonal to n): axes m, n×m, n.
pub(super) fn frame_of_pair(n: &Vector3<f64>, m: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_columns(&[*m, n.cross(m), *n])
}

/// `count` directions spread evenly over the half sphere x₃ > 0 (golden spiral).
pub(super) fn half_sphere(count: usize) -> impl Iterator<Item = Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |i| {
        let z = (i as f64 + 0.5) / count as f64;
        let (s, c) = (golden * i as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * c, r * s, z)
    })
}

/// Of directions with values, at most `most` starts: the smallest that are pairwise apart by more than an angle of given
/// cosine, in the order of the list. Several starts in one basin are wanted: some descents leave it for a lower one.
pub(super) fn starts_apart(samples: &[(f64, Vector3<f64>)], cosine: f64, most: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..samples.len()).collect();
    order.sort_by(|&i, &j| samples[i].0.total_cmp(&samples[j].0));
    let mut out: Vec<usize> = Vec::with_capacity(most);
    for i in order {
        if out.len() == most {
            break;
        }
        if !out.iter().any(|&j| samples[i].1.dot(&samples[j].1).abs() > cosine) {
            out.push(i);
        }
    }
    out.sort_unstable();
    out
}

/// Directions that symmetric tensors single out: axes, face and body diagonals, and the eigenvectors of C_ijkk and
/// C_ikjk, which lie along or across the axes of every symmetry the tensor has (Cowin & Mehrabadi 1987).
pub(super) fn special_directions(c: &Stiffness) -> Vec<Vector3<f64>> {
    let mut out = vec![Vector3::x(), Vector3::y(), Vector3::z()];
    for (i, j, k) in [(0, 1, 1), (0, 1, -1), (1, 0, 1), (1, 0, -1), (1, 1, 0), (1, -1, 0)] {
        out.push(Vector3::new(i as f64, j as f64, k as f64).normalize());
    }
    for (i, j) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
        out.push(Vector3::new(i as f64, j as f64, 1.0).normalize());
    }
    for q in eigenframes(c) {
        out.extend((0..3).map(|k| q.column(k).into_owned()));
    }
    out
}

/// Eigenvectors (columns) of the dilatational tensor C_ijkk and of the Voigt tensor C_ikjk.
pub(super) fn eigenframes(c: &Stiffness) -> [Matrix3<f64>; 2] {
    let contract = |f: &dyn Fn(usize, usize, usize) -> f64| Matrix3::from_fn(|i, j| (0..3).map(|k| f(i, j, k)).sum());
    let dilatational: Matrix3<f64> = contract(&|i, j, k| c.component(i, j, k, k));
    let voigt: Matrix3<f64> = contract(&|i, j, k| c.component(i, k, j, k));
    [dilatational, voigt].map(|m| {
        let mut q = eigen3(&m).1;
        if q.determinant() < 0.0 {
            q.column_mut(0).neg_mut();
        }
        q
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix6;

    fn generic() -> Mandel {
        array_of(&Matrix6::from_fn(|a, b| ((3 * a + 7 * b) as f64).sin() + ((7 * a + 3 * b) as f64).sin()))
    }

    /// First and second derivatives against central differences of the turned tensor.
    #[test]
    fn derivatives_are_those_of_the_turned_tensor() {
        let c = generic();
        let at = |w: Vector3<f64>| seen_from(&c, &Rotation3::from_scaled_axis(-w).into_inner());
        let view = View::new(&c, &Matrix3::identity());
        let h = 1e-4;
        let unit = |k: usize| Vector3::from_fn(|i, _| if i == k { h } else { 0.0 });
        for (a, b) in [(0, 0), (2, 0), (4, 4), (3, 5)] {
            let local = view.component(a, b);
            for k in 0..3 {
                let first = (at(unit(k))[a][b] - at(-unit(k))[a][b]) / (2.0 * h);
                assert!((local.gradient[k] - first).abs() < 1e-6, "{a}{b} {k}");
                for l in 0..3 {
                    let (p, m) = (unit(k) + unit(l), unit(k) - unit(l));
                    let second = (at(p)[a][b] - at(m)[a][b] - at(-m)[a][b] + at(-p)[a][b]) / (4.0 * h * h);
                    assert!((local.hessian[(k, l)] - second).abs() < 1e-5, "{a}{b} {k}{l}");
                }
            }
        }
    }

    #[test]
    fn eigenpairs_of_symmetric_matrices() {
        let q = *Rotation3::from_euler_angles(0.4, -1.1, 2.0).matrix();
        for values in [[1.0, 2.0, 3.0], [-1.0, -1.0, 5.0], [0.0, 0.0, 0.0], [4.0, 4.0, 4.0], [1e-9, 1.0, 1e3]] {
            for turn in [Matrix3::identity(), q] {
                let m = turn * Matrix3::from_diagonal(&Vector3::from(values)) * turn.transpose();
                let m = (m + m.transpose()) * 0.5;
                let (found, vectors) = eigen3(&m);
                assert!((found - Vector3::from(values)).amax() <= 1e-14 * (1.0 + values[2]));
                assert!((m * vectors - vectors * Matrix3::from_diagonal(&found)).amax() <= 1e-14 * (1.0 + values[2]));
                assert!((vectors.transpose() * vectors - Matrix3::identity()).amax() < 1e-14);
            }
        }
        assert!(eigen3(&Matrix3::from_element(f64::NAN)).0[0].is_nan());
    }

    #[test]
    fn seen_from_is_the_rotation_back() {
        let q = *Rotation3::from_euler_angles(0.4, -1.1, 2.0).matrix();
        let c = Matrix6::from_fn(|a, b| generic()[a][b]);
        let expected = array_of(Stiffness::from_mandel(c).rotated(&q.transpose()).mandel());
        let found = seen_from(&generic(), &q);
        for n in 0..36 {
            assert!((found[n / 6][n % 6] - expected[n / 6][n % 6]).abs() < 1e-14);
        }
    }
}
