//! Bonds between regions of different materials: which part of a bond lies in which region, how the regions lie around it,
//! and what stiffness and critical stretch it has from that.
//!
//! A bond passes from the middle of one cell to that of another, straight through cells between: each belongs to the region
//! of its node. The regions lie as layers around it ([`Layers`]), normal to the gradient of what is of another region around its
//! ends. It fails with the energy of the weakest of them: k s² |ξ|²/2 is the least of the regions'.

use std::collections::{BTreeMap, HashMap};

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::build::GridBonds;
use super::real::Real;
use crate::calibration::Layers;
use crate::tensor::Stiffness;

/// Cells on the way from the middle of one to the middle of that at an offset: their offsets, and the part of the way (–) in
/// each.
pub(super) fn cells_between(offset: [i32; 3]) -> Vec<([i32; 3], f64)> {
    let faces = |n: i32| (0..n.abs()).map(move |m| (f64::from(m) + 0.5) / f64::from(n.abs()));
    let mut cuts: Vec<f64> = offset.into_iter().flat_map(faces).chain([0.0, 1.0]).collect();
    cuts.sort_by(f64::total_cmp);
    let pieces = cuts.windows(2).map(|cut| (0.5 * (cut[0] + cut[1]), cut[1] - cut[0]));
    // The same face comes from two axes where the way goes through an edge: to rounding.
    let pieces = pieces.filter(|(_, part)| *part > 1e-9);
    pieces.map(|(at, part)| (offset.map(|n| (at * f64::from(n)).round() as i32), part)).collect()
}

/// What is known of the places where regions meet, while the bonds there are made.
pub(super) struct Interfaces<'a, T: Real> {
    bonds: &'a GridBonds<T>,
    /// By half bond: its way.
    ways: Vec<Vec<([i32; 3], f64)>>,
    /// By place of special nodes: the direction of what is of another region.
    contrast: Vec<Vector3<f64>>,
    /// By region: the stiffness of its bulk.
    bulk: Vec<Stiffness>,
}

/// What gradients (per spacing) may differ by rounding.
pub(super) const ROUNDING: f64 = 1e-9;

/// Layers by their regions and the bits of their normal.
pub(super) type KnownLayers = HashMap<(Vec<u16>, [u64; 3]), Option<Layers>>;

/// What a region brings to a bond.
struct Part {
    region: u16,
    /// Of the bond (–).
    share: f64,
    /// k (N/m) and s_c (–).
    stiffness: f64,
    critical: f64,
}

impl<'a, T: Real> Interfaces<'a, T> {
    /// Of the special nodes of bonds; `None` in a body of one region.
    pub fn of(bonds: &'a GridBonds<T>) -> Option<Self> {
        let first = bonds.body.region.iter().copied().find(|&r| r > 0)?;
        if bonds.body.region.iter().all(|&r| r == 0 || r == first) {
            return None;
        }
        let (xi, volume) = (&bonds.neighbourhood, bonds.body.grid.spacing.powi(3));
        let xi: Vec<Vector3<f64>> = xi.bonds().iter().map(|b| b.xi).collect();
        let regions = bonds.body.region.iter().copied().max().unwrap_or(0);
        Some(Interfaces {
            ways: bonds.half.offset.iter().map(|&offset| cells_between(offset)).collect(),
            contrast: bonds.special.par_iter().map(|&node| bonds.contrast(node as usize)).collect(),
            bulk: bonds.stencils[..usize::from(regions)].iter().map(|s| s.bulk(&xi, volume)).collect(),
            bonds,
        })
    }

    /// k (N/m) and s_c (–) of half bond p from one node to another; `None` where it passes through one region only.
    pub fn constants(&self, first: usize, p: usize, second: usize, known: &mut KnownLayers) -> Option<[f64; 2]> {
        let parts = self.parts(first, p, second);
        if parts.len() < 2 {
            return None;
        }
        let xi = &self.bonds.half.xi[p];
        let regions: Vec<u16> = parts.iter().map(|part| part.region).collect();
        let normal = self.normal(first, second).unwrap_or_else(|| xi.normalize());
        let layers = known.entry((regions, normal.map(f64::to_bits).into())).or_insert_with_key(|(regions, _)| {
            let materials: Vec<Stiffness> = regions.iter().map(|&r| self.bulk[usize::from(r) - 1]).collect();
            Layers::new(&materials, &normal)
        });
        let shares: Vec<(f64, f64)> = parts.iter().map(|part| (part.share, part.stiffness)).collect();
        let beside = || shares.iter().map(|(share, k)| share * k).sum();
        let stiffness = layers.as_ref().map_or_else(beside, |layers| layers.stiffness(&xi.normalize(), &shares));
        Some([
            stiffness,
            weakest(&parts, stiffness).filter(|_| !self.is_spared(first, p, second)).unwrap_or(f64::INFINITY),
        ])
    }

    /// The regions on a bond's way in the order in which it meets them; places without a node count for nothing. At its ends a
    /// region has the values of the nodes there, in between those of its bulk.
    fn parts(&self, first: usize, p: usize, second: usize) -> Vec<Part> {
        let (bonds, body) = (self.bonds, &self.bonds.body);
        let (b, opposite) = (bonds.half.full[p], bonds.half.opposite(bonds.half.full[p]));
        let mut parts: Vec<Part> = Vec::with_capacity(2);
        for &(offset, share) in &self.ways[p] {
            let region = body.grid.neighbour(first, offset).map_or(0, |cell| body.region[cell]);
            match parts.iter_mut().find(|part| part.region == region) {
                _ if region == 0 => {}
                Some(part) => part.share += share,
                None => parts.push(Part { region, share, stiffness: 0.0, critical: 0.0 }),
            }
        }
        let all: f64 = parts.iter().map(|part| part.share).sum();
        for part in &mut parts {
            part.share /= all;
            let of = |stencil: usize, bond: usize| {
                let stencil = &bonds.stencils[stencil - 1];
                (stencil.stiffness[bond], stencil.critical[bond])
            };
            let ends = [(first, b), (second, opposite)].into_iter().filter(|(end, _)| body.region[*end] == part.region);
            let mut said: Vec<(f64, f64)> = ends.map(|(end, bond)| of(usize::from(bonds.stencil[end]), bond)).collect();
            if said.is_empty() {
                said = vec![of(usize::from(part.region), b), of(usize::from(part.region), opposite)];
            }
            let count = said.len() as f64;
            part.stiffness = said.iter().map(|(k, _)| k).sum::<f64>() / count;
            part.critical = said.iter().map(|(_, s)| s).sum::<f64>() / count;
        }
        parts
    }

    /// Whether an end is of a region whose bonds break, but does not let this one break.
    fn is_spared(&self, first: usize, p: usize, second: usize) -> bool {
        let (bonds, b) = (self.bonds, self.bonds.half.full[p]);
        [(first, b), (second, bonds.half.opposite(b))].into_iter().any(|(end, bond)| {
            let breaks = |stencil: u16| bonds.stencils[usize::from(stencil) - 1].critical[bond].is_finite();
            breaks(bonds.body.region[end]) && !breaks(bonds.stencil[end])
        })
    }

    /// The normal of the regions around a bond, whichever way it points; `None` where they lie all around its ends alike.
    fn normal(&self, first: usize, second: usize) -> Option<Vector3<f64>> {
        let contrast = |node| self.bonds.special_place(node).map_or(Vector3::zeros(), |place| self.contrast[place]);
        let (here, there) = (contrast(first), contrast(second));
        // Rounding must not decide about directions at right angles.
        let sum = if here.dot(&there) < -ROUNDING { here - there } else { here + there };
        let normal = sum.try_normalize(ROUNDING)?;
        Some(if normal[normal.iamax()] < 0.0 { -normal } else { normal })
    }
}

/// The critical stretch (–) of a bond of a stiffness (N/m) whose energy at it is the least of its parts'; `None` where none of them
/// breaks.
fn weakest(parts: &[Part], stiffness: f64) -> Option<f64> {
    let breaks = parts.iter().filter(|part| part.stiffness > 0.0 && part.critical.is_finite());
    let least = breaks.map(|part| part.stiffness * part.critical.powi(2)).reduce(f64::min)?;
    (stiffness > 0.0).then(|| (least / stiffness).sqrt())
}

/// Where two regions meet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InterfaceBonds {
    /// Numbers of the regions, as in [`crate::lattice::Body::region`], the smaller first.
    pub regions: [u16; 2],
    /// Unbroken bonds with one end in each.
    pub bonds: usize,
    /// Energy (J) of those that can break, each at its critical stretch.
    pub energy: f64,
    /// Of the bonds, those that never break.
    pub unbreakable: usize,
    /// Pieces of the interface: unit normal and area (m²). Of the face between two cells, |ν·e| of its area counts, ν the
    /// regions' normal and e its own: the sum is the area of the interface, not that of the cells' stairs.
    pub pieces: Vec<(Vector3<f64>, f64)>,
}

impl<T: Real> GridBonds<T> {
    /// The interfaces between regions, by their numbers.
    pub fn interfaces(&self) -> Vec<InterfaceBonds> {
        let Some(known) = Interfaces::of(self) else { return Vec::new() };
        let (n, regions, area) = (self.row_nodes(), &self.body.region, self.body.grid.spacing.powi(2));
        let mut found: BTreeMap<[u16; 2], InterfaceBonds> = BTreeMap::new();
        for &node in &self.special {
            let (node, row, e) = (node as usize, node as usize / n, node as usize % n);
            let pair = |other: usize| {
                let pair = [regions[node].min(regions[other]), regions[node].max(regions[other])];
                (pair[0] != pair[1]).then_some(pair)
            };
            let new = |regions| InterfaceBonds { regions, ..InterfaceBonds::default() };
            for (p, &offset) in self.half.offset.iter().enumerate().filter(|(p, _)| self.own_bit(row, e, *p)) {
                let Some(pair) = self.node_at(row, e, offset).and_then(pair) else { continue };
                let interface = found.entry(pair).or_insert_with(|| new(pair));
                let [k, critical] = self.constants_of(node, p, true).map(T::f64);
                interface.bonds += 1;
                match critical.is_finite() {
                    true => interface.energy += 0.5 * k * (critical * self.half.xi[p].norm()).powi(2),
                    false => interface.unbreakable += 1,
                }
            }
            for axis in 0..3 {
                let mut offset = [0; 3];
                offset[axis] = 1;
                let Some((other, pair)) = self.node_at(row, e, offset).and_then(|o| Some((o, pair(o)?))) else {
                    continue;
                };
                let face = Vector3::ith(axis, 1.0);
                let normal = known.normal(node, other).unwrap_or(face);
                let interface = found.entry(pair).or_insert_with(|| new(pair));
                interface.pieces.push((normal, area * normal[axis].abs()));
            }
        }
        found.into_values().collect()
    }

    /// The direction of what is of another region around a node, without length where there is nothing: the gradient, by least
    /// squares over the nodes around it, of a function that is 1 there and 0 in the node's own region.
    fn contrast(&self, node: usize) -> Vector3<f64> {
        let own = self.body.region[node];
        let (row, e) = (node / self.row_nodes(), node % self.row_nodes());
        let mut found = vec![(Vector3::zeros(), 0.0)];
        for &offset in &self.half.offset {
            for to in [offset, offset.map(|x| -x)] {
                if let Some(other) = self.node_at(row, e, to) {
                    found.push((Vector3::from(to.map(f64::from)), f64::from(u8::from(self.body.region[other] != own))));
                }
            }
        }
        let count = found.len() as f64;
        let (place, value) = found.iter().fold((Vector3::zeros(), 0.0), |(p, v), (at, is)| (p + at, v + is));
        let (place, value) = (place / count, value / count);
        let mut spread = Matrix3::zeros();
        let mut slope = Vector3::zeros();
        for (at, is) in found {
            spread += (at - place) * (at - place).transpose();
            slope += (at - place) * (is - value);
        }
        spread.try_inverse().map_or(slope, |inverse| inverse * slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parts of a way are those that a fine walk finds, add to 1, and are the same from its other end.
    #[test]
    fn ways_are_those_of_a_fine_walk() {
        for offset in [[1, 0, 0], [3, 0, 0], [1, 1, 0], [2, 1, 0], [-2, 1, 2], [3, -2, 1], [1, 1, 1], [6, 3, -2]] {
            let way = cells_between(offset);
            assert!((way.iter().map(|(_, part)| part).sum::<f64>() - 1.0).abs() < 1e-12);
            let steps = 7 * 720;
            let mut walked: HashMap<[i32; 3], f64> = HashMap::new();
            for step in 0..steps {
                let at = (f64::from(step) + 0.5) / f64::from(steps);
                *walked.entry(offset.map(|n| (at * f64::from(n)).round() as i32)).or_insert(0.0) +=
                    1.0 / f64::from(steps);
            }
            for (cell, part) in &way {
                assert!((walked[cell] - part).abs() < 1e-3, "{offset:?}: {cell:?} {part}");
            }
            let back = cells_between(offset.map(|x| -x));
            for ((cell, part), (other, same)) in way.iter().zip(back.iter().rev()) {
                assert_eq!(std::array::from_fn(|a| other[a] + offset[a]), *cell);
                assert!((part - same).abs() < 1e-12);
            }
        }
    }
}
