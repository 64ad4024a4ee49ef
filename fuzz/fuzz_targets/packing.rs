//! A packing's file of any content is refused with a message, or read to a packing that is written and read back the same.
#![no_main]

use anisobond_formats::{PackingFormat, packing_text, parse_packing};

libfuzzer_sys::fuzz_target!(|text: &str| {
    for format in [PackingFormat::Text, PackingFormat::Csv, PackingFormat::Vtp, PackingFormat::Lammps] {
        if let Ok(packing) = parse_packing(text, format) {
            for written in [PackingFormat::Text, PackingFormat::Csv, PackingFormat::Vtp] {
                let read = parse_packing(&packing_text(&packing, written), written).expect("what we write is read");
                assert_eq!(read, packing);
            }
        }
    }
});
