//! The weakest wave of the Brillouin zone, searched for.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use super::bond_sums::HalfPhases;
use super::{Beyond, Dispersion, FREE_TO_TURN, LONG_WAVE};

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

/// Ends of these searches that are followed down their valleys, and steps of that at most.
const FOLLOWED: usize = 2;
const MOST_DESCENTS: usize = 15;

/// Step of the differences (rad) that make a slope, and the longest change of a phase in one step.
const DIFFERENCE: f64 = 5e-3;
const LONGEST_STEP: f64 = 0.4;

/// What the closed form of an eigenvalue may be off, relative to ‖C‖; about 10⁻⁸ where eigenvalues are double.
const CLOSED_FORM: f64 = 1e-7;

/// Wave vectors that are summed side by side.
const LANES: usize = 4;

impl Dispersion {
    /// The weakest of the samples and of the searches from them.
    pub(super) fn search(&self, count: &mut usize) -> (f64, Vector3<f64>) {
        let samples = zone_samples();
        let values = self.weakest(&samples);
        let mut order: Vec<usize> = (0..samples.len()).collect();
        order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        *count += samples.len();
        // The closed form chooses, the accurate eigenvalue judges: every sample that may be the weakest, then each end
        // of a search.
        let doubtful = order.iter().take_while(|&&i| values[i] <= values[order[0]] + CLOSED_FORM * self.norm);
        let mut ends: Vec<Vector3<f64>> = doubtful.map(|&i| samples[i]).collect();
        ends.extend(order.iter().take(REFINED).map(|&i| self.refine((values[i], samples[i]), count)));
        let mut judged: Vec<(f64, Vector3<f64>)> =
            ends.iter().map(|phases| (self.accurately(phases), *phases)).collect();
        judged.sort_by(|a, b| a.0.total_cmp(&b.0));
        judged.dedup_by(|a, b| (a.1 - b.1).norm() < 0.1);
        let followed: Vec<_> = judged.iter().take(FOLLOWED).map(|end| self.descend(end.1, count)).collect();
        judged.extend(followed);
        judged.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NAN, Vector3::zeros()))
    }

    /// Down a valley, which may be narrow and oblique: a quasi-Newton descent (Nocedal & Wright 2006, section 6.1) with the
    /// slope by differences, four step lengths tried at once.
    pub(super) fn descend(&self, start: Vector3<f64>, count: &mut usize) -> (f64, Vector3<f64>) {
        let mut best = (self.accurately(&start), start);
        let mut inverse: Option<Matrix3<f64>> = None;
        let mut last: Option<(Vector3<f64>, Vector3<f64>)> = None;
        for _ in 0..MOST_DESCENTS {
            let beside =
                |n: usize| best.1 + Vector3::ith(n / 2, if n.is_multiple_of(2) { DIFFERENCE } else { -DIFFERENCE });
            let around = self.weakest(&std::array::from_fn::<_, 6, _>(beside));
            let slope = Vector3::from_fn(|a, _| (around[2 * a] - around[2 * a + 1]) / (2.0 * DIFFERENCE));
            if let (Some(inverse), Some((place, before))) = (&mut inverse, last) {
                let (s, y) = (best.1 - place, slope - before);
                let curved = s.dot(&y);
                if curved > 0.0 {
                    let turn = Matrix3::identity() - s * y.transpose() / curved;
                    *inverse = turn * *inverse * turn.transpose() + s * s.transpose() / curved;
                }
            }
            // To begin with, the curvature along the axes.
            let inverse = inverse.get_or_insert_with(|| {
                let curvature = |a: usize| {
                    let second = (around[2 * a] + around[2 * a + 1] - 2.0 * best.0) / (DIFFERENCE * DIFFERENCE);
                    second.max(slope.norm() / LONGEST_STEP).max(f64::MIN_POSITIVE)
                };
                Matrix3::from_diagonal(&Vector3::from_fn(|a, _| curvature(a).recip()))
            });
            let step = -*inverse * slope;
            let step = step * (LONGEST_STEP / step.amax()).min(1.0);
            last = Some((best.1, slope));
            let tried = [[1.0, 0.5, 0.25, 0.1], [0.04, 0.015, 5e-3, 1e-3]].into_iter().find_map(|lengths| {
                let places = lengths.map(|t| best.1 + t * step);
                *count += lengths.len();
                let values = self.weakest(&places);
                let lower = values.into_iter().zip(places).filter(|(_, p)| wrapped_all(p).norm() >= LONG_WAVE);
                lower.filter(|(value, _)| *value < best.0).min_by(|a, b| a.0.total_cmp(&b.0))
            });
            *count += around.len();
            let Some(lower) = tried else { break };
            let little = best.0 - lower.0 <= 1e-7 * best.0.abs();
            best = lower;
            if little {
                break;
            }
        }
        let end = wrapped_all(&best.1);
        (self.accurately(&end), end)
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
        for (value, phases) in values.iter_mut().zip(phases) {
            *value = self.falling_turn(phases).unwrap_or(*value);
        }
        values
    }

    /// Smallest eigenvalue of D/κ² (Pa) to rounding.
    pub(super) fn accurately(&self, phases: &Vector3<f64>) -> f64 {
        if let Some(resistance) = self.falling_turn(phases) {
            return resistance;
        }
        let [d] = self.at_phases(&[*phases]);
        d.symmetric_eigenvalues().min() / self.laplacian(phases)
    }

    /// The resistance (Pa) to a wave of rotations that negative tangential bonds drive, if there is one: nodes then turn
    /// further and further, whatever their displacements.
    fn falling_turn(&self, phases: &Vector3<f64>) -> Option<f64> {
        let Beyond::Rotations { resistances, at_rest, normal: None, .. } = &self.beyond else { return None };
        let powers = HalfPhases::new(&[*phases], self.bonds.reach());
        let [r] = self.bonds.even(&powers, resistances, |_, cos| cos * cos);
        Some(r.symmetric_eigenvalues().min()).filter(|least| *least < -FREE_TO_TURN * at_rest)
    }

    /// κ² (1/m²).
    fn laplacian(&self, phases: &Vector3<f64>) -> f64 {
        phases.map(|p| 4.0 * (0.5 * p).sin().powi(2)).sum() / (self.spacing * self.spacing)
    }
}

/// Smallest eigenvalue of a symmetric matrix by Cardano's formula (Smith 1961): fast, and good to half the digits where
/// eigenvalues are double.
pub(super) fn smallest_eigenvalue(a: &Matrix3<f64>) -> f64 {
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

fn wrapped_all(phases: &Vector3<f64>) -> Vector3<f64> {
    phases.map(wrapped)
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
