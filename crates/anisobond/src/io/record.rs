//! One material of a database in JSON, as the Materials Project writes it.

use super::material::matrix::{Order, stiffness_of};
use super::material::{Habits, StressUnit, density_of, material_of};
use super::tree::{Entry, Kind, Node, place};
use super::units::Dimension;
use crate::Result;
use crate::tensor::Material;

/// Bare densities of the Materials Project: g/cm³, in kg/m³.
const GRAM_PER_CUBIC_CENTIMETRE: f64 = 1e3;

/// Whether an object is a database record rather than a material file: it has an elastic tensor or a database identity.
pub(super) fn is_record(node: &Node) -> bool {
    let identity = ["material_id", "formula", "formula_pretty"];
    tensor_of(node).is_some() || identity.iter().any(|key| node.get(key).is_some())
}

/// The material of a record: its `elastic_tensor` (6×6, or an object with `ieee_format` or `raw`),
/// `elasticity.elastic_tensor`, or any form of a material file. Bare stresses are in the record's `unit`, else in the given
/// unit, else in GPa; bare densities in g/cm³. Unknown keys pass.
pub(super) fn material_of_record(node: &Node, unit: Option<&StressUnit>) -> Result<Material> {
    let habits = Habits {
        unit: Some(unit.cloned().unwrap_or_else(StressUnit::giga_pascal)),
        density: Some(GRAM_PER_CUBIC_CENTIMETRE),
        unknown_keys: true,
    };
    let Some(tensor) = tensor_of(node) else {
        let mut material = material_of(node, &habits)?;
        material.name = name_of(node);
        if material.source.is_empty() {
            material.source = identity_of(node);
        }
        return Ok(material);
    };
    let size = match (node.get("unit"), &habits.unit) {
        (Some(entry), _) => {
            Dimension::Stress.unit(entry.value.text("unit")?).map_err(|e| e.at(place(entry.line, "unit")))?
        }
        (None, unit) => unit.as_ref().map_or(1e9, |unit| unit.size),
    };
    let value = |node: &Node, key: &str| match &node.kind {
        Kind::Text(text) => Dimension::Stress.parse(text).map_err(|e| e.at(place(node.line, key))),
        _ => Ok(node.number(key)? * size),
    };
    let stiffness = stiffness_of(&tensor.value, &tensor.key, Order::Voigt, value)?;
    stiffness.require_positive_definite().map_err(|e| e.at(place(tensor.line, &tensor.key)))?;
    let density = density_of(node, habits.density)?;
    Ok(Material { name: name_of(node), stiffness, density, source: identity_of(node) })
}

/// What to call a record among others; `None` if it says nothing.
pub(super) fn id_of(node: &Node) -> Option<String> {
    first_word(node, &["material_id", "id", "name", "formula_pretty", "formula"])
}

/// The record's number in its database, which is where its values come from.
fn identity_of(node: &Node) -> String {
    first_word(node, &["material_id", "id"]).unwrap_or_default()
}

fn name_of(node: &Node) -> String {
    first_word(node, &["name", "formula_pretty", "formula", "material_id", "id"]).unwrap_or_default()
}

/// The first text or number under these keys.
fn first_word(node: &Node, keys: &[&str]) -> Option<String> {
    keys.iter().find_map(|key| match &node.get(key)?.value.kind {
        Kind::Text(text) if !text.trim().is_empty() => Some(text.trim().to_string()),
        Kind::Number(number) => Some(number.to_string()),
        _ => None,
    })
}

/// The entry whose value is the 6×6 matrix.
fn tensor_of(node: &Node) -> Option<&Entry> {
    let keys = ["elastic_tensor", "elasticity.elastic_tensor", "elasticity", "ieee_format", "raw"];
    keys.iter().find_map(|key| {
        let entry = node.get(key)?;
        match &entry.value.kind {
            Kind::Table(_) => tensor_of(&entry.value),
            _ => Some(entry),
        }
    })
}
