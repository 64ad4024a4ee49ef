//! Sums over fields whose bits do not depend on the number of threads: fixed chunks, added in order.

use rayon::prelude::*;

use crate::operator::VectorField;
use crate::solver::VectorSpace;

/// Numbers per chunk.
const CHUNK: usize = 1 << 14;

/// Fields on so many nodes.
pub(super) struct Vectors(pub usize);

impl VectorSpace<1> for Vectors {
    type Vector = VectorField;

    fn zeros(&self) -> VectorField {
        VectorField::zeros(self.0)
    }

    fn dot(&self, a: &VectorField, b: &VectorField) -> [f64; 1] {
        [dot(a, b)]
    }

    fn add(&self, y: &mut VectorField, [s]: &[f64; 1], x: &VectorField) {
        add_scaled(y, *s, x);
    }

    fn turn(&self, y: &mut VectorField, [s]: &[f64; 1], x: &VectorField) {
        scale_add(y, *s, x);
    }

    fn not_finite(&self, a: &VectorField) -> Option<usize> {
        (0..a.len()).find(|n| !a.at(*n).iter().all(|x| x.is_finite()))
    }
}

/// a · b.
pub fn dot(a: &VectorField, b: &VectorField) -> f64 {
    a.components.iter().zip(&b.components).map(|(a, b)| dot_component(a, b)).sum()
}

fn dot_component(a: &[f64], b: &[f64]) -> f64 {
    let sums: Vec<f64> = a
        .par_chunks(CHUNK)
        .zip(b.par_chunks(CHUNK))
        .map(|(a, b)| {
            // Eight partial sums, so that vectors can be used without reordering.
            let mut sum = [0.0; 8];
            let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
            let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(a, b)| a * b).sum();
            for (a, b) in a8.zip(b8) {
                for i in 0..8 {
                    sum[i] += a[i] * b[i];
                }
            }
            sum.iter().sum::<f64>() + rest
        })
        .collect();
    sums.iter().sum()
}

/// √(a · a).
pub fn norm(a: &VectorField) -> f64 {
    dot(a, a).sqrt()
}

/// y += s x.
pub fn add_scaled(y: &mut VectorField, s: f64, x: &VectorField) {
    for (y, x) in y.components.iter_mut().zip(&x.components) {
        y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(|(y, x)| {
            for (y, x) in y.iter_mut().zip(x) {
                *y += s * x;
            }
        });
    }
}

/// y = x + s y.
pub fn scale_add(y: &mut VectorField, s: f64, x: &VectorField) {
    for (y, x) in y.components.iter_mut().zip(&x.components) {
        y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(|(y, x)| {
            for (y, x) in y.iter_mut().zip(x) {
                *y = x + s * *y;
            }
        });
    }
}

/// y = −y.
pub fn negate(y: &mut VectorField) {
    for y in &mut y.components {
        y.par_chunks_mut(CHUNK).for_each(|y| y.iter_mut().for_each(|y| *y = -*y));
    }
}
