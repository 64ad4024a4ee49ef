//! A report's numbers as labels and values, in the words of the command line.

use serde_json::Value;

use super::labels::{Unit, label, title};
use super::numbers::{number, percent, quantities};
use crate::case::NOT_USED;

/// Longer lists of numbers are not facts.
const LONGEST: usize = 8;

/// Labels and values under a title.
pub(super) type Section = (String, Vec<(String, String)>);

/// What a report says: what stands at its top, then one section per object and per object of a list.
pub(super) fn sections(report: &Value) -> Vec<Section> {
    let Value::Object(entries) = report else { return Vec::new() };
    let mut sections = vec![("Result".to_string(), Vec::new())];
    for (key, value) in entries.iter().filter(|(key, _)| *key != "warnings") {
        match value {
            Value::Object(_) => sections.push((title(key), facts(key, value))),
            Value::Array(cracks) if key == "cracks" => {
                sections.extend(cracks.iter().enumerate().map(|(n, c)| (format!("Crack {}", n + 1), crack(c))));
            }
            Value::Array(items) if items.iter().any(Value::is_object) => {
                for item in items.iter().take(LONGEST) {
                    sections.push((numbered(&title(key), item), facts(key, item)));
                }
            }
            // A load factor where nothing moves.
            Value::Number(_) if key == "time" && report["time_step"].is_null() => {
                sections[0].1.extend(value.as_f64().map(|x| ("load factor reached".into(), number(x))));
            }
            _ => sections[0].1.extend(fact(key, value)),
        }
    }
    sections.retain(|(_, facts)| !facts.is_empty());
    sections
}

/// A title with the name that an item has.
fn numbered(title: &str, item: &Value) -> String {
    let name = ["name", "region"].iter().find_map(|key| item[*key].as_str());
    name.map_or_else(|| title.into(), |name| format!("{title} {name}"))
}

/// Everything in an object that is a fact, deeper objects too.
fn facts(path: &str, value: &Value) -> Vec<(String, String)> {
    let Value::Object(entries) = value else { return Vec::new() };
    let mut out = Vec::new();
    for (key, value) in entries {
        let path = format!("{path}.{key}");
        match value {
            Value::Object(_) => out.extend(facts(&path, value)),
            Value::Array(items) if items.iter().any(Value::is_object) => {
                out.extend(items.iter().take(LONGEST).flat_map(|item| facts(&path, item)));
            }
            _ => out.extend(fact(&path, value)),
        }
    }
    out
}

/// Label and value of what is neither a table nor a long list.
fn fact(path: &str, value: &Value) -> Option<(String, String)> {
    let key = path.rsplit('.').next().unwrap_or(path);
    match label(path) {
        Some((words, unit)) => Some((words.into(), written(value, unit)?)),
        None => Some((key.replace('_', " "), written(value, Unit::Number)?)),
    }
}

/// A value in its unit.
fn written(value: &Value, unit: Unit) -> Option<String> {
    match (value, unit) {
        (_, Unit::Hidden) | (Value::Bool(false), Unit::Perhaps) => None,
        (Value::Bool(truth), _) => Some(if *truth { "yes" } else { "no" }.into()),
        (Value::String(text), _) => Some(text.clone()),
        (Value::Number(n), _) if n.is_u64() || n.is_i64() => match unit {
            Unit::Number | Unit::Count => Some(n.to_string()),
            _ => in_unit(&[n.as_f64()?], unit),
        },
        (Value::Number(n), _) => in_unit(&[n.as_f64()?], unit),
        (Value::Array(items), _) if !items.is_empty() && items.len() <= LONGEST => {
            in_unit(&items.iter().map(Value::as_f64).collect::<Option<Vec<_>>>()?, unit)
        }
        _ => None,
    }
}

fn in_unit(values: &[f64], unit: Unit) -> Option<String> {
    let listed = |word: &dyn Fn(f64) -> String| values.iter().map(|x| word(*x)).collect::<Vec<_>>().join(", ");
    Some(match unit {
        Unit::Hidden | Unit::Perhaps => return None,
        Unit::Number | Unit::Count => listed(&number),
        Unit::Percent => listed(&percent),
        Unit::Stress => quantities(values, "Pa"),
        Unit::Distance => quantities(values, "m"),
        Unit::Time => quantities(values, "s"),
        Unit::Energy => quantities(values, "J"),
        Unit::Spring => quantities(values, "N/m"),
        Unit::Modulus => format!("{} N/m⁶", listed(&number)),
        Unit::Speed => format!("{} m/s", listed(&number)),
        Unit::Plain(name) => format!("{} {name}", listed(&number)),
        Unit::Phases => listed(&|p| number((p / std::f64::consts::PI * 1e4).round() / 1e4)),
    })
}

/// A crack, and its tips.
fn crack(crack: &Value) -> Vec<(String, String)> {
    let places = |value: &Value| value.as_array().map(|v| v.iter().filter_map(Value::as_f64).collect::<Vec<_>>());
    let mut out: Vec<(String, String)> = ["length", "nodes", "speed", "largest_speed", "direction"]
        .iter()
        .filter_map(|key| fact(&format!("cracks.{key}"), &crack[*key]))
        .collect();
    for (n, tip) in crack["tips"].as_array().into_iter().flatten().enumerate() {
        let mut words = Vec::new();
        if let Some((parent, angle)) = tip["branch"][0].as_u64().zip(tip["branch"][1].as_f64()) {
            words.push(format!("a branch of tip {parent}, {angle:.0}° to it"));
        }
        words.extend(places(&tip["start"]).map(|p| format!("from ({})", quantities(&p, "m"))));
        words.extend(places(&tip["tip"]).map(|p| format!("to ({})", quantities(&p, "m"))));
        words.extend(tip["length"].as_f64().map(|l| format!("{} long", quantities(&[l], "m"))));
        if let Some((speed, largest)) = tip["speed"].as_f64().zip(tip["largest_speed"].as_f64()) {
            words.push(format!("{} m/s (largest {} m/s)", number(speed), number(largest)));
        }
        let round = |x: &f64| number((x * 1e3).round() / 1e3);
        let along = places(&tip["direction"]).map(|d| d.iter().map(round).collect::<Vec<_>>().join(", "));
        words.extend(along.map(|d| format!("along ({d})")));
        out.push((format!("tip {}", n + 1), words.join(", ")));
    }
    out
}

/// What a case file says, in the words and units of who wrote it.
pub(super) fn asked(case: &Value) -> Vec<Section> {
    let Value::Object(entries) = case else { return Vec::new() };
    let idle = told(&case[NOT_USED]);
    let used: Value = entries.iter().filter(|(key, _)| *key != NOT_USED).map(|(k, v)| (k.clone(), v.clone())).collect();
    let sections = [("What was asked", told(&used)), ("Not used on this lattice", idle)];
    sections.into_iter().filter(|s| !s.1.is_empty()).map(|(title, facts)| (title.into(), facts)).collect()
}

/// What a part of a case file says, but for its output.
fn told(part: &Value) -> Vec<(String, String)> {
    let Value::Object(entries) = part else { return Vec::new() };
    let mut facts = Vec::new();
    for (key, value) in entries.iter().filter(|(key, _)| *key != "output") {
        let words = key.replace('_', " ");
        match value {
            Value::Object(entries) => {
                facts.extend(entries.iter().map(|(own, v)| (format!("{words}, {}", own.replace('_', " ")), given(v))));
            }
            Value::Array(items) if items.iter().all(Value::is_object) => {
                facts.extend(items.iter().map(|item| (numbered(&words, item), given(item))));
            }
            _ => facts.push((words, given(value))),
        }
    }
    facts
}

/// A value of a case file in a line.
fn given(value: &Value) -> String {
    match value {
        Value::Object(entries) => {
            let entries = entries.iter().filter(|(key, _)| *key != "name");
            let words: Vec<String> =
                entries.map(|(key, v)| format!("{} {}", key.replace('_', " "), given(v))).collect();
            words.join("; ")
        }
        Value::Array(items) => format!("({})", items.iter().map(given).collect::<Vec<_>>().join(", ")),
        Value::String(text) => text.clone(),
        Value::Number(n) => n.as_f64().map_or_else(|| n.to_string(), number),
        Value::Bool(truth) => (if *truth { "yes" } else { "no" }).into(),
        Value::Null => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn facts_have_words_units_and_all_digits_of_integers() {
        let report = json!({
            "material": "KIO3", "relative_error": 0.0581914, "stable": true, "smallest_eigenvalue": 3.5556e9, "bonds": 3850900,
            "time": 4.6e-5, "time_step": { "step": 3.774e-8 }, "monomials": vec!["1111"; 15],
            "tangential_micromodulus": { "min": 0.0, "zero": 86 },
            "regions": [{ "name": "body", "fracture": { "wanted_mean": 3.8, "rms_deviation": 0.00911 } }],
            "cracks": [{ "length": 0.054, "nodes": 604, "direction": [1.0, 0.0, 0.0], "speed": 1480.0, "tips": [
                { "start": [0.0, 0.0, 0.0], "tip": [0.1, 0.0, 0.0], "length": 0.1, "branch": [1, 44.5], "speed": 1489.0,
                  "largest_speed": 1712.0, "direction": [1.0, 0.0, 0.0] }] }],
        });
        let sections = sections(&report);
        let find = |title: &str, label: &str| {
            let facts = &sections.iter().find(|s| s.0 == title).unwrap().1;
            facts.iter().find(|f| f.0 == label).unwrap_or_else(|| panic!("{label} is not in {facts:?}")).1.clone()
        };
        assert_eq!(find("Result", "relative error"), "5.81914 %");
        assert_eq!(find("Result", "smallest eigenvalue of waves"), "3.5556 GPa");
        assert_eq!((find("Result", "bonds"), find("Result", "time reached")), ("3850900".into(), "46 µs".into()));
        assert_eq!(find("Tangential micromoduli c_t", "bonds of micromodulus 0"), "86");
        assert_eq!(find("Region body", "fracture energy wanted"), "3.8 J/m²");
        let tip = find("Crack 1", "tip 1");
        assert!(
            tip.starts_with("a branch of tip 1, 44° to it") && tip.contains("1489 m/s (largest 1712 m/s)"),
            "{tip}"
        );
    }

    #[test]
    fn a_case_is_told_in_its_own_words() {
        let case = json!({ "material": "Si", "grid": { "spacing": "1 mm" },
            "condition": [{ "name": "top", "on": "y-max", "traction": ["0 MPa", "4 MPa", 0] }] });
        let facts = &asked(&case)[0].1;
        let split = json!({ "material": "Si", "not used": { "model.bonds": "hybrid", "grid": { "spacing": "1 mm" } } });
        let sections = asked(&split);
        assert_eq!(sections[0].1, [("material".into(), "Si".into())]);
        assert!(
            sections[1].0.starts_with("Not used") && sections[1].1.contains(&("model.bonds".into(), "hybrid".into()))
        );
        let expected =
            [("material", "Si"), ("grid, spacing", "1 mm"), ("condition top", "on y-max; traction (0 MPa, 4 MPa, 0)")];
        for (label, value) in expected {
            assert!(facts.contains(&(label.into(), value.into())), "{label}: {facts:?}");
        }
    }
}
