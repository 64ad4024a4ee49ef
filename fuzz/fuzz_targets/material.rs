//! A material file of any content is refused with a message or read as a sound material.
#![no_main]

use anisobond_formats::parse_material;

libfuzzer_sys::fuzz_target!(|text: &str| {
    for place in ["rock.toml", "rock.json"] {
        match parse_material(text, place) {
            Ok(m) => m.stiffness.require_positive_definite().expect("a material that was read is positive definite"),
            Err(e) => assert!(e.to_string().starts_with("rock.")),
        }
    }
});
