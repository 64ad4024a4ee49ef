//! Forces of bonds, row by row.
//!
//! Finite kinematics: total and exact. A bond at rest has direction n₀ and length ℓ₀; its ends turn it into p_a = R_a n₀
//! and p_b = R_b n₀, m = ½(p_a + p_b), and its branch is l = ℓ₀ n₀ + u_b − u_a, n = l/ℓ. With τ = m − (n·m) n its energy is
//!
//! U = ½ k_n (ℓ − ℓ₀)² + ½ k_t ℓ ℓ₀ |τ|²,
//!
//! which no rigid motion changes at any angle. On particle a: force (k_n (ℓ − ℓ₀) + ½ k_t ℓ₀ |τ|²) n − k_t ℓ₀ (n·m) τ and
//! moment −½ k_t ℓ ℓ₀ p_a×τ; on b the opposite force and −½ k_t ℓ ℓ₀ p_b×τ, so that l×F balances the moments exactly.
//!
//! The factor ℓ ℓ₀ makes the law agree, to second order in strain, with the incremental shear force of discrete element
//! codes (grown by k_t times the slip at the current length, turned with the bond): at −1 % the document's packing gives
//! 103.797 103.095 43.929 MPa by either; ℓ₀² gives 103.825 103.123 43.947, ℓ² 103.769 103.068 43.911. Unlike the
//! incremental law it has an energy and no memory.
//!
//! Linear kinematics (THEORY section 5): Δ = u_b − u_a − ½ ℓ₀ (θ_a + θ_b)×n₀, force k_t Δ + (k_n − k_t)(n₀·Δ) n₀, moment
//! ½ ℓ₀ k_t n₀×Δ on both.

use rayon::prelude::*;

use super::gather::Others;
use super::pose::Pose;
use super::rows::{Block, BlockStrength, LANES, NO_BOND, Rows};
use super::three::Three;
use crate::operator::Kinematics;
use crate::operator::grid::ahead::{LINE, ask};
use crate::operator::grid::lanes::{Avx2, Avx512, InstructionSet, Lanes, Portable};

/// Force (N) and moment (N·m) on a particle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub(crate) struct Load {
    pub force: [f64; 3],
    pub moment: [f64; 3],
}

/// Sums over bonds.
#[derive(Clone, Debug, Default)]
pub(super) struct RowSums {
    /// Energy (J).
    pub energy: f64,
    /// Σ F⊗l (J), rows 11 12 13 21 …
    pub virial: [f64; 9],
    /// Half bonds that broke: (bond, energy that it held).
    pub broken: Vec<(u32, f64)>,
}

/// Particles per piece of work; sums are taken piece by piece in their order, so that threads do not change them.
const CHUNK: usize = 128;

/// How many blocks ahead of the one at work are asked for, and how many ahead the poses that they lead to.
const BLOCKS_AHEAD: usize = 16;
const POSES_AHEAD: usize = 4;

/// What the kernel reads.
#[derive(Clone, Copy)]
pub(super) struct At<'a> {
    pub rows: &'a Rows,
    /// Particles, then copies of periodic images: as many as the rows' numbers reach.
    pub poses: &'a [Pose],
    pub kinematics: Kinematics,
    /// Whether Σ F⊗l is summed.
    pub virial: bool,
    /// Whether bonds leave the linear law in compression beyond their tensile strength, too.
    pub yields: bool,
}

/// Forces and moments of all bonds on particles, and their sums.
pub(super) fn forces(at: &At, loads: &mut [Load]) -> RowSums {
    if loads.len() <= CHUNK {
        // Small bodies are not worth waking other threads; the sums are those of one piece either way.
        let mut sums = RowSums::default();
        piece(at, 0, loads, &mut sums);
        return sums;
    }
    let pieces: Vec<RowSums> = loads
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(chunk, loads)| {
            let mut sums = RowSums::default();
            piece(at, chunk * CHUNK, loads, &mut sums);
            sums
        })
        .collect();
    let mut total = RowSums::default();
    for sums in pieces {
        total.energy += sums.energy;
        total.virial.iter_mut().zip(sums.virial).for_each(|(t, s)| *t += s);
        total.broken.extend(sums.broken);
    }
    total
}

/// Particles first … first + loads.len(), with the widest vectors of the processor. Those use fused multiply-add, so that
/// instruction sets differ by rounding.
pub(super) fn piece(at: &At, first: usize, loads: &mut [Load], sums: &mut RowSums) {
    match InstructionSet::best() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has the features that the function was compiled for.
        InstructionSet::Avx512 => unsafe { with_avx512(at, first, loads, sums) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        InstructionSet::Avx2 => unsafe { with_avx2(at, first, loads, sums) },
        // SAFETY: portable vectors need nothing.
        _ => unsafe { all_rows::<Portable<f64, 4>>(at, first, loads, sums) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl,avx2,fma")]
fn with_avx512(at: &At, first: usize, loads: &mut [Load], sums: &mut RowSums) {
    // SAFETY: this function is compiled for the set.
    unsafe { all_rows::<Avx512<f64>>(at, first, loads, sums) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2(at: &At, first: usize, loads: &mut [Load], sums: &mut RowSums) {
    // SAFETY: this function is compiled for the set.
    unsafe { all_rows::<Avx2<f64>>(at, first, loads, sums) }
}

/// # Safety
/// The processor has the instruction set of L.
#[inline(always)]
unsafe fn all_rows<L: Lanes<T = f64>>(at: &At, first: usize, loads: &mut [Load], sums: &mut RowSums) {
    // SAFETY: the caller's contract; loads and stores are within blocks, which are aligned to 64 bytes and hold 8 numbers,
    // of which L takes a part that divides them.
    unsafe {
        let mut all = Totals::<L> { energy: L::splat(0.0), virial: [Three::zero(); 3] };
        for (i, load) in loads.iter_mut().enumerate() {
            row(at, first + i, load, &mut all, sums);
        }
        // Every bond was met twice.
        sums.energy += 0.5 * total(all.energy);
        for i in 0..3 {
            for j in 0..3 {
                sums.virial[3 * i + j] += 0.5 * total(all.virial[i].0[j]);
            }
        }
    }
}

/// Sums over rows.
struct Totals<L> {
    energy: L,
    virial: [Three<L>; 3],
}

/// The row of one particle.
///
/// # Safety
/// As [`all_rows`].
#[inline(always)]
unsafe fn row<L: Lanes<T = f64>>(at: &At, particle: usize, load: &mut Load, all: &mut Totals<L>, sums: &mut RowSums) {
    let rows = at.rows;
    // SAFETY: the caller's contract.
    unsafe {
        let own = Own::<L>::new(&at.poses[particle]);
        let (mut force, mut moment) = (Three::zero(), Three::zero());
        for number in rows.start[particle] as usize..rows.start[particle + 1] as usize {
            let block = &rows.blocks[number];
            look_ahead(at, number);
            let others = Others::gather::<L>(at.poses, &block.to);
            for part in (0..LANES).step_by(L::N) {
                let mut some = match at.kinematics {
                    Kinematics::Finite => finite(block, part, &own, &others),
                    Kinematics::Linear => linear(block, part, &own, &others),
                };
                if let Some(strength) = rows.strength.get(number) {
                    weed_broken(&mut some, block, part, (strength, at.yields), sums);
                }
                all.energy = all.energy.add(some.energy);
                force = force.add(some.force);
                moment = moment.add(some.moment);
                if at.virial {
                    for i in 0..3 {
                        all.virial[i] = all.virial[i].add_times(some.force.0[i], some.branch);
                    }
                }
            }
        }
        for i in 0..3 {
            load.force[i] = total(force.0[i]);
            load.moment[i] = total(moment.0[i]);
        }
    }
}

/// Ask for the memory of blocks to come and of the poses at their other ends. The processor does not foresee them: rows are
/// short, and poses lie where the curve has them. It doubles the speed of bodies beyond the caches.
#[inline(always)]
fn look_ahead(at: &At, number: usize) {
    let rows = at.rows;
    let block = rows.blocks.as_ptr().wrapping_add(number + BLOCKS_AHEAD);
    for line in 0..size_of::<Block>() / LINE {
        ask(block as usize, line);
    }
    if !rows.strength.is_empty() {
        let strength = rows.strength.as_ptr().wrapping_add(number + BLOCKS_AHEAD);
        for line in 0..size_of::<BlockStrength>() / LINE {
            ask(strength as usize, line);
        }
    }
    if let Some(block) = rows.blocks.get(number + POSES_AHEAD) {
        for &to in &block.to {
            // A pose is one line.
            ask(at.poses.as_ptr() as usize, to as usize);
        }
    }
}

/// The particle's own pose, in all lanes.
struct Own<L> {
    u: Three<L>,
    /// Vector part of the quaternion, or θ.
    v: Three<L>,
    w: L,
}

impl<L: Lanes<T = f64>> Own<L> {
    /// # Safety
    /// The instruction set of L.
    #[inline(always)]
    unsafe fn new(pose: &Pose) -> Self {
        // SAFETY: the caller's contract.
        unsafe {
            let (u, v) = (&pose.displacement, &pose.turn);
            Own {
                u: Three([L::splat(u[0]), L::splat(u[1]), L::splat(u[2])]),
                v: Three([L::splat(v[0]), L::splat(v[1]), L::splat(v[2])]),
                w: L::splat(v[3]),
            }
        }
    }
}

/// What some half bonds do to their particle.
struct Halves<L> {
    force: Three<L>,
    moment: Three<L>,
    branch: Three<L>,
    energy: L,
    /// Normal force, tension positive, and squared shear force (N, N²).
    normal: L,
    shear_squared: L,
}

/// # Safety
/// As [`all_rows`].
#[inline(always)]
unsafe fn finite<L: Lanes<T = f64>>(block: &Block, part: usize, own: &Own<L>, others: &Others) -> Halves<L> {
    // SAFETY: the caller's contract.
    unsafe {
        let (n0, l0) = (Three::load(&block.n, part), L::load(&block.length[part]));
        let d = Three::load(&others.displacement, part).sub(own.u);
        let rest = n0.times(l0);
        let l = rest.add(d);
        let length = l.dot(l).sqrt();
        // ℓ − ℓ₀ = d·(l + l₀)/(ℓ + ℓ₀) keeps the digits of small strains; one division serves 1/ℓ too.
        let sum = length.add(l0);
        let inverse = L::splat(1.0).div(length.mul(sum));
        let stretch = d.dot(l.add(rest)).mul(length.mul(inverse));
        let n = l.times(sum.mul(inverse));
        let pa = turned(own.v, own.w, n0);
        let pb = turned(Three::load4(&others.turn, part), L::load(&others.turn[3][part]), n0);
        let half = L::splat(0.5);
        let m = pa.add(pb).times(half);
        let nm = n.dot(m);
        let t = m.sub_times(nm, n);
        let tt = t.dot(t);
        let (kn, kt) = (L::load(&block.kn[part]), L::load(&block.kt[part]).mul(l0));
        let half_kt = half.mul(kt);
        let elastic = kn.mul(stretch);
        let normal = half_kt.mul_add(tt, elastic);
        let shear = kt.mul(nm);
        let arm = half_kt.mul(length);
        Halves {
            force: n.times(normal).sub_times(shear, t),
            // −½ k_t ℓ ℓ₀ p_a×τ.
            moment: t.cross(pa).times(arm),
            branch: l,
            energy: half.mul(elastic).mul_add(stretch, arm.mul(tt)),
            normal,
            shear_squared: shear.mul(shear).mul(tt),
        }
    }
}

/// R n₀ = n₀ + w t + v×t, t = 2 v×n₀, of unit quaternions (v, w).
///
/// # Safety
/// As [`all_rows`].
#[inline(always)]
unsafe fn turned<L: Lanes<T = f64>>(v: Three<L>, w: L, n: Three<L>) -> Three<L> {
    // SAFETY: the caller's contract.
    unsafe {
        let t = v.cross(n);
        let t = t.add(t);
        n.add_times(w, t).add(v.cross(t))
    }
}

/// # Safety
/// As [`all_rows`].
#[inline(always)]
unsafe fn linear<L: Lanes<T = f64>>(block: &Block, part: usize, own: &Own<L>, others: &Others) -> Halves<L> {
    // SAFETY: the caller's contract.
    unsafe {
        let (n, length) = (Three::load(&block.n, part), L::load(&block.length[part]));
        let half = L::splat(0.5);
        let arm = half.mul(length);
        let d = Three::load(&others.displacement, part).sub(own.u);
        let turn = Three::load4(&others.turn, part).add(own.v);
        let slip = d.sub_times(arm, turn.cross(n));
        let stretch = n.dot(slip);
        let t = slip.sub_times(stretch, n);
        let tt = t.dot(t);
        let (kn, kt) = (L::load(&block.kn[part]), L::load(&block.kt[part]));
        let normal = kn.mul(stretch);
        Halves {
            force: n.times(normal).add_times(kt, t),
            moment: n.cross(t).times(arm.mul(kt)),
            branch: n.times(length),
            energy: half.mul(normal.mul_add(stretch, kt.mul(tt))),
            normal,
            shear_squared: kt.mul(kt).mul(tt),
        }
    }
}

/// Bonds above their strength are not the rows' from now on, and are reported.
///
/// # Safety
/// As [`all_rows`].
#[inline(always)]
unsafe fn weed_broken<L: Lanes<T = f64>>(
    some: &mut Halves<L>,
    block: &Block,
    part: usize,
    (strength, yields): (&BlockStrength, bool),
    sums: &mut RowSums,
) {
    // SAFETY: the caller's contract.
    unsafe {
        let hold = some.normal.neg_mul_add(L::load(&strength.slope[part]), L::load(&strength.cohesion[part]));
        let tension = L::load(&strength.tension[part]);
        let mut pulled = L::bits(some.normal.above(tension));
        if yields {
            pulled |= L::bits(L::splat(0.0).sub(some.normal).above(tension));
        }
        let sheared = L::bits(some.shear_squared.above(hold.mul(hold)));
        // Shear beyond a limit below zero breaks even if it is zero.
        let over = pulled | sheared | L::bits(L::splat(0.0).above(hold));
        if over != 0 {
            report_broken(&energies(some.energy), block, part, over, sums);
            let whole = L::mask(!over);
            some.energy = some.energy.keep(whole);
            some.force = some.force.keep(whole);
            some.moment = some.moment.keep(whole);
        }
    }
}

/// # Safety
/// The instruction set of L.
#[inline(always)]
unsafe fn energies<L: Lanes<T = f64>>(energy: L) -> [f64; LANES] {
    let mut numbers = Aligned([0.0; LANES]);
    // SAFETY: the caller's contract; eight aligned numbers hold any vector.
    unsafe { energy.store(numbers.0.as_mut_ptr()) };
    numbers.0
}

#[cold]
#[inline(never)]
fn report_broken(energy: &[f64; LANES], block: &Block, part: usize, over: u32, sums: &mut RowSums) {
    for l in (0..LANES - part).filter(|l| over >> l & 1 == 1) {
        let lane = part + l;
        let carries = block.kn[lane] > 0.0 || block.kt[lane] > 0.0;
        if carries && block.bond[lane] != NO_BOND {
            sums.broken.push((block.bond[lane], energy[l]));
        }
    }
}

#[repr(align(64))]
struct Aligned([f64; LANES]);

/// Sum over the lanes, in pairs.
///
/// # Safety
/// The instruction set of L.
#[inline(always)]
unsafe fn total<L: Lanes<T = f64>>(v: L) -> f64 {
    // SAFETY: the caller's contract.
    let v = unsafe { energies(v) };
    ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]))
}
