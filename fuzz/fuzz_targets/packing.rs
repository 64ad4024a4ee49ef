//! A file of spheres of any content is refused with a message, or read to a packing that is written and read back the same; what it
//! leaves open is given or not.
#![no_main]

use anisobond_formats::{PackingFormat, PackingOptions, packing_text, parse_packing};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let open = PackingOptions::default();
    let given = PackingOptions { length_unit: Some("mm".into()), frame: Some(5), ..PackingOptions::default() };
    let typed = PackingOptions { length_unit: Some("mm".into()), type_radii: vec![0.1, 0.2], ..PackingOptions::default() };
    for options in [&open, &given, &typed] {
        if let Ok(reading) = parse_packing(bytes, options) {
            assert!(!reading.read_as.is_empty());
            for format in [PackingFormat::Text, PackingFormat::Csv, PackingFormat::Vtp] {
                let written = packing_text(&reading.packing, format);
                let read = parse_packing(written.as_bytes(), &open).expect("what we write is read");
                assert_eq!(read.packing, reading.packing);
            }
        }
    }
});
