//! Where a grid's nodes are in the kernels' memory.
//!
//! A row of n₁ nodes is cut into W parts of length L = ⌈n₁/W⌉ (at least
//! as long as kernels take it together), one per lane of a vector: lane l holds elements l·L … l·L + L − 1.
//! Slot (j, l) holds element l·L + j, for −m ≤ j < L + m with m the reach of the neighbourhood along the row; slots of
//! positions j < 0 and j ≥ L repeat the neighbouring lanes (or the other end of a periodic row, or hold zero). The
//! neighbours at an offset of all elements of a vector are then one aligned vector, of position j + offset of another row.

use std::ops::Range;

use super::kernels::TOGETHER;
use crate::lattice::Grid;

/// Bytes of a core's second cache that displacements of a strip and of its neighbours may take; rows of a strip at least.
const CACHE: usize = 450 << 10;
const LEAST_ROWS: usize = 8;

/// No element, or no row.
pub const NONE: u32 = u32::MAX;

/// Where nodes are.
#[derive(Debug)]
pub struct Layout {
    /// Nodes along each axis.
    pub nodes: [usize; 3],
    /// W.
    pub lanes: usize,
    /// L.
    pub length: usize,
    /// Reach of the neighbourhood along each axis.
    pub reach: [usize; 3],
    /// Slots of a row: (L + 2m) W, and W more where L + 2m is even, so that the first vectors of rows are spread over all
    /// sets of the cache.
    pub slots: usize,
    /// Element of each slot of a row, [`NONE`] beyond a free end.
    pub element: Vec<u32>,
    /// Slots of each element of a row, its own first: `copies[first[e]..first[e + 1]]`.
    copies: Vec<u32>,
    first: Vec<u32>,
    /// Place of each row along the second and third axis.
    place: Vec<[u32; 2]>,
    /// Slots that repeat another, and that other.
    repeated: Vec<[u32; 2]>,
    /// Rows that are taken together, neighbours along the second axis; by place along that axis, then the third.
    pub strips: Vec<Range<usize>>,
    /// Strips in the order in which their neighbours stay in the cache from one to the next: along the third axis first.
    pub order: Vec<usize>,
    /// Place along the second and third axis after wrapping, for −reach ≤ place < n + reach; [`NONE`] outside.
    wrapped: [Vec<u32>; 2],
}

impl Layout {
    /// The layout of a grid for vectors of so many lanes of numbers of so many bytes.
    pub fn new(grid: &Grid, reach: [usize; 3], lanes: usize, bytes: usize) -> Self {
        let nodes = grid.nodes;
        let length = nodes[0].div_ceil(lanes).max(TOGETHER);
        let positions = length + 2 * reach[0];
        let slots = (positions | 1) * lanes;
        let wrap = |at: i64, axis: usize| match grid.periodic[axis] {
            true => at.rem_euclid(nodes[axis] as i64) as u32,
            false if (0..nodes[axis] as i64).contains(&at) => at as u32,
            false => NONE,
        };
        let element: Vec<u32> = (0..slots)
            .map(|slot| match slot / lanes {
                position if position < positions => {
                    wrap((slot % lanes * length + position) as i64 - reach[0] as i64, 0)
                }
                _ => NONE,
            })
            .collect();
        // Planes that neighbours are in, each with as many rows more as they reach.
        let held = CACHE / ((2 * reach[2] + 1) * 3 * slots * bytes);
        let columns = nodes[1].div_ceil(held.saturating_sub(2 * reach[1]).max(LEAST_ROWS));
        let rows = nodes[1].div_ceil(columns);
        let strips: Vec<Range<usize>> = (0..nodes[2])
            .flat_map(|z| (0..nodes[1]).step_by(rows).map(move |y| (y, z)))
            .map(|(y, z)| z * nodes[1] + y..z * nodes[1] + nodes[1].min(y + rows))
            .collect();
        let mut order: Vec<usize> = (0..strips.len()).collect();
        order.sort_unstable_by_key(|&s| (strips[s].start % nodes[1], strips[s].start));
        let wrapped = [1, 2].map(|axis| {
            (0..nodes[axis] + 2 * reach[axis]).map(|at| wrap(at as i64 - reach[axis] as i64, axis)).collect()
        });
        let mut layout = Layout {
            nodes,
            lanes,
            length,
            reach,
            slots,
            element,
            copies: vec![],
            first: vec![0],
            repeated: vec![],
            strips,
            order,
            place: (0..nodes[1] * nodes[2]).map(|row| [row % nodes[1], row / nodes[1]].map(|x| x as u32)).collect(),
            wrapped,
        };
        for e in 0..nodes[0] {
            let own = layout.slot(e);
            layout.copies.push(own as u32);
            let others = (0..slots).filter(|&s| s != own && layout.element[s] == e as u32);
            layout.copies.extend(others.map(|s| s as u32));
            layout.first.push(layout.copies.len() as u32);
        }
        for e in 0..nodes[0] {
            let own = layout.slot(e) as u32;
            let others: Vec<[u32; 2]> = layout.copies(e)[1..].iter().map(|&to| [to, own]).collect();
            layout.repeated.extend(others);
        }
        layout.repeated.sort_unstable();
        layout
    }

    /// Vectors of a row, those that repeat others included.
    pub fn positions(&self) -> usize {
        self.slots / self.lanes
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.nodes[1] * self.nodes[2]
    }

    /// The own slot of an element of a row.
    pub fn slot(&self, element: usize) -> usize {
        (element % self.length + self.reach[0]) * self.lanes + element / self.length
    }

    /// All slots of an element, its own first.
    pub fn copies(&self, element: usize) -> &[u32] {
        &self.copies[self.first[element] as usize..self.first[element + 1] as usize]
    }

    /// The row at an offset along the second and third axis from a row; outside the grid the row of zeros, which is
    /// stored behind all others.
    pub fn row_at(&self, row: usize, [dy, dz]: [i32; 2]) -> usize {
        let at = |place: usize, offset: i32, axis: usize| {
            self.wrapped[axis - 1][(place as i64 + i64::from(offset) + self.reach[axis] as i64) as usize]
        };
        let [y, z] = self.place[row];
        match (at(y as usize, dy, 1), at(z as usize, dz, 2)) {
            (NONE, _) | (_, NONE) => self.rows(),
            (y, z) => y as usize + self.nodes[1] * z as usize,
        }
    }

    /// Number of kinds of rows.
    pub fn kinds(&self) -> usize {
        self.kinds_along(1) * self.kinds_along(2)
    }

    fn kinds_along(&self, axis: usize) -> usize {
        self.nodes[axis].min(2 * self.reach[axis] + 1)
    }

    /// The kind of a row: rows of a kind have their neighbours at the same distances; they are as far from the grid's faces,
    /// or farther than they reach.
    pub fn kind(&self, row: usize) -> usize {
        let [_, n2, _] = self.nodes;
        let along = |at: usize, axis: usize| {
            let left = self.nodes[axis] - 1 - at;
            match self.kinds_along(axis) {
                kinds if left < self.reach[axis].min(kinds - 1) => kinds - 1 - left,
                _ => at.min(self.reach[axis]),
            }
        };
        along(row % n2, 1) + self.kinds_along(1) * along(row / n2, 2)
    }

    /// Fill the copies of a row's elements from their own slots; slots of no element stay zero.
    pub fn refresh<T: Copy>(&self, row: &mut [T]) {
        for &[to, from] in &self.repeated {
            row[to as usize] = row[from as usize];
        }
    }

    /// Write a row's elements, given in natural order, to all their slots.
    pub fn spread<T: Copy>(&self, natural: &[T], row: &mut [T]) {
        let own = &mut row[self.reach[0] * self.lanes..];
        for (lane, part) in natural.chunks(self.length).enumerate() {
            for (to, &from) in own[lane..].iter_mut().step_by(self.lanes).zip(part) {
                *to = from;
            }
        }
        self.refresh(row);
    }

    /// Read a row's elements in natural order from a block of L·W slots without copies.
    pub fn collect<T: Copy>(&self, block: &[T], natural: &mut [T]) {
        for (lane, part) in natural.chunks_mut(self.length).enumerate() {
            for (to, &from) in part.iter_mut().zip(block[lane..].iter().step_by(self.lanes)) {
                *to = from;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn layout(nodes: [usize; 3], reach: usize, lanes: usize, periodic: bool) -> Layout {
        let grid = Grid::new(nodes, 1.0, Vector3::zeros(), [periodic; 3]).unwrap();
        Layout::new(&grid, [reach; 3], lanes, 8)
    }

    #[test]
    fn neighbours_along_a_row_are_whole_vectors_apart() {
        for periodic in [false, true] {
            for (n, reach, lanes) in [(1, 3, 4), (5, 1, 8), (9, 3, 8), (16, 2, 8), (17, 4, 16), (64, 3, 8)] {
                let layout = layout([n, 3, 2], reach, lanes, periodic);
                for e in 0..n {
                    for d in -(reach as i64)..=reach as i64 {
                        let slot = layout.slot(e) as i64 + d * lanes as i64;
                        let to = e as i64 + d;
                        let expected = match periodic {
                            true => to.rem_euclid(n as i64) as u32,
                            false if (0..n as i64).contains(&to) => to as u32,
                            false => NONE,
                        };
                        assert_eq!(layout.element[slot as usize], expected, "{n} {reach} {lanes}: {e} {d}");
                    }
                    assert!(layout.copies(e).iter().all(|&s| layout.element[s as usize] == e as u32));
                }
                let numbers: Vec<u32> = (0..n as u32).collect();
                assert_eq!(layout.slots / lanes % 2, 1);
                let mut row = vec![NONE; layout.slots];
                layout.spread(&numbers, &mut row);
                assert_eq!(row, layout.element);
                let inner = &row[reach * lanes..(reach + layout.length) * lanes];
                let mut back = vec![0; n];
                layout.collect(inner, &mut back);
                assert_eq!(back, numbers);
            }
        }
    }

    #[test]
    fn rows_wrap_or_end() {
        let (free, periodic) = (layout([4, 3, 2], 3, 4, false), layout([4, 3, 2], 3, 4, true));
        assert_eq!(free.row_at(1, [1, 1]), 5);
        assert_eq!(free.row_at(1, [-2, 0]), 6);
        assert_eq!(periodic.row_at(1, [-2, 0]), 2);
        assert_eq!(periodic.row_at(0, [-3, 3]), 3);
    }
    #[test]
    fn rows_of_a_kind_have_neighbours_at_the_same_distances() {
        for (n, reach) in [(1, 3), (2, 3), (4, 3), (5, 2), (6, 3), (7, 3), (12, 3)] {
            let grid = Grid::new([4, n, 9], 1.0, Vector3::zeros(), [true; 3]).unwrap();
            let layout = Layout::new(&grid, [reach; 3], 4, 8);
            let mut seen = vec![None; layout.kinds()];
            for row in 0..layout.rows() {
                let to = |dy| (-3..=3).map(move |dz| [dy, dz]);
                let distances: Vec<i64> = (-(reach as i32)..=reach as i32)
                    .flat_map(to)
                    .filter(|[_, dz]| dz.unsigned_abs() as usize <= reach)
                    .map(|offset| layout.row_at(row, offset) as i64 - row as i64)
                    .collect();
                assert_eq!(*seen[layout.kind(row)].get_or_insert(distances.clone()), distances, "{n} {reach} {row}");
            }
            assert!(seen.iter().all(Option::is_some));
        }
    }
}
