//! Least squares behind a bound, in some hundred unknowns.

use nalgebra::{DMatrix, DVector};

/// Exchanges of all wrong unknowns that may fail to reduce their number before single ones are exchanged.
const PATIENCE: usize = 3;

/// minimise ½ xᵀHx − fᵀx subject to x ≥ l, H symmetric positive definite, by exchanging the unknowns at the bound and
/// off it until both sides have the right sign (Kim & Park, SIAM J. Sci. Comput. 33, 2011: block principal pivoting;
/// single exchanges of the last wrong unknown, which always end, when blocks go round in circles).
pub fn bounded_least_squares(h: &DMatrix<f64>, f: &DVector<f64>, bound: f64) -> DVector<f64> {
    let n = f.len();
    // In y = x − l ≥ 0.
    let f = f - h * DVector::from_element(n, bound);
    let tolerance = 1e-12 * f.amax();
    let mut free = vec![true; n];
    let (mut fewest, mut patience) = (n + 1, PATIENCE);
    loop {
        let y = on_free(h, &f, &free);
        let slope = h * &y - &f;
        let wrong: Vec<usize> = (0..n).filter(|&i| if free[i] { y[i] < 0.0 } else { slope[i] < -tolerance }).collect();
        let Some(&last) = wrong.last() else { return y.add_scalar(bound) };
        if wrong.len() < fewest {
            (fewest, patience) = (wrong.len(), PATIENCE);
        } else if patience > 0 {
            patience -= 1;
        } else {
            free[last] = !free[last];
            continue;
        }
        wrong.iter().for_each(|&i| free[i] = !free[i]);
    }
}

/// The minimum over the free unknowns, the others zero.
fn on_free(h: &DMatrix<f64>, f: &DVector<f64>, free: &[bool]) -> DVector<f64> {
    let kept: Vec<usize> = (0..f.len()).filter(|&i| free[i]).collect();
    let part = h.select_rows(&kept).select_columns(&kept);
    let right = DVector::from_iterator(kept.len(), kept.iter().map(|&i| f[i]));
    let mut y = DVector::zeros(f.len());
    // Positive definite by the weights on the diagonal; the pseudo-inverse only guards against rounding.
    let solution = match part.clone().cholesky() {
        Some(factor) => factor.solve(&right),
        None => part.svd(true, true).solve(&right, 1e-14).unwrap_or(right),
    };
    kept.iter().zip(solution.iter()).for_each(|(&i, x)| y[i] = *x);
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Properties: at the bound with a slope upwards, or off it with none.
    #[test]
    fn the_minimum_satisfies_its_conditions() {
        let mut state = 1u64;
        let mut number = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        for size in [1, 2, 5, 20, 60] {
            for rows in [size, 3 * size] {
                let a = DMatrix::from_fn(rows, size, |_, _| number());
                let h = a.transpose() * &a + DMatrix::identity(size, size) * 1e-4;
                let f = DVector::from_fn(size, |_, _| number());
                let x = bounded_least_squares(&h, &f, 0.1);
                let slope = &h * &x - &f;
                for i in 0..size {
                    assert!(x[i] >= 0.1 && slope[i] > -1e-9 && (x[i] - 0.1) * slope[i] < 1e-7, "{size} {i}");
                }
            }
        }
    }
}
