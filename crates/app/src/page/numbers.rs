//! Numbers as people read them.

/// Prefixes of SI by their power of ten.
const PREFIXES: [(i32, &str); 9] =
    [(-12, "p"), (-9, "n"), (-6, "µ"), (-3, "m"), (0, ""), (3, "k"), (6, "M"), (9, "G"), (12, "T")];

/// Shares below this are rounding.
const ROUNDING: f64 = 1e-14;

/// Six significant digits; a power of ten where there would be many zeros.
pub(super) fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".into()
    } else if !x.is_finite() {
        "–".into()
    } else if (1e-3..1e6).contains(&size) {
        let decimals = (5 - size.log10().floor() as i32).max(0) as usize;
        trimmed(&format!("{x:.decimals$}")).replace('-', "−")
    } else {
        let text = format!("{x:.5e}");
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        format!("{} × 10{}", trimmed(digits), raised(exponent)).replace('-', "−")
    }
}

/// Without zeros at the end of a fraction.
fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

fn raised(exponent: &str) -> String {
    let digit = |c: char| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(c.to_digit(10).unwrap_or(0) as usize).unwrap_or(c);
    exponent.chars().map(|c| if c == '-' { '⁻' } else { digit(c) }).collect()
}

/// A share in per cent.
pub(super) fn percent(x: f64) -> String {
    if x.abs() < ROUNDING { "0 %".into() } else { format!("{} %", number(100.0 * x)) }
}

/// The prefix with which a size has one to three digits before the point, and its factor.
fn prefix(size: f64) -> (f64, &'static str) {
    let fits = |(power, _): &&(i32, &str)| size >= 0.999_999_5 * 10f64.powi(*power);
    let (power, name) = PREFIXES.iter().rev().find(fits).copied().unwrap_or((0, ""));
    (10f64.powi(power), name)
}

/// Numbers of one unit, with the prefix that fits the largest.
pub(super) fn quantities(values: &[f64], unit: &str) -> String {
    let (factor, prefix) = prefix(values.iter().fold(0.0, |m, x| x.abs().max(m)));
    let words: Vec<String> = values.iter().map(|x| number(x / factor)).collect();
    format!("{} {prefix}{unit}", words.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_digits_and_units_their_prefix() {
        let cases =
            [(0.0, "0"), (0.25, "0.25"), (-1234.5678, "−1234.57"), (7.1111e9, "7.1111 × 10⁹"), (2e-16, "2 × 10⁻¹⁶")];
        cases.into_iter().for_each(|(x, text)| assert_eq!(number(x), text));
        assert_eq!((percent(0.0582), percent(-3e-17)), ("5.82 %".into(), "0 %".into()));
        assert_eq!(quantities(&[3.774e-8], "s"), "37.74 ns");
        assert_eq!(quantities(&[1e9, 5e7, 0.0], "Pa"), "1, 0.05, 0 GPa");
        assert_eq!((quantities(&[0.001], "m"), quantities(&[0.0], "J")), ("1 mm".into(), "0 J".into()));
    }
}
