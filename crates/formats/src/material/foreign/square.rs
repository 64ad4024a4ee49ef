//! Six rows of six numbers in an order and a unit, as a stiffness.

use nalgebra::Matrix6;

use super::figure::Figure;
use crate::material::matrix::Order;
use crate::words::number;
use anisobond::tensor::Stiffness;
use anisobond::{Error, Result};

/// Largest difference of two entries that should be equal, over the largest entry: what fits of computed stresses scatter.
const SCATTER: f64 = 0.01;

/// A matrix as it is written.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Square(pub [[Figure; 6]; 6]);

impl Square {
    /// From rows of 6; of 6, 5, … 1 (upper triangle) or 1, 2, … 6 (lower); from 21 (upper triangle, row by row) or 36 in
    /// any lines. `None` for another shape.
    pub fn of_rows(rows: &[Vec<Figure>]) -> Option<Self> {
        let lengths: Vec<usize> = rows.iter().map(Vec::len).collect();
        let all: Vec<Figure> = rows.iter().flatten().copied().collect();
        let upper = || (0..6).flat_map(|a| (a..6).map(move |b| (a, b)));
        let places: Vec<(usize, usize)> = match (&lengths[..], all.len()) {
            (_, 36) => (0..36).map(|n| (n / 6, n % 6)).collect(),
            ([6, 5, 4, 3, 2, 1] | [21], _) => upper().collect(),
            ([1, 2, 3, 4, 5, 6], _) => (0..6).flat_map(|a| (0..=a).map(move |b| (a, b))).collect(),
            _ => return None,
        };
        let mut square = Square::empty();
        for ((a, b), figure) in places.iter().zip(&all) {
            square.0[*a][*b] = *figure;
            if all.len() == 21 {
                square.0[*b][*a] = *figure;
            }
        }
        Some(square)
    }

    /// All zero.
    pub fn empty() -> Self {
        Square([[Figure { value: 0.0, digit: 0.0 }; 6]; 6])
    }

    /// Sets an entry and its mirror image.
    pub fn set(&mut self, a: usize, b: usize, value: Figure) {
        self.0[a][b] = value;
        self.0[b][a] = value;
    }

    /// The largest entry.
    pub fn largest(&self) -> f64 {
        self.0.iter().flatten().fold(0.0, |largest: f64, f| largest.max(f.value.abs()))
    }

    /// Whether two matrices are the same but for their last digits.
    pub fn agrees(&self, other: &Square) -> bool {
        let pairs = self.0.iter().flatten().zip(other.0.iter().flatten());
        pairs.into_iter().all(|(a, b)| (a.value - b.value).abs() <= a.digit + b.digit)
    }

    /// Whether an order of rows makes a difference.
    pub fn differs_in(&self, order: Order) -> bool {
        let row = |a: usize| order.row(a);
        (0..6).any(|a| {
            (0..6).any(|b| {
                let (here, there) = (self.0[a][b], self.0[row(a)][row(b)]);
                (here.value - there.value).abs() > here.digit + there.digit
            })
        })
    }

    /// The stiffness of entries in a unit (Pa) and an order, and what was done to make it symmetric.
    ///
    /// # Errors
    /// Entries that should be equal and differ by more than their digits and the scatter of a fit; numbers too large; a
    /// stiffness that is not positive definite.
    pub fn stiffness(&self, unit: f64, order: Order) -> Result<(Stiffness, String)> {
        let (square, most, allowed) = (self.whole(), self.largest(), SCATTER * self.largest());
        let mut off: f64 = 0.0;
        for (a, b) in (0..6).flat_map(|a| (0..a).map(move |b| (b, a))) {
            let (one, other) = (square[a][b], square[b][a]);
            let difference = (one.value - other.value).abs();
            if difference > (1.000_001 * (one.digit + other.digit)).min(0.2 * most).max(allowed) {
                return Err(Error::input(
                    format!(
                        "the matrix is not symmetric: row {} column {} is {}, row {} column {} is {}",
                        a + 1,
                        b + 1,
                        number(one.value),
                        b + 1,
                        a + 1,
                        number(other.value)
                    ),
                    "correct one of them",
                ));
            }
            off = off.max(difference);
        }
        let matrix = Matrix6::from_fn(|a, b| 0.5 * (square[a][b].value + square[b][a].value) * unit + 0.0);
        if matrix.iter().any(|value| !value.is_finite() || value.abs() > 1e25) {
            return Err(Error::input("the numbers are too large", "check them and their unit"));
        }
        let stiffness = Stiffness::from_voigt(&Matrix6::from_fn(|a, b| matrix[(order.row(a), order.row(b))]))?;
        stiffness.require_positive_definite()?;
        let done = match off {
            0.0 => String::new(),
            _ => format!(", made symmetric (entries differ by up to {} % of the largest)", number(100.0 * off / most)),
        };
        Ok((stiffness, done))
    }

    /// With the triangle that is zero filled from the other.
    fn whole(&self) -> [[Figure; 6]; 6] {
        let zero = |upper: bool| {
            (0..6).all(|a| (0..a).all(|b| if upper { self.0[b][a].value } else { self.0[a][b].value } == 0.0))
        };
        let mut all = self.0;
        if zero(true) != zero(false) {
            for (a, b) in (0..6).flat_map(|a| (0..a).map(move |b| (a, b))) {
                let value = if zero(false) { self.0[b][a] } else { self.0[a][b] };
                (all[a][b], all[b][a]) = (value, value);
            }
        }
        all
    }
}
