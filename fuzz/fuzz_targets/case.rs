//! A case file of any content is refused with a message or resolved to a problem whose every node is in its body.
#![no_main]

use anisobond_app::CaseFile;

libfuzzer_sys::fuzz_target!(|text: &str| {
    match CaseFile::parse(text, "case.toml", &[]) {
        Ok(case) => {
            // Larger bodies take time, and nothing else.
            if case.grid().is_ok_and(|grid| grid.len() < 5_000) {
                match case.problem() {
                    Ok(problem) => assert!(problem.probes.iter().flat_map(|p| &p.nodes).all(|&n| problem.body.has(n as usize))),
                    Err(e) => assert!(e.to_string().starts_with("case.toml")),
                }
            }
        }
        Err(e) => assert!(e.to_string().starts_with("case.toml")),
    }
});
