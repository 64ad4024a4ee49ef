//! How far the faces of cracks have come apart, or have gone through each other.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::build::GridBonds;
use super::measure::elongation;
use super::padded::Padded;
use crate::operator::Kinematics;

/// Bonds that a node at the face of a crack lacks point one way: |Σ ξ| over Σ |ξ| is above this, ...
const ONE_SIDED: f64 = 0.5;

/// ... and they are at least this part of all. A node at a plane lacks two fifths; ahead of a tip a few bonds are cut as well, whose
/// ends approach each other where the crack opens.
const LACKING: f64 = 0.25;

/// How a node has moved against those that bonds no longer join it to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening {
    /// The node.
    pub node: u32,
    /// Mean distance (m) along the crack's normal by which they have moved away; negative where they came nearer.
    pub opening: f64,
    /// Length of the whole relative displacement (m), sliding included.
    pub jump: f64,
    /// By how much the most compressed of the node's unbroken bonds would shorten over that distance (m).
    pub compression: f64,
}

impl GridBonds<f64> {
    /// Openings at nodes that lack bonds to one side, in the order of nodes. For bonds ξ that were cut or are broken, with relative
    /// displacements η, n is the direction from the mean of the unbroken ξ to that of these, for outer faces truncate both alike;
    /// at finite stretch it is turned with the unbroken bonds. The opening is the mean of n·(ξ + η) less that of n·ξ before: sliding
    /// along the crack opens nothing.
    pub fn openings(&self, u: &Padded<f64>, kinematics: Kinematics) -> Vec<Opening> {
        let (n, layout) = (self.row_nodes(), &*self.layout);
        let of = |node: usize| {
            let whole = self.whole[node / n * layout.length + node % n % layout.length];
            let none = self.stencil[node] == 0 || whole && !self.is_special(node);
            (!none).then(|| self.opening_of(node, u, kinematics)).flatten()
        };
        (0..self.stencil.len()).into_par_iter().with_min_len(1024).filter_map(of).collect()
    }

    /// Bonds ξ that a node had, or would have without a crack: ξ, the other node, and whether it is unbroken.
    fn all_bonds(&self, node: usize) -> impl Iterator<Item = (Vector3<f64>, usize, bool)> + '_ {
        let (row, e) = (node / self.row_nodes(), node % self.row_nodes());
        (0..self.half.len()).flat_map(move |p| {
            let (offset, xi) = (self.half.offset[p], self.half.xi[p]);
            let plus = self.node_at(row, e, offset).map(|other| (xi, other, self.own_bit(row, e, p)));
            let minus = self.node_at(row, e, offset.map(|x| -x));
            [plus, minus.map(|other| (-xi, other, self.opposite_bit(row, e, p)))].into_iter().flatten()
        })
    }

    fn opening_of(&self, node: usize, u: &Padded<f64>, kinematics: Kinematics) -> Option<Opening> {
        // Most nodes near outer faces lack nothing.
        let (all, lacking) = self
            .all_bonds(node)
            .fold((0, 0), |(all, lacking), (_, _, unbroken)| (all + 1, lacking + usize::from(!unbroken)));
        if lacking == 0 || (lacking as f64) < LACKING * f64::from(all) {
            return None;
        }
        let here = Vector3::from(u.at(node));
        let (mut xi_sum, mut eta_sum, mut lengths, mut count) = (Vector3::zeros(), Vector3::zeros(), 0.0, 0);
        let (mut shortest, mut turned) = (0.0_f64, Matrix3::zeros());
        let (mut rest, mut others) = (Vector3::zeros(), 0);
        for (xi, other, unbroken) in self.all_bonds(node) {
            let eta = Vector3::from(u.at(other)) - here;
            if unbroken {
                shortest = shortest.min(elongation(kinematics, &xi, &eta).0 / xi.norm());
                turned += (xi + eta) * xi.transpose();
                rest += xi;
                others += 1;
            } else {
                xi_sum += xi;
                eta_sum += eta;
                lengths += xi.norm();
                count += 1;
            }
        }
        if xi_sum.norm() < ONE_SIDED * lengths {
            return None;
        }
        let turn = match kinematics {
            Kinematics::Linear => Matrix3::identity(),
            Kinematics::Finite => rotation(&turned)?,
        };
        let mean = |sum: Vector3<f64>, count: usize| sum / (count.max(1) as f64);
        let xi = mean(xi_sum, count);
        let normal = (xi - mean(rest, others)).normalize();
        let jump = xi + mean(eta_sum, count) - turn * xi;
        Some(Opening {
            node: node as u32,
            opening: (turn * normal).dot(&jump),
            jump: jump.norm(),
            compression: -shortest * normal.dot(&xi).abs(),
        })
    }

    /// Whether an unbroken bond joins two nodes.
    pub fn joined(&self, node: usize, other: usize) -> bool {
        self.all_bonds(node).any(|(_, end, unbroken)| unbroken && end == other)
    }
}

/// The rotation nearest to Σ (ξ + η) ⊗ ξ (Kabsch 1976); `None` where the bonds do not determine it.
fn rotation(sum: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let svd = sum.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    if svd.singular_values[1] <= 1e-9 * svd.singular_values[0] {
        return None;
    }
    let sign = (u * v_t).determinant().signum();
    Some(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t)
}
