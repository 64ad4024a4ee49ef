//! Strain and stress at a node from the displacements of its neighbours, on grids and in packings alike.
//!
//! The neighbours' displacements are fitted by c + G ξ with weights w, the node itself among them (ξ = 0). With
//! x̄ = Σ w ξ/Σ w and ū = Σ w u/Σ w, G = [Σ w (u − ū)⊗(ξ − x̄)] [Σ w (ξ − x̄)⊗(ξ − x̄)]⁻¹. A linear displacement is found
//! exactly, whatever neighbours are missing; of a symmetric neighbourhood the error is of second order. Where half of it
//! is missing, G is that at x̄: of first order.
//!
//! The constant is fitted, too, and w is the number of bonds that a neighbour has: nodes with few bonds, of which a surface
//! consists, are displaced otherwise than those of the solid (their own layer of a horizon, however fine the grid), and count
//! for less. A quadratic fit sees that layer instead of the solid; measured at a hole it is several times as far off.

use nalgebra::{DMatrix, Matrix3, Matrix6, SymmetricEigen, Vector3, Vector6};

use super::grid_operator::Kinematics;
use crate::tensor::{PAIRS, Stiffness, mandel_weight};

/// Smallest eigenvalue of Σ w (ξ − x̄)⊗(ξ − x̄), relative to the largest, from which a direction counts as seen.
const FLAT: f64 = 1e-3;

/// Kelvin moduli of unseen strains, relative to ‖C‖, that count as zero.
const SOFT: f64 = 1e-12;

/// The sums of a node's least-squares fit.
#[derive(Clone, Copy, Debug, Default)]
pub struct GradientFit {
    /// Σ w.
    weight: f64,
    /// Σ w ξ.
    place: Vector3<f64>,
    /// Σ w ξ⊗ξ.
    shape: Matrix3<f64>,
    /// Σ w u.
    value: Vector3<f64>,
    /// Σ w u⊗ξ.
    product: Matrix3<f64>,
}

/// The gradient of displacement at a node, as far as its neighbours show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalGradient {
    /// ∂u/∂x (–); zero along unseen directions.
    pub gradient: Matrix3<f64>,
    /// Orthonormal directions, one per column.
    pub axes: Matrix3<f64>,
    /// Which of them neighbours lie along. A node on its own sees none.
    pub seen: [bool; 3],
}

/// Strain and stress at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalState {
    /// Strain (–): ε = sym ∂u/∂x, at finite kinematics E = ½(FᵀF − 1).
    pub strain: Matrix3<f64>,
    /// Stress (Pa): C:ε, at finite kinematics Cauchy's, F (C:E) Fᵀ/det F.
    pub stress: Matrix3<f64>,
}

impl GradientFit {
    /// Add a neighbour at ξ (m) that is displaced by u (m) against the node, or the node itself with zeros.
    pub fn add(&mut self, weight: f64, xi: &Vector3<f64>, u: &Vector3<f64>) {
        self.weight += weight;
        self.place += weight * xi;
        self.shape += weight * xi * xi.transpose();
        self.value += weight * u;
        self.product += weight * u * xi.transpose();
    }

    /// The gradient.
    pub fn gradient(&self) -> LocalGradient {
        let mean = self.place / self.weight.max(f64::MIN_POSITIVE);
        let shape = SymmetricEigen::new(self.shape - self.place * mean.transpose());
        let product = self.product - self.value * mean.transpose();
        let largest = shape.eigenvalues.max();
        let axes = shape.eigenvectors;
        let seen = [0, 1, 2].map(|k| largest > 0.0 && shape.eigenvalues[k] >= FLAT * largest);
        let gradient = (0..3).filter(|&k| seen[k]).fold(Matrix3::zeros(), |sum, k| {
            let e = axes.column(k);
            sum + (product * e / shape.eigenvalues[k]) * e.transpose()
        });
        LocalGradient { gradient, axes, seen }
    }
}

impl LocalGradient {
    /// Whether neighbours fill space around the node.
    pub fn is_whole(&self) -> bool {
        self.seen == [true; 3]
    }

    /// Strain and stress of a solid of stiffness C (Pa). No force passes along directions in which there is no neighbour: the
    /// strain in them is that of least energy, ε = ε_seen + Σ y_k B_k with (B:C:B) y = −B:C:ε_seen, so that a layer of nodes is
    /// in plane stress and a node on its own without any. At finite kinematics ε is E, and of F only what is seen counts, for
    /// S = C:E has no other part; det F = √det(2E + 1).
    pub fn state(&self, c: &Stiffness, kinematics: Kinematics) -> LocalState {
        let g = &self.gradient;
        let strain = match kinematics {
            Kinematics::Linear => 0.5 * (g + g.transpose()),
            Kinematics::Finite => 0.5 * (g + g.transpose() + g.transpose() * g),
        };
        let strain = if self.is_whole() { mandel(&strain) } else { self.relaxed(&strain, c) };
        let stress = matrix(&(c.mandel() * strain));
        let strain = matrix(&strain);
        match kinematics {
            Kinematics::Linear => LocalState { strain, stress },
            Kinematics::Finite => {
                let f = g + Matrix3::identity();
                let volume = (2.0 * strain + Matrix3::identity()).determinant().max(0.0).sqrt();
                let stress = if volume > 0.0 { f * stress * f.transpose() / volume } else { Matrix3::zeros() };
                LocalState { strain, stress }
            }
        }
    }

    /// A strain with its unseen components replaced by those of least energy (Kelvin-Mandel).
    fn relaxed(&self, strain: &Matrix3<f64>, c: &Stiffness) -> Vector6<f64> {
        let seen = (0..3).filter(|&k| self.seen[k]);
        let onto = seen.fold(Matrix3::zeros(), |sum, k| sum + self.axes.column(k) * self.axes.column(k).transpose());
        let known = mandel(&(onto * strain * onto));
        let unseen: Vec<Vector6<f64>> = PAIRS
            .iter()
            .filter(|&&(i, j)| !(self.seen[i] && self.seen[j]))
            .map(|&(i, j)| {
                let pair = self.axes.column(i) * self.axes.column(j).transpose();
                mandel(&(pair + pair.transpose())).normalize()
            })
            .collect();
        let c: &Matrix6<f64> = c.mandel();
        let n = unseen.len();
        let energy = DMatrix::from_fn(n, n, |k, l| unseen[k].dot(&(c * unseen[l])));
        let pull = DMatrix::from_fn(n, 1, |k, _| -unseen[k].dot(&(c * known)));
        let found = energy.svd(true, true).solve(&pull, SOFT * c.norm()).unwrap_or_else(|_| DMatrix::zeros(n, 1));
        unseen.iter().zip(found.iter()).fold(known, |sum, (b, y)| sum + b * *y)
    }
}

/// A symmetric matrix as a Kelvin-Mandel vector; of another its symmetric part.
fn mandel(m: &Matrix3<f64>) -> Vector6<f64> {
    Vector6::from_fn(|a, _| {
        let (i, j) = PAIRS[a];
        0.5 * (m[(i, j)] + m[(j, i)]) * mandel_weight(a)
    })
}

/// The symmetric matrix of a Kelvin-Mandel vector.
fn matrix(v: &Vector6<f64>) -> Matrix3<f64> {
    let mut m = Matrix3::zeros();
    for (a, &(i, j)) in PAIRS.iter().enumerate() {
        m[(i, j)] = v[a] / mandel_weight(a);
        m[(j, i)] = m[(i, j)];
    }
    m
}

#[cfg(test)]
mod tests {
    use super::*;

    /// E = 10 GPa, ν = 0.3.
    fn isotropic() -> Stiffness {
        let (e, nu) = (10e9, 0.3);
        Stiffness::isotropic(e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
    }

    const GRADIENT: Matrix3<f64> = Matrix3::new(1e-3, 2e-3, -4e-3, -5e-4, 3e-3, 1e-3, 2e-3, 7e-4, -2e-3);

    /// The fit of neighbours in a box of offsets that satisfy `there`, displaced by u(ξ).
    fn fit(there: impl Fn([i32; 3]) -> bool, u: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> LocalGradient {
        let mut fit = GradientFit::default();
        fit.add(3.0, &Vector3::zeros(), &Vector3::zeros());
        for offset in (0..343).map(|n| [n % 7 - 3, n / 7 % 7 - 3, n / 49 - 3]).filter(|o| *o != [0; 3] && there(*o)) {
            let xi = Vector3::from(offset.map(f64::from)) * 1e-3;
            fit.add(1.0 + f64::from((offset[0] + 3 * offset[1]).rem_euclid(5)), &xi, &u(&xi));
        }
        fit.gradient()
    }

    #[test]
    fn linear_displacements_are_found_exactly_whatever_is_missing() {
        let shapes: [fn([i32; 3]) -> bool; 4] = [
            |_| true,
            |[x, _, _]| x >= 0,
            |[x, y, z]| x >= 0 && y <= 0 && z >= 0,
            |o| [[1, 0, 0], [0, 1, 1], [-1, 2, 0]].contains(&o),
        ];
        for shape in shapes {
            let found = fit(shape, |xi| GRADIENT * xi);
            assert!(found.is_whole() && (found.gradient - GRADIENT).norm() < 1e-14, "{}", found.gradient);
        }
    }

    /// Plane stress E/(1 − ν²), uniaxial stress E, nothing.
    #[test]
    fn directions_without_neighbours_are_free_of_stress() {
        let (e, nu) = (10e9, 0.3);
        let layer = fit(|[_, _, z]| z == 0, |xi| GRADIENT * xi);
        assert_eq!(layer.seen.iter().filter(|s| **s).count(), 2);
        let LocalState { strain, stress } = layer.state(&isotropic(), Kinematics::Linear);
        let (xx, yy, shear) = (GRADIENT[(0, 0)], GRADIENT[(1, 1)], GRADIENT[(0, 1)] + GRADIENT[(1, 0)]);
        let wanted = e / (1.0 - nu * nu)
            * Matrix3::new(xx + nu * yy, 0.5 * (1.0 - nu) * shear, 0.0, 0.0, yy + nu * xx, 0.0, 0.0, 0.0, 0.0);
        let wanted = wanted + wanted.transpose() - Matrix3::from_diagonal(&wanted.diagonal());
        assert!((stress - wanted).norm() < 1e-10 * wanted.norm(), "{stress}");
        assert!((strain[(2, 2)] + nu / (1.0 - nu) * (xx + yy)).abs() < 1e-12);
        let bar = fit(|[x, y, z]| x == y && z == 0, |xi| GRADIENT * xi).state(&isotropic(), Kinematics::Linear);
        let n = Vector3::new(1.0, 1.0, 0.0).normalize();
        let wanted = e * n.dot(&(GRADIENT * n)) * n * n.transpose();
        assert!((bar.stress - wanted).norm() < 1e-10 * wanted.norm());
        let alone = fit(|_| false, |xi| GRADIENT * xi);
        assert_eq!(alone.seen, [false; 3]);
        assert_eq!(alone.state(&isotropic(), Kinematics::Finite).stress, Matrix3::zeros());
    }

    /// A turn gives nothing, in a layer of nodes too; a stretch and a turn the turned stress.
    #[test]
    fn finite_stresses_turn_with_the_body() {
        let turn = nalgebra::Rotation3::from_euler_angles(0.4, -0.9, 1.3).into_inner();
        let stretch = Matrix3::new(1.02, 0.01, 0.0, 0.01, 0.99, 0.0, 0.0, 0.0, 1.01);
        let at = |f: Matrix3<f64>, layer: bool| {
            let found = fit(|[_, _, z]| !layer || z == 0, |xi| (f - Matrix3::identity()) * xi);
            found.state(&isotropic(), Kinematics::Finite)
        };
        for layer in [false, true] {
            let rigid = at(turn, layer);
            assert!(rigid.strain.norm() < 1e-13 && rigid.stress.norm() < 1e-2, "{}", rigid.stress);
            let (still, turned) = (at(stretch, layer), at(turn * stretch, layer));
            assert!((still.strain - turned.strain).norm() < 1e-13);
            let wanted = turn * still.stress * turn.transpose();
            assert!((turned.stress - wanted).norm() < 1e-11 * wanted.norm());
        }
        // σ = (1/J) F S Fᵀ of a uniaxial strain: λ₁ S₁₁, λ₁ = 1.02.
        let f = Matrix3::from_diagonal(&Vector3::new(1.02, 1.0, 1.0));
        let e = 0.5 * (1.02f64.powi(2) - 1.0);
        let wanted = 1.02 * isotropic().component(0, 0, 0, 0) * e;
        assert!((at(f, false).stress[(0, 0)] / wanted - 1.0).abs() < 1e-11);
    }
}
