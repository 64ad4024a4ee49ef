//! The weakest wave of the Brillouin zone.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use super::{Dispersion, LONG_WAVE};

/// Points along each axis of the sampled zone; even, so that the zone's faces, edges and corners are among them.
const GRID: i32 = 8;

/// Points on each line from the centre to a face, edge or corner of the zone.
const ON_LINE: i32 = 12;

/// Directions of the shell |k|Δ = [`LONG_WAVE`].
const LONG_WAVE_DIRECTIONS: usize = 60;

/// Samples from which the minimum is refined.
const REFINED: usize = 4;

/// First and last step of the refinement, as parts of the grid's own step.
const FIRST_STEP: f64 = 0.5;
const LAST_STEP: f64 = 4e-3;

/// Rounds of the refinement at most; about a dozen are used.
const MOST_ROUNDS: usize = 60;

/// What the closed form of an eigenvalue may be off, relative to ‖C‖; about 10⁻⁸ where eigenvalues are double.
const CLOSED_FORM: f64 = 1e-7;

/// Wave vectors that are summed side by side.
const LANES: usize = 4;

/// The weakest wave of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stability {
    /// Smallest eigenvalue found of D(k)/κ²(k) (Pa), κ² = Σₐ (2 − 2 cos kₐΔ)/Δ² the grid's own |k|²: a modulus, which
    /// for long waves is Christoffel's ρc² and is not positive where a mode costs no energy.
    pub smallest_eigenvalue: f64,
    /// The phases kₐΔ (rad, −π…π) along the three grid axes at which it was found.
    pub phases: [f64; 3],
    /// Whether it is above rounding (10⁻¹³ ‖C‖; with free rotations 10⁻¹⁰ ‖C‖).
    pub stable: bool,
    /// Wave vectors tried.
    pub samples: usize,
}

impl Dispersion {
    /// The weakest wave of the Brillouin zone: D(k) at a grid of half the zone (8 points along each axis, so the zone's
    /// faces, edges and corners are met), the lines from its centre to the 13 face, edge and corner points (12 points
    /// each), 60 directions of long waves (|k|Δ = 0.05), then a search around the four weakest by halved steps.
    pub fn stability(&self) -> Stability {
        let samples = zone_samples();
        let values = self.weakest(&samples);
        let mut order: Vec<usize> = (0..samples.len()).collect();
        order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        let mut count = samples.len();
        // The closed form chooses, the accurate eigenvalue judges: every sample that may be the weakest, then each end
        // of a search.
        let doubtful = order.iter().take_while(|&&i| values[i] <= values[order[0]] + CLOSED_FORM * self.norm);
        let mut ends: Vec<Vector3<f64>> = doubtful.map(|&i| samples[i]).collect();
        ends.extend(order.iter().take(REFINED).map(|&i| self.refine((values[i], samples[i]), &mut count)));
        let judged = ends.iter().map(|phases| (self.accurately(phases), *phases));
        let weakest = judged.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NAN, Vector3::zeros()));
        Stability {
            smallest_eigenvalue: weakest.0,
            phases: weakest.1.into(),
            stable: weakest.0 > self.rounding(),
            samples: count,
        }
    }

    /// A local minimum by steps along the axes, halved when none helps.
    fn refine(&self, start: (f64, Vector3<f64>), count: &mut usize) -> Vector3<f64> {
        let mut best = start;
        let grid_step = 2.0 * PI / f64::from(GRID);
        let mut step = FIRST_STEP * grid_step;
        for _ in 0..MOST_ROUNDS {
            if step < LAST_STEP * grid_step {
                break;
            }
            let moved = |axis: usize, sign: f64| {
                let mut phases = best.1;
                phases[axis] = wrapped(phases[axis] + sign * step);
                phases
            };
            // Not nearer to k = 0, where D vanishes, than the long waves of the samples.
            let around = (0..3).flat_map(|axis| [moved(axis, 1.0), moved(axis, -1.0)]);
            let around: Vec<Vector3<f64>> = around.filter(|phases| phases.norm() >= LONG_WAVE).collect();
            *count += around.len();
            let before = best.0;
            for (value, phases) in self.weakest(&around).into_iter().zip(around) {
                if value < best.0 {
                    best = (value, phases);
                }
            }
            if best.0 >= before - 1e-6 * before.abs() {
                step *= 0.5;
            }
        }
        best.1
    }

    /// Smallest eigenvalues of D/κ² (Pa) in closed form.
    fn weakest(&self, phases: &[Vector3<f64>]) -> Vec<f64> {
        let mut values = Vec::with_capacity(phases.len() + LANES);
        for block in phases.chunks(LANES) {
            // The last block is filled up with copies of its first.
            let lanes: [Vector3<f64>; LANES] = std::array::from_fn(|l| *block.get(l).unwrap_or(&block[0]));
            let matrices = self.at_phases(&lanes);
            values.extend(matrices.iter().zip(&lanes).map(|(d, p)| smallest_eigenvalue(d) / self.laplacian(p)));
        }
        values.truncate(phases.len());
        values
    }

    /// Smallest eigenvalue of D/κ² (Pa) to rounding.
    fn accurately(&self, phases: &Vector3<f64>) -> f64 {
        let [d] = self.at_phases(&[*phases]);
        d.symmetric_eigenvalues().min() / self.laplacian(phases)
    }

    /// κ² (1/m²).
    fn laplacian(&self, phases: &Vector3<f64>) -> f64 {
        phases.map(|p| 4.0 * (0.5 * p).sin().powi(2)).sum() / (self.spacing * self.spacing)
    }
}

/// Smallest eigenvalue of a symmetric matrix by Cardano's formula (Smith 1961): fast, and good to half the digits where
/// eigenvalues are double.
fn smallest_eigenvalue(a: &Matrix3<f64>) -> f64 {
    let mean = a.trace() / 3.0;
    let b = a - Matrix3::from_diagonal_element(mean);
    let size = (b.norm_squared() / 6.0).sqrt();
    if size == 0.0 {
        return mean;
    }
    let r = (0.5 * b.determinant() / size.powi(3)).clamp(-1.0, 1.0);
    mean + 2.0 * size * (r.acos() / 3.0 + 2.0 * PI / 3.0).cos()
}

/// The phase between −π and π.
fn wrapped(phase: f64) -> f64 {
    if phase.abs() <= PI { phase } else { phase - 2.0 * PI * (phase / (2.0 * PI)).round() }
}

/// The 13 directions from the centre of the zone to its face, edge and corner points, one of each ± pair.
pub(super) fn zone_directions() -> Vec<Vector3<f64>> {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Cardano against the iterative eigenvalues, double and triple ones included.
    #[test]
    fn smallest_eigenvalues_in_closed_form() {
        let turn = *nalgebra::Rotation3::from_euler_angles(0.3, -0.4, 1.0).matrix();
        for values in [[1.0, 2.0, 5.0], [-1.0, 2.0, 2.0], [1.0, 1.0, 3.0], [4.0; 3], [0.0; 3], [1e-6, 1.0, 1.0]] {
            let a = turn * Matrix3::from_diagonal(&Vector3::from(values)) * turn.transpose();
            assert!((smallest_eigenvalue(&a) - values[0]).abs() < CLOSED_FORM, "{values:?}");
        }
    }
}
