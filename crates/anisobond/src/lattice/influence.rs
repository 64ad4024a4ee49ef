//! Influence functions ω(|ξ|): how a bond's weight depends on its length.

use crate::{Error, Result};

/// The influence function ω, a function of the relative bond length r/δ.
#[derive(Clone, Debug, PartialEq)]
pub enum Influence {
    /// ω = 1.
    Constant,
    /// ω = δ/r (P's default, section 4).
    Inverse,
    /// ω = 1 − r/δ, 0 beyond the horizon.
    Hat,
    /// ω = 1 − (r/δ)^{3/2}, 0 beyond the horizon (P prints the exponent −3/2, which would be negative everywhere).
    Power,
    /// Piecewise linear through (r/δ, ω), ascending in r/δ; built by [`Influence::table`].
    Table(Vec<(f64, f64)>),
}

impl Influence {
    /// A user's table of (r/δ, ω).
    ///
    /// # Errors
    /// Fewer than two points, abscissae that do not ascend, numbers that are not finite, negative weights.
    pub fn table(points: Vec<(f64, f64)>) -> Result<Self> {
        if points.len() < 2 {
            return Err(Error::input(
                format!("the influence table has {} point(s)", points.len()),
                "give at least two rows (r/δ, ω)",
            ));
        }
        for (row, &(r, w)) in points.iter().enumerate() {
            if !(r.is_finite() && w.is_finite() && r >= 0.0 && w >= 0.0) {
                return Err(Error::input(
                    format!("point {} of the influence table is ({r}, {w})", row + 1),
                    "give finite r/δ ≥ 0 and ω ≥ 0",
                ));
            }
            if row > 0 && r <= points[row - 1].0 {
                return Err(Error::input(
                    format!("r/δ of the influence table does not ascend at point {}: {r}", row + 1),
                    "sort the rows by r/δ and remove repeated ones",
                ));
            }
        }
        Ok(Influence::Table(points))
    }

    /// ω at a relative length r/δ > 0; never negative.
    ///
    /// # Errors
    /// A length outside a user's table.
    pub fn weight(&self, relative_length: f64) -> Result<f64> {
        let r = relative_length;
        Ok(match self {
            Influence::Constant => 1.0,
            Influence::Inverse => 1.0 / r,
            Influence::Hat => (1.0 - r).max(0.0),
            Influence::Power => (1.0 - r.powf(1.5)).max(0.0),
            Influence::Table(points) => {
                let (first, last) = (points[0].0, points[points.len() - 1].0);
                // The table's ends belong to it, whatever the rounding of r/δ.
                if r < first - 1e-9 || r > last + 1e-9 {
                    return Err(Error::input(
                        format!("a bond of r/δ = {r:.4} lies outside the influence table ({first} … {last})"),
                        "extend the table to cover every bond (a cube's corners reach r/δ = √3)",
                    ));
                }
                let upper = points.partition_point(|p| p.0 < r).clamp(1, points.len() - 1);
                let ((r0, w0), (r1, w1)) = (points[upper - 1], points[upper]);
                (w0 + (w1 - w0) * ((r - r0) / (r1 - r0)).clamp(0.0, 1.0)).max(0.0)
            }
        })
    }
}
