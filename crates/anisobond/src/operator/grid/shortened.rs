//! A body with its long runs of equal layers shortened: a block of any size has the waves of one that is some windows wide.
//!
//! Layers are equal where their nodes have the same stencils and regions and the same unbroken bonds. Where a run keeps as many as a
//! window and twice what a node sees on either side, every window of the long body is one of the short body: whatever moves
//! the nodes within a window alone costs the same energy in both.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::build::GridBonds;
use super::real::Real;
use crate::Result;
use crate::lattice::{Body, Grid};

/// Nodes of a short body at most, relative to those of the long one.
const WORTH: f64 = 0.25;

impl<T: Real> GridBonds<T> {
    /// The bonds of a body that has the same windows of so many nodes along every axis, and far fewer nodes; `None` where there is none.
    pub(super) fn shortened(&self, window: usize) -> Result<Option<GridBonds<T>>> {
        let grid = &self.body.grid;
        // A bond's constants come from the layers around its two ends.
        let kept: [Vec<usize>; 3] = {
            let equal = self.equal_layers();
            std::array::from_fn(|a| few_of_each_run(&equal[a], window + 4 * self.half.reach[a]))
        };
        let nodes = [0, 1, 2].map(|a| kept[a].len());
        if nodes.iter().product::<usize>() as f64 > WORTH * grid.len() as f64 {
            return Ok(None);
        }
        let short = Grid { nodes, ..grid.clone() };
        let of = |node: usize| {
            let at = short.coordinates(node);
            grid.index([0, 1, 2].map(|a| kept[a][at[a]]))
        };
        let from: Vec<usize> = (0..short.len()).map(of).collect();
        let region = from.iter().map(|&i| self.body.region[i]).collect();
        let stencil = from.iter().map(|&i| self.stencil[i]).collect();
        let body = Body { grid: short, region };
        let mut bonds =
            GridBonds::with_instructions(self.set, body, &self.neighbourhood, stencil, self.stencils.clone())?;
        let n = [bonds.row_nodes(), self.row_nodes()];
        let broken: Vec<(usize, usize)> = from
            .par_iter()
            .enumerate()
            .flat_map_iter(|(node, &of)| {
                let bonds = &bonds;
                (0..bonds.half.len()).filter_map(move |p| {
                    let here = bonds.own_bit(node / n[0], node % n[0], p);
                    (here && !self.own_bit(of / n[1], of % n[1], p)).then_some((node, p))
                })
            })
            .collect();
        bonds.clear(broken);
        Ok(Some(bonds))
    }

    /// By axis and layer: whether it is equal to the one before.
    fn equal_layers(&self) -> [Vec<bool>; 3] {
        let grid = &self.body.grid;
        let stride = [1, grid.nodes[0], grid.nodes[0] * grid.nodes[1]];
        let equal = grid.nodes.map(|n| (0..n).map(|at| AtomicBool::new(at > 0)).collect::<Vec<_>>());
        let bits = self.unbroken_by_node();
        let seen = |node: usize| (self.stencil[node], self.body.region[node], bits[node]);
        (0..grid.len()).into_par_iter().with_min_len(4096).for_each(|node| {
            let at = grid.coordinates(node);
            for a in (0..3).filter(|&a| at[a] > 0 && equal[a][at[a]].load(Ordering::Relaxed)) {
                if seen(node) != seen(node - stride[a]) {
                    equal[a][at[a]].store(false, Ordering::Relaxed);
                }
            }
        });
        equal.map(|equal| equal.into_iter().map(AtomicBool::into_inner).collect())
    }

    /// By node, a number for which of its half bonds are unbroken (FNV-1a).
    fn unbroken_by_node(&self) -> Vec<u64> {
        let n = self.row_nodes();
        let of = |node: usize| {
            let add = |hash: u64, p: usize| {
                (hash ^ u64::from(self.own_bit(node / n, node % n, p))).wrapping_mul(0x0100_0000_01b3)
            };
            (0..self.half.len()).fold(0xcbf2_9ce4_8422_2325, add)
        };
        (0..self.stencil.len()).into_par_iter().with_min_len(4096).map(of).collect()
    }
}

/// Places of the layers that are kept: the first so many of every run of equal ones.
fn few_of_each_run(equal_to_last: &[bool], most: usize) -> Vec<usize> {
    let mut run = 0;
    let mut keep = |equal: bool| {
        run = if equal { run + 1 } else { 1 };
        run <= most
    };
    (0..equal_to_last.len()).filter(|&at| keep(equal_to_last[at])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::{Influence, Neighbourhood};
    use crate::operator::grid::Stencil;
    use nalgebra::Vector3;

    /// A block of two materials with a crack through it: layers along each axis.
    fn block(nodes: [usize; 3]) -> GridBonds {
        let neighbourhood = Neighbourhood::sphere(2.0, 1.0, Influence::Inverse).unwrap();
        let one = Stencil::new(&neighbourhood, &vec![1.0; neighbourhood.bonds().len()]);
        let two = Stencil::new(&neighbourhood, &vec![2.0; neighbourhood.bonds().len()]);
        let mut body = Body::full(Grid::new(nodes, 1.0, Vector3::zeros(), [false; 3]).unwrap());
        for node in 0..body.grid.len() {
            body.region[node] = 1 + u16::from(body.grid.coordinates(node)[2] >= 6);
        }
        let stencil = body.region.clone();
        let mut bonds = GridBonds::new(body, &neighbourhood, stencil, vec![one, two]).unwrap();
        // Half of a plane across y, up to x = 5.
        bonds.cut(|p, q| p.x.max(q.x) < 5.5 && (p.y < 7.5) != (q.y < 7.5));
        bonds
    }

    #[test]
    fn a_long_block_is_shortened_to_one_that_was_short() {
        let (window, most) = (6, 6 + 4 * 2);
        let long = block([40, 50, 60]).shortened(window).unwrap().unwrap();
        // Layers before the run: those to the crack's tip, to its faces, to the interface.
        let nodes = long.body.grid.nodes;
        assert!(nodes.iter().all(|&n| n >= most && n < 40), "{nodes:?}");
        let short = block(nodes);
        assert_eq!((&long.stencil, &long.body.region), (&short.stencil, &short.body.region));
        assert_eq!(long.unbroken_by_node(), short.unbroken_by_node());
        assert_eq!(long.whole, short.whole);
        assert!(block([15, 16, 17]).shortened(window).unwrap().is_none());
    }

    #[test]
    fn runs_keep_their_first_layers() {
        let equal = [false, true, true, true, false, false, true, true, true];
        assert_eq!(few_of_each_run(&equal, 3), [0, 1, 2, 4, 5, 6, 7]);
    }
}
