//! Nodes whose bonds go to other stencils: one node at a time, its bonds in vectors.

use super::aligned::Aligned;
use super::build::GridBonds;
use super::lanes::Lanes;
use super::law::{Constants, bonds};
use super::offsets::Offsets;
use super::padded::Padded;
use super::real::Real;
use super::stencil::{Lane, MOST_LANES};
use super::strip::Event;
use super::surroundings::Surrounding;
use super::sweep::Law;
use crate::operator::Kinematics;

/// Neighbours' displacements of one node: three components by half bond at +ξ, then at −ξ, each in whole vectors.
pub(super) struct Ends<T: Real> {
    values: Aligned<T>,
    padded: usize,
}

impl<T: Real> Ends<T> {
    /// Of so many half bonds.
    pub fn new(half: usize) -> Self {
        let padded = half.next_multiple_of(MOST_LANES);
        Ends { values: Aligned::zeros(6 * padded), padded }
    }

    /// Those of the node at a slot of a row.
    ///
    /// # Safety
    /// The offsets are those of the row.
    #[inline(always)]
    unsafe fn gather(&mut self, u: &Padded<T>, slot: usize, offsets: &Offsets) {
        let (padded, slots) = (self.padded, u.layout.slots);
        let to = self.values.slice_mut();
        for (ahead, offsets) in [&offsets.plus, &offsets.minus].into_iter().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|a| (3 * ahead + a) * padded);
            for (p, &offset) in offsets.iter().enumerate() {
                // SAFETY: every slot of an element has its neighbours' at the same offsets, in memory; p < padded.
                unsafe {
                    let from = u.values.slice().as_ptr().add(slot).offset(offset);
                    *to.get_unchecked_mut(x + p) = *from;
                    *to.get_unchecked_mut(y + p) = *from.add(slots);
                    *to.get_unchecked_mut(z + p) = *from.add(2 * slots);
                }
            }
        }
    }
}

impl<T: Real> GridBonds<T> {
    /// Force on the special node at a place of the list (N), and the half bonds of it that break. `offsets` are those of
    /// its row.
    ///
    /// # Safety
    /// As [`Lanes`], and the offsets are those of the row.
    #[inline(always)]
    pub(super) unsafe fn special_force<L: Lanes<T = T>>(
        &self,
        u: &Padded<T>,
        law: Law,
        place: usize,
        offsets: &Offsets,
        ends: &mut Ends<T>,
        events: &mut Vec<Event>,
    ) -> [T; 3] {
        let (node, n, slots) = (self.special[place], self.row_nodes(), self.layout.slots);
        let slot = 3 * (node as usize / n) * slots + self.layout.slot(node as usize % n);
        let finite = law.kinematics == Kinematics::Finite;
        let geometry = if finite { &self.half.branch } else { &self.half.direction };
        let Surrounding { stiffness, critical, unbroken } = self.surroundings.at(place);
        // SAFETY: tables, displacements of the ends and bits are aligned and as long as whole vectors of all half bonds.
        unsafe {
            ends.gather(u, slot, offsets);
            let here = [0, 1, 2].map(|a| u.values.slice()[slot + a * slots]);
            let here = [L::splat(here[0]), L::splat(here[1]), L::splat(here[2])];
            let two = L::splat(T::of(2.0));
            let mut force = [L::splat(T::default()); 3];
            for from in (0..self.half.len()).step_by(L::N) {
                let [x, y, z] = geometry;
                let branch = [
                    L::load(x.slice().as_ptr().add(from)),
                    L::load(y.slice().as_ptr().add(from)),
                    L::load(z.slice().as_ptr().add(from)),
                ];
                let per_square = L::load(self.half.per_square.slice().as_ptr().add(from));
                let length = L::load(self.half.length.slice().as_ptr().add(from));
                for behind in 0..2 {
                    let at = behind * ends.padded + from;
                    let bits = u32::from(unbroken[at / MOST_LANES]) >> (at % MOST_LANES);
                    let mut there = L::mask(bits & (u32::MAX >> (32 - L::N)));
                    // The bond at −ξ is seen from its other end: the same numbers there and here.
                    let mut eta = here;
                    for a in 0..3 {
                        let end = L::load(ends.values.slice().as_ptr().add((3 * behind + a) * ends.padded + from));
                        eta[a] = if behind == 0 { end.sub(here[a]) } else { here[a].sub(end) };
                    }
                    let mut k = L::load(stiffness.as_ptr().add(at));
                    if finite {
                        k = k.mul(per_square);
                    }
                    let constants = Constants { branch, per_square, stiffness: k };
                    let [(measure, to, factor)] = match finite {
                        true => bonds::<L, true, 1>(&[eta], &constants),
                        false => bonds::<L, false, 1>(&[eta], &constants),
                    };
                    if law.breaking {
                        // As `law::threshold`.
                        let c = L::load(critical.as_ptr().add(at));
                        let limit = match finite {
                            true => c.mul(c.add(two)).mul(length.mul(length)),
                            false => c.mul(length),
                        };
                        let over = L::both(there, measure.above(limit));
                        there = L::but_not(there, over);
                        if behind == 0 && L::bits(over) != 0 {
                            let lanes = (0..L::N).filter(|lane| L::bits(over) >> lane & 1 == 1);
                            events.extend(lanes.map(|lane| (node, (from + lane) as u16)));
                        }
                    }
                    let pull = k.mul_where(factor, there);
                    for a in 0..3 {
                        force[a] = match behind {
                            0 => pull.mul_add(to[a], force[a]),
                            _ => pull.neg_mul_add(to[a], force[a]),
                        };
                    }
                }
            }
            let mut sums = [T::default(); 3];
            for a in 0..3 {
                let mut part = Lane::zero();
                force[a].store(part.0.as_mut_ptr());
                sums[a] = part.0[..L::N].iter().fold(T::default(), |sum, &x| sum + x);
            }
            sums
        }
    }

    /// Half bond p from an element of a row, ahead (+ξ) or behind (−ξ, seen from its other end); `None` where it is
    /// absent or broken.
    #[inline]
    pub(super) fn bond_of(&self, u: &Padded<T>, row: usize, element: usize, p: usize, ahead: bool) -> Option<Found<T>> {
        let unbroken = if ahead { self.own_bit(row, element, p) } else { self.opposite_bit(row, element, p) };
        if !unbroken {
            return None;
        }
        let offset = if ahead { self.half.offset[p] } else { self.half.offset[p].map(|x| -x) };
        let layout = &*self.layout;
        let to = layout.row_at(row, [offset[1], offset[2]]);
        let slot = (layout.slot(element) as i64 + i64::from(offset[0]) * layout.lanes as i64) as usize;
        let [k, _] = self.constants_of(row * self.row_nodes() + element, p, ahead);
        let values = u.values.slice();
        let own = layout.slot(element);
        let eta = [0, 1, 2].map(|a| {
            let there = values[(3 * to + a) * layout.slots + slot];
            let here = values[(3 * row + a) * layout.slots + own];
            if ahead { there - here } else { here - there }
        });
        Some(Found { eta, k })
    }
}

/// An unbroken bond.
pub(super) struct Found<T> {
    /// Relative displacement (m), in the sense of +ξ.
    pub eta: [T; 3],
    /// k (N/m).
    pub k: T,
}
