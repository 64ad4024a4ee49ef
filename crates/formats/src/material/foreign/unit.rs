//! The unit of stress that a text names, and the one that the user names beside it.

use super::Source;
use crate::material::StressUnit;
use crate::units::Dimension;
use crate::words::{enumeration, number};
use anisobond::{Error, Result};

/// Units as they are met in texts; where letters are all large or all small, they mean the same.
const KNOWN: [&str; 12] =
    ["GPa", "MPa", "kbar", "Mbar", "TPa", "kPa", "N/mm2", "N/m2", "dyn/cm2", "eV/A3", "Pa", "psi"];

/// Most units that are kept: of two the text is refused.
const MOST: usize = 8;

/// The units of stress that lines name, each once: "(GPa)", "in kBar", "10^9 Pa".
pub(super) fn units_of<'t>(lines: impl IntoIterator<Item = &'t str>) -> Vec<StressUnit> {
    let mut found: Vec<StressUnit> = Vec::new();
    for line in lines {
        add_units(line, &mut found);
        if found.len() >= MOST {
            break;
        }
    }
    found
}

fn add_units(line: &str, found: &mut Vec<StressUnit>) {
    let mut before = "";
    let words = line.split(|c: char| c.is_whitespace() || "()[]{},;:=\"'#%*".contains(c));
    for word in words.filter(|word| !word.is_empty()) {
        if word.len() <= 12
            && word.starts_with(|c: char| c.is_ascii_alphabetic())
            && let Some(unit) = unit_of(word.trim_end_matches('.'), before)
            && found.iter().all(|known| known.size != unit.size)
        {
            found.push(unit);
        }
        before = word;
    }
}

fn unit_of(word: &str, before: &str) -> Option<StressUnit> {
    let plain = crate::units::plain(word);
    let one_case = plain == plain.to_uppercase() || plain == plain.to_lowercase() || plain.starts_with("kB");
    let same = |name: &&&str| plain == **name || (one_case && **name != "Mbar" && plain.eq_ignore_ascii_case(name));
    let name = KNOWN.iter().find(same)?;
    let size = Dimension::Stress.unit(name).ok()?;
    let power = before.strip_prefix("10^").or(before.strip_prefix("x10^")).or(before.strip_prefix("10**"));
    match power.and_then(|power| power.parse::<i32>().ok()).filter(|power| power.abs() < 20) {
        Some(power) => Some(StressUnit { name: format!("10^{power} {name}"), size: size * 10f64.powi(power) }),
        None => Some(StressUnit { name: (*name).into(), size }),
    }
}

/// The unit of a text: its own, or the one asked for where it names none.
///
/// # Errors
/// None, with what the largest number would be in the usual ones; two; one that is not the one asked for.
pub(super) fn settled(source: &Source, own: &[StressUnit], largest: f64) -> Result<StressUnit> {
    let names: Vec<&str> = own.iter().map(|unit| unit.name.as_str()).collect();
    match (own, source.unit) {
        ([], None) => Err(missing(largest)),
        ([], Some(asked)) => Ok(asked.clone()),
        ([own], None) => Ok(own.clone()),
        (_, Some(asked)) if own.iter().any(|own| (own.size / asked.size - 1.0).abs() < 1e-12) => Ok(asked.clone()),
        (_, Some(asked)) => Err(Error::input(
            format!("the text is in {}, and the unit asked for is {}", enumeration(&names), asked.name),
            "leave the unit out: the text names it",
        )),
        (_, None) => Err(Error::input(
            format!("the text names the units {}", enumeration(&names)),
            anisobond::Wording::from("say which one the numbers have, with ").choice("unit", &own[0].name),
        )),
    }
}

/// No unit is named: what the numbers would mean in each of two.
pub(in super::super) fn missing(largest: f64) -> Error {
    let as_pascal = |size: f64| number(largest * size / 1e9);
    Error::input(
        format!(
            "no unit is named: the largest number, {}, would be {} GPa in GPa and {} GPa in MPa",
            number(largest),
            as_pascal(1e9),
            as_pascal(1e6)
        ),
        anisobond::Wording::from("name it with ")
            .choice("unit", if largest > 3e3 { "MPa" } else { "GPa" })
            .words(", or in a comment above the numbers"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_stand_in_words() {
        let names = |line: &str| units_of([line]).iter().map(|u| (u.name.clone(), u.size)).collect::<Vec<_>>();
        assert_eq!(names(" TOTAL ELASTIC MODULI (kBar)"), [("kbar".into(), 1e8)]);
        assert_eq!(names("# Voigt, GPA."), [("GPa".into(), 1e9)]);
        assert_eq!(names("# in 10^9 Pa"), [("10^9 Pa".into(), 1e9)]);
        assert_eq!(names("10 kbar = 1 GPa").len(), 2);
        assert_eq!(names("a matrix of mPa or mbar"), []);
    }
}
