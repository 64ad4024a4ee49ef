//! When the nodes of a body crack.
//!
//! A flat crack close to a node cuts the bonds that lead away from it across the crack's plane. A node counts as cracked if of
//! the energy that it takes to break the bonds across some plane beside it most is spent: so a crack is found whatever the
//! directions of the bonds that carry the material, and however many bonds of others are left.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::crack_path::{CrackPath, crack_paths};
use crate::experiment::problem::Problem;
use crate::lattice::{Grid, Neighbourhood};
use crate::operator::grid::{BondLoss, FailingBonds};

/// Distance of the planes from the node in horizons.
const BESIDE: f64 = 0.1;

/// Share of the energy of the bonds across a plane that is spent where it is a crack's. A flat crack at a distance d cuts (1 − d/δ)²
/// (2 + d/δ)/4 of all of an isotropic node's: 0.88 of those across the plane at half a spacing of a horizon of three, 0.77 at 0.7 Δ,
/// 0.61 at one spacing: one or two rows count, diagonally three. Where a ply splits in shear, half of the oblique bonds are
/// compressed and stay: 0.77 beside the split, 0.23 in the next rows.
const CRACKED: f64 = 0.7;

/// Share of that energy in the bulk which must be there, besides: near surfaces planes outside of the body cross few bonds.
const LEAST: f64 = 0.4;

/// Planes that are looked at have Miller indices up to these: all, or those around the normal of one periodic layer.
const MOST_INDEX: [i32; 2] = [3, 4];

/// Share of the energy of failed bonds away from cracks above which a run is warned of.
const DIFFUSE: f64 = 0.3;

/// Time of nodes that are whole, and of nodes that were cracked at the start.
pub(super) const WHOLE: f64 = f64::MAX;
pub(super) const FROM_THE_START: f64 = -1.0;

/// When each node was first seen cracked.
pub(super) struct CrackFront {
    /// Empty for a body whose bonds do not break.
    times: Vec<f64>,
    planes: Planes,
    /// By node: energy spent at the start (J), by bonds that pre-cracks cut.
    at_start: Vec<f64>,
    /// Energy lost with failing bonds (J) when it was last looked at.
    seen: f64,
}

impl CrackFront {
    /// Before the first step, pre-cracks cut.
    pub(super) fn new(problem: &Problem, bonds: &FailingBonds) -> Self {
        let planes = Planes::new(problem, bonds);
        if !problem.regions.iter().any(|r| r.fracture.is_some()) {
            return CrackFront { times: Vec::new(), planes, at_start: Vec::new(), seen: 0.0 };
        }
        let nodes = problem.body.grid.len();
        let mut front = CrackFront { times: vec![WHOLE; nodes], planes, at_start: vec![0.0; nodes], seen: 0.0 };
        front.mark(bonds, FROM_THE_START);
        front.at_start = spent_by_node(bonds);
        front
    }

    /// Note the nodes that are cracked now; `lost` energy of failing bonds so far (J), without which there is nothing new.
    pub(super) fn look(&mut self, bonds: &FailingBonds, time: f64, lost: f64) {
        if !self.times.is_empty() && lost != self.seen {
            self.seen = lost;
            self.mark(bonds, time);
        }
    }

    fn mark(&mut self, bonds: &FailingBonds, time: f64) {
        let planes = &self.planes;
        let damage = bonds.damage();
        self.times.par_iter_mut().enumerate().with_min_len(64).for_each(|(node, since)| {
            if *since == WHOLE && damage[node] > 0.0 && planes.cracked(bonds, node) {
                *since = time;
            }
        });
    }

    pub(super) fn times(&self) -> &[f64] {
        &self.times
    }

    pub(super) fn restore(&mut self, times: Vec<f64>) {
        self.times = times;
    }

    /// The cracks that have grown, the longest first.
    pub(super) fn paths(&self, grid: &Grid, motion: bool) -> Vec<CrackPath> {
        crack_paths(grid, &self.times, motion)
    }

    /// Share of the energy spent by failing bonds (–) whose ends are no nodes of cracks nor within reach of one along the
    /// grid's axes; `None` where nothing has failed.
    pub(super) fn away_from_cracks(
        &self,
        grid: &Grid,
        neighbourhood: &Neighbourhood,
        bonds: &FailingBonds,
    ) -> Option<f64> {
        if self.times.is_empty() || self.seen == 0.0 {
            return None;
        }
        let offsets = neighbourhood.bonds().iter().map(|b| b.offset);
        let offsets: Vec<[i32; 3]> = offsets.chain([[0; 3]]).collect();
        let (mut all, mut away) = (0.0, 0.0);
        for (node, (spent, at_start)) in spent_by_node(bonds).iter().zip(&self.at_start).enumerate() {
            let spent = spent - at_start;
            if spent > 0.0 {
                all += spent;
                let near = |o: &[i32; 3]| grid.neighbour(node, *o).is_some_and(|n| self.times[n] < WHOLE);
                away += if offsets.iter().any(near) { 0.0 } else { spent };
            }
        }
        (all > 0.0).then(|| away / all)
    }
}

/// A warning where damage is diffuse, so that a list of cracks does not tell where it is: of the cracks of a run and of the share
/// of the energy of failed bonds away from them (–).
pub fn diffuse_warning(cracks: &[CrackPath], away: Option<f64>) -> Option<String> {
    let zones = cracks.iter().filter(|crack| crack.diffuse).count();
    let what = match away {
        Some(share) if share > DIFFUSE => {
            format!("{:.0} % of the energy of failed bonds lies away from cracks", 100.0 * share)
        }
        _ if zones > 0 => format!("{zones} of {} cracks found are zones several nodes thick", cracks.len()),
        _ => return None,
    };
    Some(format!("damage is diffuse: {what}; see the field damage"))
}

/// Energy (J) that the bonds of each node have spent.
fn spent_by_node(bonds: &FailingBonds) -> Vec<f64> {
    let of = |(node, damage): (usize, &f64)| {
        let mut spent = 0.0;
        if *damage > 0.0 {
            bonds.bond_losses(node, |BondLoss { energy, spent: share, .. }| spent += energy * share);
        }
        spent
    };
    bonds.damage().par_iter().enumerate().map(of).collect()
}

/// Planes beside a node, and what they cost in the bulk.
struct Planes {
    /// Unit normals; the plane lies on the side to which they point.
    normals: Vec<Vector3<f64>>,
    /// Distance from the node (m).
    beside: f64,
    /// Region of each node.
    region: Vec<u16>,
    /// By region and normal: energy of the bonds of a bulk node across the plane (J).
    bulk: Vec<Vec<f64>>,
}

impl Planes {
    fn new(problem: &Problem, bonds: &FailingBonds) -> Self {
        let (grid, list) = (&problem.body.grid, problem.neighbourhood.bonds());
        let layer = (0..3).find(|&a| grid.periodic[a] && grid.nodes[a] == 1);
        let most = MOST_INDEX[usize::from(layer.is_some())];
        let range = || -most..=most;
        let all = range().flat_map(|i| range().flat_map(move |j| range().map(move |k| [i, j, k])));
        let in_plane = |m: &[i32; 3]| *m != [0; 3] && layer.is_none_or(|a| m[a] == 0);
        // Of collinear ones the shortest.
        let shortest = |m: &[i32; 3]| (2..=most).all(|d| m.iter().any(|x| x % d != 0));
        let normals = all.filter(in_plane).filter(shortest).map(|m| Vector3::from(m.map(f64::from)).normalize());
        let normals: Vec<Vector3<f64>> = normals.collect();
        let longest = list.iter().map(|b| b.xi.norm()).fold(0.0, f64::max);
        let beside = BESIDE * longest;
        let across = |region: usize| {
            let stencil = &bonds.grid().stencils()[region];
            let energy = |b: usize| match stencil.critical[b].is_finite() {
                true => 0.5 * stencil.stiffness[b] * (stencil.critical[b] * list[b].xi.norm()).powi(2),
                false => 0.0,
            };
            let of = |n: &Vector3<f64>| (0..list.len()).filter(|&b| n.dot(&list[b].xi) > beside).map(energy).sum();
            normals.iter().map(of).collect()
        };
        let bulk = (0..problem.regions.len()).map(across).collect();
        Planes { normals, beside, region: problem.body.region.clone(), bulk }
    }

    /// Whether the bonds of a node across some plane beside it have mostly failed.
    fn cracked(&self, bonds: &FailingBonds, node: usize) -> bool {
        let Some(bulk) = usize::from(self.region[node]).checked_sub(1).map(|region| &self.bulk[region]) else {
            return false;
        };
        let mut losses = Vec::new();
        bonds.bond_losses(node, |loss| losses.push(loss));
        let failed: Vec<BondLoss> = losses.iter().filter(|loss| loss.spent > 0.0).copied().collect();
        self.normals.iter().zip(bulk).any(|(n, bulk)| {
            let across = |loss: &&BondLoss| n.dot(&loss.xi) > self.beside;
            let lost: f64 = failed.iter().filter(across).map(|loss| loss.energy * loss.spent).sum();
            *bulk > 0.0
                && lost >= CRACKED * LEAST * bulk
                && lost >= CRACKED * losses.iter().filter(across).map(|loss| loss.energy).sum::<f64>()
        })
    }
}
