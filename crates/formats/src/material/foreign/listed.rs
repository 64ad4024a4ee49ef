//! Components by name in a text: `C11 = 168.4 GPa`, `C_12: 121.4`, `C(4,4)  75.4`, or a line of names above one of numbers.

use super::figure::{Figure, figures};
use super::unit::{settled, units_of};
use super::{Found, MOST_SEARCHED, Source};
use crate::material::components::{Component, component_of, name};
use crate::material::{Habits, StressUnit, material_of, parse_class};
use crate::tree::{Entry, Kind, Node};
use crate::words::enumeration;
use anisobond::tensor::SymmetryClass;
use anisobond::{Error, Result};

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    if source.text.len() > MOST_SEARCHED {
        return None;
    }
    let mut given: Vec<(usize, Component, Figure)> = Vec::new();
    let mut names: Vec<Component> = Vec::new();
    let mut naming: Vec<&str> = Vec::new();
    for (n, line) in source.text.lines().enumerate() {
        let found = named(line);
        let values: Vec<_> = found.iter().filter_map(|(c, f)| Some((n + 1, *c, (*f)?))).collect();
        match figures(line) {
            Some(row) if names.len() > 1 && row.len() == names.len() => {
                given.extend(names.iter().zip(row).map(|(c, f)| (n + 1, *c, f)));
            }
            _ => given.extend(&values),
        }
        names = if values.is_empty() { found.iter().map(|(c, _)| *c).collect() } else { Vec::new() };
        if !found.is_empty() || given.is_empty() {
            naming.push(line);
        }
        if given.len() > 1 << 12 {
            break;
        }
    }
    (given.len() >= 2).then(|| of_components(source, &given, &units_of(naming)))
}

/// The components that a line names, with the number behind each.
fn named(line: &str) -> Vec<(Component, Option<Figure>)> {
    let mut found = Vec::new();
    let starts = line.match_indices(['C', 'c']).map(|(at, _)| at);
    for at in starts.take(64) {
        let before = line[..at].chars().next_back();
        let rest = &line[at + 1..];
        let index: String = rest.chars().take(7).filter(|c| !"_(){}, ".contains(*c)).take(2).collect();
        let Some(component) = component_of(&format!("c{index}")).filter(|_| !before.is_some_and(char::is_alphanumeric))
        else {
            continue;
        };
        let second = rest.char_indices().filter(|(_, c)| c.is_ascii_digit()).nth(1).map_or(0, |(n, _)| n + 1);
        let rest = rest[second..].trim_start_matches([')', '}']);
        if rest.starts_with(|c: char| c.is_alphanumeric()) {
            continue;
        }
        let rest = rest.trim_start_matches(|c: char| c.is_whitespace() || c == '=' || c == ':');
        let number = rest.split(|c: char| c.is_whitespace() || c == ',' || c == ';').next().unwrap_or("");
        found.push((component, Figure::of(number)));
    }
    found
}

fn of_components(source: &Source, given: &[(usize, Component, Figure)], own: &[StressUnit]) -> Result<Found> {
    let mut once: Vec<(usize, Component, Figure)> = Vec::new();
    for &(line, component, figure) in given {
        match once.iter().find(|(_, known, _)| *known == component) {
            None => once.push((line, component, figure)),
            Some((_, _, before)) if (before.value - figure.value).abs() <= before.digit + figure.digit => {}
            Some((first, _, before)) => {
                let problem =
                    format!("{} is {} in line {first} and {} here", name(component), before.value, figure.value);
                return Err(source.at(line)(Error::input(problem, "give the one that you want by itself")));
            }
        }
    }
    let unit = settled(source, own, once.iter().fold(0.0, |m: f64, g| m.max(g.2.value.abs())))
        .map_err(|e| e.at(source.place))?;
    let class = if once.len() < 21 { class_of(source)? } else { None };
    let node = |line: usize, kind: Kind| Node { kind, line };
    let mut entries: Vec<Entry> = once
        .iter()
        .map(|&(line, c, figure)| Entry { key: name(c), line, value: node(line, Kind::Number(figure.value)) })
        .collect();
    if let Some((line, class)) = class {
        entries.push(Entry { key: "class".into(), line, value: node(line, Kind::Text(class.name().into())) });
    }
    let table = node(1, Kind::Table(entries));
    let habits = Habits { unit: Some(unit.clone()), ..Habits::default() };
    let material = material_of(&table, &habits).map_err(|e| e.at(source.place))?;
    let class = class.map_or(String::new(), |(_, class)| format!(", class {}", class.name()));
    let program = super::matrix_text::program(source).map_or(String::new(), |program| format!("{program}, "));
    let read_as = format!("{program}{} constants by name{class}, {}, order 11 22 33 23 13 12", once.len(), unit.name);
    Ok(Found::new(material.stiffness, read_as))
}

/// The one class that lines about symmetry name.
fn class_of(source: &Source) -> Result<Option<(usize, SymmetryClass)>> {
    let mut found: Vec<(usize, SymmetryClass)> = Vec::new();
    for (n, line) in source.text.lines().enumerate() {
        let lower = line.to_lowercase();
        if !["class", "symmetry", "system", "lattice", "crystal"].iter().any(|word| lower.contains(word)) {
            continue;
        }
        for word in lower.split(|c: char| !c.is_alphanumeric() && c != '-') {
            if let Ok(class) = parse_class(word)
                && found.iter().all(|(_, known)| *known != class)
            {
                found.push((n + 1, class));
            }
        }
    }
    match found[..] {
        [] => Ok(None),
        [one] => Ok(Some(one)),
        _ => {
            let names: Vec<&str> = found.iter().map(|(_, class)| class.name()).collect();
            let problem = format!("the text names the classes {}", enumeration(&names));
            Err(Error::input(problem, "write the constants into a material file with the class that you mean")
                .at(source.place))
        }
    }
}
