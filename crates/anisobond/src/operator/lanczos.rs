//! The largest eigenvalue of a symmetric matrix that is known by what it does to vectors.

use nalgebra::DMatrix;
use rayon::prelude::*;

/// Lanczos steps that are usual, and the probability that their bound is too low.
pub const STEPS: usize = 80;
const FAILURE: f64 = 1e-9;

/// Numbers that are taken together; sums are those of so many, in their order, on any number of threads.
const TOGETHER: usize = 1 << 14;

/// What may be a negative eigenvalue of rounding alone, relative to the largest.
const ROUNDING: f64 = 1e-9;

/// A bound of the largest eigenvalue of a symmetric matrix, given as w = A v, from so many Lanczos steps; too low with
/// probability 10⁻⁹ (Kuczyński and Woźniakowski 1992, theorem 4.2) if the start is [`gaussian`] where A is not zero, and
/// with twice that where A has negative eigenvalues. Infinite where so few steps promise nothing.
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
    let values = matrix.symmetric_eigenvalues();
    let (largest, least) = (values.max(), values.min());
    // Relative error ε with probability at most 1.648 √n exp(−√ε (2k − 1)), of the positive semidefinite A, or else of A − λₙ
    // and λ₁ − A: then λ₁ ≤ θ₁ + ε (λ₁ − λₙ) and λ₁ − λₙ ≤ θ₁ − θₖ + 2 ε (λ₁ − λₙ).
    let error = ((1.648 * (n as f64).sqrt() / FAILURE).ln() / (2.0 * steps as f64 - 1.0)).powi(2);
    match least < -ROUNDING * largest.abs() {
        true if error < 0.5 => largest + error / (1.0 - 2.0 * error) * (largest - least),
        false if error < 1.0 => largest / (1.0 - error),
        _ => f64::INFINITY,
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    /// A = H₁H₂H₃ Λ H₃H₂H₁ with reflections H = 1 − 2 v vᵀ: dense, of a known spectrum.
    fn matrix(spectrum: &[f64], seed: u64) -> DMatrix<f64> {
        let n = spectrum.len();
        let mut a = DMatrix::from_diagonal(&DVector::from_row_slice(spectrum));
        for reflection in 0..3 {
            let v = DVector::from_fn(n, |i, _| gaussian(((seed * 3 + reflection) << 32) + i as u64)).normalize();
            let left = &v * (v.transpose() * &a);
            a -= 2.0 * left;
            let right = (&a * &v) * v.transpose();
            a -= 2.0 * right;
        }
        0.5 * (&a + a.transpose())
    }

    /// The bound from a random start.
    fn bound_of(a: &DMatrix<f64>, steps: usize, seed: u64) -> f64 {
        let start = (0..a.nrows() as u64).map(|i| gaussian((seed << 40) + i)).collect();
        lanczos_bound(start, steps, |v, w| w.copy_from_slice((a * DVector::from_row_slice(v)).as_slice()))
    }

    /// The relative error ε that is exceeded with probability 10⁻⁹: 1.648 √n exp(−√ε (2k − 1)) = 10⁻⁹ (Kuczyński and Woźniakowski
    /// 1992, theorem 4.2), by bisection.
    fn promised(n: usize, steps: usize) -> f64 {
        let probability = |error: f64| 1.648 * (n as f64).sqrt() * (-error.sqrt() * (2.0 * steps as f64 - 1.0)).exp();
        let (mut low, mut high) = (0.0, 1e4);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if probability(middle) > 1e-9 { low = middle } else { high = middle }
        }
        low
    }

    /// Spectra without negative values whose top is apart, crowded, repeated, hidden under many others, or all there is.
    fn spectra(n: usize) -> Vec<(&'static str, Vec<f64>)> {
        let of = |f: &dyn Fn(f64) -> f64| (0..n).map(|i| f(i as f64 / n as f64)).collect::<Vec<f64>>();
        let alone = |rest: f64| (0..n).map(|i| if i == 0 { 1.0 } else { rest }).collect::<Vec<f64>>();
        vec![
            ("evenly spread", of(&|x| 1.0 - x)),
            ("crowded at the top", of(&|x| 1.0 - 1e-9 * x)),
            ("as sin² of waves", of(&|x| (0.5 * std::f64::consts::PI * (1.0 - x)).sin().powi(2))),
            ("over ten decades", of(&|x| 10f64.powf(-10.0 * x))),
            ("half of them the largest", of(&|x| if x < 0.5 { 1.0 } else { 1.0 - x })),
            ("half of them zero", of(&|x| (1.0 - 2.0 * x).max(0.0))),
            ("of rank one", alone(0.0)),
            ("one above many", alone(0.97)),
            (
                "one above a crowd",
                (0..n).map(|i| if i == 0 { 1.0 } else { 0.99 - 0.01 * i as f64 / n as f64 }).collect(),
            ),
            ("all the same", vec![1.0; n]),
        ]
    }

    #[test]
    fn a_bound_is_never_below_the_largest_eigenvalue_nor_above_its_promise() {
        for n in [5, 17, 64, 300] {
            for (which, (name, spectrum)) in spectra(n).into_iter().enumerate() {
                for (unit, steps) in [(1.0, 80), (1e-20, 40), (3e17, 20)] {
                    let scaled: Vec<f64> = spectrum.iter().map(|x| unit * x).collect();
                    let a = matrix(&scaled, which as u64);
                    let dense = a.symmetric_eigenvalues().max();
                    assert!((dense / unit - 1.0).abs() < 1e-12, "{name}: {dense:e}");
                    let bound = bound_of(&a, steps, which as u64 + 1);
                    let error = promised(n, steps);
                    assert!(bound >= unit, "{name}, {n}, {steps} steps: {bound:e} of {unit:e}");
                    let most = unit / (1.0 - error) * (1.0 + 1e-12);
                    assert!(bound <= most, "{name}, {n}, {steps} steps: {bound:e} of {unit:e}");
                }
            }
        }
        assert_eq!(bound_of(&DMatrix::zeros(9, 9), STEPS, 1), 0.0);
    }

    /// So few steps promise no relative error below one: no number is a bound.
    #[test]
    fn too_few_steps_bound_nothing_too_low() {
        for n in [5, 300] {
            for (which, (name, spectrum)) in spectra(n).into_iter().enumerate() {
                let a = matrix(&spectrum, which as u64);
                for steps in 1..=14 {
                    let bound = bound_of(&a, steps, 7);
                    assert!(bound >= 1.0 - 1e-12, "{name}, {n}, {steps} steps: {bound}");
                    assert_eq!(bound.is_finite(), promised(n, steps) < 1.0, "{name}, {n}, {steps} steps");
                }
            }
        }
    }

    /// With negative eigenvalues ε is relative to λ₁ − λₙ: the theorem is that of A − λₙ.
    #[test]
    fn a_bound_holds_beside_large_negative_eigenvalues() {
        let n = 300;
        for lowest in [-0.5, -20.0, -1e3, -1e5] {
            for top in [1.0, 0.0, -0.25] {
                let spectrum: Vec<f64> =
                    (0..n).map(|i| if i == 0 { top } else { top - 0.1 + lowest * i as f64 / n as f64 }).collect();
                let a = matrix(&spectrum, 5);
                let (bound, error) = (bound_of(&a, STEPS, 3), promised(n, STEPS));
                // As positive semidefinite ones where none is negative.
                let width = top - spectrum[n - 1].min(0.0);
                assert!(bound >= top - 1e-12 * width, "{lowest} {top}: {bound}");
                assert!(bound <= top + error / (1.0 - 2.0 * error) * width * (1.0 + 1e-9), "{lowest} {top}: {bound}");
            }
        }
    }
}
