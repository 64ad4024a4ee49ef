//! A report's numbers as labels and values, and its tensors.

use serde_json::Value;

use super::Tensor;

/// Tensors of reports in the order of what was asked to what was reached.
const TENSORS: [&str; 6] = ["target", "prescribed", "lattice", "promised", "reached", "measured"];

/// Longer lists of numbers are not facts.
const LONGEST: usize = 6;

/// The warnings of a run.
pub(super) fn warnings(report: &Value) -> Vec<String> {
    let warnings = report["warnings"].as_array().map(Vec::as_slice).unwrap_or_default();
    warnings.iter().filter_map(|w| w.as_str().map(String::from)).collect()
}

/// A density that the report names.
pub(super) fn density(report: &Value) -> Option<f64> {
    report["density"].as_f64().filter(|d| *d > 0.0)
}

/// The tensors that the report holds.
pub(super) fn tensors(report: &Value) -> Vec<Tensor> {
    TENSORS.iter().filter_map(|name| Some(Tensor { name: (*name).into(), voigt: matrix(&report[*name])? })).collect()
}

/// A 6×6 matrix.
fn matrix(value: &Value) -> Option<Vec<Vec<f64>>> {
    let rows = value.as_array().filter(|rows| rows.len() == 6)?;
    let row = |row: &Value| {
        let row = row.as_array().filter(|r| r.len() == 6)?;
        row.iter().map(Value::as_f64).collect::<Option<Vec<_>>>()
    };
    rows.iter().map(row).collect()
}

/// Labels and values in sections: what stands at the top, then one section per object and per object of a list.
pub(super) fn sections(report: &Value) -> Vec<(String, Vec<(String, Value)>)> {
    let Value::Object(entries) = report else { return Vec::new() };
    let mut sections = vec![("Result".to_string(), Vec::new())];
    for (key, value) in entries.iter().filter(|(key, _)| *key != "warnings") {
        match (value, fact(value)) {
            (_, Some(value)) => sections[0].1.push((label(key), value)),
            (Value::Object(_), None) => sections.push((label(key), facts(value))),
            (Value::Array(items), None) if items.len() <= LONGEST && items.iter().all(Value::is_object) => {
                let numbered = |(n, item)| (format!("{} {}", label(key), n + 1), facts(item));
                sections.extend(items.iter().enumerate().map(numbered));
            }
            _ => {}
        }
    }
    sections.retain(|(_, facts)| !facts.is_empty());
    sections
}

/// Everything in an object that is a fact, deeper objects with dotted names.
fn facts(value: &Value) -> Vec<(String, Value)> {
    let Value::Object(entries) = value else { return Vec::new() };
    let mut out = Vec::new();
    for (key, value) in entries {
        match (value, fact(value)) {
            (_, Some(value)) => out.push((label(key), value)),
            (Value::Object(_), None) => {
                out.extend(facts(value).into_iter().map(|(name, v)| (format!("{}, {name}", label(key)), v)));
            }
            _ => {}
        }
    }
    out
}

/// A number, text or truth, or a short list of them.
fn fact(value: &Value) -> Option<Value> {
    match value {
        Value::Number(_) | Value::String(_) => Some(value.clone()),
        Value::Bool(truth) => Some(if *truth { "yes" } else { "no" }.into()),
        Value::Array(items) if !items.is_empty() && items.len() <= LONGEST => {
            let words: Option<Vec<String>> = items.iter().map(word).collect();
            Some(words?.join(", ").into())
        }
        _ => None,
    }
}

fn word(value: &Value) -> Option<String> {
    match value {
        Value::Number(n) => Some(n.as_f64().map_or_else(|| n.to_string(), short)),
        Value::String(text) => Some(text.clone()),
        _ => None,
    }
}

/// A number of a list, to six digits.
fn short(x: f64) -> String {
    let text = format!("{x:.5e}");
    text.parse::<f64>().map_or(text, |rounded| format!("{rounded}"))
}

/// A key as words.
fn label(key: &str) -> String {
    key.replace('_', " ")
}
