//! Bonds of nodes near free surfaces and cracks, whose neighbourhood is cut off.
//!
//! A node without some of its bonds is too soft: the bonds it has left make less than the material's tensor. Its
//! micromoduli are calibrated like those of a bulk node (P eqs 36-43), only for the bonds it has: close to the bulk's
//! values and to the bulk's tensor S,
//!
//! minimise ½‖c − c⁰‖² + ‖X c − S‖²/2μ subject to l ≤ c ≤ u,
//!
//! with c⁰ the bulk's micromoduli, l a quarter of each, u four times each, and a small μ: where the bonds can
//! reach S they do to about μ, where they cannot (edges and corners see too few directions) they come as close as they can
//! without exploding. The bounds keep every motion between a quarter and four times as stiff as it is without calibration: no
//! node loses a bond that holds it. The solution is c = clamp(c⁰ + s p(n), l, u) with one quartic form p.
//!
//! A bond takes the mean of the values of its two ends.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::lattice::{Body, Neighbourhood};
use crate::tensor::{Quartic, quartic_of};
use crate::{Error, Result};

/// μ relative to the mean eigenvalue of XXᵀ.
const SOFTNESS: f64 = 1e-3;

/// u relative to the micromodulus of the bulk: the stable time step is kept within about half of the bulk's.
const MOST: f64 = 4.0;

/// l relative to the micromodulus of the bulk.
const LEAST: f64 = 0.25;

/// Newton steps; about ten are used.
const MOST_STEPS: usize = 60;

/// The bonds of all nodes of one pattern.
#[derive(Clone, Debug)]
pub struct SurfaceStencil {
    /// Region of the nodes, 1 + index as in [`Body::region`].
    pub region: u16,
    /// Micromodulus (N/m⁶) of every bond of the full neighbourhood, in its order; 0 for bonds that are absent.
    pub micromodulus: Vec<f64>,
    /// ‖X c − S‖/‖S‖: what the bonds of such a node miss of the bulk's tensor, before the mean with their other ends.
    pub error: f64,
    /// The same for the bulk's micromoduli on the bonds that are left.
    pub error_before: f64,
    /// Number of nodes.
    pub nodes: usize,
}

/// Micromoduli for every node of a body.
#[derive(Clone, Debug)]
pub struct SurfaceStencils {
    /// Per node: 0 where there is no material, else 1 + index of its stencil.
    pub stencil_of_node: Vec<u16>,
    /// Those of the regions' bulk first, in their order, then one per pattern of bonds that occurs.
    pub stencils: Vec<SurfaceStencil>,
    /// Nodes of patterns beyond the 65 535 that can be numbered; they keep their bulk's stencil.
    pub left_as_bulk: usize,
}

/// Calibrate every pattern of bonds that occurs in a body. `micromodulus` holds the bulk's values (N/m⁶) of every region;
/// `connected(node, bond)` says whether a bond (in the neighbourhood's order) whose two ends are material exists: false
/// for one that a crack cuts.
///
/// The result depends on the body only, not on the number of threads.
///
/// # Errors
/// Micromoduli of another number than the bonds, negative or not finite; a region without micromoduli.
pub fn surface_stencils(
    body: &Body,
    neighbourhood: &Neighbourhood,
    micromodulus: &[Vec<f64>],
    connected: impl Fn(usize, usize) -> bool + Sync,
) -> Result<SurfaceStencils> {
    let bonds = neighbourhood.bonds();
    for (region, c) in micromodulus.iter().enumerate() {
        if c.len() != bonds.len() || c.iter().any(|c| !(c.is_finite() && *c >= 0.0)) || c.iter().all(|c| *c == 0.0) {
            return Err(Error::input(
                format!("region {} has {} micromoduli for {} bonds", region + 1, c.len(), bonds.len()),
                "give one number ≥ 0 per bond, not all 0",
            ));
        }
    }
    if let Some(region) = body.region.iter().find(|&&r| usize::from(r) > micromodulus.len()) {
        return Err(Error::input(format!("region {region} has no micromoduli"), "calibrate the bonds of every region"));
    }

    let nodes: Vec<usize> = (0..body.grid.len()).filter(|&i| body.has(i)).collect();
    let reach = std::array::from_fn(|a| bonds.iter().map(|b| b.offset[a].unsigned_abs() as usize).max().unwrap_or(0));
    let deep = body.grid.uniform_around(&body.region, reach);
    let cut_off: Vec<Option<Pattern>> = nodes
        .par_iter()
        .map(|&node| match deep[node] && (0..bonds.len()).all(|b| connected(node, b)) {
            true => None,
            false => Pattern::of(body, neighbourhood, node, &connected),
        })
        .collect();

    let problems: Vec<Problem> = micromodulus.iter().map(|c| Problem::new(neighbourhood, c)).collect();
    let mut number: HashMap<&Pattern, u16> = HashMap::new();
    let mut patterns: Vec<&Pattern> = Vec::new();
    let mut stencil_of_node = vec![0; body.grid.len()];
    let mut left_as_bulk = 0;
    for (&node, pattern) in nodes.iter().zip(&cut_off) {
        let bulk = body.region[node];
        stencil_of_node[node] = match pattern {
            None => bulk,
            Some(pattern) => match number.get(pattern) {
                Some(&known) => known,
                None if problems.len() + patterns.len() < usize::from(u16::MAX) => {
                    patterns.push(pattern);
                    let new = (problems.len() + patterns.len()) as u16;
                    number.insert(pattern, new);
                    new
                }
                None => {
                    left_as_bulk += 1;
                    bulk
                }
            },
        };
    }
    let bulk = micromodulus.iter().enumerate().map(|(region, c)| SurfaceStencil {
        region: region as u16 + 1,
        micromodulus: c.clone(),
        error: 0.0,
        error_before: 0.0,
        nodes: 0,
    });
    let calibrated: Vec<SurfaceStencil> =
        patterns.par_iter().map(|p| problems[usize::from(p.region) - 1].calibrate(p)).collect();
    let mut stencils: Vec<SurfaceStencil> = bulk.chain(calibrated).collect();
    for &s in stencil_of_node.iter().filter(|&&s| s > 0) {
        stencils[usize::from(s) - 1].nodes += 1;
    }
    Ok(SurfaceStencils { stencil_of_node, stencils, left_as_bulk })
}

/// Which bonds a node of a region has.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Pattern {
    region: u16,
    /// One bit per bond of the full neighbourhood.
    bits: Vec<u64>,
}

impl Pattern {
    /// The pattern of a node; `None` when it has all its bonds.
    fn of(
        body: &Body,
        neighbourhood: &Neighbourhood,
        node: usize,
        connected: impl Fn(usize, usize) -> bool,
    ) -> Option<Self> {
        let bonds = neighbourhood.bonds();
        let mut bits = vec![0; bonds.len().div_ceil(64)];
        let mut count = 0;
        for (b, bond) in bonds.iter().enumerate() {
            let other = body.grid.neighbour(node, bond.offset).filter(|&j| body.has(j));
            if other.is_some() && connected(node, b) {
                bits[b / 64] |= 1 << (b % 64);
                count += 1;
            }
        }
        (count < bonds.len()).then(|| Pattern { region: body.region[node], bits })
    }

    fn has(&self, bond: usize) -> bool {
        self.bits[bond / 64] >> (bond % 64) & 1 == 1
    }
}

/// The calibration of one region's cut-off neighbourhoods, in units of the largest c and s.
struct Problem {
    /// n⊗n⊗n⊗n of every bond.
    quartics: Vec<Quartic>,
    /// s of every bond.
    share: Vec<f64>,
    /// c⁰ of every bond.
    bulk: Vec<f64>,
    /// Largest c of the bulk (N/m⁶).
    unit: f64,
    /// S = Σ c⁰ s n⊗n⊗n⊗n.
    target: Quartic,
}

impl Problem {
    fn new(neighbourhood: &Neighbourhood, micromodulus: &[f64]) -> Self {
        let bonds = neighbourhood.bonds();
        let quartics: Vec<Quartic> = bonds.iter().map(|b| quartic_of(&b.xi.normalize())).collect();
        let share: Vec<f64> = bonds.iter().map(|b| neighbourhood.stiffness_share(b)).collect();
        let largest = share.iter().copied().fold(0.0, f64::max);
        let unit = micromodulus.iter().copied().fold(0.0, f64::max);
        let share: Vec<f64> = share.iter().map(|s| s / largest).collect();
        let bulk: Vec<f64> = micromodulus.iter().map(|c| c / unit).collect();
        let target = tensor(&quartics, &share, &bulk);
        Problem { quartics, share, bulk, unit, target }
    }

    fn calibrate(&self, pattern: &Pattern) -> SurfaceStencil {
        let present: Vec<usize> = (0..self.bulk.len()).filter(|&b| pattern.has(b)).collect();
        let pick = |values: &[f64]| -> Vec<f64> { present.iter().map(|&b| values[b]).collect() };
        let quartics: Vec<Quartic> = present.iter().map(|&b| self.quartics[b]).collect();
        let (share, bulk) = (pick(&self.share), pick(&self.bulk));
        let before = tensor(&quartics, &share, &bulk);
        let error = |reached: &Quartic| (reached - self.target).norm() / self.target.norm();
        let c = closest(&quartics, &share, &bulk, &self.target);
        let mut micromodulus = vec![0.0; self.bulk.len()];
        present.iter().zip(&c).for_each(|(&b, c)| micromodulus[b] = c * self.unit);
        SurfaceStencil {
            region: pattern.region,
            micromodulus,
            error: error(&tensor(&quartics, &share, &c)),
            error_before: error(&before),
            nodes: 0,
        }
    }
}

/// Σ s c n⊗n⊗n⊗n.
fn tensor(quartics: &[Quartic], share: &[f64], c: &[f64]) -> Quartic {
    quartics.iter().zip(share).zip(c).fold(Quartic::zeros(), |sum, ((v, s), c)| sum + s * c * v)
}

/// minimise ½‖c − c⁰‖² + ‖X c − S‖²/2μ, l ≤ c ≤ u, by Newton's method on the strongly concave dual in y, whose gradient
/// is S − X c − μ y at c = clamp(c⁰ + Xᵀy, l, u).
fn closest(quartics: &[Quartic], share: &[f64], start: &[f64], target: &Quartic) -> Vec<f64> {
    if quartics.is_empty() {
        return Vec::new();
    }
    let mu = SOFTNESS * share.iter().map(|s| s * s).sum::<f64>() / 15.0;
    let free = |y: &Quartic, b: usize| start[b] + share[b] * quartics[b].dot(y);
    let values = |y: &Quartic| -> Vec<f64> {
        (0..share.len()).map(|b| free(y, b).clamp(LEAST * start[b], MOST * start[b])).collect()
    };
    let gradient = |y: &Quartic| target - tensor(quartics, share, &values(y)) - mu * y;
    let mut y = Quartic::zeros();
    for _ in 0..MOST_STEPS {
        let g = gradient(&y);
        if g.norm() <= 1e-13 * target.norm() {
            break;
        }
        let mut hessian = nalgebra::SMatrix::<f64, 15, 15>::identity() * mu;
        for b in (0..share.len()).filter(|&b| (LEAST * start[b]..MOST * start[b]).contains(&free(&y, b))) {
            hessian += share[b] * share[b] * quartics[b] * quartics[b].transpose();
        }
        let Some(factor) = hessian.cholesky() else { break };
        let direction = factor.solve(&g);
        // The slope falls along the direction: the step where it is (nearly) zero, at most a full one.
        let slope = |t: f64| gradient(&(y + t * direction)).dot(&direction);
        let (mut low, mut high) = (0.0, 1.0);
        let begin = slope(0.0);
        if slope(1.0) < -0.1 * begin {
            for _ in 0..30 {
                let t = 0.5 * (low + high);
                let s = slope(t);
                if s < 0.0 {
                    high = t
                } else {
                    low = t
                }
                if s.abs() <= 0.1 * begin {
                    high = t;
                    break;
                }
            }
        }
        y += high * direction;
    }
    values(&y)
}
