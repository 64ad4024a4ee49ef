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

use super::pose::Pose;
use super::rows::{Block, BlockStrength, LANES, NO_BOND, Rows};
use crate::operator::Kinematics;

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

/// Eight numbers.
type V = [f64; LANES];
type V3 = [V; 3];

/// Forces and moments of all bonds on particles, and their sums.
pub(super) fn forces(rows: &Rows, poses: &[Pose], kinematics: Kinematics, loads: &mut [Load]) -> RowSums {
    if loads.len() <= CHUNK {
        // Small bodies are not worth waking other threads; the sums are those of one piece either way.
        let mut sums = RowSums::default();
        piece(rows, poses, kinematics, 0, loads, &mut sums);
        return sums;
    }
    let pieces: Vec<RowSums> = loads
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(chunk, loads)| {
            let mut sums = RowSums::default();
            piece(rows, poses, kinematics, chunk * CHUNK, loads, &mut sums);
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

/// Particles first … first + loads.len(), with the widest vectors of the processor. Without fused multiply-add, so that
/// bits do not depend on the processor.
pub(super) fn piece(
    rows: &Rows,
    poses: &[Pose],
    kinematics: Kinematics,
    first: usize,
    loads: &mut [Load],
    sums: &mut RowSums,
) {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has the features that the function was compiled for.
            return unsafe { with_avx512(rows, poses, kinematics, first, loads, sums) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { with_avx2(rows, poses, kinematics, first, loads, sums) };
        }
    }
    each_row(rows, poses, kinematics, first, loads, sums);
}

/// [`each_row`] with 512-bit vectors.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn with_avx512(rows: &Rows, poses: &[Pose], kin: Kinematics, first: usize, loads: &mut [Load], sums: &mut RowSums) {
    each_row(rows, poses, kin, first, loads, sums);
}

/// [`each_row`] with 256-bit vectors.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2(rows: &Rows, poses: &[Pose], kin: Kinematics, first: usize, loads: &mut [Load], sums: &mut RowSums) {
    each_row(rows, poses, kin, first, loads, sums);
}

#[inline(always)]
fn each_row(rows: &Rows, poses: &[Pose], kin: Kinematics, first: usize, loads: &mut [Load], sums: &mut RowSums) {
    match (kin, rows.strength.is_empty()) {
        (Kinematics::Linear, true) => all_rows::<false, false>(rows, poses, first, loads, sums),
        (Kinematics::Linear, false) => all_rows::<false, true>(rows, poses, first, loads, sums),
        (Kinematics::Finite, true) => all_rows::<true, false>(rows, poses, first, loads, sums),
        (Kinematics::Finite, false) => all_rows::<true, true>(rows, poses, first, loads, sums),
    }
}

#[inline(always)]
fn all_rows<const FINITE: bool, const BREAKS: bool>(
    rows: &Rows,
    poses: &[Pose],
    first: usize,
    loads: &mut [Load],
    sums: &mut RowSums,
) {
    let mut energy = [0.0; LANES];
    let mut virial = [[0.0; LANES]; 9];
    for (i, load) in loads.iter_mut().enumerate() {
        let particle = first + i;
        let (mut force, mut moment) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for number in rows.start[particle] as usize..rows.start[particle + 1] as usize {
            let block = &rows.blocks[number];
            let mut half = if FINITE { finite(block, poses, particle) } else { linear(block, poses, particle) };
            if BREAKS {
                weed_broken(&mut half, block, &rows.strength[number], sums);
            }
            for l in 0..LANES {
                energy[l] += half.energy[l];
            }
            for i in 0..3 {
                for l in 0..LANES {
                    force[i][l] += half.force[i][l];
                    moment[i][l] += half.moment[i][l];
                }
                for j in 0..3 {
                    for l in 0..LANES {
                        virial[3 * i + j][l] += half.force[i][l] * half.branch[j][l];
                    }
                }
            }
        }
        for i in 0..3 {
            load.force[i] = total(&force[i]);
            load.moment[i] = total(&moment[i]);
        }
    }
    // Every bond was met twice.
    sums.energy += 0.5 * total(&energy);
    for (sum, v) in sums.virial.iter_mut().zip(&virial) {
        *sum += 0.5 * total(v);
    }
}

/// What eight half bonds do to their particle.
struct Eight {
    force: V3,
    moment: V3,
    branch: V3,
    energy: V,
    /// Normal force, tension positive, and squared shear force (N, N²).
    normal: V,
    shear_squared: V,
}

#[inline(always)]
fn finite(block: &Block, poses: &[Pose], particle: usize) -> Eight {
    let own = &poses[particle];
    let mut d = [[0.0; LANES]; 3];
    let mut q = [[0.0; LANES]; 4];
    for l in 0..LANES {
        let other = &poses[block.to[l] as usize];
        for i in 0..3 {
            d[i][l] = other.displacement[i];
        }
        for i in 0..4 {
            q[i][l] = other.turn[i];
        }
    }
    for i in 0..3 {
        for l in 0..LANES {
            d[i][l] -= own.displacement[i];
        }
    }
    let n0 = &block.n;
    let qa = own.turn.map(|x| [x; LANES]);
    let pa = turned(&qa, n0);
    let pb = turned(&q, n0);
    let mut e = Eight {
        force: [[0.0; LANES]; 3],
        moment: [[0.0; LANES]; 3],
        branch: [[0.0; LANES]; 3],
        energy: [0.0; LANES],
        normal: [0.0; LANES],
        shear_squared: [0.0; LANES],
    };
    for l in 0..LANES {
        let l0 = block.length[l];
        let (n0x, n0y, n0z) = (n0[0][l], n0[1][l], n0[2][l]);
        let (dx, dy, dz) = (d[0][l], d[1][l], d[2][l]);
        let (lx, ly, lz) = (l0 * n0x + dx, l0 * n0y + dy, l0 * n0z + dz);
        let length = (lx * lx + ly * ly + lz * lz).sqrt();
        // ℓ² − ℓ₀² = d·(l + l₀), which keeps the digits of small strains.
        let square = dx * (lx + l0 * n0x) + dy * (ly + l0 * n0y) + dz * (lz + l0 * n0z);
        let stretch = square / (length + l0);
        let per = 1.0 / length;
        let (nx, ny, nz) = (lx * per, ly * per, lz * per);
        let mx = 0.5 * (pa[0][l] + pb[0][l]);
        let my = 0.5 * (pa[1][l] + pb[1][l]);
        let mz = 0.5 * (pa[2][l] + pb[2][l]);
        let nm = nx * mx + ny * my + nz * mz;
        let (tx, ty, tz) = (mx - nm * nx, my - nm * ny, mz - nm * nz);
        let tt = tx * tx + ty * ty + tz * tz;
        let kt = block.kt[l] * l0;
        let half = 0.5 * kt;
        let normal = block.kn[l] * stretch + half * tt;
        let shear = -kt * nm;
        e.force[0][l] = normal * nx + shear * tx;
        e.force[1][l] = normal * ny + shear * ty;
        e.force[2][l] = normal * nz + shear * tz;
        let half = -half * length;
        e.moment[0][l] = half * (pa[1][l] * tz - pa[2][l] * ty);
        e.moment[1][l] = half * (pa[2][l] * tx - pa[0][l] * tz);
        e.moment[2][l] = half * (pa[0][l] * ty - pa[1][l] * tx);
        e.branch[0][l] = lx;
        e.branch[1][l] = ly;
        e.branch[2][l] = lz;
        e.energy[l] = 0.5 * (block.kn[l] * stretch * stretch + kt * length * tt);
        e.normal[l] = normal;
        e.shear_squared[l] = shear * shear * tt;
    }
    e
}

/// R n₀ = n₀ + w t + v×t, t = 2 v×n₀, of unit quaternions (v, w).
#[inline(always)]
fn turned(q: &[V; 4], n: &V3) -> V3 {
    let mut p = [[0.0; LANES]; 3];
    for l in 0..LANES {
        let (x, y, z, w) = (q[0][l], q[1][l], q[2][l], q[3][l]);
        let (nx, ny, nz) = (n[0][l], n[1][l], n[2][l]);
        let (tx, ty, tz) = (2.0 * (y * nz - z * ny), 2.0 * (z * nx - x * nz), 2.0 * (x * ny - y * nx));
        p[0][l] = nx + w * tx + (y * tz - z * ty);
        p[1][l] = ny + w * ty + (z * tx - x * tz);
        p[2][l] = nz + w * tz + (x * ty - y * tx);
    }
    p
}

#[inline(always)]
fn linear(block: &Block, poses: &[Pose], particle: usize) -> Eight {
    let own = &poses[particle];
    let mut d = [[0.0; LANES]; 3];
    let mut t = [[0.0; LANES]; 3];
    for l in 0..LANES {
        let other = &poses[block.to[l] as usize];
        for i in 0..3 {
            d[i][l] = other.displacement[i] - own.displacement[i];
            t[i][l] = other.turn[i] + own.turn[i];
        }
    }
    let mut e = Eight {
        force: [[0.0; LANES]; 3],
        moment: [[0.0; LANES]; 3],
        branch: [[0.0; LANES]; 3],
        energy: [0.0; LANES],
        normal: [0.0; LANES],
        shear_squared: [0.0; LANES],
    };
    for l in 0..LANES {
        let (nx, ny, nz) = (block.n[0][l], block.n[1][l], block.n[2][l]);
        let half = 0.5 * block.length[l];
        let sx = d[0][l] - half * (t[1][l] * nz - t[2][l] * ny);
        let sy = d[1][l] - half * (t[2][l] * nx - t[0][l] * nz);
        let sz = d[2][l] - half * (t[0][l] * ny - t[1][l] * nx);
        let stretch = nx * sx + ny * sy + nz * sz;
        let (tx, ty, tz) = (sx - stretch * nx, sy - stretch * ny, sz - stretch * nz);
        let tt = tx * tx + ty * ty + tz * tz;
        let (normal, kt) = (block.kn[l] * stretch, block.kt[l]);
        e.force[0][l] = normal * nx + kt * tx;
        e.force[1][l] = normal * ny + kt * ty;
        e.force[2][l] = normal * nz + kt * tz;
        let arm = half * kt;
        e.moment[0][l] = arm * (ny * tz - nz * ty);
        e.moment[1][l] = arm * (nz * tx - nx * tz);
        e.moment[2][l] = arm * (nx * ty - ny * tx);
        e.branch[0][l] = block.length[l] * nx;
        e.branch[1][l] = block.length[l] * ny;
        e.branch[2][l] = block.length[l] * nz;
        e.energy[l] = 0.5 * (normal * stretch + kt * tt);
        e.normal[l] = normal;
        e.shear_squared[l] = kt * kt * tt;
    }
    e
}

/// Bonds above their strength carry nothing from now on, and are reported.
#[inline(always)]
fn weed_broken(e: &mut Eight, block: &Block, strength: &BlockStrength, sums: &mut RowSums) {
    let mut any = false;
    let mut over = [false; LANES];
    for l in 0..LANES {
        let hold = strength.cohesion[l] - e.normal[l] * strength.slope[l];
        // Not only `above`: shear beyond a limit below zero breaks even if it is zero.
        over[l] = e.normal[l] > strength.tension[l] || hold < 0.0 || e.shear_squared[l] > hold * hold;
        any |= over[l];
    }
    if any {
        report_broken(e, block, &over, sums);
    }
}

#[cold]
#[inline(never)]
fn report_broken(e: &mut Eight, block: &Block, over: &[bool; LANES], sums: &mut RowSums) {
    for l in (0..LANES).filter(|&l| over[l]) {
        let carries = block.kn[l] > 0.0 || block.kt[l] > 0.0;
        if carries && block.bond[l] != NO_BOND {
            sums.broken.push((block.bond[l], e.energy[l]));
        }
        e.energy[l] = 0.0;
        for i in 0..3 {
            (e.force[i][l], e.moment[i][l]) = (0.0, 0.0);
        }
    }
}

/// Sum of eight, in pairs.
#[inline(always)]
fn total(v: &V) -> f64 {
    ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]))
}
