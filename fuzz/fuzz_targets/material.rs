//! A material file or another program's text of any content is refused with a message or read as a sound material.
#![no_main]

use anisobond_formats::parse_reading;

libfuzzer_sys::fuzz_target!(|text: &str| {
    for (place, unit) in [("rock.toml", None), ("rock.json", None), ("rock.", Some("GPa"))] {
        match parse_reading(text, place, unit) {
            Ok(reading) => reading.material.stiffness.require_positive_definite().expect("a material that was read is positive definite"),
            Err(e) => assert!(e.to_string().starts_with("rock.")),
        }
    }
});
