//! Keys of records in any letter case, and those that are nearly known.

use std::borrow::Cow;

use super::components::component_of;
use crate::tree::{Kind, Node};
use crate::words::quoted;
use anisobond::{Error, Result};

/// Keys that say something of the stiffness.
const KNOWN: [&str; 11] = [
    "elastic_tensor",
    "elasticity",
    "stiffness",
    "compliance",
    "engineering",
    "unit",
    "order",
    "class",
    "axis",
    "orientation",
    "density",
];

/// The known key that another one is, but for its letter case: "C11", "Unit"; "units" is unit.
pub(super) fn meant(key: &str) -> Option<String> {
    let lower = key.trim().to_lowercase();
    let lower = if lower == "units" { "unit".into() } else { lower };
    (KNOWN.contains(&lower.as_str()) || component_of(&lower).is_some()).then_some(lower)
}

/// The known key that another one is, but for one letter.
pub fn nearly(key: &str) -> Option<&'static str> {
    let lower = key.trim().to_lowercase();
    if meant(key).is_some() {
        return None;
    }
    let close =
        |known: &&&str| known.chars().next() == lower.chars().next() && strsim::damerau_levenshtein(known, &lower) == 1;
    KNOWN.iter().find(close).copied()
}

/// A record whose known keys are written as they should be.
///
/// # Errors
/// A key that is there in two letter cases, or that is nearly known.
pub(super) fn known(node: &Node) -> Result<Cow<'_, Node>> {
    let entries = node.entries();
    let at = |line: usize| format!("line {line}");
    if let Some((entry, known)) = entries.iter().find_map(|e| Some((e, nearly(&e.key)?))) {
        let problem = format!("unknown key {}", quoted(&entry.key));
        return Err(Error::input(problem, format!("did you mean {known}? Rename it, or remove it")).at(at(entry.line)));
    }
    let other = |key: &str| meant(key).filter(|known| known != key);
    if entries.iter().all(|entry| other(&entry.key).is_none()) {
        return Ok(Cow::Borrowed(node));
    }
    let mut all = entries.to_vec();
    for n in 0..all.len() {
        let Some(known) = other(&all[n].key) else { continue };
        if let Some(twin) = entries.iter().find(|e| e.key != all[n].key && meant(&e.key).as_deref() == Some(&known)) {
            let problem = format!("{} and {} are the same key", quoted(&twin.key), quoted(&all[n].key));
            return Err(Error::input(problem, "keep one of them").at(at(all[n].line)));
        }
        all[n].key = known;
    }
    Ok(Cow::Owned(Node { kind: Kind::Table(all), line: node.line }))
}
