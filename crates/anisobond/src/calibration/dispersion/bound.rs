//! A bound of D(k)/κ²(k) from below over the whole Brillouin zone, by branch and bound.
//!
//! The half of the zone that D(−k) = D(k) leaves is three pyramids θ = t s with their apex at k = 0: t ∈ \[0, π\], and s on
//! a face of the cube |s|_∞ = 1. There f(t, s) = (D − m κ²)/t² is smooth, at t = 0 too, where D/t² is Christoffel's tensor of s.
//! A box of (t, s) is judged by its corners: f lies nowhere below its multilinear interpolation by more than Σ ½ h² L, over
//! the axes with half widths h, where L ⪰ 0 is above ∂²f along that axis everywhere in the box. The smallest eigenvalue is
//! concave, so nowhere in the box is it below that of the weakest corner less this sum. With φ = t σ, σ = o·s, L is:
//!
//! - Bonds, Σ w (2 − 2 cos φ)/t², w ⪰ 0: ∂²/∂t² has w σ⁴ q(φ), q the second derivative of (2 − 2 cos φ)/φ², |q'| ≤ 1/10; ∂²/∂s_a² has
//!   w 2 o_a² cos φ. Each bond's greatest value in the box counts. (Of w ⪯ 0 the least.)
//! - Nodal term, γ·Z·γ with γ = Σ v sin φ/t: ∂² is 2 γ'·Z·γ' + γ·Z·γ'' + γ''·Z·γ in the middle, and ‖Z‖ times how far from
//!   their middles γ, γ' and γ'' may be, by the changes of φ and σ of every bond. (|d/dφ|ⁿ of sin φ/φ = ∫₀¹ cos φx dx is ≤ 1/(n + 1).)
//!
//! A box that this leaves open is halved where most is lost. Everything is in units of the spacing.

use std::collections::VecDeque;
use std::f64::consts::PI;

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::bond_sums::{BondSums, HalfPhases};
use super::{christoffel, eigenvalue, upper};
use crate::tensor::PAIRS;

/// Corners that are summed side by side: the new ones of a halved box.
pub(super) const LANES: usize = 4;

/// Parts of every edge of a pyramid's base, and of t from the first box outwards, to begin with.
const BASE_PARTS: usize = 2;
const RADIAL_PARTS: usize = 4;

/// Waves of what is open that are handed back, and how far they are apart (rad).
const STARTS: usize = 8;
const APART: f64 = 0.2;

/// Rounding of a corner's matrix, relative to the norms of what was summed.
pub(super) const ROUNDING: f64 = 1e-14;

/// A symmetric matrix: 11 22 33 23 13 12.
pub(super) type Symmetric = [f64; 6];

/// A quadratic form in a vector whose values are symmetric matrices; rows in the same order, off-diagonal ones doubled.
pub(super) type Form = [Symmetric; 6];

/// What the bound is of: the energy of bonds and of a nodal term. Half the bonds; w and Z in Pa, v without unit.
pub struct Energy<'a> {
    bonds: BondSums,
    spacing: f64,
    nodal: Option<Nodal<'a>>,
    /// Γ of the whole, Christoffel's tensor.
    long_waves: Form,
    /// Sum of the sizes of what D/t² is made of.
    norm: f64,
}

struct Nodal<'a> {
    gradients: &'a [Vector3<f64>],
    /// |v| of every bond, in 1/spacing.
    sizes: Vec<f64>,
    /// Γ of Z.
    whole: Form,
    /// ‖Z‖, the largest eigenvalue by size.
    norm: f64,
}

/// How a search for a bound ended.
pub enum Found {
    /// No wave is below what was asked for.
    Above,
    /// This wave (phases) is.
    Below(Vector3<f64>),
    /// The evaluations granted did not decide; the weakest waves met in what is open.
    Undecided(Vec<Vector3<f64>>),
}

/// D, g and κ²Δ² at phases θ.
#[derive(Clone, Copy)]
struct Corner {
    theta: Vector3<f64>,
    d: Symmetric,
    laplacian: f64,
}

/// Where a box is: a face, and the ranges of t and of the two coordinates on the face; bits of a corner's number say which end.
#[derive(Clone, Copy)]
pub(super) struct Range {
    pub face: usize,
    pub low: [f64; 3],
    pub high: [f64; 3],
}

/// A box and its corners.
#[derive(Clone)]
struct Piece {
    range: Range,
    corners: [Corner; 8],
    /// What is expected of it where it is too large to be decided, and not looked at.
    expected: Option<Open>,
}

/// What an axis of the box takes from each corner.
type Losses = [Symmetric; 3];

/// Of a box that is not decided.
#[derive(Clone, Copy)]
struct Open {
    /// What is lost by axis in the direction of the weakest corner.
    losses: [f64; 3],
    /// How far below zero that corner then is.
    short: f64,
}

impl Open {
    /// The axis with the largest loss.
    fn axis(&self) -> usize {
        (0..3).max_by(|&a, &b| self.losses[a].total_cmp(&self.losses[b])).unwrap_or(0)
    }

    /// What halving an axis leaves at best: an eighth of its loss. `None` if that may decide.
    fn halved(&self, axis: usize) -> Option<Open> {
        let mut out = *self;
        out.losses[axis] /= 8.0;
        out.short -= self.losses[axis] - out.losses[axis];
        (out.short > 0.0).then_some(out)
    }
}

impl<'a> Energy<'a> {
    /// Of bonds alone, their weights in Pa/m².
    pub fn new(bonds: BondSums, spacing: f64) -> Self {
        let (mut long_waves, mut norm) = (Form::default(), 0.0);
        for (w, o) in bonds.weights().iter().zip(bonds.offsets()) {
            let o = o.map(|x| spacing * f64::from(x));
            norm += (w[0] + w[1] + w[2]).abs() * (o[0] * o[0] + o[1] * o[1] + o[2] * o[2]);
            for (p, (i, j)) in PAIRS.into_iter().enumerate() {
                add(&mut long_waves[p], o[i] * o[j] * if i == j { 1.0 } else { 2.0 }, w);
            }
        }
        Energy { bonds, spacing, nodal: None, long_waves, norm }
    }

    /// With a nodal term: Z (Pa) and the v of every bond (1/m).
    pub fn with_nodal(mut self, term: &Matrix6<f64>, gradients: &'a [Vector3<f64>]) -> Self {
        let nodal = Nodal {
            gradients,
            sizes: gradients.iter().map(|v| self.spacing * v.norm()).collect(),
            whole: form_of(term),
            norm: term.symmetric_eigenvalues().amax(),
        };
        for (sum, row) in self.long_waves.iter_mut().zip(&nodal.whole) {
            add(sum, 1.0, row);
        }
        self.norm += nodal.norm;
        self.nodal = Some(nodal);
        self
    }

    /// Whether D(k) ⪰ m κ²(k) in the whole zone (m in Pa), by about so many evaluations of D at most; how many were used.
    pub fn is_above(&self, m: f64, most: usize) -> (Found, usize) {
        let mut search = Search { energy: self, m, evaluations: 0 };
        let found = search.run(most);
        (found, search.evaluations)
    }

    /// What the bends of (D − m κ²)/t² within a box take from its corners at most, by axis: ½ h² L, L ⪰ 0 the positive part
    /// of a matrix that is above the second derivative everywhere in the box.
    fn bends(&self, piece: &Piece, m: f64) -> Losses {
        let [h, ha, hb] = piece.range.half_widths();
        let [a, b] = axes(piece.range.face);
        let (t, s) = (0.5 * (piece.range.low[0] + piece.range.high[0]), piece.range.middle());
        let powers = HalfPhases::new(&[t * s], self.bonds.reach());
        let mut bent = [Symmetric::default(); 3];
        let mut averages = Averages::default();
        self.bonds.each(&powers, |bond, (cos_row, sin_row), (cos_first, sin_first)| {
            let half_sin = sin_row[0] * cos_first[0] + cos_row[0] * sin_first[0];
            let half_cos = cos_row[0] * cos_first[0] - sin_row[0] * sin_first[0];
            let (sin, cos) = (2.0 * half_sin * half_cos, 1.0 - 2.0 * half_sin * half_sin);
            let o = self.bonds.offsets()[bond].map(f64::from);
            // o·s and φ, and how far from those of the middle they may be.
            let os = o[0] * s[0] + o[1] * s[1] + o[2] * s[2];
            let size_os = os.abs();
            let off_os = ha * o[a].abs() + hb * o[b].abs();
            let (most_os, least_os) = (size_os + off_os, (size_os - off_os).max(0.0));
            let turn = t * off_os + h * most_os;
            let off_cos = (sin.abs() * turn + 0.5 * turn * turn).min(2.0);
            let (even, odd, odd2) = quotients(t * os, sin, cos);
            let w = &self.bonds.weights()[bond];
            // Above the second derivatives of w ⪰ 0, below those of w ⪯ 0.
            let sign = if w[0] + w[1] + w[2] < 0.0 { -1.0 } else { 1.0 };
            let even = even + sign * 0.1 * turn;
            let along = even * if sign * even > 0.0 { most_os.powi(4) } else { least_os.powi(4) };
            let across = 2.0 * (cos + sign * off_cos).clamp(-1.0, 1.0);
            for (bent, factor) in bent.iter_mut().zip([along, across * o[a] * o[a], across * o[b] * o[b]]) {
                add(bent, factor, w);
            }
            if let Some(nodal) = &self.nodal {
                let v = self.spacing * nodal.gradients[bond];
                let size = nodal.sizes[bond];
                let off_sin = (cos.abs() * turn + 0.5 * turn * turn).min(2.0);
                let off =
                    (cos.abs() + off_cos).min(1.0) * off_os + h * most_os.powi(2) * (odd.abs() + turn / 3.0).min(0.5);
                averages.value.add(&v, sin / t, size * off);
                let off = odd.abs() * (most_os.powi(2) - os * os) + most_os.powi(2) * turn / 3.0;
                averages.slopes[0].add(&v, odd * os * os, size * off);
                averages.slopes[1].add(&v, cos * o[a], size * o[a].abs() * off_cos);
                averages.slopes[2].add(&v, cos * o[b], size * o[b].abs() * off_cos);
                let off = odd2.abs() * (most_os.powi(3) - size_os.powi(3)) + most_os.powi(3) * turn / 4.0;
                averages.bends[0].add(&v, odd2 * os.powi(3), size * off);
                let off = off_sin * piece.range.high[0] + sin.abs() * h;
                averages.bends[1].add(&v, -sin * t * o[a] * o[a], size * o[a] * o[a] * off);
                averages.bends[2].add(&v, -sin * t * o[b] * o[b], size * o[b] * o[b] * off);
            }
        });
        let square = self.spacing * self.spacing;
        let of_laplacian = [0.5 * m, 2.0 * m, 2.0 * m];
        std::array::from_fn(|axis| {
            let mut bend = times(square, &bent[axis]);
            let mut off = of_laplacian[axis];
            if let Some(nodal) = &self.nodal {
                let (value, slope, second) = (&averages.value, &averages.slopes[axis], &averages.bends[axis]);
                add(&mut bend, 2.0, &at(&nodal.whole, &slope.middle));
                add(&mut bend, 1.0, &between(&nodal.whole, &value.middle, &second.middle));
                off += 2.0 * nodal.norm * (slope.off_product(slope) + value.off_product(second));
            }
            let width = [h, ha, hb][axis];
            times(0.5 * width * width, &positive_part(&more(&bend, off)))
        })
    }

    fn corners(&self, places: [(f64, Vector3<f64>); LANES]) -> [Corner; LANES] {
        let thetas = places.map(|(t, s)| t * s);
        let powers = HalfPhases::new(&thetas, self.bonds.reach());
        let bonds = self.bonds.even(&powers, self.bonds.weights(), |sin, _| 4.0 * sin * sin);
        let g = match &self.nodal {
            None => [Vector3::zeros(); LANES],
            Some(nodal) => self.bonds.odd(&powers, nodal.gradients).map(|g| self.spacing * g),
        };
        std::array::from_fn(|l| {
            let (t, s) = places[l];
            if t == 0.0 {
                return Corner { theta: thetas[l], d: at(&self.long_waves, &s), laplacian: s.norm_squared() };
            }
            let mut d = upper(&bonds[l]).map(|x| self.spacing * self.spacing * x / (t * t));
            if let Some(nodal) = &self.nodal {
                add(&mut d, 1.0, &at(&nodal.whole, &(g[l] / t)));
            }
            let laplacian = thetas[l].map(|p| 4.0 * (0.5 * p).sin().powi(2)).sum() / (t * t);
            Corner { theta: thetas[l], d, laplacian }
        })
    }
}

/// Phase up to which the quotients are summed as series.
const SERIES: f64 = 0.5;

/// Of (2 − 2 cos φ)/φ² the second derivative, of sin φ/φ the first and the second; to rounding.
#[inline]
fn quotients(phase: f64, sin: f64, cos: f64) -> (f64, f64, f64) {
    let x = phase * phase;
    if phase.abs() < SERIES {
        let even = [-1.0 / 6.0, 1.0 / 30.0, -1.0 / 672.0, 1.0 / 32400.0, -1.0 / 2661120.0, 1.0 / 330220800.0];
        let odd = [-1.0 / 3.0, 1.0 / 30.0, -1.0 / 840.0, 1.0 / 45360.0, -1.0 / 3991680.0, 1.0 / 518918400.0];
        let odd2 = [-1.0 / 3.0, 1.0 / 10.0, -1.0 / 168.0, 1.0 / 6480.0, -1.0 / 443520.0, 1.0 / 47174400.0];
        return (power_series(x, &even), phase * power_series(x, &odd), power_series(x, &odd2));
    }
    let even = (2.0 * cos - 8.0 * sin / phase + 12.0 * (1.0 - cos) / x) / x;
    let odd = (cos - sin / phase) / phase;
    (even, odd, -(sin + 2.0 * odd) / phase)
}

fn power_series(x: f64, terms: &[f64]) -> f64 {
    terms.iter().rev().fold(0.0, |sum, term| sum * x + term)
}

struct Search<'a> {
    energy: &'a Energy<'a>,
    m: f64,
    evaluations: usize,
}

impl Search<'_> {
    fn run(&mut self, most: usize) -> Found {
        let mut waiting = self.pieces();
        while let Some(piece) = waiting.pop_front() {
            let Some(open) = piece.expected.or_else(|| self.open(&piece)) else { continue };
            if let Some(theta) = self.below(&piece) {
                return Found::Below(theta);
            }
            if self.evaluations >= most {
                waiting.push_front(piece);
                return Found::Undecided(weakest_of(
                    waiting.iter().flat_map(|piece| &piece.corners).map(|c| (c.d, c.laplacian, c.theta)),
                ));
            }
            waiting.extend(self.halves(piece, &open));
        }
        Found::Above
    }

    fn evaluate(&mut self, places: [(f64, Vector3<f64>); LANES]) -> [Corner; LANES] {
        self.evaluations += LANES;
        self.energy.corners(places)
    }

    /// The half zone in pieces to begin with.
    fn pieces(&mut self) -> VecDeque<Piece> {
        let base = |j: usize| 2.0 * j as f64 / BASE_PARTS as f64 - 1.0;
        let radius = |j: usize| PI * j as f64 / RADIAL_PARTS as f64;
        let mut out = VecDeque::new();
        for n in 0..3 * BASE_PARTS * BASE_PARTS {
            let (face, i, j) = (n % 3, n / 3 % BASE_PARTS, n / 3 / BASE_PARTS);
            let (low, high) = ([base(i), base(j)], [base(i + 1), base(j + 1)]);
            let layers: Vec<[Corner; LANES]> = (0..=RADIAL_PARTS)
                .map(|r| self.evaluate(std::array::from_fn(|c| (radius(r), place(face, &low, &high, c)))))
                .collect();
            for r in 0..RADIAL_PARTS {
                let corners = std::array::from_fn(|c| layers[r + (c & 1)][c >> 1]);
                let (low, high) = ([radius(r), low[0], low[1]], [radius(r + 1), high[0], high[1]]);
                out.push_back(Piece { range: Range { face, low, high }, corners, expected: None });
            }
        }
        out
    }

    /// A corner below m κ², if there is one.
    fn below(&self, piece: &Piece) -> Option<Vector3<f64>> {
        let mut corners = piece.corners.iter().filter(|c| c.theta.norm_squared() > 0.0);
        corners.find(|c| !is_positive(&less(&c.d, self.m * c.laplacian))).map(|c| c.theta)
    }

    /// The two halves of a piece, along the axis with the largest loss.
    fn halves(&mut self, piece: Piece, open: &Open) -> [Piece; 2] {
        let axis = open.axis();
        let expected = if piece.expected.is_some() { None } else { open.halved(axis) };
        halved(&piece.range, &piece.corners, axis, |places| self.evaluate(places)).map(|(range, corners)| Piece {
            range,
            corners,
            expected,
        })
    }

    /// `None` if every corner stays positive; else what each axis takes from the weakest one.
    fn open(&self, piece: &Piece) -> Option<Open> {
        let losses = self.energy.bends(piece, self.m);
        let lost = losses.iter().fold(Symmetric::default(), |mut sum, loss| {
            add(&mut sum, 1.0, loss);
            sum
        });
        let mut weakest: Option<(f64, Vector3<f64>)> = None;
        for corner in &piece.corners {
            let mut value = less(&corner.d, self.m * corner.laplacian + ROUNDING * self.energy.norm);
            add(&mut value, -1.0, &lost);
            if is_positive(&value) {
                continue;
            }
            let here = softest(&value);
            if weakest.is_none_or(|before| here.0 < before.0) {
                weakest = Some(here);
            }
        }
        weakest.map(|(value, u)| Open { losses: losses.map(|loss| u.dot(&(matrix(&loss) * u))), short: -value })
    }
}

/// The weakest of the corners of what is open, apart from each other: D, the Laplacian and θ of each.
pub(super) fn weakest_of(open: impl Iterator<Item = (Symmetric, f64, Vector3<f64>)>) -> Vec<Vector3<f64>> {
    let away = open.filter(|(_, _, theta)| theta.norm_squared() > 0.0);
    let mut values: Vec<(f64, Vector3<f64>)> =
        away.map(|(d, laplacian, theta)| (eigenvalue(&matrix(&d)) / laplacian, theta)).collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut out: Vec<Vector3<f64>> = Vec::new();
    for (_, theta) in values {
        if out.len() == STARTS {
            break;
        }
        if out.iter().all(|other| (other - theta).norm() > APART) {
            out.push(theta);
        }
    }
    out
}

/// A vector and how far from it the vectors of a box may be.
#[derive(Default)]
struct Ball {
    middle: Vector3<f64>,
    off: f64,
}

impl Ball {
    fn add(&mut self, v: &Vector3<f64>, factor: f64, off: f64) {
        self.middle += factor * v;
        self.off += off;
    }

    /// How far the product of two lengths may be from that of the middles.
    fn off_product(&self, other: &Ball) -> f64 {
        self.middle.norm() * other.off + other.middle.norm() * self.off + self.off * other.off
    }
}

/// g of a box, and its first and second derivatives along each axis.
#[derive(Default)]
struct Averages {
    value: Ball,
    slopes: [Ball; 3],
    bends: [Ball; 3],
}

impl Range {
    /// s of the middle.
    fn middle(&self) -> Vector3<f64> {
        let middle = |axis: usize| 0.5 * (self.low[axis] + self.high[axis]);
        let s = [middle(1), middle(2)];
        place(self.face, &s, &s, 0)
    }

    pub fn half_widths(&self) -> [f64; 3] {
        std::array::from_fn(|a| 0.5 * (self.high[a] - self.low[a]))
    }

    /// s of a corner.
    pub fn place(&self, c: usize) -> Vector3<f64> {
        place(self.face, &[self.low[1], self.low[2]], &[self.high[1], self.high[2]], c >> 1)
    }

    /// t and s of a corner.
    pub fn at(&self, c: usize) -> (f64, Vector3<f64>) {
        (if c & 1 == 0 { self.low[0] } else { self.high[0] }, self.place(c))
    }

    /// The two halves along an axis.
    fn halves(&self, axis: usize) -> [Range; 2] {
        let middle = 0.5 * (self.low[axis] + self.high[axis]);
        let (mut lower, mut upper) = (*self, *self);
        (lower.high[axis], upper.low[axis]) = (middle, middle);
        [lower, upper]
    }
}

/// The halves of a box along an axis with their corners: `evaluate` is given the places t, s of those that are new.
pub(super) fn halved<C: Copy>(
    range: &Range,
    corners: &[C; 8],
    axis: usize,
    evaluate: impl FnOnce([(f64, Vector3<f64>); LANES]) -> [C; LANES],
) -> [(Range, [C; 8]); 2] {
    let [low, high] = range.halves(axis);
    let (mut lower, mut upper) = (*corners, *corners);
    // The corners of the lower half that lie in the plane between.
    let between = [[1, 3, 5, 7], [2, 3, 6, 7], [4, 5, 6, 7]][axis];
    let new = evaluate(between.map(|c: usize| low.at(c)));
    for (c, corner) in between.into_iter().zip(new) {
        lower[c] = corner;
        upper[c & !(1 << axis)] = corner;
    }
    [(low, lower), (high, upper)]
}

/// The axes of a face.
pub(super) fn axes(face: usize) -> [usize; 2] {
    [(face + 1) % 3, (face + 2) % 3]
}

/// s of a corner of a part of a face.
pub(super) fn place(face: usize, low: &[f64; 2], high: &[f64; 2], c: usize) -> Vector3<f64> {
    let mut s = Vector3::ith(face, 1.0);
    for (k, axis) in axes(face).into_iter().enumerate() {
        s[axis] = if c >> k & 1 == 0 { low[k] } else { high[k] };
    }
    s
}

/// Christoffel's tensor of Z as a form: its values at unit vectors, and what pairs of them add.
pub(super) fn form_of(z: &Matrix6<f64>) -> Form {
    let unit = |a: usize| christoffel(z, &Vector3::ith(a, 1.0));
    PAIRS.map(|(i, j)| match i == j {
        true => upper(&unit(i)),
        false => upper(&(christoffel(z, &(Vector3::ith(i, 1.0) + Vector3::ith(j, 1.0))) - unit(i) - unit(j))),
    })
}

#[inline]
pub(super) fn at(form: &Form, s: &Vector3<f64>) -> Symmetric {
    let mut sum = Symmetric::default();
    for (row, (i, j)) in form.iter().zip(PAIRS) {
        add(&mut sum, s[i] * s[j], row);
    }
    sum
}

/// What p and q add together: the form at p + q less that at p and at q.
#[inline]
fn between(form: &Form, p: &Vector3<f64>, q: &Vector3<f64>) -> Symmetric {
    let mut sum = Symmetric::default();
    for (row, (i, j)) in form.iter().zip(PAIRS) {
        add(&mut sum, p[i] * q[j] + p[j] * q[i], row);
    }
    sum
}

/// The symmetric matrix without its negative eigenvalues.
fn positive_part(m: &Symmetric) -> Symmetric {
    if is_positive(m) {
        return *m;
    }
    let eigen = matrix(m).symmetric_eigen();
    let mut out = *m;
    for (value, u) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value < 0.0 {
            add(&mut out, -value, &upper(&(u * u.transpose())));
        }
    }
    out
}

#[inline]
pub(super) fn add(sum: &mut Symmetric, factor: f64, m: &Symmetric) {
    for (sum, x) in sum.iter_mut().zip(m) {
        *sum += factor * x;
    }
}

#[inline]
pub(super) fn times(factor: f64, m: &Symmetric) -> Symmetric {
    let mut out = Symmetric::default();
    add(&mut out, factor, m);
    out
}

/// m + x 1.
#[inline]
pub(super) fn more(m: &Symmetric, x: f64) -> Symmetric {
    let [xx, yy, zz, yz, xz, xy] = *m;
    [xx + x, yy + x, zz + x, yz, xz, xy]
}

/// m − x 1.
#[inline]
pub(super) fn less(m: &Symmetric, x: f64) -> Symmetric {
    more(m, -x)
}

#[inline]
pub(super) fn matrix(m: &Symmetric) -> Matrix3<f64> {
    let [xx, yy, zz, yz, xz, xy] = *m;
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// Whether Gauss's elimination meets positive pivots only.
#[inline]
pub(super) fn is_positive(m: &Symmetric) -> bool {
    let [xx, yy, zz, yz, xz, xy] = *m;
    if xx.is_nan() || xx <= 0.0 {
        return false;
    }
    let second = yy - xy * xy / xx;
    let beside = yz - xy * xz / xx;
    second > 0.0 && zz - xz * xz / xx - beside * beside / second > 0.0
}

/// Smallest eigenvalue and its direction, to half the digits.
pub(super) fn softest(m: &Symmetric) -> (f64, Vector3<f64>) {
    let a = matrix(m);
    let value = eigenvalue(&a);
    let b = a - Matrix3::from_diagonal_element(value);
    let rows = [0, 1, 2].map(|i| b.row(i).transpose());
    let normals = [rows[0].cross(&rows[1]), rows[1].cross(&rows[2]), rows[2].cross(&rows[0])];
    let longest = normals.into_iter().max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    let direction = longest.and_then(|n| n.try_normalize(f64::MIN_POSITIVE)).unwrap_or_else(Vector3::x);
    (value, direction)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quotients against differences of their integrals, on both sides of where series end.
    #[test]
    fn quotients_are_the_derivatives() {
        // ∫₀¹ f(x) dx by Simpson's rule.
        let integral = |f: &dyn Fn(f64) -> f64| {
            let n = 2000;
            let weight = |j: usize| if j == 0 || j == n { 1.0 } else { [2.0, 4.0][j % 2] };
            (0..=n).map(|j| weight(j) * f(j as f64 / n as f64)).sum::<f64>() / (3.0 * n as f64)
        };
        for phase in [-3.0, -0.51, -0.49, -1e-3, 0.0, 0.2, 0.499, 0.501, 2.0, 9.0f64] {
            let (even, odd, odd2) = quotients(phase, phase.sin(), phase.cos());
            let expected = integral(&|x| -2.0 * (1.0 - x) * x * x * (phase * x).cos());
            assert!((even - expected).abs() < 1e-11, "{phase}: {even} {expected}");
            let expected = integral(&|x| -x * (phase * x).sin());
            assert!((odd - expected).abs() < 1e-11, "{phase}: {odd} {expected}");
            let expected = integral(&|x| -x * x * (phase * x).cos());
            assert!((odd2 - expected).abs() < 1e-11, "{phase}: {odd2} {expected}");
        }
    }
}
