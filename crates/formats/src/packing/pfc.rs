//! Commands of PFC that make balls: `ball create id 1 position (0.1, 0.2, 0.3) radius 0.05`, `BALL id=1 x=0.1 y=0.2 z=0.3 rad=0.05`.

use super::columns::{NOTHING, Role};
use super::found::{Found, Lengths, unit_in_words};
use super::numbers::number;
use super::{PackingColumn, Source};
use crate::words::quoted;
use anisobond::{Error, Result};

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    let makes_ball = |line: &str| words(line).is_some_and(|words| words.len() > 4);
    source.text().lines().any(makes_ball).then(|| balls(source.text()))
}

/// The words behind `ball` or `ball create`; `None` for another command.
fn words(line: &str) -> Option<Vec<&str>> {
    let command = line.split([';', '#']).next().unwrap_or("");
    let mut words = command.split([' ', '\t', '=', ',', '(', ')']).filter(|word| !word.is_empty());
    if !words.next()?.eq_ignore_ascii_case("ball") {
        return None;
    }
    let rest: Vec<&str> = words.collect();
    let create = rest.first().is_some_and(|word| word.eq_ignore_ascii_case("create"));
    let named = |word: &&str| ["id", "radius", "rad", "x", "position", "pos"].contains(&word.to_lowercase().as_str());
    (create || rest.first().is_some_and(named)).then(|| rest[usize::from(create)..].to_vec())
}

fn balls(text: &str) -> Result<Found> {
    let unit = text.lines().filter_map(|line| line.trim().strip_prefix([';', '#'])).find_map(unit_in_words);
    let lengths = unit.map_or(Lengths::Open, |(name, size)| Lengths::Named(name, size));
    let mut found = Found::new("PFC's commands that make balls", lengths);
    let (mut left, mut others): (Vec<String>, Vec<usize>) = (Vec::new(), Vec::new());
    for (n, line) in text.lines().enumerate() {
        match words(line) {
            Some(words) => {
                let sphere = ball(&words, &mut left).map_err(|e| e.at(format!("line {}", n + 1)))?;
                found.push(n + 1, sphere);
            }
            None if line.split([';', '#']).next().is_some_and(|command| !command.trim().is_empty()) => {
                others.push(n + 1)
            }
            None => {}
        }
    }
    if let Some(first) = others.first() {
        found.notes.push(format!("{} other commands are passed over, the first in line {first}", others.len()));
    }
    let column = |column: &str, taken: &str| PackingColumn { column: column.into(), taken_for: taken.into() };
    found.columns = vec![column("position", "x y z"), column("radius", "radius")];
    found.columns.extend(left.iter().map(|word| column(word, NOTHING)));
    Ok(found)
}

/// x, y, z and r of the words of a command; those that are not taken are kept, each once.
fn ball(words: &[&str], left: &mut Vec<String>) -> Result<[f64; 4]> {
    let mut values = [None; 4];
    let mut at = 0;
    while let Some(word) = words.get(at) {
        let lower = word.to_lowercase();
        let (places, count) = match (lower.as_str(), Role::of(&lower)) {
            ("position" | "pos", _) => (0..3, 3),
            (_, Some(Role::Centre(axis))) => (axis..axis + 1, 1),
            (_, Some(Role::Radius)) => (3..4, 1),
            _ => {
                let known = left.contains(&lower);
                if number(word).is_err() && !known && left.len() < 32 {
                    left.push(lower);
                }
                at += 1;
                continue;
            }
        };
        for (place, word) in places.zip(words.iter().skip(at + 1)) {
            if values[place].replace(number(word)?).is_some() {
                return Err(Error::input(format!("{} is given twice", quoted(&lower)), "keep one of them"));
            }
        }
        at += 1 + count;
    }
    match values {
        [Some(x), Some(y), Some(z), Some(r)] => Ok([x, y, z, r]),
        _ => Err(Error::input(
            "the ball has no whole position or no radius",
            "write ball create position x y z radius r",
        )),
    }
}
