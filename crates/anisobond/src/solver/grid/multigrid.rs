//! A V-cycle over ever coarser grids of hexahedra: an approximate inverse that is symmetric and positive.

use super::banded::BandedCholesky;
use super::hexahedra::{Hexahedra, Part};
use super::links::Links;
use super::transfer::Transfer;
use crate::tensor::Stiffness;

/// Multiplications that the factors of the coarsest grid may cost: N b² for N unknowns in a band b.
const BOTTOM_COST: f64 = 1e8;

/// Pivots of the coarsest grid below this share of their diagonal are rigid modes.
const FREE_PIVOT: f64 = 1e-9;

/// How the coarse grids are smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothing {
    /// Chebyshev steps before and after each coarser grid.
    pub degree: usize,
    /// Largest over smallest eigenvalue that the steps are to damp.
    pub span: f64,
    /// V-cycles per application.
    pub cycles: usize,
}

impl Default for Smoothing {
    fn default() -> Self {
        Smoothing { degree: 2, span: 6.0, cycles: 1 }
    }
}

/// Grids of twice the spacing each, and the factors of the last.
pub struct Multigrid {
    levels: Vec<Hexahedra>,
    transfers: Vec<Transfer>,
    bottom: BandedCholesky,
    place: Vec<usize>,
    smoothing: Smoothing,
}

impl Multigrid {
    /// From the finest grid of elements and what cracks part on it.
    pub(super) fn new(finest: Hexahedra, mut links: Links, tensors: &[Stiffness], smoothing: Smoothing) -> Self {
        let mut levels = vec![finest];
        let mut transfers = Vec::new();
        while let Some((transfer, coarse)) = levels.last().and_then(|fine| coarser(fine, &mut links, tensors)) {
            transfers.push(transfer);
            levels.push(coarse);
        }
        let coarsest = &levels[levels.len() - 1];
        let (entries, place) = coarsest.entries();
        let bottom = BandedCholesky::new(3 * coarsest.len(), &entries, FREE_PIVOT);
        Multigrid { levels, transfers, bottom, place, smoothing }
    }

    /// x ≈ A⁻¹ b on the finest grid.
    pub fn solve(&self, b: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut x = self.cycle(0, b);
        for _ in 1..self.smoothing.cycles {
            let r = self.residual(0, b, &x);
            add(&mut x, &self.cycle(0, &r));
        }
        x
    }

    /// One V-cycle from a level downwards.
    fn cycle(&self, level: usize, b: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let Some(transfer) = self.transfers.get(level) else { return self.solve_bottom(b) };
        let Smoothing { degree, span, .. } = self.smoothing;
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

/// x += y.
fn add(x: &mut [[f64; 3]], y: &[[f64; 3]]) {
    for (x, y) in x.iter_mut().zip(y) {
        for a in 0..3 {
            x[a] += y[a];
        }
    }
}

/// The next grid, unless this one is small enough to be solved exactly or cannot be coarsened.
fn coarser(fine: &Hexahedra, links: &mut Links, tensors: &[Stiffness]) -> Option<(Transfer, Hexahedra)> {
    let mut sorted = fine.nodes;
    sorted.sort_unstable();
    let band = 3.0 * (sorted[0] * sorted[1]) as f64;
    if 3.0 * fine.len() as f64 * band * band <= BOTTOM_COST {
        return None;
    }
    let transfer = Transfer::new(fine.nodes, fine.wraps()).beside(links);
    if transfer.axes.iter().all(|a| a.factor == 1) {
        return None;
    }
    let elements: [usize; 3] = std::array::from_fn(|a| transfer.axes[a].elements);
    let mut parts = vec![Vec::new(); elements.iter().product()];
    let [e1, e2, _] = fine.elements;
    for (e, held) in fine.parts.iter().enumerate() {
        let at = [e % e1, e / e1 % e2, e / (e1 * e2)];
        let to: [usize; 3] = std::array::from_fn(|a| at[a] / transfer.axes[a].factor);
        let cells: f64 = (0..3).map(|a| transfer.axes[a].cells(to[a], fine.elements[a])).product();
        let target = &mut parts[to[0] + elements[0] * (to[1] + elements[1] * to[2])];
        for part in held {
            merge(target, Part { region: part.region, weight: part.weight / cells });
        }
    }
    let support = transfer.restrict(|n| fine.support[n]);
    let edges = std::array::from_fn(|a| fine.edges[a] * transfer.axes[a].factor as f64);
    *links = links.coarse(&transfer);
    let grid = Hexahedra::new(transfer.coarse(), elements, edges, parts, support, links, tensors);
    Some((transfer, grid))
}

/// Add a part to an element.
pub fn merge(parts: &mut Vec<Part>, part: Part) {
    match parts.iter_mut().find(|p| p.region == part.region) {
        Some(p) => p.weight += part.weight,
        None => parts.push(part),
    }
}
