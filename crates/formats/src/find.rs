//! What a user may write where a material is wanted: a built-in name or the path of a file.

use std::path::Path;

use crate::table::Row;
use crate::words::{enumeration, nearest};
use crate::{read_material, read_table};
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

/// A material by built-in name (letter case does not count) or by path; of a table, the row with identifier `row`, or
/// that of a line, `row` = "line:3".
///
/// # Errors
/// Neither a name nor a file, with the nearest name; what the file's reader refuses; a table without `row`, or a `row`
/// that is not in it, or several times; a `row` or a `unit` for something that is no table.
pub fn find_material(name_or_path: &str, row: Option<&str>, unit: Option<&str>) -> Result<Material> {
    let path = Path::new(name_or_path);
    let of_tables_only = |material: Material| match row.map(|_| "row").or(unit.map(|_| "unit")) {
        None => Ok(material),
        Some(name) => Err(Error::input(
            format!("a {name} is for tables of materials, and {name_or_path} is one material"),
            Wording::from("leave out ").choice(name, ""),
        )),
    };
    if !path.exists()
        && let Some(material) = Material::builtin(name_or_path)
    {
        return of_tables_only(material);
    }
    if path.is_dir() {
        return Err(Error::input(format!("{name_or_path} is a folder"), "give the file of a material or a table"));
    }
    if !path.exists() {
        return builtin_material(name_or_path);
    }
    if !crate::is_table(path) {
        return read_material(path).and_then(of_tables_only);
    }
    let Some(row) = row else {
        return Err(Error::input(
            format!("{name_or_path} is a table of materials"),
            Wording::from("choose one with ").choice("row", "ID").words(", or calibrate the table as a whole"),
        ));
    };
    choose(read_table(path, unit)?.rows, row).map_err(|e| e.at(name_or_path))
}

/// The row of an identifier, or by its line ("line:3"), where several have one identifier.
fn choose(rows: Vec<Row>, wanted: &str) -> Result<Material> {
    let of_line = wanted.strip_prefix("line:").and_then(|line| line.trim().parse::<usize>().ok());
    let called = |row: &Row| row.id == wanted || of_line == Some(row.line);
    let lines: Vec<String> = rows.iter().filter(|row| called(row)).map(|row| row.line.to_string()).collect();
    if lines.len() > 1 {
        return Err(Error::input(
            format!("{} rows are called {wanted}, in lines {}", lines.len(), enumeration(&lines)),
            Wording::from("choose one by its line, as ").choice("row", format!("line:{}", lines[0])),
        ));
    }
    let ids: Vec<String> = rows.iter().map(|r| r.id.clone()).collect();
    match rows.into_iter().find(called) {
        Some(found) => found.material,
        None => {
            let hint = nearest(wanted, ids.iter().map(String::as_str))
                .map_or_else(|| "see the table's identifiers".into(), |id| format!("did you mean {id}?"));
            Err(Error::input(format!("there is no row {wanted}"), hint))
        }
    }
}
