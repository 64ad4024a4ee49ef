//! A V-cycle over ever coarser grids of hexahedra: an approximate inverse that is symmetric and positive.

use super::banded::BandedCholesky;
use std::collections::{BTreeMap, BTreeSet};

use super::coarsening::Coarsening;
use super::hexahedra::{Filling, Hexahedra, Part, wiggle};
use super::pieces::{Pieces, merge_sharing};
use super::rigid::grounds;
use super::transfer::Transfer;
use crate::tensor::Stiffness;

/// Multiplications that the factors of the coarsest grid may cost: N b² for N unknowns in a band b.
const BOTTOM_COST: f64 = 1e8;

/// Pivots of the coarsest grid below this share of their diagonal are rounding.
const ROUNDING: f64 = 1e-11;

/// What a coarser grid of more nodes must gain: little, beside the finest grids.
const PRICE: f64 = 1.5;

/// Most that the smoothing of a grid spans beyond that of an isotropic body.
const WIDEST: f64 = 8.0;

/// Cycles where material is parted: coarse elements join the faces of a crack around its front, too far, and a cycle undoes only
/// part of that.
const SPLIT: usize = 3;

/// Steps towards the largest eigenvalue of a cycle.
const POWER_STEPS: usize = 6;

/// Several cycles are positive as long as each step times the largest eigenvalue is below 2; the eigenvalue is known from below.
const SAFE: f64 = 1.6;

/// How the coarse grids are smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothing {
    /// Chebyshev steps before and after each coarser grid.
    pub degree: usize,
    /// Largest over smallest eigenvalue that the steps are to damp.
    pub span: f64,
    /// V-cycles per application; at least three where material is parted.
    pub cycles: usize,
}

impl Default for Smoothing {
    fn default() -> Self {
        Smoothing { degree: 2, span: 6.0, cycles: 1 }
    }
}

impl Smoothing {
    /// Over waves of a smaller share of the stiffness than those of an isotropic body.
    fn over(self, share: f64) -> Self {
        let wider = (1.0 / share).clamp(1.0, WIDEST);
        Smoothing { degree: (self.degree as f64 * wider.sqrt()).round() as usize, span: self.span * wider, ..self }
    }
}

/// Grids of twice the spacing each along all axes or some, and the factors of the last.
pub struct Multigrid {
    levels: Vec<Hexahedra>,
    transfers: Vec<Transfer>,
    bottom: BandedCholesky,
    place: Vec<usize>,
    /// Of every grid but the last.
    smoothing: Vec<Smoothing>,
    cycles: usize,
    /// Share of a cycle's step that is taken where there are several, so that they stay positive.
    damping: f64,
}

impl Multigrid {
    /// From the finest grid of elements.
    pub(super) fn new(finest: Hexahedra, tensors: &[Stiffness], smoothing: Smoothing) -> Self {
        let mut levels = vec![finest];
        let (mut transfers, mut smoothings) = (Vec::new(), vec![smoothing]);
        while let Some((transfer, coarse, share)) = levels.last().and_then(|fine| coarser(fine, tensors)) {
            smoothings.insert(transfers.len(), smoothing.over(share));
            transfers.push(transfer);
            levels.push(coarse);
        }
        let coarsest = &levels[levels.len() - 1];
        let (mut entries, place) = coarsest.entries();
        let grounded = grounds(coarsest).into_iter().map(|(node, a, k)| (3 * place[node] + a, k));
        entries.extend(grounded.map(|(at, k)| (at, at, k)));
        let bottom = BandedCholesky::new(3 * coarsest.len(), &entries, ROUNDING);
        let split = levels.iter().any(|level| !level.filling.extra.is_empty());
        let cycles = if split { smoothing.cycles.max(SPLIT) } else { smoothing.cycles };
        let mut grids = Multigrid { levels, transfers, bottom, place, smoothing: smoothings, cycles, damping: 1.0 };
        if cycles > 1 {
            grids.damping = (SAFE / grids.largest_eigenvalue()).min(1.0);
        }
        grids
    }

    /// Largest eigenvalue of one cycle times A, from below.
    fn largest_eigenvalue(&self) -> f64 {
        let grid = &self.levels[0];
        let mut u = wiggle(grid.len());
        let mut au = vec![[0.0; 3]; u.len()];
        let mut largest = 1.0;
        for _ in 0..POWER_STEPS {
            grid.apply(&u, &mut au);
            let v = self.cycle(0, &au);
            let (above, below) = (product(&v, &au), product(&u, &au));
            let norm = v.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
            if !(below > 0.0 && norm > 0.0) {
                break;
            }
            largest = above / below;
            u = v;
            u.iter_mut().flatten().for_each(|x| *x /= norm);
        }
        largest
    }

    /// x ≈ A⁻¹ b on the finest grid.
    pub fn solve(&self, b: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut x = self.cycle(0, b);
        x.iter_mut().flatten().for_each(|x| *x *= self.damping);
        for _ in 1..self.cycles {
            let r = self.residual(0, b, &x);
            let mut step = self.cycle(0, &r);
            step.iter_mut().flatten().for_each(|x| *x *= self.damping);
            add(&mut x, &step);
        }
        x
    }

    /// One V-cycle from a level downwards.
    fn cycle(&self, level: usize, b: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let Some(transfer) = self.transfers.get(level) else { return self.solve_bottom(b) };
        let Smoothing { degree, span, .. } = self.smoothing[level];
        let grid = &self.levels[level];
        let mut x = grid.smooth(b, degree, span);
        let r = self.residual(level, b, &x);
        let coarse = self.cycle(level + 1, &transfer.restrict(|n| r[n]));
        transfer.prolong_add(&coarse, &mut x);
        let r = self.residual(level, b, &x);
        add(&mut x, &grid.smooth(&r, degree, span));
        x
    }

    /// b − A x.
    fn residual(&self, level: usize, b: &[[f64; 3]], x: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut r = vec![[0.0; 3]; b.len()];
        self.levels[level].apply(x, &mut r);
        for (r, b) in r.iter_mut().zip(b) {
            for a in 0..3 {
                r[a] = b[a] - r[a];
            }
        }
        r
    }

    /// The coarsest grid, exactly.
    fn solve_bottom(&self, b: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut x = vec![0.0; 3 * b.len()];
        for (b, place) in b.iter().zip(&self.place) {
            x[3 * place..3 * place + 3].copy_from_slice(b);
        }
        self.bottom.solve(&mut x);
        self.place.iter().map(|p| [x[3 * p], x[3 * p + 1], x[3 * p + 2]]).collect()
    }
}

/// x · y.
fn product(x: &[[f64; 3]], y: &[[f64; 3]]) -> f64 {
    x.iter().flatten().zip(y.iter().flatten()).map(|(x, y)| x * y).sum()
}

/// x += y.
fn add(x: &mut [[f64; 3]], y: &[[f64; 3]]) {
    for (x, y) in x.iter_mut().zip(y) {
        for a in 0..3 {
            x[a] += y[a];
        }
    }
}

/// The next grid, and the share of waves that this one is to damp, unless this one is small enough to be solved exactly or cannot be coarsened.
fn coarser(fine: &Hexahedra, tensors: &[Stiffness]) -> Option<(Transfer, Hexahedra, f64)> {
    let mut sorted = fine.nodes;
    sorted.sort_unstable();
    let band = 3.0 * (sorted[0] * sorted[1]) as f64;
    if 3.0 * fine.len() as f64 * band * band <= BOTTOM_COST {
        return None;
    }
    let possible = fine.elements.map(|e| e > 1);
    if possible == [false; 3] {
        return None;
    }
    let Coarsening { axes, share } = Coarsening::new(tensors, fine.edges, possible, PRICE);
    let transfer = Transfer::new(fine.nodes, fine.wraps(), axes);
    let touched = touched(fine);
    let pieces = pieces(fine, &transfer, &touched);
    let transfer = transfer.with(&pieces, &fine.filling.copies);
    let filling = filling(fine, &transfer, pieces, &touched);
    let support = transfer.restrict(|n| fine.support[n]).into_iter().map(|s| s.map(|s| s.max(0.0))).collect();
    let edges = std::array::from_fn(|a| fine.edges[a] * transfer.axes[a].factor as f64);
    let grid = Hexahedra::new(transfer.coarse(), transfer.elements(), edges, filling, support, tensors);
    Some((transfer, grid, share))
}

/// The pieces of coarse elements that are not filled with elements of the grid. Elements of pieces that touch no other are left to
/// this grid: rubble costs no coarse nodes.
fn pieces(fine: &Hexahedra, transfer: &Transfer, touched: &[u32]) -> Pieces {
    let to = |element: usize| transfer.element_index(coarse_element(fine, transfer, element)) as u32;
    let mut parted: BTreeSet<u32> = fine.filling.extra.iter().map(|e| to(e.element as usize)).collect();
    parted.extend((0..fine.filling.parts.len()).filter(|e| fine.filling.parts[*e].is_empty()).map(to));
    let mut cells: BTreeMap<u32, Vec<Vec<u32>>> = parted.into_iter().map(|e| (e, Vec::new())).collect();
    for (coarse, cells) in &mut cells {
        for e in transfer.elements_in(*coarse as usize, fine.elements) {
            if !fine.filling.parts[e].is_empty() {
                cells.push(fine.corners(fine.element_at(e)).map(|c| c as u32).to_vec());
            }
        }
    }
    let (left, parted): (Vec<_>, Vec<_>) = fine.filling.extra.iter().partition(|e| alone(touched, &e.corners));
    for extra in parted {
        cells.entry(to(extra.element as usize)).or_default().push(extra.corners.to_vec());
    }
    let pieces = Pieces::new(transfer, cells.into_iter().map(|(e, cells)| (e, merge_sharing(&cells))).collect());
    Pieces { left: left.into_iter().flat_map(|e| e.corners).collect(), ..pieces }
}

/// How many elements touch every node.
fn touched(grid: &Hexahedra) -> Vec<u32> {
    let mut touched = vec![0; grid.len()];
    for (_, mut corners, _) in grid.filled() {
        // An axis of one element that wraps has a corner twice.
        corners.sort_unstable();
        corners
            .iter()
            .enumerate()
            .filter(|(l, c)| *l == 0 || corners[l - 1] != **c)
            .for_each(|(_, c)| touched[*c as usize] += 1);
    }
    touched
}

/// Whether an element touches no other.
fn alone(touched: &[u32], corners: &[u32; 8]) -> bool {
    corners.iter().all(|c| touched[*c as usize] == 1)
}

/// What the coarse elements hold of the fine ones in them.
fn filling(fine: &Hexahedra, transfer: &Transfer, pieces: Pieces, touched: &[u32]) -> Filling {
    let mut filling = Filling::empty(transfer.elements().iter().product(), pieces.copies.clone());
    let grid = fine.grid_len() as u32;
    let left = |corners: &[u32; 8]| corners.iter().any(|c| *c >= grid) && alone(touched, corners);
    for (element, corners, parts) in fine.filled().filter(|e| !left(&e.1)) {
        let to = coarse_element(fine, transfer, element);
        let cells: f64 = (0..3).map(|a| transfer.axes[a].cells(to[a], fine.elements[a])).product();
        let coarse = transfer.element_index(to);
        let usual = transfer.corners(coarse);
        let own = pieces.holding(coarse, corners[0]).map_or(usual.map(|c| c as u32), |p| p.corners);
        for part in parts {
            filling.add(coarse, own, usual, Part { region: part.region, weight: part.weight / cells });
        }
    }
    filling
}

/// Where the coarse element is that holds an element.
fn coarse_element(fine: &Hexahedra, transfer: &Transfer, element: usize) -> [usize; 3] {
    let at = fine.element_at(element);
    std::array::from_fn(|a| at[a] / transfer.axes[a].factor)
}
