//! The largest eigenvalue of a symmetric matrix that is known by what it does to vectors.

use nalgebra::DMatrix;
use rayon::prelude::*;

/// Lanczos steps that are usual, and the probability that their bound is too low.
pub const STEPS: usize = 80;
const FAILURE: f64 = 1e-9;

/// Numbers that are taken together; sums are those of so many, in their order, on any number of threads.
const TOGETHER: usize = 1 << 14;

/// A bound of the largest eigenvalue of a symmetric matrix, given as w = A v, from so many Lanczos steps; too low with
/// probability 10⁻⁹ (Kuczyński and Woźniakowski 1992, theorem 4.2) if the start is [`gaussian`] where A is not zero.
pub fn lanczos_bound(start: Vec<f64>, steps: usize, mut apply: impl FnMut(&[f64], &mut [f64])) -> f64 {
    let n = start.len();
    let mut v = start;
    normalise(&mut v);
    let (mut last, mut w) = (vec![0.0; n], vec![0.0; n]);
    let (mut alphas, mut betas) = (Vec::new(), Vec::<f64>::new());
    for _ in 0..steps {
        apply(&v, &mut w);
        let alpha = dot(&w, &v);
        let beta = betas.last().copied().unwrap_or(0.0);
        let chunks = w.par_chunks_mut(TOGETHER).zip(v.par_chunks(TOGETHER)).zip(last.par_chunks(TOGETHER));
        chunks.for_each(|((w, v), last)| {
            w.iter_mut().zip(v.iter().zip(last)).for_each(|(w, (v, last))| *w -= alpha * v + beta * last);
        });
        alphas.push(alpha);
        let norm = normalise(&mut w);
        // The start lies in a space that the matrix maps to itself: its eigenvalues are found.
        if norm <= 1e-12 * alphas[0].abs() {
            break;
        }
        betas.push(norm);
        std::mem::swap(&mut last, &mut v);
        std::mem::swap(&mut v, &mut w);
    }
    let done = alphas.len();
    let matrix = DMatrix::from_fn(done, done, |i, j| match i.abs_diff(j) {
        0 => alphas[i],
        1 => betas[i.min(j)],
        _ => 0.0,
    });
    let largest = matrix.symmetric_eigenvalues().max();
    // Relative error ε with probability at most 1.648 √n exp(−√ε (2k − 1)).
    let root = (1.648 * (n as f64).sqrt() / FAILURE).ln() / (2.0 * steps as f64 - 1.0);
    largest / (1.0 - root * root)
}

/// v·w.
fn dot(v: &[f64], w: &[f64]) -> f64 {
    let chunks = v.par_chunks(TOGETHER).zip(w.par_chunks(TOGETHER));
    let sums: Vec<f64> = chunks.map(|(v, w)| v.iter().zip(w).map(|(v, w)| v * w).sum()).collect();
    sums.iter().sum()
}

/// Divide by the norm, and return it.
fn normalise(v: &mut [f64]) -> f64 {
    let norm = dot(v, v).sqrt();
    if norm > 0.0 {
        v.par_chunks_mut(TOGETHER).for_each(|v| v.iter_mut().for_each(|x| *x /= norm));
    }
    norm
}

/// A repeatable number of the normal distribution (splitmix64 and the sum of twelve).
pub fn gaussian(index: u64) -> f64 {
    let uniform = |k: u64| {
        let mut z = (12 * index + k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..12).map(uniform).sum::<f64>() - 6.0
}
