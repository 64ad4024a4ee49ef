//! The columns of X, collapsed: bonds that always carry the same share of the solution are one ray.

use nalgebra::{Cholesky, Const, SMatrix};

use crate::tensor::Quartic;

/// Rays per block: a vector register's lanes.
const LANES: usize = 8;

/// A number per ray, in blocks of [`LANES`].
pub type PerRay = Vec<[f64; LANES]>;

/// 15×15 symmetric matrix over quartic coordinates.
pub type QuarticMatrix = SMatrix<f64, 15, 15>;

/// Relative size below which an eigenvalue of Σ v vᵀ is zero: the rays do not reach that direction.
const RANK: f64 = 1e-12;

/// A set of rays v (unit quartics n⊗n⊗n⊗n in orthonormal coordinates) with a share s and a weight w each: a ray of
/// value c adds w s c v to the tensor and w c²/2 to the norm to be made small.
///
/// The coordinates are those of the rays' own span (dimension [`Rays::rank`]), zero-padded to 15.
pub struct Rays {
    rank: usize,
    /// Orthonormal basis of the span in its first `rank` columns; `None` when the span is everything.
    basis: Option<QuarticMatrix>,
    /// Rows v, one per ray, for rank-one updates.
    rows: Vec<[f64; 15]>,
    /// The same numbers in blocks, for sums over all rays.
    blocks: Vec<[[f64; LANES]; 15]>,
    share: PerRay,
    /// Zero in the padding of the last block, so that padding never counts.
    weight: PerRay,
    gram: QuarticMatrix,
    gram_factor: Cholesky<f64, Const<15>>,
}

/// Number of blocks that hold `count` rays.
fn blocks_of(count: usize) -> usize {
    count.div_ceil(LANES)
}

/// Spread a list over blocks, padded with zeros.
fn in_blocks(values: &[f64]) -> PerRay {
    let mut out = vec![[0.0; LANES]; blocks_of(values.len())];
    for (i, &x) in values.iter().enumerate() {
        out[i / LANES][i % LANES] = x;
    }
    out
}

impl Rays {
    /// From unit quartics, shares and weights (all positive).
    pub fn new(quartics: &[Quartic], share: &[f64], weight: &[f64]) -> Self {
        let (basis, rank) = span(quartics);
        let rows: Vec<[f64; 15]> = quartics
            .iter()
            .map(|v| match &basis {
                None => (*v).into(),
                Some(u) => (u.transpose() * v).into(),
            })
            .collect();
        let mut blocks = vec![[[0.0; LANES]; 15]; blocks_of(rows.len())];
        for (i, row) in rows.iter().enumerate() {
            for k in 0..15 {
                blocks[i / LANES][k][i % LANES] = row[k];
            }
        }
        let mut gram = QuarticMatrix::zeros();
        for (i, row) in rows.iter().enumerate() {
            add_outer(&mut gram, row, weight[i] * share[i] * share[i]);
        }
        let gram_factor = factor(&gram, rank);
        Rays { rank, basis, rows, blocks, share: in_blocks(share), weight: in_blocks(weight), gram, gram_factor }
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Dimension of the span of the rays (15 for every neighbourhood of horizon ratio 3 or more).
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Coordinates of a quartic in the rays' span (orthogonal projection).
    pub fn project(&self, quartic: &Quartic) -> Quartic {
        match &self.basis {
            None => *quartic,
            Some(u) => u.transpose() * quartic,
        }
    }

    /// The quartic of given span coordinates.
    pub fn lift(&self, coordinates: &Quartic) -> Quartic {
        match &self.basis {
            None => *coordinates,
            Some(u) => u * coordinates,
        }
    }

    /// Row v of a ray.
    pub fn row(&self, ray: usize) -> &[f64; 15] {
        &self.rows[ray]
    }

    /// Shares s in blocks.
    pub fn share(&self) -> &[[f64; LANES]] {
        &self.share
    }

    /// Weights w in blocks.
    pub fn weight(&self) -> &[[f64; LANES]] {
        &self.weight
    }

    /// Σ w s² v vᵀ over all rays.
    pub fn gram(&self) -> &QuarticMatrix {
        &self.gram
    }

    /// Zeros, one per ray.
    pub fn zeros(&self) -> PerRay {
        vec![[0.0; LANES]; self.blocks.len()]
    }

    /// One number for every ray.
    pub fn filled(&self, value: f64) -> PerRay {
        vec![[value; LANES]; self.blocks.len()]
    }

    /// The unit quartic v of a ray, in span coordinates.
    pub fn quartic(&self, ray: usize) -> Quartic {
        Quartic::from(self.rows[ray])
    }

    /// p = v·y of every ray.
    pub fn forms(&self, y: &Quartic, p: &mut PerRay) {
        for (block, out) in self.blocks.iter().zip(p.iter_mut()) {
            let mut sum = [0.0; LANES];
            for k in 0..15 {
                for lane in 0..LANES {
                    sum[lane] += block[k][lane] * y[k];
                }
            }
            *out = sum;
        }
    }

    /// Σ w s c v: the tensor that values c give.
    pub fn tensor(&self, c: &PerRay) -> Quartic {
        let mut sum = [[0.0; LANES]; 15];
        for (((block, c), s), w) in self.blocks.iter().zip(c).zip(&self.share).zip(&self.weight) {
            let mut a = [0.0; LANES];
            for lane in 0..LANES {
                a[lane] = w[lane] * s[lane] * c[lane];
            }
            for k in 0..15 {
                for lane in 0..LANES {
                    sum[k][lane] += block[k][lane] * a[lane];
                }
            }
        }
        Quartic::from_fn(|k, _| sum[k].iter().sum())
    }

    /// The y of the pseudo-inverse solution c = s v·y of Σ w s c v = target (P's first step, lsqminnorm).
    pub fn pseudo_inverse(&self, target: &Quartic) -> Quartic {
        self.gram_factor.solve(target)
    }

    /// Rays by index.
    pub fn subset(&self, rays: &[usize]) -> Rays {
        let quartics: Vec<Quartic> = rays.iter().map(|&i| self.lift(&Quartic::from(self.rows[i]))).collect();
        let pick = |values: &PerRay| -> Vec<f64> { rays.iter().map(|&i| values[i / LANES][i % LANES]).collect() };
        Rays::new(&quartics, &pick(&self.share), &pick(&self.weight))
    }
}

/// A value of one ray.
pub fn at(values: &[[f64; LANES]], ray: usize) -> f64 {
    values[ray / LANES][ray % LANES]
}

/// Set the value of one ray.
pub fn set(values: &mut [[f64; LANES]], ray: usize, value: f64) {
    values[ray / LANES][ray % LANES] = value;
}

/// matrix += factor · v vᵀ (both triangles).
pub fn add_outer(matrix: &mut QuarticMatrix, v: &[f64; 15], factor: f64) {
    for b in 0..15 {
        let scaled = factor * v[b];
        let mut column = matrix.column_mut(b);
        for a in 0..15 {
            column[a] += v[a] * scaled;
        }
    }
}

/// Cholesky factor of the leading rank×rank block (the padding becomes the identity), shifted up from singularity by as
/// little as it takes.
pub fn factor(matrix: &QuarticMatrix, rank: usize) -> Cholesky<f64, Const<15>> {
    let mut padded = *matrix;
    let scale = (0..rank).map(|k| matrix[(k, k)]).fold(f64::MIN_POSITIVE, f64::max);
    for k in rank..15 {
        padded[(k, k)] = scale;
    }
    let mut shift = 0.0;
    loop {
        let mut shifted = padded;
        for k in 0..rank {
            shifted[(k, k)] += shift;
        }
        if let Some(factor) = Cholesky::new(shifted)
            && (0..15).all(|k| factor.l_dirty()[(k, k)].powi(2) > 1e-15 * scale)
        {
            return factor;
        }
        shift = if shift == 0.0 { 1e-14 * scale } else { 10.0 * shift };
    }
}

/// Orthonormal basis of the span of some quartics (`None` if they span everything) and its dimension.
fn span(quartics: &[Quartic]) -> (Option<QuarticMatrix>, usize) {
    let mut gram = QuarticMatrix::zeros();
    for v in quartics {
        add_outer(&mut gram, &(*v).into(), 1.0);
    }
    let eigen = gram.symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let kept: Vec<usize> = (0..15).filter(|&k| eigen.eigenvalues[k] > RANK * largest).collect();
    if kept.len() == 15 {
        return (None, 15);
    }
    let mut basis = QuarticMatrix::zeros();
    for (column, &k) in kept.iter().enumerate() {
        basis.set_column(column, &eigen.eigenvectors.column(k));
    }
    (Some(basis), kept.len())
}
