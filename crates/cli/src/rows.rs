//! Tables for commands that say something of each material: one report per row, failures beside them.

use anisobond::tensor::Material;
use anisobond::{Error, Result};
use anisobond_app::each_row;
use anisobond_formats::{is_table, read_table};
use serde::Serialize;
use serde_json::{Value, json};

use crate::{Ending, args, text};

/// Whether a command is to report every row: a table of several, of which none is chosen.
pub fn asked(material: &str, table: &args::TableArgs) -> bool {
    let named = |path: &std::path::Path| path.exists() && !path.is_dir() && is_table(path);
    table.row.is_none()
        && named(std::path::Path::new(material))
        && read_table(material, table.unit.as_deref()).is_ok_and(|table| table.rows.len() != 1)
}

/// The report of every row, printed as JSON or a line each.
pub fn run<R: Serialize>(
    material: &str,
    args: &args::TableArgs,
    as_json: bool,
    report: impl Fn(&Material) -> Result<R> + Sync,
    line: impl Fn(&Value) -> String,
) -> Result<Ending> {
    let table = read_table(material, args.unit.as_deref())?;
    let rows = each_row(&table, report);
    for row in &rows {
        for warning in row["warnings"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            eprintln!("warning: {}: {warning}", row["id"].as_str().unwrap_or(""));
        }
    }
    let failed = rows.iter().filter(|row| !row["error"].is_null()).count();
    if as_json {
        text::print_json(&json!({ "rows": rows }))?;
    } else {
        let id = |row: &Value| row["id"].as_str().unwrap_or("").to_string();
        let words = |row: &Value| match row["error"].as_str() {
            Some(error) => format!("{:16} {error}\n", id(row)),
            None => format!("{:16} {:16} {}\n", id(row), row["material"].as_str().unwrap_or(""), line(row)),
        };
        text::print(&rows.iter().map(words).collect::<String>())?;
    }
    match failed {
        0 => Ok(Ending::Done),
        failed if failed == rows.len() => {
            Err(Error::input("no row of the table is a material", "see the errors of its rows"))
        }
        failed => {
            eprintln!("{failed} of {} rows failed", rows.len());
            Ok(Ending::RowsFailed)
        }
    }
}
