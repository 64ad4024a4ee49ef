//! The weakest wave of the Brillouin zone.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::bond_sums::{BondSums, HalfPhases};
use super::bound::{Energy, Found};
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

/// What the closed form of an eigenvalue may be off, relative to ‖C‖; about 10⁻⁸ where eigenvalues are double.
const CLOSED_FORM: f64 = 1e-7;

/// Evaluations of D for a proof at most.
const THOROUGH: usize = 100_000;

/// Share of the smallest eigenvalue found that is to be proved.
const PROVED: f64 = 0.1;

/// What nine ± pairs of bonds n⊗n (2 − 2 cos φ) to the nearest 18 neighbours are above, relative to κ²Δ². It is ⅓, at the
/// zone's corners; proved by [`Energy::is_above`] in a test.
const NEAREST: f64 = 0.33;

/// Reach (spacings) of the bonds that are tried alone first.
const SHORT: usize = 3;

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
    /// How that is known.
    pub evidence: Evidence,
    /// No wave of the zone has an eigenvalue below this (Pa, > 0); `None` where none was proved.
    pub bound: Option<f64>,
    /// ‖C‖ of the grid (Pa), the scale of the others.
    pub norm: f64,
    /// Wave vectors tried.
    pub samples: usize,
}

impl Stability {
    /// The smallest eigenvalue found, relative to ‖C‖ (–).
    pub fn margin(&self) -> f64 {
        self.smallest_eigenvalue / self.norm
    }

    /// How it is known, in brief.
    pub fn brief(&self) -> StabilityEvidence {
        StabilityEvidence {
            evidence: self.evidence,
            margin: self.margin(),
            bound: self.bound.map(|bound| bound / self.norm),
            at: self.phases,
        }
    }
}

/// What a report says beside whether a grid is stable.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StabilityEvidence {
    /// proved or sampled.
    pub evidence: Evidence,
    /// Smallest eigenvalue found of D(k)/κ²(k), relative to ‖C‖ (–).
    pub margin: f64,
    /// What it is proved to be at least everywhere in the Brillouin zone, relative to ‖C‖; `None` where nothing is.
    pub bound: Option<f64>,
    /// Phases kₐΔ (rad) along the grid's axes where the margin was found.
    pub at: [f64; 3],
}

/// How it is known that a grid is stable, or that it is not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Evidence {
    /// Stable: positive bonds to the nearest 18 neighbours and a nodal term ⪰ 0, or a bound over the whole zone. Not stable:
    /// the wave vector at which it was found.
    Proved,
    /// Stable as far as wave vectors were tried.
    Sampled,
}

impl Evidence {
    /// proved or sampled.
    pub fn name(self) -> &'static str {
        match self {
            Evidence::Proved => "proved",
            Evidence::Sampled => "sampled",
        }
    }
}

impl Dispersion {
    /// The weakest wave of the Brillouin zone: D(k) at a grid of half the zone (8 points along each axis, so the zone's
    /// faces, edges and corners are met), the lines from its centre to the 13 face, edge and corner points (12 points
    /// each), 60 directions of long waves (|k|Δ = 0.05), then a search around the four weakest by halved steps; and a
    /// proof that no wave is weaker than a share of that: at once where the bonds to the nearest 18 neighbours are positive
    /// and Z ⪰ 0, else by branch and bound with 100 000 evaluations of D at most. A weaker wave that the proof meets is
    /// followed.
    pub fn stability(&self) -> Stability {
        self.stability_within(THOROUGH)
    }

    /// As [`Self::stability`], with another number of evaluations for the proof at most.
    pub fn stability_within(&self, most: usize) -> Stability {
        let mut count = 0;
        let mut weakest = self.search(&mut count);
        let mut bound = self.bound_by_signs();
        let mut left = most;
        while bound.is_none() && weakest.0 > self.rounding() && left > 0 {
            let m = PROVED * weakest.0;
            let (found, used) = self.is_above(m, left);
            left = left.saturating_sub(used);
            count += used;
            match found {
                Found::Above => bound = Some(m),
                Found::Undecided => break,
                Found::Below(phases) => {
                    let start = (self.weakest(&[phases])[0], phases);
                    let end = self.refine(start, &mut count);
                    let followed = [phases, end].map(|phases| (self.accurately(&phases), phases));
                    let lower = if followed[0].0 < followed[1].0 { followed[0] } else { followed[1] };
                    // The part that was looked at can be below what the whole is.
                    if lower.0 >= weakest.0 {
                        break;
                    }
                    weakest = lower;
                }
            }
        }
        let stable = weakest.0 > self.rounding();
        let proved = !stable || bound.is_some();
        Stability {
            smallest_eigenvalue: weakest.0,
            phases: weakest.1.into(),
            stable,
            evidence: if proved { Evidence::Proved } else { Evidence::Sampled },
            bound: bound.filter(|_| stable),
            norm: self.norm,
            samples: count,
        }
    }

    /// The weakest of the samples and of the searches from them.
    fn search(&self, count: &mut usize) -> (f64, Vector3<f64>) {
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
        let judged = ends.iter().map(|phases| (self.accurately(phases), *phases));
        judged.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NAN, Vector3::zeros()))
    }

    /// A bound (Pa) from the signs of bonds and nodal term alone: with w ⪰ β n⊗n, β > 0, of the nine ± pairs to the nearest
    /// and second nearest neighbours, D_b ⪰ [`NEAREST`] β κ²; and with |sin φ| ≤ κ|ξ| a nodal term takes z (Σ |v| |ξ|)² κ²
    /// at most, −z its smallest eigenvalue, rounding where it is ⪰ 0.
    fn bound_by_signs(&self) -> Option<f64> {
        let weights = match &self.beyond {
            Beyond::Rotations { normal, .. } => normal.as_deref()?,
            _ => self.bonds.weights(),
        };
        // Of w = a n⊗n/|ξ|² the trace is a/|ξ|².
        let strength = |w: &[f64; 6]| (w[0] + w[1] + w[2]) * self.spacing * self.spacing;
        let near = self.bonds.offsets().iter().zip(weights).filter(|(o, _)| o.iter().map(|x| x * x).sum::<i32>() <= 2);
        let (pairs, least) = near.fold((0, f64::INFINITY), |(n, least), (_, w)| (n + 1, strength(w).min(least)));
        if pairs < 9 || weights.iter().any(|w| strength(w) < 0.0) {
            return None;
        }
        let taken = match &self.beyond {
            Beyond::Nodal { term, gradients } => {
                let lengths = self.bonds.offsets().iter().map(|o| Vector3::from(o.map(f64::from)).norm());
                let reach: f64 = gradients.iter().zip(lengths).map(|(v, length)| self.spacing * v.norm() * length).sum();
                -term.symmetric_eigenvalues().min().min(0.0) * reach * reach
            }
            _ => 0.0,
        };
        Some(NEAREST * least - taken).filter(|bound| *bound > self.rounding())
    }

    /// Whether D(k) ⪰ m κ²(k) in the whole zone. Of free rotations that tangential bonds ≥ 0 resist it is enough that normal
    /// bonds alone are above; of bonds alone, that their short ones are.
    fn is_above(&self, m: f64, most: usize) -> (Found, usize) {
        let all = &self.bonds;
        let (bonds, nodal) = match &self.beyond {
            Beyond::Nothing => (all.clone(), None),
            Beyond::Nodal { term, gradients } => (all.clone(), Some((term, gradients))),
            Beyond::Rotations { normal: Some(normal), .. } => (BondSums::new(all.offsets().to_vec(), normal.clone()), None),
            Beyond::Rotations { normal: None, .. } => return (Found::Undecided, 0),
        };
        if let Some((term, gradients)) = nodal {
            return Energy::new(bonds, self.spacing).with_nodal(term, gradients).is_above(m, most);
        }
        let mut used = 0;
        let none_negative = bonds.weights().iter().all(|w| w[0] + w[1] + w[2] >= 0.0);
        if bonds.reach() > SHORT && none_negative {
            let (found, tried) = Energy::new(bonds.within(SHORT), self.spacing).is_above(m, most);
            used = tried;
            if matches!(found, Found::Above) {
                return (found, used);
            }
        }
        let (found, more) = Energy::new(bonds, self.spacing).is_above(m, most);
        (found, used + more)
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
    fn accurately(&self, phases: &Vector3<f64>) -> f64 {
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

    /// The bonds to the nearest 18 neighbours: what [`Dispersion::bound_by_signs`] relies on.
    #[test]
    fn nearest_neighbours_are_above_a_third() {
        let offsets: Vec<[i32; 3]> = zone_directions()
            .iter()
            .filter(|n| n.norm_squared() < 2.5)
            .map(|n| std::array::from_fn(|a| n[a] as i32))
            .collect();
        let weights: Vec<[f64; 6]> = offsets
            .iter()
            .map(|o| {
                let n = Vector3::from(o.map(f64::from)).normalize();
                super::super::upper(&(n * n.transpose()))
            })
            .collect();
        assert_eq!(weights.len(), 9);
        let energy = Energy::new(BondSums::new(offsets, weights), 1.0);
        assert!(matches!(energy.is_above(NEAREST, 20_000).0, Found::Above));
        assert!(matches!(energy.is_above(0.334, 20_000).0, Found::Below(_)));
    }

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
