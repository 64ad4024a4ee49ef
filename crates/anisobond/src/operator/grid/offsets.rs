//! Where neighbours of a row are in the kernels' memory.

use super::layout::Layout;
use super::real::Real;
use super::stencil::HalfBonds;

/// Offsets by half bond, from a row on: numbers at +ξ and −ξ, and words of bits at −ξ.
#[derive(Clone, Debug, Default)]
pub struct Offsets {
    /// At +ξ.
    pub plus: Vec<isize>,
    /// At −ξ.
    pub minus: Vec<isize>,
    /// Bits at −ξ.
    pub minus_bits: Vec<isize>,
    /// The row they are of.
    row: usize,
    /// Which of them, at +ξ and −ξ, lead to the row of zeros: these alone differ between rows of the same kind.
    outside: [Vec<bool>; 2],
    /// Whether none does.
    pub inside: bool,
}

impl Offsets {
    /// Those of a row.
    fn of_row<T: Real>(layout: &Layout, half: &HalfBonds<T>, words: usize, row: usize) -> Self {
        let mut offsets = Offsets { row, ..Offsets::default() };
        let (slots, words) = (layout.slots as isize, words as isize);
        for p in 0..half.len() {
            let [dx, dy, dz] = half.offset[p];
            let [plus, minus] = [[dy, dz], [-dy, -dz]].map(|offset| layout.row_at(row, offset));
            offsets.outside[0].push(plus == layout.rows());
            offsets.outside[1].push(minus == layout.rows());
            let [plus, minus] = [plus, minus].map(|to| to as isize - row as isize);
            let along = dx as isize * layout.lanes as isize;
            offsets.plus.push(plus * 3 * slots + along);
            offsets.minus.push(minus * 3 * slots - along);
            offsets.minus_bits.push((minus * layout.positions() as isize - dx as isize) * words + p as isize);
        }
        offsets.inside = !offsets.outside.iter().flatten().any(|&outside| outside);
        offsets
    }

    /// Those of each kind of rows ([`Layout::kind`]).
    pub fn by_kind<T: Real>(layout: &Layout, half: &HalfBonds<T>, words: usize) -> Vec<Self> {
        let mut offsets = vec![None; layout.kinds()];
        for row in 0..layout.rows() {
            offsets[layout.kind(row)].get_or_insert_with(|| Offsets::of_row(layout, half, words, row));
        }
        offsets.into_iter().flatten().collect()
    }

    /// Those of another row of the same kind.
    pub fn move_to(&self, layout: &Layout, words: usize, row: usize, to: &mut Offsets) {
        let rows = self.row as isize - row as isize;
        let (numbers, bits) = (rows * (3 * layout.slots) as isize, rows * (words * layout.positions()) as isize);
        let shifted = |from: &[isize], outside: &[bool], by: isize, to: &mut Vec<isize>| {
            to.clear();
            to.extend(from.iter().zip(outside).map(|(from, &outside)| from + by * isize::from(outside)));
        };
        shifted(&self.plus, &self.outside[0], numbers, &mut to.plus);
        shifted(&self.minus, &self.outside[1], numbers, &mut to.minus);
        shifted(&self.minus_bits, &self.outside[1], bits, &mut to.minus_bits);
    }
}
