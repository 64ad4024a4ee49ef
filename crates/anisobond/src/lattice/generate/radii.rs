//! Distributions of radii.

use super::stream::Stream;
use crate::{Error, Result};

/// Draws from a clipped log-normal distribution before it is taken to lie outside its clipping.
const MOST_DRAWS: usize = 10_000;

/// How the radii of a packing are distributed; lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub enum Radii {
    /// All the same.
    Uniform {
        /// Radius (m).
        radius: f64,
    },
    /// Evenly between mean (1 − fuzz) and mean (1 + fuzz).
    Fuzzy {
        /// Mean radius (m).
        mean: f64,
        /// Half the width relative to the mean, 0 ≤ fuzz < 1.
        fuzz: f64,
    },
    /// ln r normal; radii outside the clipping are drawn again.
    LogNormal {
        /// Median radius before clipping (m).
        median: f64,
        /// Standard deviation of ln r (–).
        deviation: f64,
        /// Smallest radius (m).
        least: f64,
        /// Largest radius (m).
        most: f64,
    },
    /// One of some radii.
    Table {
        /// (radius (m), fraction); fractions need not sum to 1.
        rows: Vec<(f64, f64)>,
        /// Of what the fractions are.
        share: Share,
    },
}

/// Of what the fractions of a table of radii are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// Of the number of spheres.
    Number,
    /// Of their volume, as in a grading curve.
    Volume,
}

/// A distribution whose parameters are known to be good.
pub(super) struct Sampler<'r> {
    radii: &'r Radii,
    /// Of a table: sums of number fractions up to each row.
    cumulative: Vec<f64>,
}

impl Radii {
    /// Log-normal radii, clipped at a third and at three times the median (m).
    pub fn log_normal(median: f64, deviation: f64) -> Self {
        Radii::LogNormal { median, deviation, least: median / 3.0, most: 3.0 * median }
    }

    /// The sampler of a distribution.
    ///
    /// # Errors
    /// Parameters out of their range, with the name of the parameter.
    pub(super) fn sampler(&self) -> Result<Sampler<'_>> {
        match self {
            Radii::Uniform { radius } => length("radius", *radius)?,
            Radii::Fuzzy { mean, fuzz } => {
                length("mean radius", *mean)?;
                if !(0.0..1.0).contains(fuzz) {
                    return Err(Error::input(format!("the fuzz of the radii is {fuzz}"), "give 0 ≤ fuzz < 1"));
                }
            }
            Radii::LogNormal { median, deviation, least, most } => {
                length("median radius", *median)?;
                length("least radius", *least)?;
                length("largest radius", *most)?;
                if !(deviation.is_finite() && *deviation >= 0.0) {
                    return Err(Error::input(
                        format!("the deviation of ln r is {deviation}"),
                        "give a number ≥ 0, such as 0.3",
                    ));
                }
                if !(least <= median && median <= most) {
                    return Err(Error::input(
                        format!("the radii are clipped to {least} … {most} m, the median is {median} m"),
                        "give least ≤ median ≤ largest",
                    ));
                }
            }
            Radii::Table { rows, .. } => check_table(rows)?,
        }
        Ok(Sampler { radii: self, cumulative: self.cumulative() })
    }

    fn cumulative(&self) -> Vec<f64> {
        let Radii::Table { rows, share } = self else { return Vec::new() };
        let number = |&(r, fraction): &(f64, f64)| match share {
            Share::Number => fraction,
            Share::Volume => fraction / (r / rows[0].0).powi(3),
        };
        let mut sum = 0.0;
        let sums = rows.iter().map(|row| {
            sum += number(row);
            sum
        });
        sums.collect()
    }
}

fn length(name: &str, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::input(format!("the {name} is {value} m"), "give a positive length"))
}

fn check_table(rows: &[(f64, f64)]) -> Result<()> {
    for &(radius, fraction) in rows {
        length("radius in the table", radius)?;
        if !(fraction.is_finite() && fraction >= 0.0) {
            return Err(Error::input(format!("the fraction of radius {radius} m is {fraction}"), "give fractions ≥ 0"));
        }
    }
    if rows.iter().any(|row| row.1 > 0.0) {
        return Ok(());
    }
    Err(Error::input("the table of radii has no row with a positive fraction", "give rows (radius, fraction)"))
}

impl Sampler<'_> {
    /// A radius (m).
    ///
    /// # Errors
    /// A log-normal distribution that hardly meets its clipping.
    pub fn draw(&self, stream: &mut Stream) -> Result<f64> {
        match *self.radii {
            Radii::Uniform { radius } => Ok(radius),
            Radii::Fuzzy { mean, fuzz } => Ok(mean * (1.0 + fuzz * stream.signed())),
            Radii::LogNormal { median, deviation, least, most } => (0..MOST_DRAWS)
                .map(|_| median * (deviation * stream.normal()).exp())
                .find(|r| (least..=most).contains(r))
                .ok_or_else(|| {
                    Error::input(
                        format!("hardly any radius of the log-normal distribution lies in {least} … {most} m"),
                        "widen the clipping or reduce the deviation",
                    )
                }),
            Radii::Table { ref rows, .. } => {
                let total = self.cumulative.last().copied().unwrap_or(0.0);
                let level = total * stream.unit();
                let row = self.cumulative.partition_point(|&sum| sum <= level).min(rows.len() - 1);
                Ok(rows[row].0)
            }
        }
    }
}
