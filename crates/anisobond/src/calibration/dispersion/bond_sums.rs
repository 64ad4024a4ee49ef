//! Sums over the bonds of a grid at several wave vectors at once.
//!
//! With phases φ = k·ξ = Σₐ offsetₐ kₐΔ every sum is of one of two kinds, over one of ξ and −ξ:
//! even, as Σ w (2 − 2 cos φ), and odd, Σ v sin φ. Several wave vectors side by side (`L` lanes) let the compiler use the
//! processor's vectors.

use nalgebra::{Matrix3, Vector3};

/// Half the bonds of a node, sorted by third, second, first offset.
#[derive(Clone, Debug)]
pub struct BondSums {
    offsets: Vec<[i32; 3]>,
    weights: Vec<[f64; 6]>,
    reach: usize,
}

/// A complex number (cos, sin) in every lane.
pub type Turn<const L: usize> = ([f64; L], [f64; L]);

impl BondSums {
    /// Offsets of half the bonds and the weight of their even sum (symmetric matrix, 11 22 33 23 13 12).
    pub fn new(offsets: Vec<[i32; 3]>, weights: Vec<[f64; 6]>) -> Self {
        let reach = offsets.iter().flatten().map(|x| x.unsigned_abs()).max().unwrap_or(0) as usize;
        BondSums { offsets, weights, reach }
    }

    /// The bonds of length up to a reach.
    pub fn within(&self, reach: usize) -> Self {
        let square = (reach * reach) as i32;
        let short =
            self.offsets.iter().zip(&self.weights).filter(|(o, _)| o.iter().map(|x| x * x).sum::<i32>() <= square);
        let (offsets, weights) = short.unzip();
        BondSums::new(offsets, weights)
    }

    /// The weights of the bonds.
    pub fn weights(&self) -> &[[f64; 6]] {
        &self.weights
    }

    /// The offsets of half the bonds.
    pub fn offsets(&self) -> &[[i32; 3]] {
        &self.offsets
    }

    /// Largest offset along an axis.
    pub fn reach(&self) -> usize {
        self.reach
    }

    /// Σ w f with an even function f of sin(φ/2) and cos(φ/2).
    pub fn even<const L: usize>(
        &self,
        powers: &HalfPhases<L>,
        weights: &[[f64; 6]],
        f: impl Fn(f64, f64) -> f64,
    ) -> [Matrix3<f64>; L] {
        let mut sum = [[0.0; L]; 6];
        self.each(powers, |bond, (cos_row, sin_row), (cos, sin)| {
            let factor: [f64; L] = std::array::from_fn(|l| {
                let s = sin_row[l] * cos[l] + cos_row[l] * sin[l];
                let c = cos_row[l] * cos[l] - sin_row[l] * sin[l];
                f(s, c)
            });
            for (sum, w) in sum.iter_mut().zip(&weights[bond]) {
                for l in 0..L {
                    sum[l] += w * factor[l];
                }
            }
        });
        let [xx, yy, zz, yz, xz, xy] = sum;
        std::array::from_fn(|l| Matrix3::new(xx[l], xy[l], xz[l], xy[l], yy[l], yz[l], xz[l], yz[l], zz[l]))
    }

    /// Σ v sin φ = Σ v 2 sin(φ/2) cos(φ/2).
    pub fn odd<const L: usize>(&self, powers: &HalfPhases<L>, vectors: &[Vector3<f64>]) -> [Vector3<f64>; L] {
        let mut sum = [[0.0; L]; 3];
        self.each(powers, |bond, (cos_row, sin_row), (cos, sin)| {
            let factor: [f64; L] = std::array::from_fn(|l| {
                let s = sin_row[l] * cos[l] + cos_row[l] * sin[l];
                let c = cos_row[l] * cos[l] - sin_row[l] * sin[l];
                2.0 * s * c
            });
            for (sum, v) in sum.iter_mut().zip(vectors[bond].iter()) {
                for l in 0..L {
                    sum[l] += v * factor[l];
                }
            }
        });
        std::array::from_fn(|l| Vector3::new(sum[0][l], sum[1][l], sum[2][l]))
    }

    /// Call with every bond's number, exp(iφ/2) of its second and third offsets, and of its first.
    #[inline(always)]
    pub fn each<const L: usize>(&self, powers: &HalfPhases<L>, mut f: impl FnMut(usize, &Turn<L>, &Turn<L>)) {
        let mut row = ([1.0; L], [0.0; L]);
        let mut of = None;
        for (bond, &[i, j, k]) in self.offsets.iter().enumerate() {
            if of != Some((j, k)) {
                of = Some((j, k));
                row = times(powers.at(1, j), powers.at(2, k));
            }
            f(bond, &row, powers.at(0, i));
        }
    }
}

/// exp(iφ/2) of the offsets of a grid along each axis.
pub struct HalfPhases<const L: usize> {
    reach: usize,
    /// exp(i j phase/2), j = −reach…reach, one row per axis.
    rows: Vec<Turn<L>>,
}

impl<const L: usize> HalfPhases<L> {
    /// Of phases kₐΔ along the grid's axes: powers of exp(i phase/2).
    pub fn new(phases: &[Vector3<f64>; L], reach: usize) -> Self {
        let width = 2 * reach + 1;
        let mut rows = vec![([1.0; L], [0.0; L]); 3 * width];
        for axis in 0..3 {
            let turns = phases.map(|phase| (0.5 * phase[axis]).sin_cos());
            let one = (turns.map(|(_, cos)| cos), turns.map(|(sin, _)| sin));
            let middle = axis * width + reach;
            for j in 1..=reach {
                let (cos, sin) = times(&rows[middle + j - 1], &one);
                rows[middle + j] = (cos, sin);
                rows[middle - j] = (cos, sin.map(|s| -s));
            }
        }
        HalfPhases { reach, rows }
    }

    fn at(&self, axis: usize, offset: i32) -> &Turn<L> {
        &self.rows[axis * (2 * self.reach + 1) + (offset + self.reach as i32) as usize]
    }
}

/// Product of complex numbers, lane by lane.
fn times<const L: usize>(a: &Turn<L>, b: &Turn<L>) -> Turn<L> {
    (
        std::array::from_fn(|l| a.0[l] * b.0[l] - a.1[l] * b.1[l]),
        std::array::from_fn(|l| a.0[l] * b.1[l] + a.1[l] * b.0[l]),
    )
}
