//! Plane waves on the grid: the dynamical matrix of bonds and nodal term, and whether it is positive.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::strain_average::StrainAverage;
use crate::lattice::Neighbourhood;
use crate::tensor::{PAIRS, Stiffness, mandel_weight};
use crate::{Error, Result};

/// Points along each axis of the sampled zone; even, so that the zone's faces, edges and corners are among them.
const GRID: i32 = 8;

/// Points on each line from the centre to a face, edge or corner of the zone.
const ON_LINE: i32 = 12;

/// |k|Δ of the shell that stands for long waves, and the number of its directions.
const LONG_WAVE: f64 = 0.05;
const LONG_WAVE_DIRECTIONS: usize = 60;

/// Samples from which the minimum is refined.
const REFINED: usize = 4;

/// First and last step of the refinement, as parts of the grid's own step.
const FIRST_STEP: f64 = 0.5;
const LAST_STEP: f64 = 1e-3;

/// Rounds of the refinement at most; about fifteen are used.
const MOST_ROUNDS: usize = 60;

/// Eigenvalue, relative to ‖C‖, up to which rounding may stand for a zero-energy mode.
const ZERO: f64 = 1e-12;

/// Half the bonds of a node: one of ξ and −ξ.
#[derive(Clone, Debug)]
struct HalfBond {
    offset: [i32; 3],
    /// Column of the upper triangle 11 22 33 23 13 12 of n⊗n/|ξ|² (1/m²).
    outer: [f64; 6],
    /// s c of both (Pa).
    stiffness: f64,
    /// 2 ω K⁻¹ξ (1/m).
    gradient: Vector3<f64>,
}

/// The waves of a bulk grid: every node with the same bonds and the same nodal term.
///
/// A plane wave u = û exp(ik·x) has the energy density ½ û*·D(k)·û with
/// D(k) = Σ_ξ s c (2 − 2 cos k·ξ)/|ξ|² n⊗n + g·Z·g, g(k) = Σ_ξ ω K⁻¹ξ sin k·ξ:
/// the bonds' own sum and Christoffel's tensor of Z at the wave vector g that the averaged strain sees. D is real and
/// symmetric because ξ and −ξ are both bonds; D(k) → Γ(k), Christoffel's tensor of C, for long waves. With Z = 0 it is
/// the central model's.
#[derive(Clone, Debug)]
pub struct Dispersion {
    spacing: f64,
    orientation: Matrix3<f64>,
    reach: usize,
    bonds: Vec<HalfBond>,
    nodal: Option<Matrix6<f64>>,
    /// ‖C‖ of bonds and nodal term (Pa).
    norm: f64,
}

/// The weakest wave of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stability {
    /// Smallest eigenvalue found of D(k)/κ²(k) (Pa), κ² = Σₐ (2 − 2 cos kₐΔ)/Δ² the grid's own |k|²: a modulus, which
    /// for long waves is Christoffel's ρc² and is not positive where a mode costs no energy.
    pub smallest_eigenvalue: f64,
    /// The phases kₐΔ (rad, −π…π) along the three grid axes at which it was found.
    pub phases: [f64; 3],
    /// Whether it is above rounding (10⁻¹² ‖C‖).
    pub stable: bool,
    /// Wave vectors tried.
    pub samples: usize,
}

/// How the grid's longest waves compare with the continuum's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LongWaves {
    /// Largest relative error of a phase speed at |k|Δ = 0.05, over 13 directions.
    pub error: f64,
    /// Order of that error in |k|, from |k|Δ = 0.1 and 0.05; 2 in theory.
    pub order: f64,
}

impl Dispersion {
    /// From a neighbourhood, the micromodulus of every bond (N/m⁶, in its order) and the nodal term Z (Pa).
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
        let bonds = neighbourhood.bonds();
        if micromodulus.len() != bonds.len() {
            return Err(Error::input(
                format!("{} micromoduli for {} bonds", micromodulus.len(), bonds.len()),
                "give one micromodulus per bond, in the neighbourhood's order",
            ));
        }
        // The order of bonds is symmetric: ξ and −ξ stand at equal distances from the list's ends.
        let last = bonds.len() - 1;
        let stiffness = |i: usize| micromodulus[i] * neighbourhood.stiffness_share(&bonds[i]);
        let half: Vec<HalfBond> = (0..bonds.len() / 2)
            .map(|i| {
                let xi = bonds[i].xi;
                let scale = xi.norm_squared().powi(2);
                HalfBond {
                    offset: bonds[i].offset,
                    outer: PAIRS.map(|(a, b)| xi[a] * xi[b] / scale),
                    stiffness: stiffness(i) + stiffness(last - i),
                    gradient: 2.0 * average.gradients()[i],
                }
            })
            .collect();
        let reach = bonds.iter().flat_map(|b| b.offset).map(i32::unsigned_abs).max().unwrap_or(0) as usize;
        let mut dispersion = Dispersion {
            spacing: neighbourhood.spacing(),
            orientation: *neighbourhood.orientation(),
            reach,
            bonds: half,
            nodal: (nodal.norm() > 0.0).then(|| *nodal.mandel()),
            norm: 0.0,
        };
        dispersion.norm = dispersion.stiffness().norm();
        Ok(dispersion)
    }

    /// The tensor of bonds and nodal term, Σ s c n⊗n⊗n⊗n + Z.
    fn stiffness(&self) -> Matrix6<f64> {
        self.bonds.iter().fold(self.nodal.unwrap_or_default(), |sum, bond| {
            // |ξ|⁻² = tr(n⊗n)/|ξ|², so n⊗n is `outer` over its trace.
            let square = bond.outer[0] + bond.outer[1] + bond.outer[2];
            let e = Vector6::from_fn(|a, _| bond.outer[a] / square * mandel_weight(a));
            sum + bond.stiffness * e * e.transpose()
        })
    }

    /// D(k) (Pa/m²) of a wave vector k (rad/m).
    pub fn matrix(&self, k: &Vector3<f64>) -> Matrix3<f64> {
        self.at_phases(&(self.spacing * (self.orientation.transpose() * k)))
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

    /// D at the phases kₐΔ along the grid's axes.
    fn at_phases(&self, phases: &Vector3<f64>) -> Matrix3<f64> {
        let powers = HalfPhases::new(phases, self.reach);
        let mut d = [0.0; 6];
        let mut g = Vector3::zeros();
        for bond in &self.bonds {
            // 2 − 2 cos φ = 4 sin²(φ/2) and sin φ = 2 sin(φ/2) cos(φ/2).
            let (cos, sin) = powers.at(bond.offset);
            let factor = bond.stiffness * 4.0 * sin * sin;
            for a in 0..6 {
                d[a] += factor * bond.outer[a];
            }
            g += bond.gradient * (2.0 * sin * cos);
        }
        let mut matrix = Matrix3::new(d[0], d[5], d[4], d[5], d[1], d[3], d[4], d[3], d[2]);
        if let Some(z) = &self.nodal {
            matrix += christoffel(z, &g);
        }
        matrix
    }

    /// Smallest eigenvalue of D/κ² at some phases (Pa).
    fn weakest(&self, phases: &Vector3<f64>) -> f64 {
        let laplacian = phases.map(|p| 4.0 * (0.5 * p).sin().powi(2)).sum() / (self.spacing * self.spacing);
        self.at_phases(phases).symmetric_eigenvalues().min() / laplacian
    }

    /// The weakest wave of the Brillouin zone: D(k) at a grid of half the zone (8 points along each axis, so the zone's
    /// faces, edges and corners are met), the lines from its centre to the 13 face, edge and corner points (12 points
    /// each), 60 directions of long waves (|k|Δ = 0.05), then a search around the four weakest by halved steps.
    pub fn stability(&self) -> Stability {
        let mut samples: Vec<(f64, Vector3<f64>)> =
            zone_samples().into_iter().map(|phases| (self.weakest(&phases), phases)).collect();
        let mut count = samples.len();
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut weakest = samples[0];
        for &start in samples.iter().take(REFINED) {
            let refined = self.refine(start, &mut count);
            if refined.0 < weakest.0 {
                weakest = refined;
            }
        }
        Stability {
            smallest_eigenvalue: weakest.0,
            phases: weakest.1.into(),
            stable: weakest.0 > ZERO * self.norm,
            samples: count,
        }
    }

    /// A local minimum by steps along the axes, halved when none helps.
    fn refine(&self, start: (f64, Vector3<f64>), count: &mut usize) -> (f64, Vector3<f64>) {
        let mut best = start;
        let grid_step = 2.0 * PI / f64::from(GRID);
        let mut step = FIRST_STEP * grid_step;
        for _ in 0..MOST_ROUNDS {
            if step < LAST_STEP * grid_step {
                break;
            }
            let before = best.0;
            for axis in 0..3 {
                for sign in [1.0, -1.0] {
                    let mut phases = best.1;
                    phases[axis] = wrapped(phases[axis] + sign * step);
                    // Not nearer to k = 0, where D vanishes, than the long waves of the samples.
                    if phases.norm() < LONG_WAVE {
                        continue;
                    }
                    *count += 1;
                    let value = self.weakest(&phases);
                    if value < best.0 {
                        best = (value, phases);
                        break;
                    }
                }
            }
            if best.0 >= before - 1e-6 * before.abs() {
                step *= 0.5;
            }
        }
        best
    }

    /// Phase speeds of long waves against the continuum's (Christoffel's equation for `target`), over the 13 directions
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

/// The phase between −π and π.
fn wrapped(phase: f64) -> f64 {
    if phase.abs() <= PI { phase } else { phase - 2.0 * PI * (phase / (2.0 * PI)).round() }
}

/// exp(iφ/2) of the offsets of a grid, from its powers along each axis.
struct HalfPhases {
    reach: usize,
    /// (cos, sin) of j·phase/2, j = −reach…reach, one row per axis.
    rows: [Vec<(f64, f64)>; 3],
}

impl HalfPhases {
    fn new(phases: &Vector3<f64>, reach: usize) -> Self {
        let row = |phase: f64| {
            let half = |j: i32| (0.5 * f64::from(j) * phase).sin_cos();
            let mut row = vec![(1.0, 0.0); 2 * reach + 1];
            for j in 1..=reach {
                let (sin, cos) = half(j as i32);
                row[reach + j] = (cos, sin);
                row[reach - j] = (cos, -sin);
            }
            row
        };
        HalfPhases { reach, rows: [row(phases[0]), row(phases[1]), row(phases[2])] }
    }

    /// (cos, sin) of φ/2.
    fn at(&self, offset: [i32; 3]) -> (f64, f64) {
        let factor = |axis: usize| self.rows[axis][(offset[axis] + self.reach as i32) as usize];
        times(times(factor(0), factor(1)), factor(2))
    }
}

/// Product of two complex numbers.
fn times(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
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

/// The 13 directions from the centre of the zone to its face, edge and corner points, one of each ± pair.
fn zone_directions() -> Vec<Vector3<f64>> {
    let numbers = || -1..=1;
    let all = numbers().flat_map(|i| numbers().flat_map(move |j| numbers().map(move |k| [i, j, k])));
    all.filter(|n| *n > [0, 0, 0]).map(|n| Vector3::from(n.map(f64::from))).collect()
}

/// Phases at which the zone is sampled, half of it for D(−k) = D(k).
fn zone_samples() -> Vec<Vector3<f64>> {
    let step = 2.0 * PI / f64::from(GRID);
    let numbers = || -GRID / 2 + 1..=GRID / 2;
    let grid = numbers().flat_map(|i| numbers().flat_map(move |j| numbers().map(move |k| [i, j, k])));
    let mut samples: Vec<Vector3<f64>> =
        grid.filter(|n| *n > [0, 0, 0]).map(|n| Vector3::from(n.map(f64::from)) * step).collect();
    for n in zone_directions() {
        samples.extend((1..=ON_LINE).map(|j| n * (PI * f64::from(j) / f64::from(ON_LINE))));
    }
    // A spiral of even density over the half sphere.
    let turn = PI * (3.0 - 5f64.sqrt());
    samples.extend((0..LONG_WAVE_DIRECTIONS).map(|j| {
        let z = (j as f64 + 0.5) / LONG_WAVE_DIRECTIONS as f64;
        let (sin, cos) = (turn * j as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        LONG_WAVE * Vector3::new(r * cos, r * sin, z)
    }));
    samples
}
