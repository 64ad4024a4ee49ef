//! A table of parameters of any content is refused with a message that names the file, or each of its jobs is its own.
#![no_main]

use std::collections::HashSet;

use anisobond_app::sweep::ParameterTable;

libfuzzer_sys::fuzz_target!(|text: &str| {
    for file in ["sweep.toml", "sweep.csv"] {
        match ParameterTable::parse(text, file) {
            Ok(table) => {
                let ids: HashSet<&str> = table.jobs().iter().map(|job| job.id.as_str()).collect();
                assert!(!ids.is_empty() && ids.len() == table.jobs().len());
            }
            Err(e) => assert!(e.to_string().starts_with("sweep")),
        }
    }
});
