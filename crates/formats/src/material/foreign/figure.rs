//! Numbers as other programs write them: Fortran's exponents, decimal commas, uncertainties.

use std::borrow::Cow;

/// A number, and how much one of its last digit is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// Its value.
    pub value: f64,
    /// One of the last digit that is written, or the uncertainty that stands behind it.
    pub digit: f64,
}

impl Figure {
    /// "1.2", "1.2D+02", "86.8(3)", "86.8±0.3"; `None` for anything else, NaN and infinity among it.
    pub fn of(token: &str) -> Option<Self> {
        let token = token.replace('−', "-");
        let (token, uncertainty) = match token.split_once('±').or_else(|| token.split_once("+/-")) {
            Some((number, uncertainty)) => (number.to_string(), Some(Figure::of(uncertainty.trim())?.value)),
            None => (token, None),
        };
        let (number, last) = match token.trim().strip_suffix(')').and_then(|t| t.split_once('(')) {
            Some((number, last)) => (number, Some(last.parse::<u32>().ok()?)),
            None => (token.trim(), None),
        };
        let digits = number.strip_prefix(['-', '+']).unwrap_or(number);
        let plain = |c: char| c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E' | 'd' | 'D' | '+' | '-');
        if !digits.starts_with(|c: char| c.is_ascii_digit() || c == '.') || !digits.chars().all(plain) {
            return None;
        }
        let number = number.replace(['d', 'D', 'E'], "e");
        let value = number.parse::<f64>().ok().filter(|value| value.is_finite())?;
        let (mantissa, exponent) = number.split_once('e').unwrap_or((&number, "0"));
        let decimals = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len()).min(30) as i32;
        let digit = 10f64.powi(exponent.parse::<i32>().ok()?.clamp(-300, 300) - decimals);
        let uncertain = uncertainty.or(last.map(|last| last as f64 * digit));
        Some(Figure { value, digit: uncertain.map_or(digit, |u| u.max(digit)) })
    }
}

/// A quantity whose number has a Fortran exponent or an uncertainty, with a plain one: "86.8(3) GPa" is "86.8 GPa".
pub fn plain_number(text: &str) -> Cow<'_, str> {
    let text = text.trim();
    let (number, unit) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    match Figure::of(number).filter(|_| number.contains(['(', '±', 'd', 'D'])) {
        Some(figure) => Cow::Owned(format!("{:?} {}", figure.value, unit.trim()).trim_end().to_string()),
        None => Cow::Borrowed(text),
    }
}

/// The numbers of a line, apart by blanks, commas or semicolons; `None` if something else stands there. A comma within a
/// number is its decimal mark where blanks, tabs or semicolons keep the numbers apart.
pub fn figures(line: &str) -> Option<Vec<Figure>> {
    let apart = |line: &str, marks: &[char]| -> Vec<String> {
        let pieces = line.split(|c: char| c.is_whitespace() || marks.contains(&c));
        pieces.filter(|piece| !piece.is_empty()).map(String::from).collect()
    };
    let all = |pieces: Vec<String>| pieces.iter().map(|piece| Figure::of(piece)).collect::<Option<Vec<_>>>();
    let pieces = apart(line, &[';']);
    if pieces.iter().any(|piece| decimal(piece)) && pieces.len() > 1 {
        let points: Vec<String> = pieces.iter().map(|piece| piece.replace(',', ".")).collect();
        if let Some(found) = all(points) {
            return Some(found);
        }
    }
    all(apart(line, &[',', ';'])).filter(|found| !found.is_empty())
}

/// Whether the one comma of a piece stands between digits.
fn decimal(piece: &str) -> bool {
    let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    piece.split_once(',').is_some_and(|(a, b)| digit(a.chars().last()) && digit(b.chars().next()) && !b.contains(','))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_every_hand() {
        let of = |text: &str| Figure::of(text).map(|f| (f.value, f.digit));
        assert_eq!(of("1.2D+02"), Some((120.0, 10.0)));
        assert_eq!(of("-.5e0"), Some((-0.5, 0.1)));
        assert_eq!(of("86.8(3)").unwrap().0, 86.8);
        assert!((of("86.8(3)").unwrap().1 - 0.3).abs() < 1e-12);
        assert_eq!(of("86.8±0.5"), Some((86.8, 0.5)));
        assert_eq!(of("−3"), Some((-3.0, 1.0)));
        for wrong in ["nan", "inf", "-infinity", "", "-", "1e999", "e5", "0x10", "1.2.3", "d3", "3(x)", "C11"] {
            assert_eq!(of(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn quantities_lose_their_uncertainty() {
        for (text, plain) in
            [("86.8(3) GPa", "86.8 GPa"), ("1.5D+02 GPa", "150.0 GPa"), ("2 mm", "2 mm"), ("86.8(3)", "86.8")]
        {
            assert_eq!(plain_number(text), plain);
        }
    }

    #[test]
    fn commas_are_marks_or_points() {
        let values = |line: &str| figures(line).map(|all| all.iter().map(|f| f.value).collect::<Vec<_>>());
        assert_eq!(values("1,5 2,5\t3"), Some(vec![1.5, 2.5, 3.0]));
        assert_eq!(values("1,5;2,5;0"), Some(vec![1.5, 2.5, 0.0]));
        assert_eq!(values("1,5,2,5"), Some(vec![1.0, 5.0, 2.0, 5.0]));
        assert_eq!(values(" 1, 5, 2 "), Some(vec![1.0, 5.0, 2.0]));
        assert_eq!(values("1,5"), Some(vec![1.0, 5.0]));
        assert_eq!(values("a 1"), None);
        assert_eq!(values(""), None);
    }
}
