//! What the bonds of a node could lose, and have lost.

use nalgebra::Vector3;

use super::failing::FailingBonds;

/// A bond of a node that can fail, whether it has or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BondLoss {
    /// Bond vector (m), from the node on.
    pub xi: Vector3<f64>,
    /// The energy that it takes to fail (J); of softening bonds that up to the onset of damage, the same part for all.
    pub energy: f64,
    /// The share of it that has been spent (–); 1 of bonds that were cut.
    pub spent: f64,
}

impl FailingBonds {
    /// Visit the bonds that a node had at the start or that were cut then, if they can fail.
    pub fn bond_losses(&self, node: usize, mut visit: impl FnMut(BondLoss)) {
        let grid = self.grid();
        let (n, half) = (grid.row_nodes(), &grid.half);
        let (row, e) = (node / n, node % n);
        for (p, &offset) in half.offset.iter().enumerate() {
            for ahead in [true, false] {
                let (to, sign) = if ahead { (offset, 1.0) } else { (offset.map(|x| -x), -1.0) };
                if grid.node_at(row, e, to).is_none() {
                    continue;
                }
                let [k, critical] = grid.constants_of(node, p, ahead);
                let whole = if ahead { grid.own_bit(row, e, p) } else { grid.opposite_bit(row, e, p) };
                if critical.is_finite() && k > 0.0 {
                    let spent = if whole { 0.0 } else { self.spent(node, p, ahead) };
                    visit(BondLoss {
                        xi: sign * half.xi[p],
                        energy: 0.5 * k * (critical * half.xi[p].norm()).powi(2),
                        spent,
                    });
                }
            }
        }
    }
}
