//! What a user may write where a material is wanted: a built-in name or the path of a file.

use std::path::Path;

use crate::table::Row;
use crate::tree::read_text;
use crate::words::{enumeration, nearest};
use crate::{Reading, read_reading, read_table};
use anisobond::tensor::Material;
use anisobond::{Error, Result, Wording};

/// A built-in material by name; letter case does not count.
///
/// # Errors
/// Another name, with the nearest.
pub fn builtin_material(name: &str) -> Result<Material> {
    let names = Material::builtin_names();
    Material::builtin(name).ok_or_else(|| {
        let hint = match nearest(name, names.iter().copied()) {
            Some(name) => format!("did you mean {name}?"),
            None => format!("give a file, or one of {}", names.join(", ")),
        };
        let problem = match name.trim() {
            "" => "no material is named".into(),
            name => format!("{name}: neither a file nor a built-in material"),
        };
        Error::input(problem, hint)
    })
}

/// A material by built-in name (letter case does not count) or by path; see [`find_reading`].
///
/// # Errors
/// As [`find_reading`].
pub fn find_material(name_or_path: &str, row: Option<&str>, unit: Option<&str>) -> Result<Material> {
    find_reading(name_or_path, row, unit).map(|reading| reading.material)
}

/// A material by built-in name (letter case does not count) or by path, and what its file was taken for. Of a table, the row
/// with identifier `row`; of several with one identifier, `row` = "Q#2" is the second, and "line:3" that of a line. A table of
/// one row needs no `row`. `unit` is the unit of numbers for which the file names none.
///
/// # Errors
/// Neither a name nor a file, with the nearest name; what the file's reader refuses; a table of several without `row`, or a
/// `row` that is not in it, or several times (of a deck of Abaqus `row` is the name of a material); a `row` for something that is no table; a `unit` for a built-in material.
pub fn find_reading(name_or_path: &str, row: Option<&str>, unit: Option<&str>) -> Result<Reading> {
    let path = Path::new(name_or_path);
    let leave_out = |name: &'static str, what: &str| {
        let problem = format!("a {name} is for {what}");
        Err(Error::input(problem, Wording::from("leave out ").choice(name, "")))
    };
    let of_builtin = |material: Material| match (row, unit) {
        (None, None) => {
            let read_as = format!("built-in material, {}", material.source);
            Ok(Reading { material, read_as: read_as.trim_end_matches(", ").into(), notes: Vec::new() })
        }
        (Some(_), _) => leave_out("row", &format!("tables of materials, and {name_or_path} is one material")),
        (_, Some(_)) => leave_out("unit", &format!("files, and {name_or_path} is one material that is built in")),
    };
    if !path.exists()
        && let Some(material) = Material::builtin(name_or_path)
    {
        return of_builtin(material);
    }
    if path.is_dir() {
        return Err(Error::input(format!("{name_or_path} is a folder"), "give the file of a material or a table"));
    }
    if !path.exists() {
        return builtin_material(name_or_path).and_then(of_builtin);
    }
    if !crate::is_table(path) {
        let Some(row) = row else { return read_reading(path, unit) };
        return match crate::material::foreign::of_row(&read_text(path)?, row) {
            Some(text) => crate::parse_reading(&text.map_err(|e| e.at(name_or_path))?, name_or_path, unit),
            None => leave_out("row", &format!("tables of materials, and {name_or_path} is one material")),
        };
    }
    let mut rows = read_table(path, unit)?.rows;
    match row {
        Some(row) => choose(rows, row).map_err(|e| e.at(name_or_path))?.reading(),
        None if rows.len() == 1 => rows.remove(0).reading(),
        None => Err(Error::input(
            format!("{name_or_path} is a table of {} materials: {}", rows.len(), listed(&rows)),
            Wording::from("choose one with ").choice("row", "ID").words(", or calibrate the table as a whole"),
        )),
    }
}

/// A material from text, as somebody pastes it: one material in any form ([`crate::parse_reading`]), or a table of one row.
///
/// # Errors
/// What its reader refuses; a table of several rows.
pub fn parse_any(text: &str, place: &str, unit: Option<&str>) -> Result<Reading> {
    if !crate::table::is_table_text(text) {
        return crate::parse_reading(text, place, unit);
    }
    let mut rows = crate::parse_table(text, "table", unit)?.rows;
    if rows.len() == 1 {
        return rows.remove(0).reading();
    }
    let problem = format!("this is a table of {} materials: {}", rows.len(), listed(&rows));
    Err(Error::input(problem, "give its header and one row").at(place))
}

/// Identifiers that are named in a message.
const SHOWN: usize = 12;

/// The first identifiers; those of one name by their number among them.
fn listed(rows: &[Row]) -> String {
    let number = |n: usize, row: &Row| 1 + rows[..n].iter().filter(|before| before.id == row.id).count();
    let same = |row: &Row| rows.iter().take(1000).filter(|other| other.id == row.id).count() > 1;
    let name =
        |(n, row): (usize, &Row)| if same(row) { format!("{}#{}", row.id, number(n, row)) } else { row.id.clone() };
    let mut names: Vec<String> = rows.iter().take(SHOWN).enumerate().map(name).collect();
    if rows.len() > SHOWN {
        names.push("…".into());
    }
    names.join(", ")
}

/// The row of an identifier; of several, by their number ("Q#2") or by its line ("line:3").
fn choose(rows: Vec<Row>, wanted: &str) -> Result<Row> {
    let of_line = wanted.strip_prefix("line:").and_then(|line| line.trim().parse::<usize>().ok());
    let called = |row: &Row| row.id == wanted || of_line == Some(row.line);
    let lines: Vec<String> = rows.iter().filter(|row| called(row)).map(|row| row.line.to_string()).collect();
    if lines.len() > 1 {
        return Err(Error::input(
            format!("{} rows are called {wanted}, in lines {}", lines.len(), enumeration(&lines)),
            Wording::from("choose one by its line, as ")
                .choice("row", format!("line:{}", lines[0]))
                .words(", or by its number among them, as ")
                .choice("row", format!("{wanted}#1")),
        ));
    }
    let ids: Vec<String> = rows.iter().map(|r| r.id.clone()).collect();
    let numbered = wanted.rsplit_once('#').and_then(|(id, number)| Some((id, number.parse::<usize>().ok()?)));
    let place = rows.iter().position(called).or_else(|| {
        let (id, number) = numbered?;
        rows.iter().enumerate().filter(|(_, row)| row.id == id).nth(number.checked_sub(1)?).map(|(n, _)| n)
    });
    match place.and_then(|place| rows.into_iter().nth(place)) {
        Some(found) => Ok(found),
        None => {
            let among = numbered.map(|(id, _)| (id, ids.iter().filter(|known| *known == id).count()));
            let hint = match (among, nearest(wanted, ids.iter().map(String::as_str))) {
                (Some((id, count @ 1..)), _) => format!("there are {count} called {id}"),
                (_, Some(id)) => format!("did you mean {id}?"),
                _ => "see the table's identifiers".into(),
            };
            Err(Error::input(format!("there is no row {wanted}"), hint))
        }
    }
}
