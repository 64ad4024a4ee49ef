//! One material of a database in JSON, as the Materials Project writes it.

use super::{Form, Habits, StressUnit, material_in_form, material_of};
use crate::tree::{Entry, Kind, Node, place};
use anisobond::tensor::Material;
use anisobond::{Error, Result};

/// Bare densities of the Materials Project: g/cm³, in kg/m³.
const GRAM_PER_CUBIC_CENTIMETRE: f64 = 1e3;

/// Whether an object is a database record rather than a material file: it has an elastic tensor or a database identity.
pub(super) fn is_record(node: &Node) -> bool {
    let identity = ["material_id", "formula", "formula_pretty"];
    tensor_of(node).is_some() || identity.iter().any(|key| node.get(key).is_some())
}

/// The material of a record: its `elastic_tensor` (6×6, or an object with `ieee_format` or `raw`),
/// `elasticity.elastic_tensor`, or any form of a material file; `order`, `class`, `axis` and `orientation` count as there. Bare
/// stresses are in the record's `unit`, else in the given unit, else in GPa; bare densities in g/cm³. Unknown keys pass.
///
/// # Errors
/// As of a material file; a tensor beside another form, or two tensors that differ.
pub(crate) fn material_of_record(node: &Node, unit: Option<&StressUnit>) -> Result<Material> {
    let habits = Habits {
        unit: Some(unit.cloned().unwrap_or_else(StressUnit::giga_pascal)),
        density: Some(GRAM_PER_CUBIC_CENTIMETRE),
        unknown_keys: true,
    };
    let mut material = match tensor_of(node) {
        None => material_of(node, &habits)?,
        Some(tensor) => {
            refuse_others(node, tensor.entry)?;
            let table = with_keys_of(node, tensor.table);
            let form = Form::only(&table, Some(Form::Stiffness(tensor.entry)))?;
            material_in_form(&table, &form, &habits)?
        }
    };
    material.name = name_of(node);
    if material.source.is_empty() {
        material.source = identity_of(node);
    }
    Ok(material)
}

/// A record with `unit` and `order` of the table in which its tensor stands. An `order` of 2 is that of the tensor's
/// expansion (Materials Project), not of its rows.
fn with_keys_of(node: &Node, inner: &Node) -> Node {
    let expansion = |e: &Entry| e.key == "order" && matches!(e.value.kind, Kind::Number(2.0));
    let near = inner.entries().iter().filter(|e| ["unit", "order"].contains(&e.key.as_str()) && !expansion(e));
    let mut entries: Vec<Entry> = near.cloned().collect();
    let far = node.entries().iter().filter(|e| !expansion(e));
    far.for_each(|e| {
        if entries.iter().all(|known| known.key != e.key) {
            entries.push(e.clone())
        }
    });
    Node { kind: Kind::Table(entries), line: node.line }
}

/// Refuses a second tensor under another key that says something else.
fn refuse_others(node: &Node, tensor: &Entry) -> Result<()> {
    let others = TENSORS.iter().filter_map(|key| tensor_under(node, key)).map(|other| other.entry);
    let differs = |other: &&Entry| other.value.json() != tensor.value.json();
    match others.into_iter().find(differs) {
        None => Ok(()),
        Some(other) => Err(Error::input(
            format!("{} and {} both give the stiffness, and they differ", tensor.key, other.key),
            "keep one of them",
        )
        .at(place(other.line, &other.key))),
    }
}

/// What to call a record among others; `None` if it says nothing.
pub(crate) fn id_of(node: &Node) -> Option<String> {
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

/// Keys of a record under which its tensor is looked for, in this order.
const TENSORS: [&str; 3] = ["elastic_tensor", "elasticity.elastic_tensor", "elasticity"];

/// Keys of a tensor's object; that of IEEE's axes first.
const SETTINGS: [&str; 2] = ["ieee_format", "raw"];

/// A tensor of a record: the entry whose value is the 6×6 matrix, and the table in which that stands.
#[derive(Clone, Copy)]
struct Tensor<'n> {
    entry: &'n Entry,
    table: &'n Node,
}

fn tensor_of(node: &Node) -> Option<Tensor<'_>> {
    TENSORS.iter().chain(&SETTINGS).find_map(|key| tensor_under(node, key))
}

fn tensor_under<'n>(node: &'n Node, key: &str) -> Option<Tensor<'n>> {
    let entry = node.get(key)?;
    match &entry.value.kind {
        Kind::Table(_) => tensor_of(&entry.value),
        _ => Some(Tensor { entry, table: node }),
    }
}
