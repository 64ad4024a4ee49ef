//! Whether a grid is stable, and how that is known.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::bond_sums::BondSums;
use super::bound::{Energy, Found};
use super::edge_bound::FarEnergy;
use super::{Beyond, Dispersion};

/// Evaluations of D for a proof at most: of bonds that reach no farther than [`SHORT`], and of others.
const THOROUGH: [usize; 2] = [200_000, 100_000];

/// Evaluations after which what is still open is looked at for weaker waves.
const FIRST: usize = 4_000;

/// Share of the smallest eigenvalue found that is to be proved.
const PROVED: f64 = 0.1;

/// What nine ± pairs of bonds n⊗n (2 − 2 cos φ) to the nearest 18 neighbours are above, relative to κ²Δ². It is ⅓, at the
/// zone's corners; proved by [`Energy::is_above`] in a test.
const NEAREST: f64 = 0.33;

/// Reach (spacings) of the bonds that are tried alone first, and of those with a nodal term that are bounded box by box.
const SHORT: usize = 3;

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
    /// each), 60 directions of long waves (|k|Δ = 0.05), a search around the four weakest by halved steps and a
    /// quasi-Newton descent from the two weakest ends; then a proof that no wave is weaker than a tenth of that: at once where
    /// the bonds to the nearest 18 neighbours are positive and Z ⪰ 0, else by branch and bound with 200 000 evaluations of
    /// D at most (100 000 of bonds that reach far). A weaker wave that the proof meets is followed.
    pub fn stability(&self) -> Stability {
        self.stability_of(true)
    }

    /// As [`Self::stability`], or without the branch and bound: what the signs do not prove is then sampled.
    pub(in crate::calibration) fn stability_of(&self, proves: bool) -> Stability {
        let most = THOROUGH[usize::from(self.bonds.reach() > SHORT)];
        self.stability_within(if proves { most } else { 0 })
    }

    /// As [`Self::stability`], with another number of evaluations for the proof at most.
    pub fn stability_within(&self, most: usize) -> Stability {
        let mut count = 0;
        let mut weakest = self.search(&mut count);
        let mut bound = self.bound_by_signs();
        let (mut granted, mut left) = (FIRST, most);
        while bound.is_none() && weakest.0 > self.rounding() && left > 0 {
            let m = PROVED * weakest.0;
            let (found, used) = self.is_above(m, granted.min(left));
            left = left.saturating_sub(used);
            count += used;
            let open = match found {
                Found::Above => {
                    bound = Some(m);
                    break;
                }
                Found::Below(phases) => vec![phases],
                Found::Undecided(open) => open,
            };
            let lowest = open.into_iter().map(|phases| self.descend(phases, &mut count));
            let lowest = lowest.min_by(|a, b| a.0.total_cmp(&b.0));
            match lowest {
                Some(lower) if lower.0 < 0.999 * weakest.0 => weakest = lower,
                // What was looked at for the proof can be weaker than the whole is; else more may decide.
                _ if granted >= left => break,
                _ => granted = left,
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
                let reach: f64 =
                    gradients.iter().zip(lengths).map(|(v, length)| self.spacing * v.norm() * length).sum();
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
            Beyond::Rotations { normal: Some(normal), .. } => {
                (BondSums::new(all.offsets().to_vec(), normal.clone()), None)
            }
            Beyond::Rotations { normal: None, .. } => return (Found::Undecided(Vec::new()), 0),
        };
        if let Some((term, gradients)) = nodal.filter(|_| bonds.reach() > SHORT) {
            return FarEnergy::new(bonds, self.spacing, term, gradients).is_above(m, most);
        }
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
}

#[cfg(test)]
mod tests {
    use super::super::{upper, zone_directions};
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
                upper(&(n * n.transpose()))
            })
            .collect();
        assert_eq!(weights.len(), 9);
        let energy = Energy::new(BondSums::new(offsets, weights), 1.0);
        assert!(matches!(energy.is_above(NEAREST, 20_000).0, Found::Above));
        assert!(matches!(energy.is_above(0.334, 20_000).0, Found::Below(_)));
    }
}
