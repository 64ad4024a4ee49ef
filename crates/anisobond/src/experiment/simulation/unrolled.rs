//! Places of a crack's nodes, unrolled along periodic axes: each beside the node that it hangs on, through faces too.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Vector3;

use crate::lattice::Grid;

/// Places (m) of nodes that follow each other in short steps, the first where it is.
pub(super) fn along(grid: &Grid, nodes: &[usize]) -> Vec<Vector3<f64>> {
    let mut image = [0; 3];
    let mut before = nodes.first().copied().unwrap_or(0);
    let place = |&node: &usize| {
        image = beside(grid, before, image, node);
        before = node;
        place_in(grid, node, image)
    };
    nodes.iter().map(place).collect()
}

/// Places (m) of nodes that hang together by hops, the first where it is. Of a crack that goes around an axis each is as few
/// hops away as may be.
pub(super) fn around(
    grid: &Grid,
    nodes: &[usize],
    hops: &[([i32; 3], f64)],
    first: usize,
) -> BTreeMap<usize, Vector3<f64>> {
    let mut images: BTreeMap<usize, Option<[i64; 3]>> = nodes.iter().map(|&node| (node, None)).collect();
    images.insert(first, Some([0; 3]));
    let mut next = VecDeque::from([(first, [0; 3])]);
    while let Some((node, image)) = next.pop_front() {
        for other in hops.iter().filter_map(|(offset, _)| grid.neighbour(node, *offset)) {
            if let Some(known @ None) = images.get_mut(&other) {
                let there = beside(grid, node, image, other);
                *known = Some(there);
                next.push_back((other, there));
            }
        }
    }
    images.into_iter().map(|(node, image)| (node, place_in(grid, node, image.unwrap_or_default()))).collect()
}

/// The period in which a node is nearest to another.
fn beside(grid: &Grid, node: usize, image: [i64; 3], other: usize) -> [i64; 3] {
    let [from, to] = [node, other].map(|n| grid.coordinates(n));
    std::array::from_fn(|a| {
        let (period, step) = (grid.nodes[a] as i64, to[a] as i64 - from[a] as i64);
        match grid.periodic[a] {
            true if 2 * step > period => image[a] - 1,
            true if 2 * step < -period => image[a] + 1,
            _ => image[a],
        }
    })
}

fn place_in(grid: &Grid, node: usize, image: [i64; 3]) -> Vector3<f64> {
    let periods = Vector3::from_fn(|a, _| image[a] as f64 * grid.nodes[a] as f64);
    grid.position(node) + periods * grid.spacing
}
