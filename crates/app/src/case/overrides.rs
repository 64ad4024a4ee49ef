//! `--set key=value`: values of a case file replaced from the command line.

use anisobond::{Error, Result};
use anisobond_formats::tree::{Entry, Kind, Node, parse_toml};
use anisobond_formats::words::quoted;

/// Deepest way to a key.
const DEEPEST: usize = 20;

/// Replace or add one value: `grid.spacing=0.5 mm`, `condition.0.pressure=2 MPa`. The value is read as TOML, and as a text
/// where it is none. Of a list, the element after the last may be added.
///
/// # Errors
/// No `=`, an empty key, a way through something that is no table, an index that is not in the list.
pub(super) fn set(root: &mut Node, assignment: &str) -> Result<()> {
    let at = |e: Error| e.at(format!("--set {}", assignment.trim()));
    let wrong = |problem: String, remedy: &str| at(Error::input(problem, remedy));
    let Some((key, value)) = assignment.split_once('=') else {
        return Err(wrong("there is no =".into(), "write --set key=value, as --set grid.spacing='0.5 mm'"));
    };
    let steps: Vec<&str> = key.trim().split('.').map(str::trim).collect();
    if steps.iter().any(|s| s.is_empty()) || steps.len() > DEEPEST {
        return Err(wrong(format!("{} is no key", quoted(key)), "write the keys of the file with points between them"));
    }
    let mut here = root;
    for (n, step) in steps.iter().enumerate() {
        let way = steps[..n].join(".");
        let words = here.described();
        here = match &mut here.kind {
            Kind::List(items) => {
                let count = items.len();
                let index = step.parse::<usize>().ok().filter(|i| *i <= count).ok_or_else(|| {
                    wrong(format!("{way} is a list of {count}"), "name an element by its number, from 0")
                })?;
                if index == count {
                    items.push(empty());
                }
                &mut items[index]
            }
            Kind::Table(entries) => {
                let index = entries.iter().position(|e| e.key == *step).unwrap_or_else(|| {
                    entries.push(Entry { key: (*step).into(), line: 0, value: empty() });
                    entries.len() - 1
                });
                entries[index].line = 0;
                &mut entries[index].value
            }
            _ => return Err(wrong(format!("{way} is {words}, and has no keys"), "set it as a whole")),
        };
    }
    *here = parsed(value.trim());
    Ok(())
}

fn empty() -> Node {
    Node { kind: Kind::Table(Vec::new()), line: 0 }
}

/// The value as TOML, else as a text.
fn parsed(value: &str) -> Node {
    let toml = (!value.contains(['\n', '\r'])).then(|| parse_toml(&format!("v = {value}"), "--set").ok()).flatten();
    match toml.as_ref().and_then(|t| t.get("v")) {
        Some(entry) => from_flag(entry.value.clone()),
        None => Node { kind: Kind::Text(value.into()), line: 0 },
    }
}

/// The same tree, marked as given by a flag.
fn from_flag(mut node: Node) -> Node {
    node.line = 0;
    node.kind = match node.kind {
        Kind::List(items) => Kind::List(items.into_iter().map(from_flag).collect()),
        Kind::Table(entries) => {
            Kind::Table(entries.into_iter().map(|e| Entry { key: e.key, line: 0, value: from_flag(e.value) }).collect())
        }
        other => other,
    };
    node
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_replaced_and_added() {
        let mut root = parse_toml("[grid]\nspacing = '1 mm'\n[[condition]]\non = 'all'\n", "f").unwrap();
        for assignment in [
            "grid.spacing=0.5 mm",
            "grid.horizon = 4",
            "condition.0.on=['a', 'b']",
            "condition.1.on=x",
            "new.deep = true",
        ] {
            set(&mut root, assignment).unwrap();
        }
        let grid = &root.get("grid").unwrap().value;
        assert_eq!(grid.get("spacing").unwrap().value.text("").unwrap(), "0.5 mm");
        assert_eq!(grid.get("horizon").unwrap().value.number("").unwrap(), 4.0);
        let conditions = root.get("condition").unwrap().value.list().unwrap();
        assert_eq!(conditions[0].get("on").unwrap().value.list().unwrap().len(), 2);
        assert_eq!(conditions[1].get("on").unwrap().value.text("").unwrap(), "x");
        for (assignment, part) in [
            ("grid", "there is no ="),
            ("grid..x=1", "is no key"),
            ("grid.spacing.x=1", "grid.spacing is \"0.5 mm\", and has no keys"),
            ("condition.5.on=1", "condition is a list of 2"),
            ("condition.x.on=1", "by its number"),
        ] {
            let message = set(&mut root, assignment).unwrap_err().to_string();
            assert!(message.starts_with(&format!("--set {assignment}: ")) && message.contains(part), "{message}");
        }
    }
}
