//! Printing: one way out to stdout, and numbers as people read them.

use std::io::{ErrorKind, Write};

use anisobond::{Choice, Error, Result};
use nalgebra::Vector3;
use serde::Serialize;

/// Print to stdout; a reader that went away (`| head`) is no error.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::file("write", "standard output", e)),
        _ => Ok(()),
    }
}

/// An error's sentence, with options as they are typed.
pub fn sentence(error: &Error) -> String {
    error.spelled(&flag)
}

fn flag(choice: &Choice) -> String {
    let name = choice.name.replace('_', "-");
    match choice.value.as_str() {
        "" => format!("--{name}"),
        value if value.contains(' ') => format!("--{name} '{value}'"),
        value => format!("--{name} {value}"),
    }
}

/// Say on stderr what a user should look at.
pub fn warn(warnings: &[String]) {
    warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
}

/// Print one JSON document; a number that is not finite is an error.
pub fn print_json(value: &impl Serialize) -> Result<()> {
    print(&anisobond_formats::json_text(value)?)
}

/// Three numbers "x,y,z" of a flag.
pub fn vector(text: &str, flag: &str) -> Result<Vector3<f64>> {
    anisobond_formats::parse_vector(text).map_err(|e| e.at(flag))
}

/// A positive number, bare in the flag's unit or with a unit of its own.
pub fn length(text: &str, flag: &str) -> Result<(f64, bool)> {
    if let Ok(value) = text.trim().parse::<f64>() {
        return Ok((value, false));
    }
    let length = anisobond_formats::parse_length(text).map_err(|e| e.at(flag))?;
    Ok((length, true))
}

/// Six significant digits, without an exponent where that is readable.
pub fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".into()
    } else if (1e-3..1e6).contains(&size) {
        let decimals = (5 - size.log10().floor() as i32).max(0) as usize;
        let text = format!("{x:.decimals$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
    } else {
        format!("{x:.5e}")
    }
}

/// A share in per cent; rounding is nothing.
pub fn percent(x: f64) -> String {
    if x < 1e-14 { "0".into() } else { number(100.0 * x) }
}

/// A word as a shell takes it.
pub fn in_shell(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.,:/".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word.into() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

/// A title and words after it, broken at a width of [`WIDTH`]; lines after the first start where the words do.
pub fn wrapped(title: &str, words: &str) -> String {
    let indent = title.chars().count();
    let mut out = title.to_string();
    let mut column = indent;
    for (i, word) in words.split_whitespace().enumerate() {
        let length = word.chars().count();
        if i > 0 && column + 1 + length > WIDTH {
            out += &format!("\n{:indent$}", "");
            column = indent;
        } else if i > 0 {
            out.push(' ');
            column += 1;
        }
        out += word;
        column += length;
    }
    out.push('\n');
    out
}

/// Columns of printed sentences.
const WIDTH: usize = 100;

/// Name of a material, with its source.
pub fn heading(material: &str, source: &str) -> String {
    if source.is_empty() { material.into() } else { format!("{material} ({source})") }
}

/// The stress unit in which a tensor's largest component has one to three digits before the point.
pub fn stress_unit(largest: f64) -> (f64, &'static str) {
    [(1e12, "TPa"), (1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa")]
        .into_iter()
        .find(|(size, _)| largest >= *size)
        .unwrap_or((1.0, "Pa"))
}

/// Rows of a 6×6 matrix in a unit, right-aligned.
pub fn matrix_rows(m: &[[f64; 6]; 6], unit: f64) -> Vec<String> {
    m.iter().map(|row| row.iter().map(|x| entry(x / unit)).collect()).collect()
}

/// An entry of a printed matrix; rounding is not printed as −0.
pub fn entry(x: f64) -> String {
    format!("{:>10.3}", if x.abs() < 5e-4 { 0.0 } else { x })
}

/// Largest magnitude of a 6×6 matrix.
pub fn largest(m: &[[f64; 6]; 6]) -> f64 {
    m.iter().flatten().fold(0.0, |a, x| a.max(x.abs()))
}

/// A direction in brief.
pub fn direction(n: &[f64; 3]) -> String {
    let [x, y, z] = n.map(|c| if c.abs() < 5e-5 { 0.0 } else { c });
    format!("({x:.4}, {y:.4}, {z:.4})")
}

/// Least and largest relative error of the energy of a strain, as a line; nothing where there is none.
pub fn energy_error(error: Option<[f64; 2]>) -> String {
    let signed = |x: f64| if x.abs() < 1e-12 { "0".into() } else { format!("{:+.3}", 100.0 * x).replace('-', "−") };
    error.map_or(String::new(), |[least, largest]| {
        format!("energy of a strain off by {} to {} %\n", signed(least), signed(largest))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_are_wrapped() {
        let words = "eigenvalues ≥ 0 ".repeat(30);
        let text = wrapped("  reach      ", &words);
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines.len() > 4 && lines.iter().all(|l| l.chars().count() <= WIDTH && !l.ends_with(' ')));
        assert!(lines[1..].iter().all(|l| l.starts_with("             ") && !l.starts_with("              ")));
        assert!(text.split_whitespace().skip(1).eq(words.split_whitespace()));
    }
}
