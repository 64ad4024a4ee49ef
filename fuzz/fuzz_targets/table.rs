//! A table of any content is refused with a message, or each of its rows is.
#![no_main]

use anisobond_formats::parse_table;

libfuzzer_sys::fuzz_target!(|text: &str| {
    for place in ["rocks.csv", "rocks.json", "rocks.jsonl", "rocks"] {
        match parse_table(text, place, None) {
            Ok(table) => table.rows.iter().for_each(|row| {
                assert!(row.line >= 1);
                match &row.material {
                    Ok(m) => m.stiffness.require_positive_definite().expect("a row that was read is positive definite"),
                    Err(e) => assert!(e.to_string().starts_with("rocks")),
                }
            }),
            Err(e) => assert!(e.to_string().starts_with("rocks")),
        }
    }
});
