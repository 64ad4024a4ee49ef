//! How exact a number is, by the digits with which it is written.

/// Largest relative uncertainty that a number is granted: that of 100 in three digits.
const LARGEST: f64 = 0.005;

/// Half a unit of the last digit of a number as it is written: 0.05 for 86.8, 0.5 for 153. A number of fewer than three digits is
/// granted no more than ½ %, for 0.3 is often meant as it stands.
pub(super) fn half_digit(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return 0.0;
    }
    // The fewest digits that give the number back, but for the rounding of a unit.
    let same = |digits: &usize| {
        let rounded: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
        (rounded - value).abs() <= 1e-13 * value.abs()
    };
    let digits = (1..=15).find(same).unwrap_or(16);
    let leading = value.abs().log10().floor();
    let mut last = 10f64.powf(leading - digits as f64 + 1.0);
    // Zeros at the end of a whole number count, up to the ones or to four digits.
    if last > 1.0 {
        last = 10f64.powf((leading - 3.0).max(0.0)).min(last);
    }
    (0.5 * last).min(LARGEST * value.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_last_digits() {
        for (value, half) in [
            (86.8, 0.05),
            (153.0, 0.5),
            (130.0, 0.5),
            (-18.04, 0.005),
            (86.8e9 / 1e9, 0.05),
            (0.3, 0.0015),
            (7.0, 0.035),
            (55_000.0, 5.0),
            (0.0, 0.0),
        ] {
            assert!((half_digit(value) - half).abs() < 1e-9 * (1.0 + half), "{value}: {}", half_digit(value));
        }
    }
}
