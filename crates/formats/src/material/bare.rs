//! Units of the numbers of a file that name none themselves.

use super::foreign;
use super::form::Form;
use crate::tree::{Kind, Node, place};
use crate::units::Dimension;
use crate::words::{number, quoted};
use anisobond::{Error, Result};

/// A unit of stress as the user wrote it.
#[derive(Clone, Debug)]
pub struct StressUnit {
    /// For messages: "MPa".
    pub name: String,
    /// Its size (Pa).
    pub size: f64,
}

impl StressUnit {
    /// A unit by its name.
    ///
    /// # Errors
    /// An unknown one.
    pub fn named(name: &str) -> Result<Self> {
        Dimension::Stress.unit(name).map(|size| StressUnit { name: name.trim().into(), size })
    }

    /// The unit of the Materials Project.
    pub fn giga_pascal() -> Self {
        StressUnit { name: "GPa".into(), size: 1e9 }
    }

    /// A value (Pa) in this unit, for messages.
    pub(super) fn show(&self, value: f64) -> String {
        format!("{} {}", number(value / self.size), self.name)
    }
}

/// What a file of a kind leaves unsaid.
#[derive(Clone, Debug, Default)]
pub struct Habits {
    /// Unit of a bare stress where the file names none.
    pub unit: Option<StressUnit>,
    /// Unit (kg/m³) of a bare density.
    pub density: Option<f64>,
    /// Whether keys we do not know pass in silence.
    pub unknown_keys: bool,
    /// A unit asked for beside the file, which no other may contradict.
    pub asked: Option<StressUnit>,
    /// Largest difference of two entries of a matrix that should be equal, over the largest entry (at least 10⁻⁶).
    pub scatter: f64,
}

/// Units of the bare numbers of one file.
#[derive(Default)]
pub(super) struct Units {
    pub(super) stress: Option<StressUnit>,
    /// 1/Pa per unit.
    pub(super) compliance: Option<f64>,
}

impl Units {
    /// The unit in which messages show a stress.
    pub(super) fn shown(&self) -> StressUnit {
        self.stress.clone().unwrap_or_else(StressUnit::giga_pascal)
    }

    /// A stress (Pa): a number × unit, or a text with its own. Zero needs none.
    pub(super) fn stress(&self, node: &Node, key: &str) -> Result<f64> {
        self.quantity(node, key, Dimension::Stress, self.stress.as_ref().map(|u| u.size), "unit = \"GPa\"")
    }

    /// A compliance (1/Pa).
    pub(super) fn compliance(&self, node: &Node, key: &str) -> Result<f64> {
        self.quantity(node, key, Dimension::Compliance, self.compliance, "unit = \"1/GPa\"")
    }

    fn quantity(&self, node: &Node, key: &str, what: Dimension, unit: Option<f64>, missing: &str) -> Result<f64> {
        let value = match (&node.kind, unit) {
            (Kind::Text(text), unit) => {
                let plain = foreign::figure::plain_number(text);
                return match (plain.parse::<f64>(), unit) {
                    // A number that the file's language cannot hold otherwise.
                    (Ok(value), Some(size)) if plain != text.trim() => what.bounded(value * size, text),
                    _ => what.parse(&plain),
                }
                .map_err(|e| e.at(place(node.line, key)));
            }
            (_, Some(size)) => node.number(key)? * size,
            (_, None) if node.number(key)? == 0.0 => 0.0,
            (_, None) => {
                return Err(node.wrong(
                    key,
                    format!("{} has no unit", node.described()),
                    format!("add {missing} at the top of the file"),
                ));
            }
        };
        if value.is_finite() {
            Ok(value)
        } else {
            Err(node.wrong(key, "the number is too large", "check it and its unit"))
        }
    }
}

/// `unit`, which may be reciprocal for a compliance.
pub(super) fn units_of(table: &Node, form: &Form, habits: &Habits) -> Result<Units> {
    let Some(entry) = table.get("unit") else {
        let unit = habits.asked.clone().or(habits.unit.clone());
        let compliance = unit.as_ref().map(|unit| 1.0 / unit.size);
        return Ok(Units { stress: unit, compliance });
    };
    let name = entry.value.text("unit")?;
    let at = |e: Error| e.at(place(entry.line, "unit"));
    if matches!(form, Form::Compliance(_))
        && let Ok(size) = Dimension::Compliance.unit(name)
    {
        return Ok(Units { stress: None, compliance: Some(size) });
    }
    let size = Dimension::Stress.unit(name).map_err(at)?;
    if let Some(asked) = habits.asked.as_ref().filter(|asked| asked.size != size) {
        let problem = format!("the unit asked for, {}, contradicts {}", asked.name, quoted(name));
        return Err(at(Error::input(problem, "leave it out: the file names its unit")));
    }
    Ok(Units { stress: Some(StressUnit { name: name.trim().to_string(), size }), compliance: Some(1.0 / size) })
}
