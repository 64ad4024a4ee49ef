//! VASP's OUTCAR: the total elastic moduli in kBar, their rows XX YY ZZ XY YZ ZX.

use super::figure::Figure;
use super::grid::blocks;
use super::unit::{settled, units_of};
use super::{Found, Source, counted};
use crate::material::matrix::Order;
use anisobond::{Error, Result};

const TITLE: &str = "TOTAL ELASTIC MODULI";

/// Lines of a block: title, header, ruler, six rows.
const LINES: usize = 9;

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    let starts: Vec<usize> = source.text.match_indices(TITLE).map(|(at, _)| at).take(1 << 16).collect();
    let Some(&last) = starts.last() else {
        let other = source.text.find("ELASTIC MODULI CONTR FROM").or(source.text.find("SYMMETRIZED ELASTIC MODULI"))?;
        return Some(Err(source.at(source.line(other))(Error::input(
            "the text has parts of VASP's elastic moduli, but not the total ones",
            "let the calculation end (IBRION = 6, ISIF = 3), or give the 6×6 matrix that you want by itself",
        ))));
    };
    let line = source.line(last);
    Some(block(source, &source.text[last..], starts.len()).map_err(source.at(line)))
}

fn block(source: &Source, text: &str, times: usize) -> Result<Found> {
    let lines: Vec<&str> = text.lines().take(LINES).collect();
    let found = blocks(&lines.join("\n"));
    let rows: Vec<Vec<Figure>> = found.iter().flat_map(|block| block.rows.clone()).collect();
    let square = found.first().and_then(|block| block.squares().into_iter().next()).ok_or_else(|| {
        let problem = format!(
            "the total elastic moduli are not whole: {} of six numbers",
            counted(rows.iter().filter(|row| row.len() == 6).count(), "row",)
        );
        Error::input(problem, "is the file cut off, or a number not printed (******)?")
    })?;
    let order = found[0].order().unwrap_or(Order::VASP);
    let own = units_of([lines[0]]);
    let unit = settled(source, &own, square.largest())?;
    let (stiffness, done) = square.stiffness(unit.size, order)?;
    let which = if times > 1 { format!(" (the last of {times} blocks)") } else { String::new() };
    let order = order.words();
    let read_as = format!("VASP OUTCAR, {TITLE}{which}, {}, order {order}{done}", unit.name);
    let mut found = Found::new(stiffness, read_as);
    found.name = name_of(source.text);
    Ok(found)
}

/// What INCAR calls the system.
fn name_of(text: &str) -> String {
    let line = text.lines().find_map(|line| line.trim_start().strip_prefix("SYSTEM")?.trim_start().strip_prefix('='));
    line.map_or("", str::trim).chars().take(80).collect()
}
