//! Cholesky factors of a symmetric banded matrix: the bottom of the coarse grids.

/// L of A + shift = L Lᵀ, row by row: row i holds columns i − band … i.
pub struct BandedCholesky {
    size: usize,
    band: usize,
    rows: Vec<f64>,
}

impl BandedCholesky {
    /// Factor a matrix given by its lower entries (row, column, value), which are added up. A pivot below `floor` times
    /// its diagonal entry is rounding: its row gives zero, as do rows without any stiffness.
    pub fn new(size: usize, entries: &[(usize, usize, f64)], floor: f64) -> Self {
        let band = entries.iter().map(|e| e.0.abs_diff(e.1)).max().unwrap_or(0);
        let width = band + 1;
        let mut rows = vec![0.0; size * width];
        for &(row, column, value) in entries {
            if column <= row {
                rows[row * width + band + column - row] += value;
            }
        }
        for i in 0..size {
            let first = i.saturating_sub(band);
            let diagonal = rows[i * width + band];
            for j in first..=i {
                let from = first.max(j.saturating_sub(band));
                let (a, b) = (i * width + band - i, j * width + band - j);
                let sum: f64 = (from..j).map(|k| rows[a + k] * rows[b + k]).sum();
                let rest = rows[a + j] - sum;
                rows[a + j] = if j == i {
                    if rest > floor * diagonal { rest.sqrt() } else { 0.0 }
                } else if rows[b + j] > 0.0 {
                    rest / rows[b + j]
                } else {
                    0.0
                };
            }
        }
        BandedCholesky { size, band, rows }
    }

    /// x = A⁻¹ b in place.
    pub fn solve(&self, x: &mut [f64]) {
        let (band, width) = (self.band, self.band + 1);
        for i in 0..self.size {
            let first = i.saturating_sub(band);
            let row = &self.rows[i * width + band - (i - first)..(i + 1) * width];
            let sum: f64 = row.iter().zip(&x[first..i]).map(|(l, x)| l * x).sum();
            let pivot = row[i - first];
            x[i] = if pivot > 0.0 { (x[i] - sum) / pivot } else { 0.0 };
        }
        for i in (0..self.size).rev() {
            let first = i.saturating_sub(band);
            let row = &self.rows[i * width + band - (i - first)..(i + 1) * width];
            let pivot = row[i - first];
            let value = if pivot > 0.0 { x[i] / pivot } else { 0.0 };
            x[i] = value;
            for (l, x) in row.iter().zip(&mut x[first..i]) {
                *x -= l * value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_banded_system_with_an_empty_row() {
        let n: usize = 12;
        let mut entries = Vec::new();
        for i in (0..n).filter(|i| *i != 5) {
            entries.push((i, i, 4.0 + i as f64));
            for j in [i.wrapping_sub(1), i.wrapping_sub(3)] {
                if j < n && j != 5 {
                    entries.push((i, j, -1.0));
                }
            }
        }
        let b: Vec<f64> = (0..n).map(|i| if i == 5 { 0.0 } else { (i as f64).sin() }).collect();
        let mut x = b.clone();
        BandedCholesky::new(n, &entries, 0.0).solve(&mut x);
        let mut product = vec![0.0; n];
        for &(i, j, v) in &entries {
            product[i] += v * x[j];
            if i != j {
                product[j] += v * x[i];
            }
        }
        assert!(b.iter().zip(&product).all(|(b, p)| (b - p).abs() < 1e-14) && x[5] == 0.0);
    }
}
