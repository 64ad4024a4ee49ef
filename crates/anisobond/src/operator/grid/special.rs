//! Nodes whose bonds go to other stencils: one node at a time, its bonds in vectors.

use super::build::GridBonds;
use super::lanes::Lanes;
use super::law::{Constants, bonds, mean, stiffness, threshold};
use super::padded::Padded;
use super::real::Real;
use super::stencil::Lane;
use super::strip::Event;
use super::sweep::Law;
use crate::operator::Kinematics;

impl<T: Real> GridBonds<T> {
    /// Force on a node (N), and the half bonds of it that break.
    ///
    /// # Safety
    /// As [`Lanes`].
    #[inline(always)]
    pub(super) unsafe fn special_force<L: Lanes<T = T>>(
        &self,
        u: &Padded<T>,
        law: Law,
        row: usize,
        element: usize,
        events: &mut Vec<Event>,
    ) -> [T; 3] {
        let node = row * self.row_nodes() + element;
        let finite = law.kinematics == Kinematics::Finite;
        let branch = if finite { &self.half.branch } else { &self.half.direction };
        let mut force = [T::default(); 3];
        for from in (0..self.half.len()).step_by(L::N) {
            for ahead in [true, false] {
                let mut eta = [Lane::zero(), Lane::zero(), Lane::zero()];
                let (mut k, mut limit) = (Lane::zero(), Lane::zero());
                let mut here = 0u32;
                for lane in 0..L::N.min(self.half.len() - from) {
                    if let Some(found) = self.bond_of(u, finite, row, element, from + lane, ahead) {
                        here |= 1 << lane;
                        k.0[lane] = found.stiffness;
                        limit.0[lane] = found.threshold;
                        for a in 0..3 {
                            eta[a].0[lane] = found.eta[a];
                        }
                    }
                }
                // SAFETY: the arrays are aligned and as long as the widest vector; the tables are padded to it.
                let (pulls, over) = unsafe {
                    let constants = Constants {
                        branch: [
                            L::load(branch[0].slice().as_ptr().add(from)),
                            L::load(branch[1].slice().as_ptr().add(from)),
                            L::load(branch[2].slice().as_ptr().add(from)),
                        ],
                        per_square: L::load(self.half.per_square.slice().as_ptr().add(from)),
                        stiffness: L::load(k.0.as_ptr()),
                    };
                    let [x, y, z] = &eta;
                    let eta = [L::load(x.0.as_ptr()), L::load(y.0.as_ptr()), L::load(z.0.as_ptr())];
                    let [(measure, to, factor)] = match finite {
                        true => bonds::<L, true, 1>(&[eta], &constants),
                        false => bonds::<L, false, 1>(&[eta], &constants),
                    };
                    let over = match law.breaking {
                        true => L::bits(measure.above(L::load(limit.0.as_ptr()))) & here,
                        false => 0,
                    };
                    let pull = constants.stiffness.mul_where(factor, L::mask(here & !over));
                    ([pull.mul(to[0]), pull.mul(to[1]), pull.mul(to[2])], over)
                };
                for a in 0..3 {
                    let mut part = Lane::zero();
                    // SAFETY: aligned and as long as the widest vector.
                    unsafe { pulls[a].store(part.0.as_mut_ptr()) };
                    let sum = part.0[..L::N].iter().fold(T::default(), |sum, &x| sum + x);
                    force[a] = if ahead { force[a] + sum } else { force[a] - sum };
                }
                if ahead {
                    let lanes = (0..L::N).filter(|lane| over >> lane & 1 == 1);
                    events.extend(lanes.map(|lane| (node as u32, (from + lane) as u16)));
                }
            }
        }
        force
    }

    /// Half bond p from an element of a row, ahead (+ξ) or behind (−ξ, seen from its other end); `None` where it is
    /// absent or broken.
    #[inline]
    pub(super) fn bond_of(
        &self,
        u: &Padded<T>,
        finite: bool,
        row: usize,
        element: usize,
        p: usize,
        ahead: bool,
    ) -> Option<Found<T>> {
        let unbroken = if ahead { self.own_bit(row, element, p) } else { self.opposite_bit(row, element, p) };
        if !unbroken {
            return None;
        }
        let offset = if ahead { self.half.offset[p] } else { self.half.offset[p].map(|x| -x) };
        let layout = &*self.layout;
        let to = layout.row_at(row, [offset[1], offset[2]]);
        let slot = (layout.slot(element) as i64 + i64::from(offset[0]) * layout.lanes as i64) as usize;
        let other = to * self.row_nodes() + layout.element[slot] as usize;
        let node = row * self.row_nodes() + element;
        let (first, second) = if ahead { (node, other) } else { (other, node) };
        let (b, bonds) = (self.half.full[p], self.half.bonds);
        let of = |values: &[T]| {
            let at = |node: usize, bond: usize| values[(usize::from(self.stencil[node]) - 1) * bonds + bond];
            mean(at(first, b), at(second, self.half.opposite(b)))
        };
        let values = u.values.slice();
        let own = layout.slot(element);
        let eta = [0, 1, 2].map(|a| {
            let there = values[(3 * to + a) * layout.slots + slot];
            let here = values[(3 * row + a) * layout.slots + own];
            if ahead { there - here } else { here - there }
        });
        let threshold = threshold(finite, of(&self.critical), self.half.length.slice()[p]);
        let k = of(&self.stiffness);
        Some(Found { eta, k, stiffness: stiffness(finite, k, self.half.per_square.slice()[p]), threshold })
    }
}

/// An unbroken bond.
pub(super) struct Found<T> {
    /// Relative displacement (m), in the sense of +ξ.
    pub eta: [T; 3],
    /// k (N/m).
    pub k: T,
    /// What the factor of its force is multiplied by.
    pub stiffness: T,
    /// Measure of stretch above which it breaks.
    pub threshold: T,
}
