//! MSAT's simple format: rows `i j value`, and `0 0 density`; in GPa and kg/m³ unless said otherwise.

use super::figure::{Figure, figures};
use super::square::Square;
use super::unit::{settled, units_of};
use super::{Found, Source, counted};
use crate::material::StressUnit;
use crate::material::matrix::Order;
use anisobond::{Error, Result};

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    let mut comments: Vec<&str> = Vec::new();
    let mut rows: Vec<(usize, usize, usize, Figure)> = Vec::new();
    for (n, line) in source.text.lines().enumerate() {
        let (line, comment) = line.split_once(['%', '#']).unwrap_or((line, ""));
        comments.push(comment);
        if line.trim().is_empty() {
            continue;
        }
        let [i, j, value] = figures(line)?.try_into().ok()?;
        let index = |f: Figure| (f.value.fract() == 0.0 && (0.0..=9.0).contains(&f.value)).then_some(f.value as usize);
        rows.push((n + 1, index(i)?, index(j)?, value));
        if rows.len() > 64 {
            return None;
        }
    }
    (rows.len() >= 3).then(|| of_rows(source, &rows, &units_of(comments)).map_err(|e| e.at(source.place)))
}

fn of_rows(source: &Source, rows: &[(usize, usize, usize, Figure)], own: &[StressUnit]) -> Result<Found> {
    let mut square = Square::empty();
    let (mut seen, mut density) = (Vec::new(), None);
    for &(line, i, j, value) in rows {
        let at = |e: Error| e.at(format!("line {line}"));
        if !(1..=6).contains(&i) || !(1..=6).contains(&j) {
            if density.replace((line, value.value)).is_some() {
                return Err(at(Error::input("a second density is given", "keep one of them")));
            }
            continue;
        }
        let (a, b) = (i.min(j) - 1, i.max(j) - 1);
        if seen.contains(&(a, b)) && (square.0[a][b].value - value.value).abs() > square.0[a][b].digit + value.digit {
            return Err(at(Error::input(format!("C{i}{j} is given twice, and differs"), "keep one of them")));
        }
        seen.push((a, b));
        square.set(a, b, value);
    }
    if let Some(n) = (0..6).find(|&n| !seen.contains(&(n, n))) {
        let problem = format!(
            "{} of the 21 constants given, and C{}{} is not among them",
            counted(seen.len(), "row"),
            n + 1,
            n + 1
        );
        return Err(Error::input(
            problem,
            "name a class in a material file: class = \"cubic\", c33 = …, c66 = …, c12 = …",
        ));
    }
    let gpa = [StressUnit::giga_pascal()];
    let usual = own.is_empty() && source.unit.is_none();
    let unit = settled(source, if usual { &gpa } else { own }, 1.0)?;
    let (stiffness, done) = square.stiffness(unit.size, Order::Voigt)?;
    let mut found = Found::new(stiffness, String::new());
    if let Some((line, value)) = density {
        if !(100.0..1e5).contains(&value) {
            return Err(Error::input(
                format!(
                    "a density of {value}: {value} kg/m3 as MSAT has it, or {} kg/m3 if it is in g/cm3",
                    1e3 * value
                ),
                "write it in kg/m3",
            )
            .at(format!("line {line}")));
        }
        found.density = Some(value);
    }
    let with = if found.density.is_some() { ", density in kg/m3" } else { "" };
    let by = if usual { " (MSAT's own)" } else { "" };
    found.read_as = format!("MSAT rows i j value, {}{by}, order {}{with}{done}", unit.name, Order::Voigt.words());
    Ok(found)
}
