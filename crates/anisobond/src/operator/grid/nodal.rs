//! The nodal term ([`super::hybrid`]) a vector of nodes at a time, in two passes: P of all nodes, then forces.
//!
//! Where all bonds are there, Σ ω η⊗ξ = Σ ω (u₊ − u₋)⊗ξ and Σ ω (P_i + P_j) ξ = Σ ω (P₊ − P₋) ξ over half bonds, constant
//! stencils; elsewhere each bond counts where its bit is set, in these sums and in K = Σ ω ξ⊗ξ. Node by node only K⁻¹ is
//! applied, and only where it is not the bulk's.

use std::sync::atomic::Ordering;

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::build::GridBonds;
use super::kernels::{RowView, minus_bits, own_bits};
use super::lanes::{InstructionSet, Lanes};
use super::offsets::Offsets;
use super::padded::Padded;
use super::real::Real;
use super::stencil::Lane;
use crate::operator::Kinematics;
use crate::tensor::PAIRS;

/// A row of three fields.
type RowOf<'a, T> = ((&'a mut [T], &'a mut [T]), &'a mut [T]);

/// Nine numbers from nine.
type Map<T> = [[T; 9]; 9];

/// What P of a node with all bonds is, by stencil; `None` without a nodal term.
enum Whole<T> {
    /// P of Σ ω η⊗ξ, both row by row.
    Linear(Vec<Option<Map<T>>>),
    /// K⁻¹ (1/m²), and ΔV Z (N m) in Voigt's order and scaling.
    Finite([[T; 3]; 3], Vec<Option<[[T; 6]; 6]>>),
}

/// P of all nodes, and ω ξ.
pub struct Nodal<T: Real> {
    /// Rows of P (N/m), each a field of three components.
    pub pulls: [Padded<T>; 3],
    /// ω ξ (m) by half bond.
    weighted: Vec<[T; 3]>,
}

/// What bonds add to the sums of a node, by half bond.
struct Moments<T> {
    /// ω ξ (m).
    first: Vec<[T; 3]>,
    /// ω ξ⊗ξ (m²), in the order of [`PAIRS`].
    second: Vec<[T; 6]>,
}

/// A row whose P is to be found.
pub struct PullRow<'a, T: Real> {
    bonds: &'a GridBonds<T>,
    u: &'a Padded<T>,
    moments: &'a Moments<T>,
    kinematics: Kinematics,
    whole: &'a Whole<T>,
    row: usize,
    offsets: &'a Offsets,
}

impl<T: Real> GridBonds<T> {
    /// P of every node; `None` without nodal terms.
    pub(super) fn nodal(&self, u: &Padded<T>, kinematics: Kinematics) -> Option<Nodal<T>> {
        if !self.has_nodal_term() {
            return None;
        }
        let kept = self.nodal_scratch.lock().ok().and_then(|mut kept| kept.take());
        let mut pulls = kept.unwrap_or_else(|| std::array::from_fn(|_| self.padded()));
        let moments = self.moments();
        let whole = self.whole_nodes(kinematics);
        let size = 3 * self.layout.slots;
        let [x, y, z] =
            pulls.each_mut().map(|p| p.values.slice_mut()[..self.layout.rows() * size].par_chunks_mut(size));
        let of_row = |moved: &mut Offsets, (row, ((x, y), z)): (usize, RowOf<T>)| {
            let offsets = self.offsets_of(row, moved);
            let task = PullRow { bonds: self, u, moments: &moments, kinematics, whole: &whole, row, offsets };
            T::pulls(&task, [x, y, z]).f64()
        };
        let rows = x.zip(y).zip(z).enumerate().with_min_len(8).map_init(Offsets::default, of_row);
        let largest = rows.reduce(|| 0.0, f64::max);
        self.nodal_strain.store(largest.sqrt().to_bits(), Ordering::Relaxed);
        Some(Nodal { pulls, weighted: moments.first })
    }

    /// The largest ‖E‖ (–; ‖ε̄‖ with linear kinematics) of a node with a nodal term in the last pass for forces.
    pub fn largest_nodal_strain(&self) -> f64 {
        f64::from_bits(self.nodal_strain.load(Ordering::Relaxed))
    }

    /// What nodes with all bonds have in common.
    fn whole_nodes(&self, kinematics: Kinematics) -> Whole<T> {
        let inverse = &self.shape_inverse;
        let nodal = |s: usize| self.stencils[s].nodal.as_ref();
        let stencils = 0..self.stencils.len();
        if kinematics == Kinematics::Finite {
            let volume = self.body.grid.spacing.powi(3);
            let rows = std::array::from_fn(|i| std::array::from_fn(|j| T::of(inverse[(i, j)])));
            let of = |s: usize| {
                let voigt = nodal(s)?.voigt();
                Some(std::array::from_fn(|a| std::array::from_fn(|b| T::of(volume * voigt[(a, b)]))))
            };
            return Whole::Finite(rows, stencils.map(of).collect());
        }
        let map = |s: usize| {
            nodal(s).map(|z| {
                let mut map = [[T::default(); 9]; 9];
                for from in 0..9 {
                    let unit = Matrix3::from_fn(|i, j| f64::from(u8::from(3 * i + j == from)));
                    let (pull, _) = self.pull_of(kinematics, z.mandel(), &unit, inverse);
                    (0..9).for_each(|to| map[to][from] = T::of(pull[(to / 3, to % 3)]));
                }
                map
            })
        };
        Whole::Linear(stencils.map(map).collect())
    }

    /// ω ξ and ω ξ⊗ξ of the half bonds.
    fn moments(&self) -> Moments<T> {
        let of = |p: usize| (self.weight(p), self.half.xi[p]);
        let first = (0..self.half.len()).map(of).map(|(w, xi)| (w * xi).map(T::of).into());
        let second = (0..self.half.len()).map(of).map(|(w, xi)| PAIRS.map(|(a, b)| T::of(w * xi[a] * xi[b])));
        Moments { first: first.collect(), second: second.collect() }
    }

    /// Keep the memory for the next pass.
    pub(super) fn keep_nodal(&self, nodal: Option<Nodal<T>>) {
        if let (Some(nodal), Ok(mut kept)) = (nodal, self.nodal_scratch.lock()) {
            *kept = Some(nodal.pulls);
        }
    }

    /// Offsets of a row's neighbours.
    fn offsets_of<'a>(&'a self, row: usize, moved: &'a mut Offsets) -> &'a Offsets {
        let of_kind = &self.offsets[self.layout.kind(row)];
        if of_kind.inside {
            return of_kind;
        }
        of_kind.move_to(&self.layout, self.words, row, moved);
        moved
    }

    /// Whether all nodes at a position of a row have all their bonds, and are bulk.
    #[inline(always)]
    fn whole_at(&self, row: usize, j: usize) -> bool {
        self.whole[row * self.layout.length + j] && self.special_from[row] == self.special_from[row + 1]
    }

    /// P of the nodes of a row, and the largest ‖E‖² of them; of linear kinematics zero.
    ///
    /// # Safety
    /// As [`Lanes`]; the offsets are those of the row.
    #[inline(always)]
    unsafe fn pulls_in<L: Lanes<T = T>>(task: &PullRow<T>, to: [&mut [T]; 3]) -> T {
        let PullRow { bonds, u, moments, kinematics, whole, row, offsets } = *task;
        let (layout, n) = (&*bonds.layout, bonds.row_nodes());
        let view = bonds.view(u, row, offsets);
        let mut largest = T::default();
        for j in 0..layout.length {
            let mixture = bonds.mixture[row * layout.length + j];
            let uniform = mixture > 0 && bonds.mixtures[mixture as usize - 1].uniform;
            let place = (layout.reach[0] + j) * L::N;
            // SAFETY: the row has position j, and its neighbours are at the offsets; rows are aligned.
            unsafe {
                if uniform && bonds.whole_at(row, j) {
                    let sum = gradient::<L, false>(&view, j, &moments.first);
                    let stencil = usize::from(bonds.mixtures[mixture as usize - 1].stencils[0]) - 1;
                    let (pull, square) = match whole {
                        Whole::Linear(maps) => (mapped(&sum, maps[stencil].as_ref()), None),
                        Whole::Finite(inverse, stiffness) => objective(&sum, inverse, stiffness[stencil].as_ref()),
                    };
                    for k in 0..9 {
                        pull[k / 3][k % 3].store(to[k / 3].as_mut_ptr().add(k % 3 * layout.slots + place));
                    }
                    if let Some(square) = square {
                        let mut lanes = Lane::<T>::zero();
                        square.store(lanes.0.as_mut_ptr());
                        for lane in 0..L::N {
                            let e = lane * layout.length + j;
                            if e < n && bonds.stencil[row * n + e] > 0 {
                                largest = larger(largest, lanes.0[lane]);
                            }
                        }
                    }
                    continue;
                }
                let sum = gradient::<L, true>(&view, j, &moments.first);
                let shape = shape::<L>(&view, j, &moments.second);
                let mut lanes = [Lane::<T>::zero(); 9];
                for (k, lane) in lanes.iter_mut().enumerate() {
                    sum[k / 3][k % 3].store(lane.0.as_mut_ptr());
                }
                let mut shapes = [Lane::<T>::zero(); 6];
                for (k, lane) in shapes.iter_mut().enumerate() {
                    shape[k].store(lane.0.as_mut_ptr());
                }
                for lane in 0..L::N {
                    let e = lane * layout.length + j;
                    let node = row * n + e;
                    let z = if e < n { bonds.nodal_of(node) } else { None };
                    let (pull, square) = z.map_or((Matrix3::zeros(), 0.0), |z| {
                        let sum = Matrix3::from_fn(|a, b| lanes[3 * a + b].0[lane].f64());
                        let [xx, yy, zz, yz, xz, xy] = shapes.map(|k| k.0[lane].f64());
                        let shape = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                        bonds.pull_of(kinematics, z, &sum, &bonds.invert_shape(&shape))
                    });
                    largest = larger(largest, T::of(square));
                    for k in 0..9 {
                        to[k / 3][k % 3 * layout.slots + place + lane] = T::of(pull[(k / 3, k % 3)]);
                    }
                }
            }
        }
        to.into_iter().flat_map(|row| row.chunks_exact_mut(layout.slots)).for_each(|row| layout.refresh(row));
        largest
    }

    /// Add the forces Σ ω (P_i + P_j) ξ of a row's nodes to `natural`, with memory for a row's block and for one component.
    ///
    /// # Safety
    /// As [`Lanes`]; the offsets are those of the row, and the block is for one row.
    #[inline(always)]
    pub(super) unsafe fn add_nodal_forces<L: Lanes<T = T>>(
        &self,
        nodal: &Nodal<T>,
        row: usize,
        offsets: &Offsets,
        block: &mut [T],
        natural: &mut [Vec<T>; 3],
        one: &mut [T],
    ) {
        let (layout, n) = (&*self.layout, self.row_nodes());
        let [x, y, z] = &nodal.pulls;
        let views = [self.view(x, row, offsets), self.view(y, row, offsets), self.view(z, row, offsets)];
        let size = layout.length * L::N;
        for j in 0..layout.length {
            // SAFETY: the caller's contract.
            unsafe {
                let force = match self.whole_at(row, j) {
                    true => pulled::<L, false>(&views, j, &nodal.weighted),
                    false => pulled::<L, true>(&views, j, &nodal.weighted),
                };
                for a in 0..3 {
                    force[a].store(block.as_mut_ptr().add(a * size + j * L::N));
                }
            }
        }
        let stencils = &self.stencil[row * n..(row + 1) * n];
        for (natural, block) in natural.iter_mut().zip(block.chunks_exact(size)) {
            // SAFETY: the caller's contract; a block is as long as it must be.
            unsafe { L::natural_order(block, one) };
            for ((f, &add), _) in natural.iter_mut().zip(&*one).zip(stencils).filter(|(_, s)| **s > 0) {
                *f += add;
            }
        }
    }
}

/// The larger of two numbers.
#[inline(always)]
fn larger<T: Real>(a: T, b: T) -> T {
    if b.f64() > a.f64() { b } else { a }
}

/// P by its map; zero without one.
#[inline(always)]
unsafe fn mapped<L: Lanes>(sum: &[[L; 3]; 3], map: Option<&Map<L::T>>) -> [[L; 3]; 3] {
    // SAFETY: the caller's contract.
    unsafe {
        let mut pull = [[L::splat(L::T::default()); 3]; 3];
        if let Some(map) = map {
            for k in 0..9 {
                for (l, &m) in map[k].iter().enumerate() {
                    pull[k / 3][k % 3] = L::splat(m).mul_add(sum[l / 3][l % 3], pull[k / 3][k % 3]);
                }
            }
        }
        pull
    }
}

/// P = ΔV F̄ (Z:E) K⁻¹ and ‖E‖² of Σ ω η⊗ξ: F̄ = 1 + H, H = (Σ ω η⊗ξ) K⁻¹, E = ½(H + Hᵀ + HᵀH).
#[inline(always)]
unsafe fn objective<L: Lanes>(
    sum: &[[L; 3]; 3],
    inverse: &[[L::T; 3]; 3],
    stiffness: Option<&[[L::T; 6]; 6]>,
) -> ([[L; 3]; 3], Option<L>) {
    // SAFETY: the caller's contract.
    unsafe {
        let zero = [[L::splat(L::T::default()); 3]; 3];
        let Some(stiffness) = stiffness else { return (zero, None) };
        let h = times(sum, inverse);
        let half = L::splat(L::T::of(0.5));
        let mut strain = [L::splat(L::T::default()); 6];
        let mut square = L::splat(L::T::default());
        for (a, &(i, j)) in PAIRS.iter().enumerate() {
            let mut twice = h[i][j].add(h[j][i]);
            for k in 0..3 {
                twice = h[k][i].mul_add(h[k][j], twice);
            }
            // Voigt: normal components, and twice those of shear.
            strain[a] = if i == j { half.mul(twice) } else { twice };
            square = strain[a].mul_add(if i == j { strain[a] } else { half.mul(twice) }, square);
        }
        let mut stress = zero;
        for (a, &(i, j)) in PAIRS.iter().enumerate() {
            let mut s = L::splat(L::T::default());
            for b in 0..6 {
                s = L::splat(stiffness[a][b]).mul_add(strain[b], s);
            }
            (stress[i][j], stress[j][i]) = (s, s);
        }
        let mut nominal = stress;
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    nominal[i][j] = h[i][k].mul_add(stress[k][j], nominal[i][j]);
                }
            }
        }
        (times(&nominal, inverse), Some(square))
    }
}

/// A times a matrix of constants.
#[inline(always)]
unsafe fn times<L: Lanes>(a: &[[L; 3]; 3], b: &[[L::T; 3]; 3]) -> [[L; 3]; 3] {
    // SAFETY: the caller's contract.
    unsafe {
        let mut product = [[L::splat(L::T::default()); 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    product[i][j] = a[i][k].mul_add(L::splat(b[k][j]), product[i][j]);
                }
            }
        }
        product
    }
}

/// Σ ω η⊗ξ at position j.
#[inline(always)]
unsafe fn gradient<L: Lanes, const MASKED: bool>(row: &RowView<L::T>, j: usize, weighted: &[[L::T; 3]]) -> [[L; 3]; 3] {
    // SAFETY: the caller's contract.
    unsafe {
        let mut sum = [[L::splat(L::T::default()); 3]; 3];
        let u = row.u.add(j * L::N);
        for (p, w) in weighted.iter().enumerate() {
            let (plus, minus) = (u.offset(*row.plus.get_unchecked(p)), u.offset(*row.minus.get_unchecked(p)));
            for a in 0..3 {
                let (up, um) = (L::load(plus.add(a * row.slots)), L::load(minus.add(a * row.slots)));
                let eta = match MASKED {
                    true => {
                        let here = L::load(u.add(a * row.slots));
                        up.sub_where(here, own_bits::<L>(row, j, p)).add(here.sub_where(um, minus_bits::<L>(row, j, p)))
                    }
                    false => up.sub(um),
                };
                for b in 0..3 {
                    sum[a][b] = eta.mul_add(L::splat(w[b]), sum[a][b]);
                }
            }
        }
        sum
    }
}

/// K = Σ ω ξ⊗ξ at position j, in the order of [`PAIRS`].
#[inline(always)]
unsafe fn shape<L: Lanes>(row: &RowView<L::T>, j: usize, second: &[[L::T; 6]]) -> [L; 6] {
    // SAFETY: the caller's contract.
    unsafe {
        let mut sum = [L::splat(L::T::default()); 6];
        for (p, products) in second.iter().enumerate() {
            let (here, there) = (own_bits::<L>(row, j, p), minus_bits::<L>(row, j, p));
            for k in 0..6 {
                let product = L::splat(products[k]);
                sum[k] = sum[k].add(product.keep(here)).add(product.keep(there));
            }
        }
        sum
    }
}

/// Σ ω (P_i + P_j) ξ at position j, of the rows of P.
#[inline(always)]
unsafe fn pulled<L: Lanes, const MASKED: bool>(rows: &[RowView<L::T>; 3], j: usize, weighted: &[[L::T; 3]]) -> [L; 3] {
    // SAFETY: the caller's contract.
    unsafe {
        let mut force = [L::splat(L::T::default()); 3];
        for (p, w) in weighted.iter().enumerate() {
            for a in 0..3 {
                let row = &rows[a];
                let own = row.u.add(j * L::N);
                let (plus, minus) = (own.offset(*row.plus.get_unchecked(p)), own.offset(*row.minus.get_unchecked(p)));
                for b in 0..3 {
                    let (up, um) = (L::load(plus.add(b * row.slots)), L::load(minus.add(b * row.slots)));
                    let both = match MASKED {
                        true => {
                            let here = L::load(own.add(b * row.slots));
                            let ahead = here.add(up).keep(own_bits::<L>(row, j, p));
                            ahead.sub(here.add(um).keep(minus_bits::<L>(row, j, p)))
                        }
                        false => up.sub(um),
                    };
                    force[a] = both.mul_add(L::splat(w[b]), force[a]);
                }
            }
        }
        force
    }
}

/// P of a row's nodes and their largest ‖E‖². Called through [`Real`], so that it is compiled with this library.
#[inline(always)]
pub fn pulls<T: Real>(task: &PullRow<T>, to: [&mut [T]; 3]) -> T {
    match task.bonds.set {
        // SAFETY: the constructor refuses sets that the machine lacks; offsets are made for the row.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => unsafe { pulls_avx512(task, to) },
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { pulls_avx2(task, to) },
        // SAFETY: portable vectors need nothing.
        _ => unsafe { GridBonds::pulls_in::<T::Portable>(task, to) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl,avx2,fma")]
unsafe fn pulls_avx512<T: Real>(task: &PullRow<T>, to: [&mut [T]; 3]) -> T {
    // SAFETY: the caller's machine has the instruction set.
    unsafe { GridBonds::pulls_in::<T::Avx512>(task, to) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn pulls_avx2<T: Real>(task: &PullRow<T>, to: [&mut [T]; 3]) -> T {
    // SAFETY: the caller's machine has the instruction set.
    unsafe { GridBonds::pulls_in::<T::Avx2>(task, to) }
}
