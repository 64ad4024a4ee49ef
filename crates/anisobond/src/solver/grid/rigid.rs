//! Rigid motions of a coarse grid's parts that no spring holds, and where to ground them.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector};

use super::hexahedra::Hexahedra;

/// Motions that springs resist by less than this share of the stiffest are free.
const FREE: f64 = 1e-12;

/// Springs to ground (node, component, N/m), as few as hold the free rigid motions of every part. As many as there are
/// motions, they carry nothing of loads that balance: such loads are answered exactly, and a motion of the part comes on top.
pub(super) fn grounds(grid: &Hexahedra) -> Vec<(usize, usize, f64)> {
    let elements: Vec<[u32; 8]> = grid.filled().map(|(_, corners, _)| corners).collect();
    let mut around = vec![Vec::new(); grid.len()];
    for (e, corners) in elements.iter().enumerate() {
        corners.iter().for_each(|c| around[*c as usize].push(e as u32));
    }
    let blocks = grid.diagonals();
    let mut seen: Vec<Option<[i64; 3]>> = vec![None; grid.len()];
    let mut grounds = Vec::new();
    for start in 0..grid.len() {
        if seen[start].is_none() && !around[start].is_empty() {
            let part = Part::walk(start, &elements, &around, &mut seen);
            grounds.extend(part.grounds(grid, &blocks));
        }
    }
    grounds
}

/// Nodes that elements hold together.
struct Part {
    nodes: Vec<usize>,
    /// Places, unwrapped along periodic axes.
    at: Vec<[i64; 3]>,
    /// Axes along which the part leads back to itself.
    goes_around: [bool; 3],
}

impl Part {
    /// From a node, element by element.
    fn walk(start: usize, elements: &[[u32; 8]], around: &[Vec<u32>], seen: &mut [Option<[i64; 3]>]) -> Self {
        let mut part = Part { nodes: Vec::new(), at: Vec::new(), goes_around: [false; 3] };
        seen[start] = Some([0; 3]);
        let mut queue = VecDeque::from([(start, [0i64; 3])]);
        while let Some((node, at)) = queue.pop_front() {
            part.nodes.push(node);
            part.at.push(at);
            for &e in &around[node] {
                let corners = &elements[e as usize];
                for own in (0..8).filter(|l| corners[*l] as usize == node) {
                    for (l, &corner) in corners.iter().enumerate() {
                        let there = [0, 1, 2].map(|a| at[a] + (l >> a & 1) as i64 - (own >> a & 1) as i64);
                        match seen[corner as usize] {
                            Some(known) => (0..3).for_each(|a| part.goes_around[a] |= known[a] != there[a]),
                            None => {
                                seen[corner as usize] = Some(there);
                                queue.push_back((corner as usize, there));
                            }
                        }
                    }
                }
            }
        }
        part
    }

    fn grounds(&self, grid: &Hexahedra, blocks: &[[[f64; 3]; 3]]) -> Vec<(usize, usize, f64)> {
        let motions = self.motions(grid);
        let spring = |row: usize| grid.support[self.nodes[row / 3]][row % 3];
        // Orthonormal motions, then those that the springs do not resist.
        let (unit, scale) = eigenvectors(&(motions.transpose() * &motions), |value, most| value > FREE * most);
        let unit = &motions * DMatrix::from_fn(unit.nrows(), unit.ncols(), |r, c| unit[(r, c)] / scale[c].sqrt());
        let held = DMatrix::from_fn(unit.nrows(), unit.ncols(), |r, c| unit[(r, c)] * spring(r));
        let (free, _) = eigenvectors(&(unit.transpose() * held), |value, most| value <= FREE * most);
        let mut rows = unit * free;
        let mut grounds = Vec::new();
        for _ in 0..rows.ncols() {
            let Some(row) = (0..rows.nrows()).max_by(|a, b| rows.row(*a).norm().total_cmp(&rows.row(*b).norm())) else {
                break;
            };
            let direction = rows.row(row).normalize();
            let along = &rows * direction.transpose();
            rows -= along * direction;
            grounds.push((self.nodes[row / 3], row % 3, blocks[self.nodes[row / 3]][row % 3][row % 3]));
        }
        grounds
    }

    /// Translations and rotations, a column each; about an axis only where the part does not go around the others.
    fn motions(&self, grid: &Hexahedra) -> DMatrix<f64> {
        let n = self.nodes.len();
        let edge = grid.edges.iter().copied().fold(0.0, f64::max);
        let arms: Vec<[f64; 3]> =
            self.at.iter().map(|at| [0, 1, 2].map(|a| at[a] as f64 * grid.edges[a] / edge)).collect();
        let centre = [0, 1, 2].map(|a| arms.iter().map(|p| p[a]).sum::<f64>() / n as f64);
        let size = arms.iter().flat_map(|p| (0..3).map(|a| (p[a] - centre[a]).abs())).fold(1.0, f64::max);
        let turns = (0..3).filter(|a| (0..3).all(|b| b == *a || !self.goes_around[b]));
        let mut columns: Vec<DVector<f64>> =
            (0..3).map(|a| DVector::from_fn(3 * n, |row, _| if row % 3 == a { 1.0 } else { 0.0 })).collect();
        columns.extend(turns.map(|a| {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            DVector::from_fn(3 * n, |row, _| {
                let arm = |axis: usize| (arms[row / 3][axis] - centre[axis]) / size;
                if row % 3 == c {
                    arm(b)
                } else if row % 3 == b {
                    -arm(c)
                } else {
                    0.0
                }
            })
        }));
        DMatrix::from_columns(&columns)
    }
}

/// Eigenvectors of a symmetric matrix whose eigenvalues, given the largest, are wanted, with those.
fn eigenvectors(matrix: &DMatrix<f64>, wanted: impl Fn(f64, f64) -> bool) -> (DMatrix<f64>, Vec<f64>) {
    let eigen = matrix.clone().symmetric_eigen();
    let most = eigen.eigenvalues.amax();
    let keep: Vec<usize> = (0..eigen.eigenvalues.len()).filter(|i| wanted(eigen.eigenvalues[*i], most)).collect();
    (eigen.eigenvectors.select_columns(&keep), keep.iter().map(|i| eigen.eigenvalues[*i]).collect())
}

#[cfg(test)]
mod tests {
    use super::super::hexahedra::{Filling, Part as Share};
    use super::*;
    use crate::tensor::Stiffness;

    /// A block alone is grounded at six components, a plate in plane strain at four, a tube at four, a block of which two
    /// opposite corners are held at one (it turns about the line through them), and one that a face holds nowhere.
    #[test]
    fn as_many_grounds_as_free_motions() {
        let steel = [Stiffness::isotropic(40e9, 40e9)];
        let count = |elements: [usize; 3], wraps: [bool; 3], held: &dyn Fn(usize, usize) -> bool| {
            let nodes = [0, 1, 2].map(|a| elements[a] + usize::from(!wraps[a]));
            let mut filling = Filling::empty(elements.iter().product(), Vec::new());
            filling.parts.iter_mut().for_each(|parts| parts.push(Share { region: 0, weight: 1.0 }));
            let n: usize = nodes.iter().product();
            let support = (0..n).map(|node| if held(node, n) { [1e9; 3] } else { [0.0; 3] }).collect();
            let grid = Hexahedra::new(nodes, elements, [1.0, 2.0, 1.0], filling, support, &steel);
            let grounds = grounds(&grid);
            assert!(grounds.iter().all(|g| g.2 > 0.0));
            grounds.len()
        };
        let none = |_: usize, _: usize| false;
        assert_eq!(count([3, 2, 4], [false; 3], &none), 6);
        assert_eq!(count([3, 1, 4], [false, true, false], &none), 4);
        assert_eq!(count([5, 3, 4], [false, true, false], &none), 4);
        assert_eq!(count([3, 2, 4], [false; 3], &|node, n| node == 0 || node + 1 == n), 1);
        assert_eq!(count([3, 2, 4], [false; 3], &|node, _| node < 12), 0);
    }
}
