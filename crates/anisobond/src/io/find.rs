//! What a user may write where a material is wanted: a built-in name or the path of a file.

use std::path::Path;

use super::words::nearest;
use super::{read_material, read_table};
use crate::tensor::Material;
use crate::{Error, Result};

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

/// A material by built-in name (letter case does not count) or by path; of a table, the row with identifier `row`.
///
/// # Errors
/// Neither a name nor a file, with the nearest name; what the file's reader refuses; a table without `row`, or a `row`
/// that is not in it; a `row` or a `unit` for something that is no table.
pub fn find_material(name_or_path: &str, row: Option<&str>, unit: Option<&str>) -> Result<Material> {
    let path = Path::new(name_or_path);
    let of_tables_only = |material: Material| match row.map(|_| "row").or(unit.map(|_| "unit")) {
        None => Ok(material),
        Some(flag) => Err(Error::input(
            format!("--{flag} is for tables of materials, and {name_or_path} is one material"),
            format!("leave out --{flag}"),
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
    if !super::is_table(path) {
        return read_material(path).and_then(of_tables_only);
    }
    let Some(row) = row else {
        return Err(Error::input(
            format!("{name_or_path} is a table of materials"),
            "choose one with --row ID, or give the table to `anisobond calibrate`",
        ));
    };
    let table = read_table(path, unit)?;
    let ids: Vec<String> = table.rows.iter().map(|r| r.id.clone()).collect();
    match table.rows.into_iter().find(|r| r.id == row) {
        Some(found) => found.material,
        None => {
            let hint = nearest(row, ids.iter().map(String::as_str))
                .map_or_else(|| "see the table's identifiers".into(), |id| format!("did you mean {id}?"));
            Err(Error::input(format!("{name_or_path} has no row {row}"), hint))
        }
    }
}
