//! Plane waves on the grid: the dynamical matrix of a model, and whether it is positive.

mod bond_sums;
mod bound;
mod edge_bound;
mod stability;
mod zone;

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::microplane::{normal_projection, tangential_projection};
use super::strain_average::StrainAverage;
use crate::lattice::Neighbourhood;
use crate::tensor::{PAIRS, Stiffness};
use crate::{Error, Result};
use bond_sums::{BondSums, HalfPhases};
pub use stability::{Evidence, Stability, StabilityEvidence};
use zone::{smallest_eigenvalue as eigenvalue, zone_directions};

/// |k|Δ of the waves that stand for long ones.
const LONG_WAVE: f64 = 0.05;

/// Eigenvalue, relative to ‖C‖, up to which rounding may stand for a zero-energy mode; with rotations that follow.
const ZERO: f64 = 1e-13;
const ZERO_CONDENSED: f64 = 1e-10;

/// Smallest eigenvalue of a resistance to rotation that is not rounding, relative to the trace at rest.
const FREE_TO_TURN: f64 = 1e-12;

/// Determinant, relative to the cube of a third of the trace, above which a 3×3 resistance is inverted as it stands.
const WELL_CONDITIONED: f64 = 1e-6;

/// The waves of a bulk grid: every node with the same bonds and, as the model has it, the same nodal term or free
/// rotations.
///
/// A plane wave u = û exp(ik·x) has the energy density ½ û*·D(k)·û. With φ = k·ξ and the sums over half the bonds
/// (ξ stands for −ξ too, a = 2 s c):
///
/// - central: D = Σ a n⊗n (2 − 2 cos φ)/|ξ|²;
/// - hybrid: D = central + g·Z·g, g(k) = Σ 2 ω K⁻¹ξ sin φ, Christoffel's tensor of Z at the wave vector that the
///   averaged strain sees;
/// - micropolar: the relative displacement of a bond is u_B − u_A + ½ ξ×(θ_A + θ_B) and its energy ½ a_n/|ξ|² (its part
///   along n)² + ½ a_t/|ξ|² (its part across n)². A wave of rotations θ = iϑ exp(ik·x) then has
///   D_uu = Σ (a_n n⊗n + a_t (1 − n⊗n)) (2 − 2 cos φ)/|ξ|², D_uϑ = \[v\]× with v = Σ a_t n/|ξ| sin φ, and
///   D_ϑϑ = Σ a_t (1 − n⊗n) cos²(φ/2). Rotations without inertia follow the displacements: D = D_uu − D_uϑ D_ϑϑ⁻¹ D_uϑᵀ.
///
/// D is real and symmetric because ξ and −ξ are both bonds. For long waves D(k) → Γ(k), Christoffel's tensor of C; of
/// the micropolar model, of the tensor with free rotations.
#[derive(Clone, Debug)]
pub struct Dispersion {
    spacing: f64,
    orientation: Matrix3<f64>,
    bonds: BondSums,
    beyond: Beyond,
    /// ‖C‖ of the whole (Pa).
    norm: f64,
}

/// What a model has beyond its bonds' own resistance.
#[derive(Clone, Debug)]
enum Beyond {
    /// Nothing: central bonds.
    Nothing,
    /// The nodal term Z, and 2 ω K⁻¹ξ (1/m) of half the bonds.
    Nodal { term: Box<Matrix6<f64>>, gradients: Vec<Vector3<f64>> },
    /// Free rotations: a_t n/|ξ| (Pa/m) and a_t (1 − n⊗n) (Pa, upper triangle) of half the bonds, and the trace of the
    /// latter's sum (Pa).
    Rotations {
        couplings: Vec<Vector3<f64>>,
        resistances: Vec<[f64; 6]>,
        at_rest: f64,
        /// The weights of the normal bonds alone; `None` where a tangential bond is negative.
        normal: Option<Vec<[f64; 6]>>,
    },
}

/// How the grid's longest waves compare with a continuum's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LongWaves {
    /// Largest relative error of a phase speed at |k|Δ = 0.05, over 13 directions.
    pub error: f64,
    /// Order of that error in |k|, from |k|Δ = 0.1 and 0.05; 2 in theory where the grid has the continuum's tensor.
    pub order: f64,
}

impl Dispersion {
    /// Bonds and nodal term: micromodulus of every bond (N/m⁶, in the neighbourhood's order) and Z (Pa).
    ///
    /// # Errors
    /// A number of micromoduli other than that of the bonds, or bonds that lie in a plane.
    pub fn new(neighbourhood: &Neighbourhood, micromodulus: &[f64], nodal: &Stiffness) -> Result<Self> {
        let average = StrainAverage::new(neighbourhood)?;
        Dispersion::with_average(neighbourhood, &average, micromodulus, nodal)
    }

    /// As [`Dispersion::new`], with the averaging prepared once for many materials.
    pub(super) fn with_average(
        neighbourhood: &Neighbourhood,
        average: &StrainAverage,
        micromodulus: &[f64],
        nodal: &Stiffness,
    ) -> Result<Self> {
        let mut dispersion = Dispersion::central(neighbourhood, micromodulus)?;
        if nodal.norm() > 0.0 {
            let half = neighbourhood.bonds().len() / 2;
            let gradients = average.gradients()[..half].iter().map(|g| 2.0 * g).collect();
            dispersion.beyond = Beyond::Nodal { term: Box::new(*nodal.mandel()), gradients };
            let bonds = pair_stiffness(neighbourhood, micromodulus)?;
            dispersion.norm = (tensor(neighbourhood, &bonds, None) + nodal.mandel()).norm();
        }
        Ok(dispersion)
    }

    /// Bonds alone: micromodulus of every bond (N/m⁶, in the neighbourhood's order).
    ///
    /// # Errors
    /// A number of micromoduli other than that of the bonds.
    pub fn central(neighbourhood: &Neighbourhood, micromodulus: &[f64]) -> Result<Self> {
        let stiffness = pair_stiffness(neighbourhood, micromodulus)?;
        let weights = neighbourhood.bonds().iter().zip(&stiffness).map(|(bond, a)| {
            let scale = a / bond.xi.norm_squared().powi(2);
            PAIRS.map(|(i, j)| bond.xi[i] * bond.xi[j] * scale)
        });
        let norm = tensor(neighbourhood, &stiffness, None).norm();
        Ok(Dispersion::of(neighbourhood, weights.collect(), Beyond::Nothing, norm))
    }

    /// Normal and tangential bonds, node rotations free and without inertia: c_n and c_t of every bond (N/m⁶, in the
    /// neighbourhood's order). Rotations that no tangential bond resists do not count.
    ///
    /// # Errors
    /// A number of micromoduli other than that of the bonds.
    pub fn micropolar(neighbourhood: &Neighbourhood, normal: &[f64], tangential: &[f64]) -> Result<Self> {
        let along = pair_stiffness(neighbourhood, normal)?;
        let across = pair_stiffness(neighbourhood, tangential)?;
        let (mut weights, mut couplings, mut resistances) = (Vec::new(), Vec::new(), Vec::new());
        let (mut at_rest, mut normal) = (0.0, Vec::new());
        for ((bond, a_n), a_t) in neighbourhood.bonds().iter().zip(&along).zip(&across) {
            let (length, n) = (bond.xi.norm(), bond.xi.normalize());
            let outer = n * n.transpose();
            let crossing = *a_t * (Matrix3::identity() - outer);
            normal.push(upper(&(*a_n / (length * length) * outer)));
            weights.push(upper(&((*a_n * outer + crossing) / (length * length))));
            couplings.push(a_t / length * n);
            resistances.push(upper(&crossing));
            at_rest += crossing.trace().abs();
        }
        let normal = across.iter().all(|a| *a >= 0.0).then_some(normal);
        let norm = tensor(neighbourhood, &along, Some(&across)).norm();
        let beyond = match at_rest > 0.0 {
            true => Beyond::Rotations { couplings, resistances, at_rest, normal },
            false => Beyond::Nothing,
        };
        Ok(Dispersion::of(neighbourhood, weights, beyond, norm))
    }

    fn of(neighbourhood: &Neighbourhood, weights: Vec<[f64; 6]>, beyond: Beyond, norm: f64) -> Self {
        let half = weights.len();
        let offsets = neighbourhood.bonds()[..half].iter().map(|bond| bond.offset).collect();
        let (spacing, orientation) = (neighbourhood.spacing(), *neighbourhood.orientation());
        Dispersion { spacing, orientation, bonds: BondSums::new(offsets, weights), beyond, norm }
    }

    /// D(k) (Pa/m²) of a wave vector k (rad/m).
    pub fn matrix(&self, k: &Vector3<f64>) -> Matrix3<f64> {
        let [matrix] = self.at_phases(&[self.spacing * (self.orientation.transpose() * k)]);
        matrix
    }

    /// Phase speeds (m/s) of the three waves of wave vector k (rad/m, not zero), slowest first: ρ (|k| c)² = eigenvalue of
    /// D(k). A wave that the grid does not resist has speed 0.
    ///
    /// # Errors
    /// A density (kg/m³) that is not positive, or a wave vector that is zero or not finite.
    pub fn speeds(&self, k: &Vector3<f64>, density: f64) -> Result<[f64; 3]> {
        if !(density.is_finite() && density > 0.0) {
            return Err(Error::input(format!("the density is {density} kg/m³"), "give a positive density"));
        }
        if !(k.norm().is_finite() && k.norm() > 0.0) {
            return Err(Error::input("the wave vector is zero or not finite", "give a finite k that is not zero"));
        }
        Ok(ascending(&self.matrix(k)).map(|value| (value.max(0.0) / density).sqrt() / k.norm()))
    }

    /// D at several phases kₐΔ along the grid's axes.
    fn at_phases<const L: usize>(&self, phases: &[Vector3<f64>; L]) -> [Matrix3<f64>; L] {
        let powers = HalfPhases::new(phases, self.bonds.reach());
        // 2 − 2 cos φ = 4 sin²(φ/2).
        let mut matrices = self.bonds.even(&powers, self.bonds.weights(), |sin, _| 4.0 * sin * sin);
        match &self.beyond {
            Beyond::Nothing => {}
            Beyond::Nodal { term, gradients } => {
                for (d, g) in matrices.iter_mut().zip(self.bonds.odd(&powers, gradients)) {
                    *d += christoffel(term, &g);
                }
            }
            Beyond::Rotations { couplings, resistances, at_rest, .. } => {
                let coupled = self.bonds.odd(&powers, couplings);
                let resisted = self.bonds.even(&powers, resistances, |_, cos| cos * cos);
                for ((d, v), r) in matrices.iter_mut().zip(coupled).zip(resisted) {
                    *d -= relaxation(&v, &r, FREE_TO_TURN * at_rest);
                }
            }
        }
        matrices
    }

    /// The resistance (Pa) up to which rounding may stand for a wave that costs nothing. Following rotations cost digits.
    fn rounding(&self) -> f64 {
        let share = if matches!(self.beyond, Beyond::Rotations { .. }) { ZERO_CONDENSED } else { ZERO };
        share * self.norm
    }

    /// Phase speeds of long waves against a continuum's (Christoffel's equation for `target`), over the 13 directions
    /// of the grid's faces, edges and corners.
    pub fn long_waves(&self, target: &Stiffness) -> LongWaves {
        let error = |size: f64| {
            zone_directions().into_iter().map(|n| self.speed_error(target, &n.normalize(), size)).fold(0.0, f64::max)
        };
        let (coarse, fine) = (error(2.0 * LONG_WAVE), error(LONG_WAVE));
        LongWaves { error: fine, order: (coarse / fine).log2() }
    }

    /// Largest relative error of the three phase speeds along a direction of the grid, at a given |k|Δ.
    fn speed_error(&self, target: &Stiffness, n: &Vector3<f64>, size: f64) -> f64 {
        let k = self.orientation * n * (size / self.spacing);
        let (grid, continuum) = (ascending(&self.matrix(&k)), ascending(&target.christoffel(&k)));
        grid.iter().zip(continuum).map(|(d, c)| ((d / c).max(0.0).sqrt() - 1.0).abs()).fold(0.0, f64::max)
    }
}

/// a = s c of ξ and −ξ together (Pa), of half the bonds. The order of bonds is symmetric: ξ and −ξ stand at equal
/// distances from the list's ends.
fn pair_stiffness(neighbourhood: &Neighbourhood, micromodulus: &[f64]) -> Result<Vec<f64>> {
    let bonds = neighbourhood.bonds();
    if micromodulus.len() != bonds.len() {
        return Err(Error::input(
            format!("{} micromoduli for {} bonds", micromodulus.len(), bonds.len()),
            "give one micromodulus per bond, in the neighbourhood's order",
        ));
    }
    let last = bonds.len() - 1;
    let pair = |i: usize| (micromodulus[i] + micromodulus[last - i]) * neighbourhood.stiffness_share(&bonds[i]);
    Ok((0..bonds.len() / 2).map(pair).collect())
}

/// Σ a_n N + a_t T (Pa) over half the bonds.
fn tensor(neighbourhood: &Neighbourhood, normal: &[f64], tangential: Option<&[f64]>) -> Matrix6<f64> {
    let directions = || neighbourhood.bonds().iter().map(|bond| bond.xi.normalize());
    let sum = directions().zip(normal).fold(Matrix6::zeros(), |sum, (n, a)| sum + *a * normal_projection(&n));
    let across = directions().zip(tangential.unwrap_or(&[]));
    across.fold(sum, |sum, (n, a)| sum + *a * tangential_projection(&n))
}

/// 11 22 33 23 13 12 of a symmetric matrix.
fn upper(m: &Matrix3<f64>) -> [f64; 6] {
    PAIRS.map(|(i, j)| m[(i, j)])
}

/// \[v\]× R⁻¹ \[v\]×ᵀ, what free rotations take off the resistance to displacements. Rotations that R does not resist
/// (eigenvalues up to `floor`) are not driven either, the energy being positive.
fn relaxation(v: &Vector3<f64>, r: &Matrix3<f64>, floor: f64) -> Matrix3<f64> {
    let cross = v.cross_matrix();
    let third = r.trace() / 3.0;
    let inverse = match r.try_inverse() {
        Some(inverse) if 3.0 * third > floor && r.determinant() > WELL_CONDITIONED * third.powi(3) => inverse,
        _ => {
            let eigen = r.symmetric_eigen();
            let inverse = eigen.eigenvalues.map(|value| if value > floor { value.recip() } else { 0.0 });
            eigen.eigenvectors * Matrix3::from_diagonal(&inverse) * eigen.eigenvectors.transpose()
        }
    };
    let mut out = cross * inverse * cross.transpose();
    out.fill_lower_triangle_with_upper_triangle();
    out
}

/// Γ_ik = Z_ijkl g_j g_l from the Kelvin-Mandel matrix: wᵢ·Z·w_k with wᵢ the symmetric part of eᵢ⊗g.
fn christoffel(z: &Matrix6<f64>, g: &Vector3<f64>) -> Matrix3<f64> {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let w = nalgebra::Matrix6x3::new(
        g[0],
        0.0,
        0.0,
        0.0,
        g[1],
        0.0,
        0.0,
        0.0,
        g[2], //
        0.0,
        half * g[2],
        half * g[1],
        half * g[2],
        0.0,
        half * g[0],
        half * g[1],
        half * g[0],
        0.0,
    );
    let mut gamma = w.transpose() * (z * w);
    gamma.fill_lower_triangle_with_upper_triangle();
    gamma
}

/// Eigenvalues, ascending.
fn ascending(matrix: &Matrix3<f64>) -> [f64; 3] {
    let mut values: [f64; 3] = matrix.symmetric_eigenvalues().into();
    values.sort_by(f64::total_cmp);
    values
}
