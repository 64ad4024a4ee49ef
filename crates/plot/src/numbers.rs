//! Numbers as people read them in a picture.

use nalgebra::Vector3;

/// A number with so many significant digits, without trailing zeros: "−0.1726".
pub(super) fn significant(value: f64, digits: i32) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-4..6).contains(&exponent) {
        let (mantissa, power) = (value / 10f64.powi(exponent), exponent);
        if mantissa.is_finite() {
            return format!("{}·10{}", significant(mantissa, digits), superscript(power));
        }
    }
    let text = format!("{value:.*}", (digits - 1 - exponent).clamp(0, 12) as usize);
    signed(if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text })
}

/// The typographic minus in front of a negative number, none in front of zero.
pub(super) fn signed(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().any(|c| c.is_ascii_digit() && c != '0') => format!("−{rest}"),
        Some(rest) => rest.into(),
        None => text.into(),
    }
}

/// "(0, −1, 0)".
pub(super) fn vector(v: &Vector3<f64>) -> String {
    let [x, y, z] = [v.x, v.y, v.z].map(|x| significant(x, 3));
    format!("({x}, {y}, {z})")
}

/// A length (m) with a fitting prefix: "1.5 mm".
pub(super) fn length(metres: f64) -> String {
    let (scale, unit) = match metres {
        x if x < 1e-6 => (1e9, "nm"),
        x if x < 1e-3 => (1e6, "µm"),
        x if x < 0.1 => (1e3, "mm"),
        _ => (1.0, "m"),
    };
    format!("{} {unit}", significant(metres * scale, 6))
}

/// "¹²", "⁻³".
pub(super) fn superscript(power: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    power.to_string().chars().map(|c| c.to_digit(10).map_or('⁻', |d| DIGITS[d as usize])).collect()
}

/// The power of ten, a multiple of three, after which a magnitude is in 0.1 … 100.
pub(super) fn engineering_power(magnitude: f64) -> i32 {
    if magnitude > 0.0 { 3 * ((magnitude.log10() + 1.0 + 1e-9) / 3.0).floor() as i32 } else { 0 }
}

/// Round numbers in [low, high], about five of them, with their text.
pub(super) fn ticks(low: f64, high: f64) -> Vec<(f64, String)> {
    some_ticks(low, high, 5.0)
}

/// Round numbers in [low, high], about so many of them, with their text.
pub(super) fn some_ticks(low: f64, high: f64, count: f64) -> Vec<(f64, String)> {
    let (step, decimals) = step((high - low) / count);
    // Ends count although rounding puts them outside.
    let (first, last) = ((low / step - 1e-6).ceil(), (high / step + 1e-6).floor());
    multiples(first, last, step, decimals).into_iter().map(|(value, text)| (value.clamp(low, high), text)).collect()
}

/// A range with round ends around [low, high], and the round numbers in it, some `count` of them, with their text.
pub(super) fn round_range(low: f64, high: f64, count: f64) -> ([f64; 2], Vec<(f64, String)>) {
    let (step, decimals) = step((high - low) / count);
    let (first, last) = ((low / step + 1e-6).floor(), (high / step - 1e-6).ceil());
    ([first * step, last * step], multiples(first, last, step, decimals))
}

/// A round step of at least `rough` (1, 2, 2.5 or 5 times a power of ten) and the decimals of its multiples.
fn step(rough: f64) -> (f64, usize) {
    let power = rough.log10().floor();
    let unit = 10f64.powf(power);
    // 2.5 has one more decimal.
    let (step, extra) = [(1.0, 0), (2.0, 0), (2.5, 1), (5.0, 0), (10.0, -1)]
        .into_iter()
        .map(|(factor, extra)| (factor * unit, extra))
        .find(|(step, _)| *step >= rough * (1.0 - 1e-9))
        .unwrap_or((unit, 0));
    (step, (extra - power as i32).clamp(0, 12) as usize)
}

fn multiples(first: f64, last: f64, step: f64, decimals: usize) -> Vec<(f64, String)> {
    let count = (last - first).clamp(0.0, 20.0) as usize;
    let value = |i: usize| (first + i as f64) * step;
    (0..=count).map(value).map(|value| (value, signed(&format!("{value:.decimals$}")))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        for (value, text) in [
            (0.0, "0"),
            (-1.0, "−1"),
            (0.172555, "0.1726"),
            (1250.0, "1250"),
            (12345.678, "12346"),
            (-3.2e-7, "−3.2·10⁻⁷"),
            (6.02214e23, "6.022·10²³"),
        ] {
            assert_eq!(significant(value, 4), text);
        }
        assert_eq!(vector(&Vector3::new(0.0, -1.0, 1.0 / 3.0)), "(0, −1, 0.333)");
        assert_eq!([1.0, 0.0025, 1e-4, 2e-9].map(length), ["1 m", "2.5 mm", "100 µm", "2 nm"]);
        assert_eq!(signed("-0.00"), "0.00");
    }

    #[test]
    fn engineering_powers_leave_small_numbers() {
        for (magnitude, power) in [
            (0.0, 0),
            (0.2076, 0),
            (1.65, 0),
            (99.9, 0),
            (100.0, 3),
            (1.65e9, 9),
            (2e21, 21),
            (3e-4, -3),
            (5e-324, -324),
        ] {
            assert_eq!(engineering_power(magnitude), power, "{magnitude}");
        }
    }

    #[test]
    fn ticks_are_round_and_inside() {
        for (low, high) in
            [(0.0, 1.656), (0.1726, 0.2076), (-3.0, 8.0), (0.0, 10.0), (99.0, 99.5), (0.0, 0.3), (1., 2.)]
        {
            let ticks = ticks(low, high);
            assert!((3..=7).contains(&ticks.len()), "{ticks:?}");
            assert!(ticks.iter().all(|(value, _)| (low..=high).contains(value)), "{ticks:?}");
            for (value, text) in &ticks {
                assert!((text.replace('−', "-").parse::<f64>().unwrap() - value).abs() < 1e-9, "{ticks:?}");
            }
        }
        let texts: Vec<String> = ticks(0.0, 0.3).into_iter().map(|(_, text)| text).collect();
        assert_eq!(texts, ["0.0", "0.1", "0.2", "0.3"]);
    }
}
