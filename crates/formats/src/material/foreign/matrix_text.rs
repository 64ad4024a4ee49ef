//! A 6×6 matrix or its triangle as text: ELATE, MTEX, dpgen, VASPKIT, AELAS, ElasTool, CASTEP, CRYSTAL, thermo_pw, a
//! spreadsheet or an editor. Words above or beside it say what it is, in which unit and order.

use super::grid::{Block, blocks};
use super::square::Square;
use super::unit::{settled, units_of};
use super::{Found, MOST_SEARCHED, Source};
use crate::material::StressUnit;
use crate::material::matrix::Order;
use crate::words::{enumeration, number};
use anisobond::{Error, Result};

/// Words by which programs are known, and their names.
const PROGRAMS: [(&str, &str); 13] = [
    ("VASPKIT", "VASPKIT"),
    ("Stiffness Tensor C_ij", "VASPKIT"),
    ("AELAS", "AELAS"),
    ("Chung-Buessem Anisotropy Index (Ac=(Gv-Gr)/(Gv+Gr))", "AELAS"),
    ("elastool", "ElasTool"),
    ("ElasTool", "ElasTool"),
    ("Elastic Stiffness Constants Cij", "CASTEP"),
    ("CASTEP", "CASTEP"),
    ("SYMMETRIZED ELASTIC CONSTANTS", "CRYSTAL"),
    ("thermo_pw", "Quantum ESPRESSO thermo_pw"),
    ("Elastic constants C_ij", "Quantum ESPRESSO thermo_pw"),
    ("tensor in Voigt matrix representation", "MTEX"),
    ("MTEX", "MTEX"),
];

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    if source.text.len() > MOST_SEARCHED {
        return None;
    }
    let all = blocks(source.text);
    let matrices: Vec<(&Block, Square)> =
        all.iter().flat_map(|block| block.squares().into_iter().map(move |square| (block, square))).collect();
    if matrices.is_empty() {
        return broken(source, &all).map(Err);
    }
    Some(chosen(source, matrices))
}

/// The program that wrote a text, where it says so.
pub(super) fn program(source: &Source) -> Option<&'static str> {
    PROGRAMS.iter().find(|(words, _)| source.text.contains(words)).map(|(_, name)| *name)
}

/// Whether a line speaks of the inverse.
fn of_compliance(title: &str) -> bool {
    let title = title.to_lowercase();
    ["complian", "flexib", "s_ij", "sij", "^-1", "^{-1", "1/gpa", "1/mbar", "1/kbar", "inverse"]
        .iter()
        .any(|w| title.contains(w))
}

/// Whether a line speaks of a stiffness.
fn of_stiffness(title: &str) -> bool {
    let title = title.to_lowercase();
    ["stiffness", "elastic", "c_ij", "cij", "voigt matrix"].iter().any(|w| title.contains(w))
}

fn chosen(source: &Source, matrices: Vec<(&Block, Square)>) -> Result<Found> {
    let nearest = |block: &Block| block.title(|t| of_compliance(t) || of_stiffness(t)).map(of_compliance);
    let (titled, rest): (Vec<_>, Vec<_>) = matrices.into_iter().partition(|(block, _)| nearest(block) == Some(false));
    let untitled: Vec<_> = rest.iter().filter(|(block, _)| nearest(block).is_none()).cloned().collect();
    let candidates = if titled.is_empty() { untitled } else { titled };
    let Some((block, square)) = candidates.first() else {
        let line = rest.first().map_or(1, |(block, _)| block.line);
        return Err(source.at(line)(Error::input(
            "the text has a compliance and no stiffness",
            "write it as compliance = [ … ] in a material file, with its unit",
        )));
    };
    if candidates.iter().any(|(_, other)| !other.agrees(square)) {
        let lines: Vec<String> = candidates.iter().take(6).map(|(block, _)| block.line.to_string()).collect();
        return Err(Error::input(
            format!("{} matrices may be the stiffness, in lines {}", candidates.len(), enumeration(&lines)),
            "give the one that you want by itself",
        )
        .at(source.place));
    }
    whole(source, block, square).map_err(source.at(block.line))
}

fn whole(source: &Source, block: &Block, square: &Square) -> Result<Found> {
    let program = program(source).or(source.place.contains("ELASTIC_TENSOR").then_some("VASPKIT"));
    let factor = block.factor();
    let largest = factor * square.largest();
    let mut own = own_units(source, block);
    // VASPKIT's input file and AELAS' output are in GPa, and do not say so.
    let in_giga_pascal = match program {
        Some("VASPKIT") => source.unit.is_none(),
        Some("AELAS") => true,
        _ => false,
    };
    if own.is_empty() && in_giga_pascal {
        own.push(StressUnit::giga_pascal());
    }
    let unit = settled(source, &own, largest)?;
    let named = block.order();
    if named.is_none() && program.is_none() && unit.name == "kbar" && square.differs_in(Order::VASP) {
        return Err(two_orders(square, unit.size * factor));
    }
    let order = named.unwrap_or(Order::Voigt);
    let (stiffness, done) = square.stiffness(unit.size * factor, order)?;
    let what = match program {
        Some(program) => format!("{program}, 6×6 matrix"),
        None => "6×6 matrix as text".into(),
    };
    let read_as = format!("{what}, {}, order {}{done}", unit.name, order.words());
    let mut found = Found::new(stiffness, read_as);
    found.name = mineral(block);
    Ok(found)
}

/// The units of the nearest line above that names any, else those of all words of the text.
fn own_units(source: &Source, block: &Block) -> Vec<StressUnit> {
    let near = block.title(|title| !units_of([title]).is_empty()).map(|title| units_of([title]));
    near.unwrap_or_else(|| units_of(source.text.lines()))
}

/// kbar is VASP's unit, and its rows stand in another order.
fn two_orders(square: &Square, unit: f64) -> Error {
    let c44 = |order: Order| number(square.0[order.row(3)][order.row(3)].value * unit / 1e9);
    Error::input(
        format!(
            "no order of rows is named, and kbar is VASP's unit: C44 is {} GPa if the rows are 11 22 33 23 13 12, {} GPa if \
             they are XX YY ZZ XY YZ ZX",
            c44(Order::Voigt),
            c44(Order::VASP)
        ),
        "write the order in a line above the numbers, as # XX YY ZZ XY YZ ZX",
    )
}

/// MTEX names the mineral.
fn mineral(block: &Block) -> String {
    let of =
        |title: &String| title.split_once("mineral").map(|(_, rest)| rest.trim_start_matches([' ', ':']).to_string());
    block.titles.iter().find_map(of).unwrap_or_default()
}

/// Why a text that seems to hold a matrix has none; `None` if it does not seem to.
fn broken(source: &Source, all: &[Block]) -> Option<Error> {
    let block = all.iter().find(|block| {
        let wide = block.rows.iter().filter(|row| (3..=7).contains(&row.len())).count();
        wide >= 2 && (all.len() <= 2 || block.title(of_stiffness).is_some())
    })?;
    let words = source.text.lines().enumerate().skip(block.line.saturating_sub(1)).take(8);
    let odd = words.filter(|(_, line)| line.split_whitespace().count() >= 4).find_map(|(n, line)| {
        let (good, bad): (Vec<&str>, Vec<&str>) =
            line.split_whitespace().partition(|w| super::figure::figures(w).is_some());
        (good.len() >= 3 && !bad.is_empty() && !line.trim_start().starts_with('#')).then(|| (n + 1, bad[0].to_string()))
    });
    Some(match odd {
        Some((line, word)) => source.at(line)(Error::input(
            format!("{} is not a finite number", crate::words::quoted(&word)),
            "write a number such as 130, 0.25 or 1.3e2",
        )),
        None => {
            let lengths: Vec<usize> = block.rows.iter().take(8).map(Vec::len).collect();
            source.at(block.line)(Error::input(
                format!("a 6×6 matrix is needed, not rows of {lengths:?} numbers"),
                "give six rows of six numbers, or rows of 6, 5, 4, 3, 2 and 1 (upper triangle); is the text cut off?",
            ))
        }
    })
}
