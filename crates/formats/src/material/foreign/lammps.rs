//! LAMMPS' script for elastic constants: `Elastic Constant C11all = 151.4 GPa`, 21 lines.

use super::figure::Figure;
use super::square::Square;
use super::unit::{settled, units_of};
use super::{Found, Source};
use crate::material::components::{component_of, name, names};
use crate::material::matrix::Order;
use crate::words::enumeration;
use anisobond::{Error, Result};

const START: &str = "Elastic Constant C";

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    let lines = source.text.lines().enumerate().filter(|(_, line)| line.trim_start().starts_with(START));
    let lines: Vec<(usize, &str)> = lines.take(1 << 16).collect();
    let (first, _) = *lines.first()?;
    Some(constants(source, &lines).map_err(|e| e.at(format!("{}, line {}", source.place, first + 1))))
}

fn constants(source: &Source, lines: &[(usize, &str)]) -> Result<Found> {
    let mut square = Square::empty();
    let (mut seen, mut values): (Vec<String>, Vec<&str>) = (Vec::new(), Vec::new());
    for (n, line) in lines {
        let rest = line.trim_start()[START.len() - 1..].trim();
        let (key, value) = rest.split_once('=').unwrap_or((rest, ""));
        // Averages over a class beside them say nothing more.
        let Some(component) = key.trim().strip_suffix("all").and_then(|key| component_of(&key.to_lowercase())) else {
            continue;
        };
        let text = value.split_whitespace().next().unwrap_or("");
        let figure = Figure::of(text).ok_or_else(|| {
            Error::input(format!("{} is no finite number: {:?}", key.trim(), text), "is the file cut off?")
                .at(format!("line {}", n + 1))
        })?;
        square.set(component.0, component.1, figure);
        values.push(value);
        seen.push(name(component));
    }
    let missing: Vec<String> = names().into_iter().filter(|name| !seen.contains(name)).collect();
    if !missing.is_empty() {
        return Err(Error::input(
            format!("of LAMMPS' 21 elastic constants {} missing", enumeration(&missing)),
            "is the file cut off?",
        ));
    }
    let unit = settled(source, &units_of(values), square.largest())?;
    let (stiffness, done) = square.stiffness(unit.size, Order::Voigt)?;
    Ok(Found::new(
        stiffness,
        format!("LAMMPS, Elastic Constant C11all … C66all, {}, order {}{done}", unit.name, Order::Voigt.words()),
    ))
}
