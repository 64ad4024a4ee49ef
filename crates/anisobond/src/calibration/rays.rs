//! The columns of X, collapsed: bonds that always carry the same share of the solution are one ray.

use nalgebra::{Cholesky, Const, DMatrix, SMatrix, SVector};

/// Rays per block: a vector register's lanes.
const LANES: usize = 8;

/// A number per ray, in blocks of [`LANES`].
pub type PerRay = Vec<[f64; LANES]>;

/// Coordinates of a tensor in an orthonormal basis: 15 of a fully symmetric one, 21 of any.
pub type Coordinates<const D: usize> = SVector<f64, D>;

/// Symmetric matrix over coordinates.
pub type Square<const D: usize> = SMatrix<f64, D, D>;

/// Relative size below which an eigenvalue of Σ v vᵀ is zero: the rays do not reach that direction.
const RANK: f64 = 1e-12;

/// A set of rays v (unit tensors in orthonormal coordinates: n⊗n⊗n⊗n for central bonds, D = 15) with a share s and a weight w each: a ray of
/// value c adds w s c v to the tensor and w c²/2 to the norm to be made small.
///
/// The coordinates are those of the rays' own span (dimension [`Rays::rank`]), zero-padded to D.
pub struct Rays<const D: usize> {
    rank: usize,
    /// Orthonormal basis of the span in its first `rank` columns; `None` when the span is everything.
    basis: Option<Square<D>>,
    /// Rows v, one per ray, for rank-one updates.
    rows: Vec<[f64; D]>,
    /// The same numbers in blocks, for sums over all rays.
    blocks: Vec<[[f64; LANES]; D]>,
    share: PerRay,
    /// Zero in the padding of the last block, so that padding never counts.
    weight: PerRay,
    gram: Square<D>,
    gram_factor: Cholesky<f64, Const<D>>,
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

impl<const D: usize> Rays<D> {
    /// From unit tensors, shares and weights (all positive).
    pub fn new(quartics: &[Coordinates<D>], share: &[f64], weight: &[f64]) -> Self {
        let (basis, rank) = span(quartics);
        let rows: Vec<[f64; D]> = quartics
            .iter()
            .map(|v| match &basis {
                None => (*v).into(),
                Some(u) => (u.transpose() * v).into(),
            })
            .collect();
        let mut blocks = vec![[[0.0; LANES]; D]; blocks_of(rows.len())];
        for (i, row) in rows.iter().enumerate() {
            for k in 0..D {
                blocks[i / LANES][k][i % LANES] = row[k];
            }
        }
        let mut gram = Square::zeros();
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
    pub fn project(&self, quartic: &Coordinates<D>) -> Coordinates<D> {
        match &self.basis {
            None => *quartic,
            Some(u) => u.transpose() * quartic,
        }
    }

    /// The quartic of given span coordinates.
    pub fn lift(&self, coordinates: &Coordinates<D>) -> Coordinates<D> {
        match &self.basis {
            None => *coordinates,
            Some(u) => u * coordinates,
        }
    }

    /// Row v of a ray.
    pub fn row(&self, ray: usize) -> &[f64; D] {
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
    pub fn gram(&self) -> &Square<D> {
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
    pub fn quartic(&self, ray: usize) -> Coordinates<D> {
        Coordinates::from(self.rows[ray])
    }

    /// p = v·y of every ray.
    pub fn forms(&self, y: &Coordinates<D>, p: &mut PerRay) {
        for (block, out) in self.blocks.iter().zip(p.iter_mut()) {
            let mut sum = [0.0; LANES];
            for k in 0..D {
                for lane in 0..LANES {
                    sum[lane] += block[k][lane] * y[k];
                }
            }
            *out = sum;
        }
    }

    /// Σ w s c v: the tensor that values c give.
    pub fn tensor(&self, c: &PerRay) -> Coordinates<D> {
        let mut sum = [[0.0; LANES]; D];
        for (((block, c), s), w) in self.blocks.iter().zip(c).zip(&self.share).zip(&self.weight) {
            let mut a = [0.0; LANES];
            for lane in 0..LANES {
                a[lane] = w[lane] * s[lane] * c[lane];
            }
            for k in 0..D {
                for lane in 0..LANES {
                    sum[k][lane] += block[k][lane] * a[lane];
                }
            }
        }
        Coordinates::from_fn(|k, _| sum[k].iter().sum())
    }

    /// The y of the pseudo-inverse solution c = s v·y of Σ w s c v = target (P's first step, lsqminnorm).
    pub fn pseudo_inverse(&self, target: &Coordinates<D>) -> Coordinates<D> {
        self.gram_factor.solve(target)
    }

    /// Rays by index.
    pub fn subset(&self, rays: &[usize]) -> Rays<D> {
        let quartics: Vec<Coordinates<D>> = rays.iter().map(|&i| self.lift(&Coordinates::from(self.rows[i]))).collect();
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
pub fn add_outer<const D: usize>(matrix: &mut Square<D>, v: &[f64; D], factor: f64) {
    for b in 0..D {
        let scaled = factor * v[b];
        let mut column = matrix.column_mut(b);
        for a in 0..D {
            column[a] += v[a] * scaled;
        }
    }
}

/// Cholesky factor of the leading rank×rank block (the padding becomes the identity), shifted up from singularity by as
/// little as it takes.
pub fn factor<const D: usize>(matrix: &Square<D>, rank: usize) -> Cholesky<f64, Const<D>> {
    let mut padded = *matrix;
    let scale = (0..rank).map(|k| matrix[(k, k)]).fold(f64::MIN_POSITIVE, f64::max);
    for k in rank..D {
        padded[(k, k)] = scale;
    }
    let mut shift = 0.0;
    loop {
        let mut shifted = padded;
        for k in 0..rank {
            shifted[(k, k)] += shift;
        }
        if let Some(factor) = Cholesky::new(shifted)
            && (0..D).all(|k| factor.l_dirty()[(k, k)].powi(2) > 1e-15 * scale)
        {
            return factor;
        }
        shift = if shift == 0.0 { 1e-14 * scale } else { 10.0 * shift };
    }
}

/// Orthonormal basis of the span of some quartics (`None` if they span everything) and its dimension.
fn span<const D: usize>(quartics: &[Coordinates<D>]) -> (Option<Square<D>>, usize) {
    let mut gram = Square::zeros();
    for v in quartics {
        add_outer(&mut gram, &(*v).into(), 1.0);
    }
    // Of dynamic size: nalgebra knows the eigenvalues of fixed sizes one by one only.
    let eigen = DMatrix::from_column_slice(D, D, gram.as_slice()).symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let kept: Vec<usize> = (0..D).filter(|&k| eigen.eigenvalues[k] > RANK * largest).collect();
    if kept.len() == D {
        return (None, D);
    }
    let mut basis = Square::<D>::zeros();
    for (column, &k) in kept.iter().enumerate() {
        basis.set_column(column, &eigen.eigenvectors.column(k));
    }
    (Some(basis), kept.len())
}
