//! The headings of a CSV table: what they name, and what is refused of them.

use super::columns::Column;
use crate::material::StressUnit;
use crate::material::components::{component_of, name, names};
use crate::material::engineering::ratio;
use crate::material::keys::nearly;
use crate::units::Dimension;
use crate::words::{enumeration, nearest, quoted};
use anisobond::{Error, Result};

/// A heading: "C11 (GPa)" is c11 with the unit GPa.
pub(super) struct Heading<'h> {
    pub(super) text: &'h str,
    pub(super) name: String,
    pub(super) unit: Option<&'h str>,
}

impl<'h> Heading<'h> {
    pub(super) fn of(text: &'h str) -> Self {
        let (name, unit) = match text.split_once(['(', '[']) {
            Some((name, unit)) => (name, Some(unit.trim_end().trim_end_matches([')', ']']).trim())),
            None => (text, None),
        };
        let mut name = name.trim().to_lowercase().replace([' ', '-'], "_");
        if let Some(component) = component_of(&name) {
            name = self::name(component);
        }
        Heading { text, name, unit: unit.filter(|unit| !unit.is_empty()) }
    }
}

/// Refuses a header without all of c11 … c66, but where a class says what the others are, or the nine of orthotropy are all.
pub(super) fn refuse_missing(headings: &[Heading]) -> Result<()> {
    let has = |name: &str| headings.iter().any(|h| h.name == name);
    let missing: Vec<String> = names().into_iter().filter(|c| !has(c)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let unused: Vec<&str> =
        headings.iter().map(|h| h.text).filter(|text| component_of(&Heading::of(text).name).is_none()).collect();
    let unknown = unused.iter().copied().filter(|text| Heading::of(text).name.starts_with('c') && !has_meaning(text));
    let near = missing.iter().find_map(|c| Some((c, nearest(c, unknown.clone())?)));
    let given = 21 - missing.len();
    let nine = ["c11", "c22", "c33", "c12", "c13", "c23", "c44", "c55", "c66"];
    let enough = (has("class") && given >= 2) || (given == 9 && nine.iter().all(|c| has(c)));
    if enough && near.is_none() {
        return Ok(());
    }
    let remedy = match near {
        Some((c, column)) => format!("is {} meant as {c}?", quoted(column)),
        None => {
            let unused: Vec<String> = unused.iter().take(8).map(|text| quoted(text)).collect();
            format!(
                "name all of c11 … c66 in the first line, or those that a column class needs; other columns there: {}",
                unused.join(", ")
            )
        }
    };
    let word = if missing.len() == 1 { "column" } else { "columns" };
    Err(Error::input(format!("{word} {} missing", enumeration(&missing)), remedy))
}

/// Whether a heading is one that tables have for something else than components.
pub(super) fn has_meaning(text: &str) -> bool {
    ["class", "compliance", "comment"].contains(&Heading::of(text).name.as_str())
}

/// Refuses stresses of which some name a unit that is not the usual one, and some none.
pub(super) fn refuse_half_named<'c>(
    stresses: impl Iterator<Item = &'c Column> + Clone,
    asked: Option<&StressUnit>,
    column: Option<usize>,
) -> Result<()> {
    let odd = stresses.clone().find(|c| c.unit.is_some_and(|unit| unit != StressUnit::giga_pascal().size));
    let bare = stresses.clone().find(|c| c.unit.is_none());
    match (odd, bare) {
        (Some(odd), Some(bare)) if asked.is_none() && column.is_none() => {
            let (odd, bare) = (quoted(&odd.heading), quoted(&bare.heading));
            let problem = format!("{bare} may have the unit of {odd}, or GPa as tables have where none is named");
            Err(Error::input(problem, "name the unit in every heading, or in a column unit"))
        }
        _ => Ok(()),
    }
}

/// Refuses engineering constants beside components, of which each would give the stiffness.
pub(super) fn refuse_both_forms(headings: &[Heading]) -> Result<()> {
    let component = headings.iter().find(|h| component_of(&h.name).is_some());
    let constants: Vec<&Heading> = headings.iter().filter(|h| constant(&h.name).is_some()).collect();
    // Averages as K and G, or a Young's modulus, stand beside many a tensor.
    let whole = constants.iter().any(|h| h.name.len() > 2 && constant(&h.name).is_some_and(|(_, ratio)| ratio));
    match (component, constants.first()) {
        (Some(component), Some(first)) if whole => {
            let problem =
                format!("columns {} and {} both give the stiffness", quoted(component.text), quoted(first.text));
            Err(Error::input(problem, "keep the components, or the engineering constants"))
        }
        _ => Ok(()),
    }
}

/// Whether a header gives the stiffness by engineering constants: a Young's modulus and another constant, and no components.
pub(super) fn names_constants(headings: &[Heading]) -> bool {
    let keys: Vec<String> = headings.iter().filter_map(|h| constant(&h.name)).map(|(key, _)| key).collect();
    keys.len() > 1
        && keys.iter().any(|key| key.starts_with('e'))
        && headings.iter().all(|h| component_of(&h.name).is_none())
}

/// The key of an engineering constant that a heading names, and whether it is a ratio: "E1", "ν12" and "v12" too.
pub(super) fn constant(name: &str) -> Option<(String, bool)> {
    let plain = name.replace('ν', "nu").replace('_', "");
    let axes = |rest: &str| rest.len() == 2 && rest.bytes().all(|b| b"123xyz".contains(&b));
    let plain = match plain.strip_prefix('v').filter(|rest| axes(rest)) {
        Some(rest) => format!("nu{rest}"),
        None => plain,
    };
    ratio(&plain).map(|ratio| (plain, ratio))
}

/// Refuses a column whose name is nearly one that counts.
pub(super) fn refuse_near(headings: &[Heading]) -> Result<()> {
    match headings.iter().find_map(|h| Some((h, nearly(&h.name)?))) {
        None => Ok(()),
        Some((h, known)) => Err(Error::input(
            format!("unknown column {}", quoted(h.text)),
            format!("did you mean {known}? Rename or remove it"),
        )),
    }
}

/// Refuses a column that would give the stiffness, or turn it, in a way that tables do not have.
pub(super) fn refuse_second_form(headings: &[Heading]) -> Result<()> {
    let second = ["stiffness", "compliance", "engineering", "axis", "elastic_tensor"];
    match headings.iter().find(|h| second.contains(&h.name.as_str())) {
        None => Ok(()),
        Some(h) => Err(Error::input(
            format!("column {} is not read beside c11 … c66", quoted(h.text)),
            "remove or rename it; orientation (as \"bunge:10,20,30\") turns a row's material",
        )),
    }
}

/// Unit (Pa) that the heading of a column of stresses names.
pub(super) fn stress_unit(heading: &Heading, asked: Option<&StressUnit>) -> Result<Option<f64>> {
    let own =
        heading.unit.map(|name| Dimension::Stress.unit(name).map_err(|e| e.at(format!("column {}", heading.text))));
    match (own.transpose()?, asked) {
        (Some(own), Some(asked)) if own != asked.size => Err(Error::input(
            format!("column {} contradicts the unit {} asked for", quoted(heading.text), asked.name),
            "leave the unit out: the header names it",
        )),
        (own, _) => Ok(own),
    }
}
