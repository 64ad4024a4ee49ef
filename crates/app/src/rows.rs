//! What is said of every row of a table of materials: rows in parallel, failures kept with their rows.

use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use anisobond::tensor::Material;
use anisobond::{Error, Result};
use anisobond_formats::json_value;
use anisobond_formats::table::{Row, Table};

/// A row's report as JSON, headed by `id`, `line` and `read_as`; of a failed row its `id`, `line`, `error` and `kind`. In the
/// table's order.
pub fn each_row<R: Serialize>(table: &Table, report: impl Fn(&Material) -> Result<R> + Sync) -> Vec<Value> {
    table.rows.par_iter().map(|row| row_value(row, &report)).collect()
}

fn row_value<R: Serialize>(row: &Row, report: &(impl Fn(&Material) -> Result<R> + Sync)) -> Value {
    let material = match &row.material {
        Ok(material) => material,
        Err(error) => return failure(row, error),
    };
    match report(material).and_then(|report| json_value(&report)) {
        Ok(Value::Object(entries)) => {
            let mut value = json!({ "id": row.id, "line": row.line, "read_as": row.read_as });
            if let Value::Object(all) = &mut value {
                all.extend(entries);
            }
            value
        }
        Ok(other) => other,
        Err(error) => failure(row, &error),
    }
}

fn failure(row: &Row, error: &Error) -> Value {
    json!({ "id": row.id, "line": row.line, "error": error.to_string(), "kind": error.kind().name() })
}
