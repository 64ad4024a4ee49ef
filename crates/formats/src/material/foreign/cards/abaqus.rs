//! `*ELASTIC` of Abaqus and CalculiX: anisotropic (21 constants, D1111 D1122 D2222 D1133 …), orthotropic (9), engineering
//! constants (9), isotropic (2). Order 11 22 33 12 13 23. No unit is part of the format.

use super::super::figure::Figure;
use super::super::square::Square;
use super::super::unit::{settled, units_of};
use super::super::{Found, Source, counted};
use super::{Orthotropic, number_of};
use crate::material::matrix::Order;
use crate::words::{enumeration, quoted, suggestion};
use anisobond::{Error, Result, Wording};

/// A card with its data.
struct Card {
    line: usize,
    material: String,
    kind: String,
    numbers: Vec<Figure>,
}

pub(in super::super) fn read(source: &Source) -> Option<Result<Found>> {
    let is_card = |line: &str| keyword(line).is_some_and(|(name, _)| name == "ELASTIC");
    source.text.lines().any(is_card).then(|| deck(source).map_err(|e| e.at(source.place)))
}

/// The name and the parameters of a keyword line, in capitals.
fn keyword(line: &str) -> Option<(String, Vec<String>)> {
    let rest = line.trim_start().strip_prefix('*').filter(|rest| !rest.starts_with('*'))?;
    let mut words = rest.split(',').map(|word| word.trim().to_uppercase());
    Some((words.next()?, words.collect()))
}

/// The value of a parameter.
fn parameter(words: &[String], name: &str) -> Option<String> {
    words.iter().find_map(|word| {
        let (key, value) = word.split_once('=')?;
        (key.trim() == name).then(|| value.trim().trim_matches('"').to_string())
    })
}

fn deck(source: &Source) -> Result<Found> {
    let (cards, density) = cards(source.text)?;
    let card = match &cards[..] {
        [card] => card,
        _ => {
            let names: Vec<String> =
                cards.iter().take(8).map(|c| format!("{} (line {})", c.material, c.line)).collect();
            let problem = format!("there are {} *ELASTIC cards: {}", cards.len(), enumeration(&names));
            let first = cards.first().map_or("", |card| card.material.as_str());
            let remedy =
                Wording::from("choose one with ").choice("row", first).words(", or give one material by itself");
            return Err(Error::input(problem, remedy));
        }
    };
    let mut found = one(source, card).map_err(|e| e.at(format!("line {}", card.line)))?;
    if density {
        found.read_as += "; *DENSITY is not taken, for the file names no unit of it";
    }
    found.name = card.material.clone();
    Ok(found)
}

/// The deck with the lines of one material only, by its name in any letter case, or by "line:7" of its card; the lines keep
/// their numbers. `None` where there is no `*ELASTIC` card.
///
/// # Errors
/// No material of that name, or several.
pub(in super::super) fn only(text: &str, row: &str) -> Option<Result<String>> {
    let name_of = |line: &str| {
        let (name, words) = keyword(line)?;
        (name == "MATERIAL").then(|| parameter(&words, "NAME").unwrap_or_default())
    };
    let is_card = |line: &str| keyword(line).is_some_and(|(name, _)| name == "ELASTIC");
    let lines: Vec<&str> = text.lines().collect();
    if !lines.iter().any(|line| is_card(line)) {
        return None;
    }
    let starts: Vec<(usize, String)> =
        lines.iter().enumerate().filter_map(|(n, line)| Some((n, name_of(line)?))).collect();
    let end = |which: usize| starts.get(which + 1).map_or(lines.len(), |next| next.0);
    let of_line = row.strip_prefix("line:").and_then(|line| line.trim().parse::<usize>().ok());
    let called = |which: &usize| match of_line {
        Some(line) => (starts[*which].0..end(*which)).contains(&line.saturating_sub(1)),
        None => starts[*which].1.eq_ignore_ascii_case(row.trim()),
    };
    let found: Vec<usize> = (0..starts.len()).filter(called).collect();
    let names: Vec<&str> = starts.iter().take(12).map(|(_, name)| name.as_str()).collect();
    Some(match found[..] {
        [which] => {
            let kept = starts[which].0..end(which);
            let is_kept = |n: usize| kept.contains(&n) || lines[n].trim_start().starts_with("**");
            Ok((0..lines.len()).map(|n| if is_kept(n) { lines[n] } else { "" }).collect::<Vec<_>>().join("\n"))
        }
        [] => {
            Err(Error::input(format!("there is no material {}", quoted(row)), suggestion(&row.to_uppercase(), &names)))
        }
        _ => {
            let at: Vec<String> = found.iter().map(|which| (starts[*which].0 + 1).to_string()).collect();
            let problem = format!("{} materials are called {}, in lines {}", at.len(), quoted(row), enumeration(&at));
            Err(Error::input(
                problem,
                Wording::from("choose one by its line, as ").choice("row", format!("line:{}", at[0])),
            ))
        }
    })
}

/// Every `*ELASTIC` card, and whether there is a density.
fn cards(text: &str) -> Result<(Vec<Card>, bool)> {
    let (mut all, mut material, mut density): (Vec<Card>, _, _) = (Vec::new(), String::new(), false);
    let mut open = false;
    for (n, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("**") || line.trim().is_empty() {
            continue;
        }
        if let Some((name, words)) = keyword(line) {
            open = name == "ELASTIC";
            density |= name == "DENSITY";
            if name == "MATERIAL" {
                material = parameter(&words, "NAME").unwrap_or_default();
            }
            if open {
                let kind = parameter(&words, "TYPE").unwrap_or_else(|| "ISOTROPIC".into());
                all.push(Card { line: n + 1, material: material.clone(), kind, numbers: Vec::new() });
            }
        } else if let (true, Some(card)) = (open, all.last_mut()) {
            for field in line.split(',').filter(|field| !field.trim().is_empty()) {
                card.numbers.push(number_of(field).map_err(|e| e.at(format!("line {}", n + 1)))?);
                if card.numbers.len() > 4096 {
                    return Err(Error::input("the card has thousands of numbers", "is it *ELASTIC?"));
                }
            }
        }
    }
    Ok((all, density))
}

fn one(source: &Source, card: &Card) -> Result<Found> {
    let (kind, needed) = match card.kind.as_str() {
        "ANISOTROPIC" | "ANISO" => ("ANISOTROPIC", 21),
        "ORTHOTROPIC" | "ORTHO" => ("ORTHOTROPIC", 9),
        "ENGINEERING CONSTANTS" | "ENGINEERINGCONSTANTS" => ("ENGINEERING CONSTANTS", 9),
        "ISOTROPIC" | "ISO" => ("ISOTROPIC", 2),
        other => {
            let problem =
                format!("*ELASTIC, TYPE={} is no stiffness in three dimensions that is known here", quoted(other));
            return Err(Error::input(problem, "give ANISOTROPIC, ORTHOTROPIC, ENGINEERING CONSTANTS or ISOTROPIC"));
        }
    };
    // Behind the constants a temperature may stand.
    let extra = card.numbers.len().checked_sub(needed);
    if !matches!(extra, Some(0 | 1)) {
        let remedy = match extra {
            None => "is the card cut off?",
            _ => "give one temperature, in a file by itself",
        };
        let problem = format!("{kind} has {needed} constants, and {} are there", counted(card.numbers.len(), "number"));
        return Err(Error::input(problem, remedy));
    }
    let values: Vec<f64> = card.numbers.iter().map(|f| f.value).collect();
    let own = units_of(source.text.lines().filter(|line| line.trim_start().starts_with("**")));
    let moduli = values[..needed].iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let unit = settled(source, &own, moduli)?;
    let mut square = Square::empty();
    let (stiffness, done) = match kind {
        "ANISOTROPIC" => {
            for ((a, b), figure) in Order::Abaqus.upper().into_iter().zip(&card.numbers) {
                square.set(a, b, *figure);
            }
            square.stiffness(unit.size, Order::Abaqus)?
        }
        "ORTHOTROPIC" => {
            let places = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2), (3, 3), (4, 4), (5, 5)];
            places.iter().zip(&card.numbers).for_each(|(&(a, b), figure)| square.set(a, b, *figure));
            square.stiffness(unit.size, Order::Abaqus)?
        }
        "ISOTROPIC" => (Orthotropic::isotropic(values[0], values[1]).stiffness(&unit)?, String::new()),
        _ => {
            let three = |from: usize| [values[from], values[from + 1], values[from + 2]];
            (Orthotropic { e: three(0), nu: three(3), g: three(6) }.stiffness(&unit)?, String::new())
        }
    };
    let temperature = match extra {
        Some(1) => format!(" at temperature {}", values[needed]),
        _ => String::new(),
    };
    Ok(Found::new(
        stiffness,
        format!("Abaqus *ELASTIC, TYPE={kind}{temperature}, {}, order 11 22 33 12 13 23{done}", unit.name),
    ))
}
