//! Numbers in lines of spheres.

use nalgebra::Vector3;

use crate::material::foreign::figure::Figure;
use crate::words::quoted;
use anisobond::{Error, Result};

/// A finite number, as programs write it: Fortran's exponents and uncertainties too.
pub(super) fn number(word: &str) -> Result<f64> {
    let plain = word.parse::<f64>().ok().or_else(|| Figure::of(word).map(|figure| figure.value));
    plain.filter(|value| value.is_finite()).ok_or_else(|| {
        Error::input(format!("{} is not a finite number", quoted(word)), "write a plain number such as 0.03")
    })
}

/// A number whose decimal mark is a comma or a point.
pub(super) fn with_comma(word: &str) -> Result<f64> {
    if word.contains(',') { number(&word.replacen(',', ".", 1)) } else { number(word) }
}

/// The edges of a cell.
pub(super) fn edges(words: &[&str]) -> Result<Vector3<f64>> {
    let [a, b, c] = words else {
        return Err(Error::input(
            format!("the cell has {} numbers", words.len()),
            "give the three edges of a rectangular cell",
        ));
    };
    let edges = Vector3::new(with_comma(a)?, with_comma(b)?, with_comma(c)?);
    if edges.min() > 0.0 {
        return Ok(edges);
    }
    Err(Error::input(format!("the cell's edges are {a} {b} {c}"), "give three positive lengths"))
}

/// Words between blanks, commas and semicolons; a comma is a decimal mark where blanks or semicolons part the numbers.
pub(super) fn words(line: &str) -> Vec<&str> {
    let split = |marks: &'static [char]| line.split(marks).filter(|word| !word.is_empty()).collect::<Vec<_>>();
    if line.contains(',') {
        let pieces = split(&[' ', '\t', ';']);
        if pieces.len() > 1 && pieces.iter().any(|piece| decimal(piece)) && pieces.iter().all(|p| one_number(p)) {
            return pieces;
        }
    }
    split(&[' ', '\t', ',', ';'])
}

/// Whether the one comma of a piece stands between digits.
fn decimal(piece: &str) -> bool {
    let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    piece.split_once(',').is_some_and(|(a, b)| digit(a.chars().last()) && digit(b.chars().next()))
}

fn one_number(piece: &str) -> bool {
    with_comma(piece).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_are_marks_or_points() {
        assert_eq!(words("1, 2,\t3;4"), ["1", "2", "3", "4"]);
        assert_eq!(words("0,1 0,2 3 4"), ["0,1", "0,2", "3", "4"]);
        assert_eq!(words("0,1;0,2;3;4"), ["0,1", "0,2", "3", "4"]);
        assert_eq!(words("0,1,2,3"), ["0", "1", "2", "3"]);
        assert_eq!(with_comma("-0,5e-3").unwrap(), -0.5e-3);
        for wrong in ["1,2,3", "nan", "inf", "1e999", ""] {
            assert!(with_comma(wrong).is_err(), "{wrong}");
        }
        assert_eq!(number("1.5D-02").unwrap(), 0.015);
    }
}
