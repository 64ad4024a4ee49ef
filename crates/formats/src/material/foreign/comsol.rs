//! Lists of COMSOL's materials: `D` (rows x y z xy yz xz), `DVo` and `cE` (rows xx yy zz yz xz xy), 36 numbers or the upper
//! triangle of 21 column by column, each with its unit: `{"127[GPa]", "80[GPa]", …}`.

use super::figure::Figure;
use super::square::Square;
use super::unit::{settled, units_of};
use super::{Found, Source, counted};
use crate::material::matrix::Order;
use crate::words::quoted;
use anisobond::{Error, Result};

/// Names of lists, and the order of their rows.
const LISTS: [(&str, Order); 3] = [("DVo", Order::Voigt), ("cE", Order::Voigt), ("D", Order::VASP)];

/// Longest list that is read (bytes).
const MOST: usize = 1 << 14;

/// Most lists that are looked at.
const MOST_LISTS: usize = 10_000;

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    for (open, _) in source.text.match_indices('{').take(MOST_LISTS) {
        let start = source.text.floor_char_boundary(open.saturating_sub(200));
        let before = source.text[start..open].rsplit('\n').next().unwrap_or("");
        let words: Vec<&str> = before.split(|c: char| !c.is_alphanumeric()).collect();
        let Some((name, order)) = LISTS.iter().find(|(name, _)| words.contains(name)) else { continue };
        let end = source.text.floor_char_boundary((open + MOST).min(source.text.len()));
        let Some((inside, _)) = source.text[open + 1..end.max(open + 1)].split_once('}') else { continue };
        let fields: Vec<&str> = inside.split(',').map(|field| field.trim().trim_matches(['"', '\''])).collect();
        if fields.len() >= 6 {
            return Some(of_fields(source, name, *order, &fields).map_err(source.at(source.line(open))));
        }
    }
    None
}

fn of_fields(source: &Source, name: &str, order: Order, fields: &[&str]) -> Result<Found> {
    let places: Vec<(usize, usize)> = match fields.len() {
        36 => (0..36).map(|n| (n / 6, n % 6)).collect(),
        21 => Order::Abaqus.upper(),
        count => {
            let problem = format!("{name} has {}", counted(count, "number"));
            return Err(Error::input(problem, "give 36, or 21 of the upper triangle, column by column"));
        }
    };
    let mut square = Square::empty();
    for ((a, b), field) in places.into_iter().zip(fields) {
        let number = field.split('[').next().unwrap_or("").trim();
        let figure = Figure::of(number).ok_or_else(|| {
            Error::input(
                format!("{} is not a finite number", quoted(field)),
                "write a number with its unit, as 127[GPa]",
            )
        })?;
        if fields.len() == 21 { square.set(a, b, figure) } else { square.0[a][b] = figure }
    }
    let unit = settled(source, &units_of(fields.iter().copied()), square.largest())?;
    let (stiffness, done) = square.stiffness(unit.size, order)?;
    let rows = if order == Order::Voigt { "xx yy zz yz xz xy" } else { "xx yy zz xy yz xz" };
    Ok(Found::new(stiffness, format!("COMSOL list {name} of {}, {}, order {rows}{done}", fields.len(), unit.name)))
}
