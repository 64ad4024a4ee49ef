//! Bonds whose force falls along any decreasing curve once damage has begun.
//!
//! The curve f(λ) is given by points between which it is straight, from (1, 1) at the onset to (r, 0) at the end. With λ the
//! largest elongation so far, the secant is g = f(λ)/λ; a bond unloads to the origin along it. In units of k e₀² it takes
//! ½ + ∫₁^r f in all, and has lost ½ + ∫₁^λ f − ½ f λ at λ.

use super::{BondLaw, BondState};
use crate::{Error, Result};

/// Softening by a table of force against elongation.
#[derive(Clone, Debug, PartialEq)]
pub struct TableSoftening {
    /// λ and f(λ), the first (1, 1), the last (r, 0).
    points: Vec<(f64, f64)>,
    /// ∫₁^λ f up to every point.
    area: Vec<f64>,
}

/// Points of an exponential curve, and the elongation over its length at its end, where e^−7 = 0.0009 of the force are left and
/// are taken off.
const PIECES: u32 = 64;
const LENGTHS: f64 = 7.0;

impl TableSoftening {
    /// Softening along points (λ, f): elongation relative to that of the onset, force relative to that of the onset.
    ///
    /// # Errors
    /// Fewer than two points; a first one that is not (1, 1), a last force that is not 0, elongations that do not rise or forces
    /// that rise, force that is used up before the last point.
    pub fn new(points: Vec<(f64, f64)>) -> Result<Self> {
        let refused = |problem: String, remedy: &str| Err(Error::input(problem, remedy));
        if points.len() < 2 {
            return refused(format!("a softening table of {} points", points.len()), "give at least two: 1 1, and r 0");
        }
        if points[0] != (1.0, 1.0) {
            let (l, f) = points[0];
            return refused(
                format!("a softening table begins with the force {f} at the elongation {l}"),
                "begin with force 1 at elongation 1: both are relative to the onset",
            );
        }
        for (n, pair) in points.windows(2).enumerate() {
            let [(l, f), (next, force)] = [pair[0], pair[1]];
            let rises = next.is_finite() && next > l;
            if !rises || !force.is_finite() || force > f || force < 0.0 || f == 0.0 {
                return refused(
                    format!("point {} of a softening table is {next}, {force} after {l}, {f}", n + 2),
                    "let elongations rise and forces fall, to 0 at the last point only",
                );
            }
        }
        let (end, rest) = points[points.len() - 1];
        if rest != 0.0 {
            return refused(
                format!("a softening table ends with the force {rest} at the elongation {end}"),
                "let the last force be 0: the bond breaks there",
            );
        }
        let mut area = vec![0.0];
        for pair in points.windows(2) {
            let piece = 0.5 * (pair[1].0 - pair[0].0) * (pair[0].1 + pair[1].1);
            area.push(area[area.len() - 1] + piece);
        }
        Ok(TableSoftening { points, area })
    }

    /// Exponential softening: f = e^(−(λ − 1)/a) in 64 straight pieces up to λ = 1 + 7 a, less what would be left there.
    ///
    /// # Errors
    /// A length a that is not positive.
    pub fn exponential(length: f64) -> Result<Self> {
        if !(length.is_finite() && length > 0.0) {
            return Err(Error::input(
                format!("exponential softening over {length} times the elongation of its onset"),
                "give a positive number: over that elongation the force falls to 1/e",
            ));
        }
        let rest = (-LENGTHS).exp();
        let point = |n: u32| {
            let t = LENGTHS * f64::from(n) / f64::from(PIECES);
            (1.0 + length * t, ((-t).exp() - rest) / (1.0 - rest))
        };
        let mut points: Vec<(f64, f64)> = (0..=PIECES).map(point).collect();
        points[0] = (1.0, 1.0);
        points[PIECES as usize].1 = 0.0;
        TableSoftening::new(points)
    }

    /// r (–).
    fn end(&self) -> f64 {
        self.points[self.points.len() - 1].0
    }

    /// f(λ) and ∫₁^λ f, 1 ≤ λ ≤ r.
    fn at(&self, largest: f64) -> (f64, f64) {
        let n = self.points.partition_point(|(l, _)| *l <= largest).clamp(1, self.points.len() - 1);
        let [(l, f), (next, force)] = [self.points[n - 1], self.points[n]];
        let here = f + (force - f) * (largest - l) / (next - l);
        (here, self.area[n - 1] + 0.5 * (f + here) * (largest - l))
    }
}

impl BondLaw for TableSoftening {
    fn energy_ratio(&self) -> f64 {
        1.0 + 2.0 * self.area[self.area.len() - 1]
    }

    fn secant(&self, state: &BondState) -> f64 {
        match state.history {
            l if l <= 1.0 => 1.0,
            l if l >= self.end() => 0.0,
            l => self.at(l).0 / l,
        }
    }

    fn damage(&self, state: &BondState) -> f64 {
        match state.history {
            l if l <= 1.0 => 0.0,
            l if l >= self.end() => 1.0,
            l => {
                let (f, area) = self.at(l);
                (1.0 + 2.0 * area - f * l) / self.energy_ratio()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::LinearSoftening;
    use super::*;

    /// A table of two points is linear softening.
    #[test]
    fn two_points_are_linear_softening() {
        let (table, linear) =
            (TableSoftening::new(vec![(1.0, 1.0), (3.5, 0.0)]).unwrap(), LinearSoftening::new(3.5).unwrap());
        assert!((table.energy_ratio() - linear.energy_ratio()).abs() < 1e-14);
        for x in [0.5, 1.0, 1.3, 2.7, 3.49, 3.5, 9.0] {
            let (a, b) = (table.after(&table.start(), x), linear.after(&linear.start(), x));
            assert!((table.secant(&a) - linear.secant(&b)).abs() < 1e-14, "{x}");
            assert!((table.damage(&a) - linear.damage(&b)).abs() < 1e-14, "{x}");
        }
    }

    /// An exponential curve falls as the exponential function does, and its area is its length but for what is cut off.
    #[test]
    fn an_exponential_curve_is_one() {
        let law = TableSoftening::exponential(2.0).unwrap();
        for x in [1.0, 2.0, 4.0, 8.0] {
            let f = law.secant(&law.after(&law.start(), x)) * x;
            assert!((f - (-(x - 1.0) / 2.0).exp()).abs() < 2e-3, "{x}: {f}");
        }
        assert!((law.energy_ratio() / 5.0 - 1.0).abs() < 1e-2, "{}", law.energy_ratio());
    }

    #[test]
    fn a_table_that_is_none_is_refused() {
        for (points, what) in [
            (vec![(1.0, 1.0)], "1 points"),
            (vec![(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)], "begins with"),
            (vec![(1.0, 1.0), (2.0, 1.1), (3.0, 0.0)], "point 2"),
            (vec![(1.0, 1.0), (2.0, 0.5), (2.0, 0.0)], "point 3"),
            (vec![(1.0, 1.0), (2.0, 0.0), (3.0, 0.0)], "point 3"),
            (vec![(1.0, 1.0), (2.0, 0.5)], "ends with"),
            (vec![(1.0, 1.0), (2.0, f64::NAN)], "point 2"),
        ] {
            let said = TableSoftening::new(points).unwrap_err().to_string();
            assert!(said.contains(what), "{said}");
        }
        assert!(TableSoftening::exponential(0.0).is_err());
    }
}
