//! An orientation of any text is refused with a message or an orthogonal matrix; a quantity is refused or finite.
#![no_main]

use anisobond_formats::{Dimension, parse_orientation};

libfuzzer_sys::fuzz_target!(|text: &str| {
    if let Ok(q) = parse_orientation(text) {
        let product = q * q.transpose();
        for row in 0..3 {
            for column in 0..3 {
                let identity = if row == column { 1.0 } else { 0.0 };
                assert!((product[(row, column)] - identity).abs() < 1e-12);
            }
        }
    }
    use Dimension::{Angle, Compliance, Density, Length, Stress};
    for dimension in [Stress, Compliance, Length, Density, Angle] {
        if let Ok(value) = dimension.parse(text) {
            assert!(value.is_finite());
        }
    }
});
