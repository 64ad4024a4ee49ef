//! Where a body, its regions and its holes are few nodes across.
//!
//! A place is thin if a small cube of nodes that fits into it there is not beside a larger one that fits: with the erosion E_k, the
//! nodes whose cube of 2k − 1 nodes a side is of one label, it is what E_k has farther than three steps from E_{k+1} (a residue of
//! openings: Serra, Image Analysis and Mathematical Morphology, 1982). The steps of a staircase along a curved surface are beside larger
//! cubes, and are not thin.

use rayon::prelude::*;

use crate::lattice::{Body, Grid};

/// So many nodes make a thin place.
const LEAST: usize = 4;

/// A thin place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thin {
    /// Its label.
    pub label: u16,
    /// Nodes across.
    pub across: usize,
    /// The axis across.
    pub axis: usize,
    /// Nodes found so thin.
    pub nodes: usize,
    /// One of them.
    pub node: usize,
}

/// Labels of the nodes of a grid, and which bonds between nearest nodes are cut.
pub struct Labelled<'a> {
    /// The grid.
    pub grid: &'a Grid,
    /// Label of every node; 0 is where there is no material, also outside the grid.
    pub label: &'a [u16],
    /// By node, a bit per axis: whether its bond to the next node is cut.
    pub cut: &'a [u8],
}

impl Labelled<'_> {
    /// The thinnest places of each label that are at most so many nodes across.
    pub fn thin(&self, most: impl Fn(u16) -> usize) -> Vec<Thin> {
        let labels = usize::from(self.label.iter().copied().max().unwrap_or(0)) + 1;
        let most: Vec<usize> = (0..labels).map(|label| most(label as u16)).collect();
        let levels = most.iter().max().map_or(0, |m| m.div_ceil(2));
        // By label and nodes across: nodes found, the first of them and its axis.
        let mut found = vec![Vec::new(); labels];
        found.iter_mut().zip(&most).for_each(|(f, m)| f.resize(m + 1, (0, 0, 0)));
        let mut inside = vec![true; self.label.len()];
        for _ in 0..levels {
            let deeper = self.eroded(&inside);
            let beside = self.dilated(&self.dilated(&deeper));
            let left = |&node: &usize| {
                let far = |at: Option<usize>| at.is_none_or(|n| self.label[n] != self.label[node] || !beside[n]);
                let around = || (0..3).flat_map(|axis| [self.next(node, axis), self.previous(node, axis)]);
                inside[node] && !beside[node] && around().all(far)
            };
            let ridge: Vec<usize> = (0..self.label.len()).into_par_iter().filter(left).collect();
            for node in ridge {
                let label = usize::from(self.label[node]);
                let (across, axis) = self.across(node, most[label] + 1);
                if let Some(entry) = found[label].get_mut(across) {
                    *entry = if entry.0 == 0 { (1, node, axis) } else { (entry.0 + 1, entry.1, entry.2) };
                }
            }
            inside = deeper;
        }
        let thinnest = |(label, found): (usize, &Vec<(usize, usize, usize)>)| {
            let (across, &(nodes, node, axis)) = found.iter().enumerate().find(|(_, f)| f.0 >= LEAST)?;
            Some(Thin { label: label as u16, across, axis, nodes, node })
        };
        found.iter().enumerate().filter_map(thinnest).collect()
    }

    /// Nodes whose nearest nodes, 26 with corners, are all in `of` and of their own label; outside the grid everything is label 0.
    fn eroded(&self, of: &[bool]) -> Vec<bool> {
        let mut result = of.to_vec();
        for axis in (0..3).filter(|&a| !self.endless(a)) {
            let before = result;
            let joins = |node: usize, next: Option<usize>, cut: bool| match next {
                Some(next) => !cut && before[next] && self.label[next] == self.label[node],
                None => self.label[node] == 0,
            };
            result = self.pass(axis, |node, previous, next| {
                before[node]
                    && joins(node, next, self.is_cut(node, axis))
                    && joins(node, previous, previous.is_some_and(|p| self.is_cut(p, axis)))
            });
        }
        result
    }

    /// A value for every node from itself and its neighbours along an axis.
    fn pass(&self, axis: usize, of: impl Fn(usize, Option<usize>, Option<usize>) -> bool + Sync) -> Vec<bool> {
        let [n1, n2, _] = self.grid.nodes;
        let (n, stride, around) = (self.grid.nodes[axis], self.stride(axis), self.grid.periodic[axis]);
        let mut result = vec![false; self.label.len()];
        result.par_chunks_mut(n1).enumerate().for_each(|(row, values)| {
            let place = [0, row % n2, row / n2][axis];
            for (i, value) in values.iter_mut().enumerate() {
                let (node, at) = (row * n1 + i, if axis == 0 { i } else { place });
                let next = if at + 1 < n { Some(node + stride) } else { around.then(|| node + stride - n * stride) };
                let previous = if at > 0 { Some(node - stride) } else { around.then(|| node + (n - 1) * stride) };
                *value = of(node, previous, next);
            }
        });
        result
    }

    /// Nodes beside those in `of`, with corners, that have their label.
    fn dilated(&self, of: &[bool]) -> Vec<bool> {
        let mut result = of.to_vec();
        for axis in (0..3).filter(|&a| !self.endless(a)) {
            let before = result;
            result = self.pass(axis, |node, previous, next| {
                let has = |n: Option<usize>| n.is_some_and(|n| before[n] && self.label[n] == self.label[node]);
                before[node] || has(next) || has(previous)
            });
        }
        result
    }

    /// Nodes of one label in a row through a node, uncut, along the axis of the fewest, at most `most`.
    fn across(&self, node: usize, most: usize) -> (usize, usize) {
        let joined = |from: usize, to: usize, cut: usize, axis: usize| {
            self.label[from] == self.label[to] && !self.is_cut(cut, axis)
        };
        let run = |axis: usize| {
            let (mut up, mut down, mut count) = (node, node, 1);
            while let Some(next) = self.next(up, axis).filter(|&n| count < most && joined(up, n, up, axis)) {
                (up, count) = (next, count + 1);
            }
            while let Some(next) = self.previous(down, axis).filter(|&n| count < most && joined(down, n, n, axis)) {
                (down, count) = (next, count + 1);
            }
            // Outside the grid nothing goes on.
            let open = self.next(up, axis).is_none() || self.previous(down, axis).is_none();
            if self.label[node] == 0 && open { most } else { count }
        };
        (0..3).filter(|&a| !self.endless(a)).map(|axis| (run(axis), axis)).min().unwrap_or((most, 0))
    }

    /// Whether an axis has one layer that repeats: there is nothing across it.
    fn endless(&self, axis: usize) -> bool {
        self.grid.periodic[axis] && self.grid.nodes[axis] == 1
    }

    fn is_cut(&self, node: usize, axis: usize) -> bool {
        self.cut.get(node).is_some_and(|bits| bits >> axis & 1 == 1)
    }

    fn stride(&self, axis: usize) -> usize {
        self.grid.nodes[..axis].iter().product()
    }

    fn next(&self, node: usize, axis: usize) -> Option<usize> {
        let (n, stride) = (self.grid.nodes[axis], self.stride(axis));
        match node / stride % n + 1 < n {
            true => Some(node + stride),
            false => self.grid.periodic[axis].then(|| node + stride - n * stride),
        }
    }

    fn previous(&self, node: usize, axis: usize) -> Option<usize> {
        let (n, stride) = (self.grid.nodes[axis], self.stride(axis));
        match node / stride % n {
            0 => self.grid.periodic[axis].then(|| node + (n - 1) * stride),
            _ => Some(node - stride),
        }
    }
}

/// A body's material as label 1, nothing as 0.
pub fn filled(body: &Body) -> Vec<u16> {
    body.region.iter().map(|&r| u16::from(r > 0)).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::lattice::Solid;
    use crate::lattice::solid::{grid_around, inside};

    fn found(shape: &Solid, plane_strain: Option<usize>) -> Vec<(u16, usize, usize)> {
        let grid = grid_around(shape, 1.0, [false; 3], plane_strain).unwrap();
        let label: Vec<u16> = inside(shape, &grid).into_iter().map(u16::from).collect();
        let thin = Labelled { grid: &grid, label: &label, cut: &[] }.thin(|label| if label == 0 { 10 } else { 6 });
        thin.iter().map(|t| (t.label, t.across, t.axis)).collect()
    }

    fn block(size: [f64; 3]) -> Solid {
        Solid::Box { min: Vector3::zeros(), max: size.into() }
    }

    #[test]
    fn plates_and_beams_are_as_thin_as_they_are() {
        for n in 1..=6 {
            assert_eq!(found(&block([30.0, 20.0, n as f64]), None), [(1, n, 2)], "{n}");
            assert_eq!(found(&block([30.0, n as f64, 20.0]), Some(2)), [(1, n, 1)], "{n}");
        }
        assert_eq!(found(&block([30.0, 20.0, 7.0]), None), []);
        assert_eq!(found(&block([7.0, 7.0, 7.0]), None), []);
    }

    #[test]
    fn staircases_of_curved_surfaces_are_not_thin() {
        for radius in [5.3, 7.5, 10.0, 12.25, 20.0] {
            let sphere = Solid::Sphere { centre: Vector3::new(0.3, 0.1, 0.0), radius };
            assert_eq!(found(&sphere, None), [], "{radius}");
            for axis in [Vector3::z(), Vector3::new(1.0, 2.0, 3.0).normalize()] {
                let rod = Solid::Cylinder { centre: Vector3::zeros(), axis, radius, half_length: 1.5 * radius };
                assert_eq!(found(&rod, None), [], "{radius} {axis:?}");
            }
        }
    }

    #[test]
    fn holes_and_ligaments_are_found() {
        let hole = |x: f64, radius: f64| Solid::Cylinder {
            centre: Vector3::new(x, 20.0, 0.0),
            axis: Vector3::z(),
            radius,
            half_length: f64::INFINITY,
        };
        let with = |hole: Solid| Solid::Difference(Box::new(block([60.0, 40.0, 1.0])), vec![hole]);
        // A hole six nodes wide; one that is wide enough; one that leaves three nodes to the face.
        assert_eq!(found(&with(hole(30.0, 3.0)), Some(2))[0].0, 0);
        assert_eq!(found(&with(hole(30.0, 10.0)), Some(2)), []);
        assert_eq!(found(&with(hole(13.0, 10.0)), Some(2)), [(1, 3, 0)]);
    }
}
