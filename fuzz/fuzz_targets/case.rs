//! A case file of any content is refused with a message or resolved to a problem whose every node is in its body. Files that it
//! names are not there: relative paths are in a folder that is not, and others are left out.
#![no_main]

use anisobond::Error;
use anisobond_app::CaseFile;

const FILE: &str = "/no such folder/case.toml";

libfuzzer_sys::fuzz_target!(|text: &str| {
    if names_root(text) {
        return;
    }
    match CaseFile::parse(text, FILE, &[]) {
        Ok(case) => {
            // Larger bodies take time, and nothing else.
            if case.grid().is_ok_and(|grid| grid.len() < 5_000) {
                match case.problem() {
                    Ok(problem) => {
                        assert!(problem.probes.iter().flat_map(|p| &p.nodes).all(|&n| problem.body.has(n as usize)))
                    }
                    Err(e) => assert!(said(&e)),
                }
            }
        }
        Err(e) => assert!(said(&e)),
    }
});

/// Whether an error names the case, or the file that is not there.
fn said(error: &Error) -> bool {
    matches!(error, Error::File { .. }) || error.to_string().starts_with(FILE)
}

/// Whether a text may begin at the root of the disk, or say so with an escape.
fn names_root(text: &str) -> bool {
    let close: String = text.split_whitespace().collect();
    close.contains('\\') || close.contains("\"/") || close.contains("'/")
}
