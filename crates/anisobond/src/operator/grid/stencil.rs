//! What the bonds of a node are, and the geometry that all stencils share.

use std::collections::BTreeSet;
use std::ops::Range;

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::aligned::Aligned;
use super::kernels::TOGETHER;
use super::real::Real;
use crate::lattice::{Bond, Neighbourhood};
use crate::tensor::{PAIRS, Stiffness, mandel_weight};
use crate::{Error, Result};

/// What a node brings to its bonds. A bond has the mean of what its two ends say of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Stencil {
    /// k = ω c ΔV²/|ξ| (N/m) of every bond of the neighbourhood, in its order (THEORY 2).
    pub stiffness: Vec<f64>,
    /// Critical stretch s_c (–) of every bond; infinite where bonds do not break.
    pub critical: Vec<f64>,
    /// Nodal term Z (Pa), if any: energy ΔV ½ ε̄:Z:ε̄ of the node (THEORY 6).
    pub nodal: Option<Stiffness>,
}

impl Stencil {
    /// Unbreakable bonds of given micromoduli c (N/m⁶), in the neighbourhood's order.
    pub fn new(neighbourhood: &Neighbourhood, micromodulus: &[f64]) -> Self {
        let square = neighbourhood.spacing().powi(6);
        let bonds = neighbourhood.bonds();
        let stiffness = bonds.iter().zip(micromodulus).map(|(b, c)| b.influence * c * square / b.xi.norm()).collect();
        Stencil { stiffness, critical: vec![f64::INFINITY; bonds.len()], nodal: None }
    }

    /// The same with one critical stretch (–) for all bonds.
    pub fn breaking_at(mut self, critical: f64) -> Self {
        self.critical.fill(critical);
        self
    }

    pub(super) fn check(&self, bonds: usize) -> Result<()> {
        for (name, values) in [("stiffnesses", &self.stiffness), ("critical stretches", &self.critical)] {
            if values.len() != bonds {
                return Err(Error::input(
                    format!("a stencil has {} {name} for {bonds} bonds", values.len()),
                    "give one per bond, in the neighbourhood's order",
                ));
            }
        }
        if let Some(k) = self.stiffness.iter().find(|k| !k.is_finite()) {
            return Err(Error::input(format!("a bond's stiffness is {k} N/m"), "give finite numbers"));
        }
        if let Some(s) = self.critical.iter().find(|s| s.is_nan() || **s <= 0.0) {
            return Err(Error::input(
                format!("a bond's critical stretch is {s}"),
                "give positive numbers, or infinity",
            ));
        }
        Ok(())
    }

    /// Σ k |ξ|² n⊗n⊗n⊗n / 2ΔV + Z (Pa): the stiffness of a body of this stencil alone.
    pub(super) fn bulk(&self, geometry: &[Vector3<f64>], volume: f64) -> Stiffness {
        let mut sum = self.nodal.as_ref().map_or(Matrix6::zeros(), |z| *z.mandel());
        for (xi, &k) in geometry.iter().zip(&self.stiffness) {
            let n = xi.normalize();
            let e = Vector6::from_fn(|a, _| n[PAIRS[a].0] * n[PAIRS[a].1] * mandel_weight(a));
            sum += 0.5 * k * xi.norm_squared() / volume * e * e.transpose();
        }
        Stiffness::from_mandel(sum)
    }
}

/// Half the bonds of the neighbourhood, in the order in which kernels take them, and the numbers that they read.
#[derive(Debug)]
pub struct HalfBonds<T: Real> {
    /// Offset of each.
    pub offset: Vec<[i32; 3]>,
    /// Its place in the neighbourhood's order, in the second half; the opposite bond is as far from the order's begin.
    pub full: Vec<usize>,
    /// Bond vector ξ (m).
    pub xi: Vec<Vector3<f64>>,
    /// Direction n by component, ξ (m) by component, 1/|ξ|² (1/m²) and |ξ| (m), each padded to whole vectors with zeros.
    pub direction: [Aligned<T>; 3],
    /// ξ (m).
    pub branch: [Aligned<T>; 3],
    /// 1/|ξ|² (1/m²).
    pub per_square: Aligned<T>,
    /// |ξ| (m).
    pub length: Aligned<T>,
    /// Bonds that are taken together.
    pub groups: Vec<Group>,
    /// Distinct offsets along the second and third axis, and which of them each bond has.
    pub rows: Vec<[i32; 2]>,
    /// See `rows`.
    pub row_of: Vec<usize>,
    /// Bonds of the neighbourhood.
    pub bonds: usize,
    /// Reach along each axis.
    pub reach: [usize; 3],
}

/// Half bonds that kernels take together, for all rows of a strip, before the next: their neighbours at a few positions of
/// rows fit into the first cache, and going from one row to the next needs few others.
#[derive(Debug)]
pub struct Group {
    /// The bonds.
    pub bonds: Range<usize>,
    /// Those whose directions have the same components that are not zero; bit a of the pattern for component a.
    pub patterns: Vec<(u8, Range<usize>)>,
}

/// Bytes of a core's first cache that the neighbours of a group may take, and those of a vector.
const CACHE: usize = 22 << 10;
const VECTOR: usize = 64;

/// The group of each plane of neighbours, by distance along the third axis: the planes with most neighbours first, each in
/// the first group that has room.
fn group_of_planes(bonds: &[Bond], reach: usize) -> Vec<usize> {
    let size = |z: usize| {
        let here = |y: i32| bonds.iter().filter(move |b| b.offset[2].unsigned_abs() as usize == z && b.offset[1] == y);
        let rows = bonds.iter().map(|b| b.offset[1]).collect::<BTreeSet<_>>();
        let along = |y| here(y).map(|b| TOGETHER + 2 * b.offset[0].unsigned_abs() as usize).max().unwrap_or(0);
        // The neighbours' opposites are as many; of bonds in the plane no third component is read.
        (if z == 0 { 4 } else { 6 }) * rows.into_iter().map(along).sum::<usize>() * VECTOR
    };
    let sizes: Vec<usize> = (0..=reach).map(size).collect();
    let mut planes: Vec<usize> = (0..=reach).collect();
    planes.sort_by_key(|&z| std::cmp::Reverse(sizes[z]));
    let (mut group, mut filled) = (vec![0; reach + 1], Vec::<usize>::new());
    for z in planes {
        group[z] = filled.iter().position(|f| f + sizes[z] <= CACHE).unwrap_or(filled.len());
        match filled.get_mut(group[z]) {
            Some(filled) => *filled += sizes[z],
            None => filled.push(sizes[z]),
        }
    }
    group
}

/// Widest vector.
pub const MOST_LANES: usize = 16;

/// A vector in memory, of whatever width.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Lane<T>(pub [T; MOST_LANES]);

impl<T: Real> Lane<T> {
    /// Zeros.
    pub fn zero() -> Self {
        Lane([T::default(); MOST_LANES])
    }
}

impl<T: Real> HalfBonds<T> {
    /// Of a neighbourhood.
    pub fn new(neighbourhood: &Neighbourhood) -> Self {
        let bonds = neighbourhood.bonds();
        let pattern = |b: usize| {
            (0..3).fold(0, |pattern, a| pattern | u8::from(bonds[b].xi[a].abs() > 1e-14 * bonds[b].xi.norm()) << a)
        };
        let reach = [0, 1, 2].map(|a| bonds.iter().map(|b| b.offset[a].unsigned_abs() as usize).max().unwrap_or(0));
        let planes = group_of_planes(&bonds[bonds.len() / 2..], reach[2]);
        let group = |b: usize| planes[bonds[b].offset[2].unsigned_abs() as usize];
        let mut full: Vec<usize> = (bonds.len() / 2..bonds.len()).collect();
        full.sort_by_key(|&b| (group(b), pattern(b), b));
        let mut groups: Vec<Group> = Vec::new();
        for part in full.chunk_by(|&a, &b| group(a) == group(b)) {
            let begin = groups.last().map_or(0, |g| g.bonds.end);
            let mut patterns: Vec<(u8, Range<usize>)> = Vec::new();
            for same in part.chunk_by(|&a, &b| pattern(a) == pattern(b)) {
                let begin = patterns.last().map_or(begin, |(_, range)| range.end);
                patterns.push((pattern(same[0]), begin..begin + same.len()));
            }
            groups.push(Group { bonds: begin..begin + part.len(), patterns });
        }
        let row = |b: usize| [bonds[b].offset[1], bonds[b].offset[2]];
        let mut rows: Vec<[i32; 2]> = full.iter().map(|&b| row(b)).collect();
        rows.sort_unstable();
        rows.dedup();
        let row_of = full.iter().filter_map(|&b| rows.binary_search(&row(b)).ok()).collect();
        let padded = |value: &dyn Fn(&Vector3<f64>) -> f64| {
            let mut out = Aligned::zeros(full.len().next_multiple_of(MOST_LANES));
            for (to, &b) in out.slice_mut().iter_mut().zip(&full) {
                *to = T::of(value(&bonds[b].xi));
            }
            out
        };
        HalfBonds {
            offset: full.iter().map(|&b| bonds[b].offset).collect(),
            xi: full.iter().map(|&b| bonds[b].xi).collect(),
            direction: [0, 1, 2].map(|a| padded(&|xi| xi[a] / xi.norm())),
            branch: [0, 1, 2].map(|a| padded(&|xi| xi[a])),
            per_square: padded(&|xi| 1.0 / xi.norm_squared()),
            length: padded(&|xi| xi.norm()),
            groups,
            rows,
            row_of,
            bonds: bonds.len(),
            reach,
            full,
        }
    }

    /// Number of half bonds.
    pub fn len(&self) -> usize {
        self.full.len()
    }

    /// The bond opposite to bond b of the neighbourhood's order.
    pub fn opposite(&self, b: usize) -> usize {
        self.bonds - 1 - b
    }
}

/// n⊗n.
pub fn outer(n: &Vector3<f64>) -> Matrix3<f64> {
    n * n.transpose()
}
