//! The bound of [`super::bound`] from less: what D bends is bounded over the whole zone at once and what the nodal term does from
//! its differences along a box's edges. A box costs its corners only, which is what counts where many bonds reach far.
//!
//! A box of (t, s) is judged by its corners: a multilinear interpolation of D lies above it by no more than its second
//! derivatives allow, and D is a trigonometric polynomial.
//!
//! - Bonds, D_b = Σ w (2 − 2 cos φ) with w ⪰ 0 and φ = t o·s: ∂²D_b/∂t² ⪯ 2 Γ_b(s) with Γ_b(s) = Σ w (o·s)², and
//!   ∂²D_b/∂s_a² ⪯ 2 t² Σ w o_a². Between two points h from their middle, half of that times h² is lost. (Of w ⪯ 0, −w counts.)
//! - Nodal term, g·Z·g with g = Σ v sin φ: g is interpolated to ρ; and Σ λ_c g_c·Z·g_c − ḡ·Z·ḡ ⪯ ¼ δ·Z₊·δ for each axis, δ the
//!   difference of g along an edge, Z₊ the positive part of Z.
//! - Next to k = 0, D/t² ⪰ Γ(s) − t²/12 Σ w (o·s)⁴ and |g/t − s| ≤ t²/6 Σ |v| |o·s|³, with Christoffel's tensor Γ of the
//!   whole, a quadratic form in s.
//!
//! The smallest eigenvalue is concave, so nowhere in the box is it below that of the weakest corner less these. A box
//! that this leaves open is halved where most is lost. Everything is in units of the spacing.

use std::collections::VecDeque;
use std::f64::consts::PI;

use nalgebra::{Matrix6, Vector3};

use super::bond_sums::{BondSums, HalfPhases};
use super::bound::{
    Form, Found, LANES, ROUNDING, Range, Symmetric, add, at, axes, form_of, halved, is_positive, less, matrix, more,
    place, softest, times, weakest_of,
};
use super::upper;
use crate::tensor::PAIRS;

/// Parts of every edge of a pyramid's base, and of t from the first box outwards, to begin with.
const BASE_PARTS: usize = 2;
const RADIAL_PARTS: usize = 4;

/// What the bound is of: the energy of bonds and of a nodal term. Half the bonds; w and Z in Pa, v without unit.
pub struct FarEnergy<'a> {
    bonds: BondSums,
    spacing: f64,
    nodal: Nodal<'a>,
    /// Γ of the whole, Γ_b with |w|, and Γ with w⁺ (Σ|o_a|)², an upper bound of Σ w (o·s)⁴ on the cube.
    long_waves: Form,
    curvature: Form,
    quartic: Form,
    norm: f64,
}

struct Nodal<'a> {
    gradients: &'a [Vector3<f64>],
    /// Γ of Z and of its positive part.
    whole: Form,
    positive: Form,
    /// ‖Z‖, the largest eigenvalue by size.
    norm: f64,
    /// Σ |v| |o|² and Σ |v| |o|³, and with o_a² for |o|².
    second: f64,
    third: f64,
    second_along: [f64; 3],
    third_along: [f64; 3],
}

/// D, g and κ²Δ² at phases θ.
#[derive(Clone, Copy)]
struct Corner {
    theta: Vector3<f64>,
    d: Symmetric,
    g: Vector3<f64>,
    laplacian: f64,
}

/// A box and its corners.
#[derive(Clone)]
struct Piece {
    range: Range,
    corners: [Corner; 8],
}

/// What an axis of the box takes from each corner.
type Losses = [Symmetric; 3];

/// What is lost by axis in the direction of the weakest corner, of a box that is not decided.
type Open = [f64; 3];

impl<'a> FarEnergy<'a> {
    /// Of bonds, their weights in Pa/m², and a nodal term: Z (Pa) and the v of every bond (1/m).
    pub fn new(bonds: BondSums, spacing: f64, term: &Matrix6<f64>, gradients: &'a [Vector3<f64>]) -> Self {
        let (mut long_waves, mut curvature, mut quartic) = (Form::default(), Form::default(), Form::default());
        for (w, o) in bonds.weights().iter().zip(bonds.offsets()) {
            let o = o.map(f64::from);
            let sign = if w[0] + w[1] + w[2] < 0.0 { -1.0 } else { 1.0 };
            let fourth = o.iter().map(|x| x.abs()).sum::<f64>().powi(2) * f64::max(sign, 0.0);
            for (p, (i, j)) in PAIRS.into_iter().enumerate() {
                let moment = spacing * spacing * o[i] * o[j] * if i == j { 1.0 } else { 2.0 };
                for (q, w) in w.iter().enumerate() {
                    long_waves[p][q] += moment * w;
                    curvature[p][q] += sign * moment * w;
                    quartic[p][q] += fourth * moment * w;
                }
            }
        }
        let norm: f64 = curvature[..3].iter().map(|m| m[0] + m[1] + m[2]).sum();
        let eigen = term.symmetric_eigen();
        let positive = eigen.eigenvectors
            * Matrix6::from_diagonal(&eigen.eigenvalues.map(|z| z.max(0.0)))
            * eigen.eigenvectors.transpose();
        let mut nodal = Nodal {
            gradients,
            whole: form_of(term),
            positive: form_of(&positive),
            norm: eigen.eigenvalues.amax(),
            second: 0.0,
            third: 0.0,
            second_along: [0.0; 3],
            third_along: [0.0; 3],
        };
        for (v, o) in gradients.iter().zip(bonds.offsets()) {
            let (v, o) = (spacing * v.norm(), Vector3::from(o.map(f64::from)));
            nodal.second += v * o.norm_squared();
            nodal.third += v * o.norm().powi(3);
            for a in 0..3 {
                nodal.second_along[a] += v * o[a] * o[a];
                nodal.third_along[a] += v * o[a] * o[a] * o.norm();
            }
        }
        for (sum, row) in long_waves.iter_mut().zip(&nodal.whole) {
            add(sum, 1.0, row);
        }
        let norm = norm + nodal.norm;
        FarEnergy { bonds, spacing, nodal, long_waves, curvature, quartic, norm }
    }

    /// Whether D(k) ⪰ m κ²(k) in the whole zone (m in Pa), by about so many evaluations of D at most; how many were used.
    pub fn is_above(&self, m: f64, most: usize) -> (Found, usize) {
        let mut search = Search { energy: self, m, evaluations: 0 };
        let found = search.run(most);
        (found, search.evaluations)
    }

    fn corners(&self, thetas: [Vector3<f64>; LANES]) -> [Corner; LANES] {
        let powers = HalfPhases::new(&thetas, self.bonds.reach());
        let bonds = self.bonds.even(&powers, self.bonds.weights(), |sin, _| 4.0 * sin * sin);
        let g = self.bonds.odd(&powers, self.nodal.gradients).map(|g| self.spacing * g);
        std::array::from_fn(|l| {
            let mut d = upper(&bonds[l]).map(|x| self.spacing * self.spacing * x);
            add(&mut d, 1.0, &at(&self.nodal.whole, &g[l]));
            let laplacian = thetas[l].map(|p| 4.0 * (0.5 * p).sin().powi(2)).sum();
            Corner { theta: thetas[l], d, g: g[l], laplacian }
        })
    }
}

struct Search<'a> {
    energy: &'a FarEnergy<'a>,
    m: f64,
    evaluations: usize,
}

impl Search<'_> {
    fn run(&mut self, most: usize) -> Found {
        let mut waiting = self.pieces();
        while let Some(piece) = waiting.pop_front() {
            let open = if piece.range.low[0] == 0.0 { self.at_apex(&piece) } else { self.away(&piece) };
            let Some(losses) = open else { continue };
            if let Some(theta) = self.below(&piece) {
                return Found::Below(theta);
            }
            if self.evaluations >= most {
                waiting.push_front(piece);
                return Found::Undecided(weakest_of(
                    waiting.iter().flat_map(|piece| &piece.corners).map(|c| (c.d, c.laplacian, c.theta)),
                ));
            }
            waiting.extend(self.halves(piece, &losses));
        }
        Found::Above
    }

    fn evaluate(&mut self, thetas: [Vector3<f64>; LANES]) -> [Corner; LANES] {
        self.evaluations += LANES;
        self.energy.corners(thetas)
    }

    /// The half zone in pieces to begin with.
    fn pieces(&mut self) -> VecDeque<Piece> {
        let first = 1.0 / self.energy.bonds.reach().max(1) as f64;
        let outwards = (0..=RADIAL_PARTS).map(|j| first * (PI / first).powf(j as f64 / RADIAL_PARTS as f64));
        let radii: Vec<f64> = std::iter::once(0.0).chain(outwards).collect();
        let base = |j: usize| 2.0 * j as f64 / BASE_PARTS as f64 - 1.0;
        let mut out = VecDeque::new();
        for n in 0..3 * BASE_PARTS * BASE_PARTS {
            let (face, i, j) = (n % 3, n / 3 % BASE_PARTS, n / 3 / BASE_PARTS);
            let (low, high) = ([base(i), base(j)], [base(i + 1), base(j + 1)]);
            let mut inner = None;
            for r in radii.windows(2) {
                let outer = self.evaluate(std::array::from_fn(|c| r[1] * place(face, &low, &high, c)));
                // D itself is not looked at where t = 0.
                let within = inner.unwrap_or(outer);
                let corners = std::array::from_fn(|c| if c & 1 == 0 { within[c >> 1] } else { outer[c >> 1] });
                let (low, high) = ([r[0], low[0], low[1]], [r[1], high[0], high[1]]);
                out.push_back(Piece { range: Range { face, low, high }, corners });
                inner = Some(outer);
            }
        }
        out
    }

    /// A corner below m κ², if there is one.
    fn below(&self, piece: &Piece) -> Option<Vector3<f64>> {
        let mut corners = piece.corners.iter().filter(|c| c.laplacian > 0.0);
        corners.find(|c| !is_positive(&less(&c.d, self.m * c.laplacian))).map(|c| c.theta)
    }

    /// The two halves of a piece, along the axis with the largest loss.
    fn halves(&mut self, piece: Piece, losses: &Open) -> [Piece; 2] {
        let axis = (0..3).max_by(|&a, &b| losses[a].total_cmp(&losses[b])).unwrap_or(0);
        halved(&piece.range, &piece.corners, axis, |places| self.evaluate(places.map(|(t, s)| t * s)))
            .map(|(range, corners)| Piece { range, corners })
    }

    /// A box away from k = 0; `None` where it is decided.
    fn away(&self, piece: &Piece) -> Option<Open> {
        let (energy, m) = (self.energy, self.m);
        let [h, ha, hb] = piece.range.half_widths().map(|h| h * h);
        let [a, b] = axes(piece.range.face);
        let [along_a, along_b] = [a, b].map(|axis| more(&energy.curvature[axis], m));
        let places: [Vector3<f64>; 4] = std::array::from_fn(|c| piece.range.place(2 * c));
        let along_t = places.map(|s| more(&at(&energy.curvature, &s), m * s.norm_squared()));
        let z = &energy.nodal;
        let square = places.iter().map(Vector3::norm_squared).fold(0.0, f64::max);
        let t = piece.range.high[0];
        let phase = t * square.sqrt();
        // Half of the second derivative of g, times the squares of half the edges.
        let rho = [
            0.5 * h * square * z.second.min(phase * z.third),
            0.5 * ha * t * t * z.second_along[a].min(phase * z.third_along[a]),
            0.5 * hb * t * t * z.second_along[b].min(phase * z.third_along[b]),
        ];
        let all: f64 = rho.iter().sum();
        let largest = piece.corners.iter().map(|c| c.g.norm_squared()).fold(0.0, f64::max).sqrt();
        let rounded = z.norm * all * (2.0 * largest + all);
        let rounded_by_axis = rho.map(|rho| z.norm * rho * (2.0 * largest + all));
        let edges = piece.edges(&z.positive);
        self.open(rounded_by_axis, |c| {
            let corner = &piece.corners[c];
            let t = if c & 1 == 0 { piece.range.low[0] } else { piece.range.high[0] };
            let mut losses = [times(h, &along_t[c >> 1]), times(ha * t * t, &along_a), times(hb * t * t, &along_b)];
            losses.iter_mut().zip(&edges).for_each(|(loss, edge)| add(loss, 0.25, &edge[c]));
            let value = less(&corner.d, m * corner.laplacian + rounded + ROUNDING * energy.norm * t * t);
            (value, losses)
        })
    }

    /// A box at k = 0, of D/t²; `None` where it is decided.
    fn at_apex(&self, piece: &Piece) -> Option<Open> {
        let energy = self.energy;
        let [_, ha, hb] = piece.range.half_widths().map(|h| h * h);
        let [a, b] = axes(piece.range.face);
        let t2 = piece.range.high[0].powi(2);
        let places: [Vector3<f64>; 4] = std::array::from_fn(|c| piece.range.place(2 * c));
        let size = places.iter().map(Vector3::norm).fold(0.0, f64::max);
        let off = t2 / 6.0 * energy.nodal.third * size.powi(3);
        let rounded = energy.nodal.norm * off * (2.0 * size + off);
        self.open([rounded, 0.0, 0.0], |c| {
            let s = &places[c >> 1];
            let losses = [
                times(t2 / 12.0, &at(&energy.quartic, s)),
                times(ha, &energy.long_waves[a]),
                times(hb, &energy.long_waves[b]),
            ];
            let off = self.m * s.norm_squared() + rounded + ROUNDING * energy.norm;
            (less(&at(&energy.long_waves, s), off), losses)
        })
    }

    /// `None` if every corner stays positive; else what each axis takes from the weakest one.
    fn open(&self, besides: Open, corner: impl Fn(usize) -> (Symmetric, Losses)) -> Option<Open> {
        let mut weakest: Option<(f64, Open)> = None;
        for c in 0..8 {
            let (mut value, losses) = corner(c);
            losses.iter().for_each(|loss| add(&mut value, -1.0, loss));
            if is_positive(&value) {
                continue;
            }
            let (smallest, u) = softest(&value);
            if weakest.is_none_or(|(before, _)| smallest < before) {
                let lost = |axis: usize| besides[axis] + u.dot(&(matrix(&losses[axis]) * u));
                weakest = Some((smallest, std::array::from_fn(lost)));
            }
        }
        weakest.map(|(_, lost)| lost)
    }
}

impl Piece {
    /// The form of the difference of g along the edges of every corner, by axis.
    fn edges(&self, form: &Form) -> [[Symmetric; 8]; 3] {
        let mut out = [[Symmetric::default(); 8]; 3];
        for (axis, edges) in out.iter_mut().enumerate() {
            for c in (0..8).filter(|c| c >> axis & 1 == 0) {
                let other = c | 1 << axis;
                edges[c] = at(form, &(self.corners[other].g - self.corners[c].g));
                edges[other] = edges[c];
            }
        }
        out
    }
}
