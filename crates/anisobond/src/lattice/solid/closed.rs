//! Whether triangles close a surface; corners that rounding has parted are made one.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::mesh::Triangle;
use crate::{Error, Result};

/// Corners nearer than these parts of the surface's diagonal are made one, the first that closes it.
const WELDS: [f64; 3] = [2e-7, 2e-6, 1e-5];

/// Corners of open edges among which distances are looked at.
const MEASURED: usize = 3000;

/// The bits of a place; −0 and 0 are one.
type Key = [u64; 3];

/// A pair of corners, and the number of triangles that have it as an edge.
type Edge = ((Key, Key), usize);

/// Triangles that close a surface: as they are, or with corners made one that differ by rounding.
///
/// # Errors
/// Edges of an odd number of triangles, with the place and the size of the gap.
pub(super) fn closed(triangles: Vec<Triangle>) -> Result<Vec<Triangle>> {
    if open_edges(&triangles).is_empty() {
        return Ok(triangles);
    }
    let corners = || triangles.iter().flatten();
    let low = corners().fold(Vector3::repeat(f64::INFINITY), |low, p| low.inf(p));
    let high = corners().fold(Vector3::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
    let size = (high - low).norm();
    let mut open = Vec::new();
    for part in WELDS {
        let welded = welded(&triangles, part * size);
        open = open_edges(&welded);
        if open.is_empty() && !welded.is_empty() {
            return Ok(welded);
        }
    }
    Err(gap(&open))
}

/// The triangles with corners nearer than a distance (m) made one, the first of them; those that vanish are left out.
fn welded(triangles: &[Triangle], distance: f64) -> Vec<Triangle> {
    let mut kept: HashMap<[i64; 3], Vec<Vector3<f64>>> = HashMap::new();
    let mut to_kept = |p: &Vector3<f64>| {
        let cell = [0, 1, 2].map(|a| (p[a] / distance).floor() as i64);
        let around = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [i, j, k])));
        let near = around.flat_map(|step| kept.get(&[0, 1, 2].map(|a| cell[a] + step[a])).into_iter().flatten());
        let near = near.copied().find(|q| (p - q).norm() <= distance);
        near.unwrap_or_else(|| {
            kept.entry(cell).or_default().push(*p);
            *p
        })
    };
    let mut welded: Vec<Triangle> =
        triangles.iter().map(|t| [to_kept(&t[0]), to_kept(&t[1]), to_kept(&t[2])]).collect();
    welded.retain(|[a, b, c]| a != b && b != c && c != a);
    welded
}

/// Edges of an odd number of triangles, in the order of their corners.
fn open_edges(triangles: &[Triangle]) -> Vec<Edge> {
    let key = |p: &Vector3<f64>| [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits);
    let mut edges: HashMap<(Key, Key), usize> = HashMap::with_capacity(triangles.len() * 3 / 2);
    for t in triangles {
        for (p, q) in [(0, 1), (1, 2), (2, 0)] {
            let (p, q) = (key(&t[p]), key(&t[q]));
            *edges.entry(if p < q { (p, q) } else { (q, p) }).or_default() += 1;
        }
    }
    let mut open: Vec<Edge> = edges.into_iter().filter(|(_, n)| n % 2 == 1).collect();
    open.sort_unstable();
    open
}

/// The error of a surface with open edges.
fn gap(open: &[Edge]) -> Error {
    let place = |p: Key| Vector3::from(p.map(f64::from_bits));
    let Some(&((p, q), n)) = open.first() else {
        return Error::input("the surface has no triangle with an area", "export it as a closed surface");
    };
    let words = |p: &Vector3<f64>| format!("({}, {}, {})", p.x, p.y, p.z);
    let mut corners: Vec<Key> = open.iter().flat_map(|((p, q), _)| [*p, *q]).take(MEASURED).collect();
    corners.sort_unstable();
    corners.dedup();
    let corners: Vec<Vector3<f64>> = corners.into_iter().map(place).collect();
    let nearest = |(i, p): (usize, &Vector3<f64>)| {
        let others = corners.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, q)| (q - p).norm());
        others.fold(f64::INFINITY, f64::min)
    };
    let widest = corners.iter().enumerate().map(nearest).fold(0.0, f64::max);
    let word = if n == 1 { "triangle" } else { "triangles" };
    Error::input(
        format!(
            "the surface is not closed: the edge from {} m to {} m belongs to {n} {word}, and {} more are open; the corners of \
             open edges are up to {widest:.3e} m from the next",
            words(&place(p)),
            words(&place(q)),
            open.len() - 1
        ),
        "close its gaps and export it again as one watertight surface; corners that differ by rounding, up to 1e-5 of its size, \
         are taken for one",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::lattice::solid::{Mesh, Solid, grid_around};

    /// A box of twelve triangles, every corner of every triangle moved by up to `noise`.
    fn block(noise: f64) -> Vec<Triangle> {
        let corner = |n: usize| Vector3::new((n & 1) as f64, (n >> 1 & 1) as f64 * 2.0, (n >> 2 & 1) as f64 * 3.0);
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).map(|t| t.map(corner));
        let moved = |(i, t): (usize, Triangle)| {
            let shift = |j: usize, a: usize| noise * (12.9 * (9 * i + 3 * j + a) as f64).sin();
            [0, 1, 2].map(|j| t[j] + Vector3::from_fn(|a, _| shift(j, a)))
        };
        triangles.enumerate().map(moved).collect()
    }

    #[test]
    fn corners_that_rounding_has_parted_are_one() {
        for noise in [1e-12, 3e-8, 3e-7, 3e-6] {
            let mesh = Mesh::new(block(noise)).unwrap();
            assert_eq!(mesh.len(), 12);
            for (x, inside) in [([0.5, 1.0, 1.5], true), ([0.01, 1.99, 0.01], true), ([1.01, 1.0, 1.5], false)] {
                let x = Vector3::from(x);
                assert_eq!(mesh.encloses(&x), inside);
                assert!((mesh.winding(&x).abs() - f64::from(u8::from(inside))).abs() < 1e-9, "{noise}");
            }
        }
        // Rounding adds no layer of nodes.
        let rounded = Solid::Mesh(Arc::new(Mesh::new(block(3e-7)).unwrap()));
        assert_eq!(grid_around(&rounded, 0.1, [false; 3], None).unwrap().nodes, [10, 20, 30]);
        // Exact surfaces are left as they are.
        assert_eq!(closed(block(0.0)).unwrap(), block(0.0));
    }

    #[test]
    fn a_true_gap_has_a_place_and_a_size() {
        let mut parted = block(0.0);
        parted.iter_mut().skip(10).flatten().for_each(|p| p.x += 0.004);
        let message = closed(parted).unwrap_err().to_string();
        assert!(message.contains("not closed") && message.contains("4.000e-3 m"), "{message}");
        let mut missing = block(0.0);
        missing.pop();
        let message = closed(missing).unwrap_err().to_string();
        assert!(message.contains("1 triangle, and 2 more") && message.contains("(1, 0, 0)"), "{message}");
    }
}
