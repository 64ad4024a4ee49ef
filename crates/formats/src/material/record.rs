//! One material of a database in JSON, as the Materials Project writes it.

use super::components::component_of;
use super::{Form, Habits, Reading, StressUnit, keys, matrix, reading_in_form, reading_of};
use crate::tree::{Entry, Kind, Node, place};
use anisobond::tensor::Material;
use anisobond::{Error, Result};

/// Bare densities of the Materials Project: g/cm³, in kg/m³.
const GRAM_PER_CUBIC_CENTIMETRE: f64 = 1e3;

/// Largest difference of two entries of a record's matrix that should be equal, over the largest: what fits of computed
/// stresses scatter.
pub(super) const SCATTER: f64 = 0.01;

/// Whether an object is a database record rather than a material file: it has an elastic tensor or a database identity.
pub(super) fn is_record(node: &Node) -> bool {
    let identity = ["material_id", "formula", "formula_pretty", "jid"];
    tensor_of(node).is_some() || identity.iter().any(|key| node.get(key).is_some())
}

/// Whether a key is one under which records have their tensor.
pub(super) fn names_a_tensor(key: &str) -> bool {
    TENSORS.contains(&key) || key == "stiffness" || component_of(&key.to_lowercase()).is_some()
}

/// As [`reading_of_record`], the material alone.
///
/// # Errors
/// As [`reading_of_record`].
pub fn material_of_record(node: &Node, unit: Option<&StressUnit>) -> Result<Material> {
    reading_of_record(node, unit).map(|reading| reading.material)
}

/// The material of a record: its `elastic_tensor` (6×6 or 3×3×3×3, or an object with `ieee_format` or `raw`),
/// `elasticity.elastic_tensor`, pymatgen's `input_array`, or any form of a material file; `order`, `class`, `axis` and
/// `orientation` count as there. Bare stresses are in the record's `unit`, else in the given unit, else in GPa; bare densities
/// in g/cm³. Unknown keys pass, but those that are nearly known.
///
/// # Errors
/// As of a material file; a tensor beside another form, or two tensors that differ.
pub fn reading_of_record(node: &Node, unit: Option<&StressUnit>) -> Result<Reading> {
    let node = &keys::known(node)?;
    let habits = Habits {
        unit: Some(unit.cloned().unwrap_or_else(StressUnit::giga_pascal)),
        density: Some(GRAM_PER_CUBIC_CENTIMETRE),
        unknown_keys: true,
        asked: None,
        scatter: SCATTER,
    };
    let mut reading = match tensor_of(node) {
        None => reading_of(node, &habits, "JSON record")?,
        Some(tensor) => {
            refuse_others(node, tensor.entry)?;
            let mut table = with_keys_of(node, tensor.table);
            let what = origin(node, &tensor, &mut table, &habits)?;
            in_form(&table, &tensor, &habits, &what)?
        }
    };
    let named = ["unit", "Unit"].iter().any(|key| node.get(key).is_some());
    if unit.is_none() && !named && tensor_of(node).is_none_or(|t| t.table.get("unit").is_none()) {
        reading.read_as = reading.read_as.replacen(", GPa,", ", GPa (as databases have it, for none is named),", 1);
    }
    reading.material.name = name_of(node);
    if reading.material.source.is_empty() {
        reading.material.source = identity_of(node);
    }
    Ok(reading)
}

fn in_form(table: &Node, tensor: &Tensor, habits: &Habits, what: &str) -> Result<Reading> {
    let class = |node: &Node| node.get("@class").and_then(|e| e.value.text("@class").ok()).unwrap_or("").to_string();
    let compliance = class(tensor.table) == "ComplianceTensor";
    let first = if compliance { Form::Compliance(tensor.entry) } else { Form::Stiffness(tensor.entry) };
    let form = Form::only(table, Some(first))?;
    reading_in_form(table, &form, habits, what)
}

/// What a record with a tensor is; of records of JARVIS, the order of their rows is set, which is VASP's.
fn origin(node: &Node, tensor: &Tensor, table: &mut Node, habits: &Habits) -> Result<String> {
    if tensor.table.get("@class").is_some() {
        return Ok("pymatgen tensor".into());
    }
    let jid = node.get("jid").and_then(|entry| entry.value.text("jid").ok());
    let line = tensor.entry.line;
    let add_order = |table: &mut Node| {
        if let Kind::Table(entries) = &mut table.kind {
            let value = Node { kind: Kind::Text("vasp".into()), line };
            entries.push(Entry { key: "order".into(), line, value });
        }
    };
    let ordered = table.get("order").is_some() || matrix::full(&tensor.entry.value).is_some();
    if jid.is_some_and(|jid| jid.starts_with("JVASP")) && !ordered {
        add_order(table);
        return Ok("JARVIS record (rows as VASP prints them)".into());
    }
    if tensor.entry.key == "raw_et_tensor" && jid.is_none() && !ordered {
        let mut other = table.clone();
        add_order(&mut other);
        let one = in_form(table, tensor, habits, "")?.material.stiffness;
        let vasp = in_form(&other, tensor, habits, "")?.material.stiffness;
        if one.relative_error(&vasp) > 1e-9 {
            let c44 = [one, vasp].map(|c| crate::words::number(c.voigt()[(3, 3)] / 1e9));
            let problem = format!(
                "no order of rows is named: C44 is {} GPa if they are 11 22 33 23 13 12, {} GPa if they are VASP's XX YY ZZ XY YZ ZX",
                c44[0], c44[1]
            );
            return Err(tensor.entry.value.wrong(
                &tensor.entry.key,
                problem,
                "add \"order\": \"voigt\" or \"vasp\" to the record",
            ));
        }
    }
    let raw_too = tensor.entry.key == "ieee_format" && tensor.table.get("raw").is_some();
    let ieee = match (tensor.entry.key.rsplit('.').next(), raw_too) {
        (Some("ieee_format"), true) => " (in IEEE's axes; raw is there too)",
        (Some("ieee_format"), false) => " (in IEEE's axes)",
        (Some("raw"), _) => " (raw, in the axes of the calculation)",
        _ => "",
    };
    Ok(format!("JSON record{ieee}"))
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
    let ieee = tensor.key.ends_with("ieee_format");
    let others = TENSORS.iter().filter(|key| !(ieee && key.ends_with("raw")));
    let others = others.filter_map(|key| tensor_under(node, key)).map(|other| other.entry);
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
pub fn id_of(node: &Node) -> Option<String> {
    first_word(node, &["material_id", "jid", "id", "name", "formula_pretty", "formula"])
}

/// The record's number in its database, which is where its values come from.
fn identity_of(node: &Node) -> String {
    first_word(node, &["material_id", "jid", "id"]).unwrap_or_default()
}

fn name_of(node: &Node) -> String {
    first_word(node, &["name", "formula_pretty", "formula", "material_id", "jid", "id"]).unwrap_or_default()
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
const TENSORS: [&str; 9] = [
    "elastic_tensor",
    "elasticity.elastic_tensor",
    "elasticity",
    "elastic_tensor.ieee_format",
    "elastic_tensor.raw",
    "elasticity.elastic_tensor.ieee_format",
    "elasticity.elastic_tensor.raw",
    "elastic_tensor_data",
    "elastic_moduli",
];

/// Keys of a tensor's object; that of IEEE's axes first.
const SETTINGS: [&str; 4] = ["ieee_format", "raw", "raw_et_tensor", "input_array"];

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
