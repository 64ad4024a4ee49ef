//! Tests of the module.

use super::*;

#[test]
fn vectors_are_three_numbers_and_nothing_else() {
    assert_eq!(parse_vector("0, -1,2.5").unwrap(), Vector3::new(0.0, -1.0, 2.5));
    for wrong in ["", "0,0", "0,x,0,1", "0,0,1,", "0,0,nan", "inf,0,0"] {
        assert!(parse_vector(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn quantities() {
    for (dimension, text, value) in [
        (Dimension::Stress, "130 MPa", 130e6),
        (Dimension::Stress, " -1.5e2GPa ", -150e9),
        (Dimension::Stress, "−2 N/mm²", -2e6),
        (Dimension::Stress, "1 eV/Å^3", 1.602176634e11),
        (Dimension::Stress, "1eV/A3", 1.602176634e11),
        (Dimension::Stress, "10 Mpsi", 68.94757293168361e9),
        (Dimension::Stress, "1.2 Mbar", 120e9),
        (Dimension::Stress, "868 kbar", 86.8e9),
        (Dimension::Compliance, "7.7 1/TPa", 7.7e-12),
        (Dimension::Compliance, "7.7 GPa^-1", 7.7e-9),
        (Dimension::Length, "2 mm", 2e-3),
        (Dimension::Length, "3 µm", 3e-6),
        (Dimension::Length, "3 μm", 3e-6),
        (Dimension::Length, "1 Å", 1e-10),
        (Dimension::Length, ".5 in", 0.0127),
        (Dimension::Density, "2.65 g/cm³", 2650.0),
        (Dimension::Density, "2650 kg / m3", 2650.0),
        (Dimension::Angle, "180°", std::f64::consts::PI),
        (Dimension::Angle, "0.5 rad", 0.5),
    ] {
        let parsed = dimension.parse(text).unwrap();
        assert!((parsed / value - 1.0).abs() < 1e-15, "{text}: {parsed}");
    }
}

#[test]
fn every_unit_is_found_and_unique() {
    for (dimension, name, size) in UNITS {
        assert_eq!(dimension.unit(name).unwrap(), size);
        assert_eq!(UNITS.iter().filter(|u| u.1 == name).count(), 1, "{name}");
    }
}

#[test]
fn refusals() {
    for (dimension, text, parts) in [
        (Dimension::Stress, "130 mPa", &["unknown unit \"mPa\"", "it reads as 1e-3 Pa; use one of Pa", "case"][..]),
        (Dimension::Stress, "130 Mpa", &["did you mean MPa = 1e6 Pa", "case"]),
        (Dimension::Stress, "130 GPas", &["did you mean GPa = 1e9 Pa"]),
        (Dimension::Stress, "130 daN/mm2", &["use one of Pa"]),
        (Dimension::Stress, "130 mN/um2", &["write GPa = 1e9 Pa"]),
        (Dimension::Density, "3 kg/cm3", &["it reads as 1e6 kg/m3; use one of"]),
        (Dimension::Density, "3 g/mm3", &["it reads as 1e6 kg/m3"]),
        (Dimension::Length, "3 dm", &["it reads as 1e-1 m"]),
        (Dimension::Force, "3 GN", &["it reads as 1e9 N"]),
        (Dimension::Stress, "130 GPA", &["did you mean GPa"]),
        (Dimension::Stress, "130 mm", &["\"mm\" is a unit of a length", "a stress is needed"]),
        (Dimension::Stress, "130 1/GPa", &["is a unit of a compliance"]),
        (Dimension::Stress, "130 furlong", &["unknown unit", "use one of Pa, kPa"]),
        (Dimension::Stress, "130", &["has no unit", "130 GPa"]),
        (Dimension::Stress, "1,5 GPa", &["comma", "point"]),
        (Dimension::Stress, "nan GPa", &["not a finite number"]),
        (Dimension::Stress, "inf GPa", &["not a finite number"]),
        (Dimension::Stress, "1e400 Pa", &["too large"]),
        (Dimension::Stress, "1e305 TPa", &["too large"]),
        (Dimension::Stress, "", &["not a finite number"]),
        (Dimension::Stress, "- 5 Pa", &["not a finite number"]),
        (Dimension::Compliance, "3 GPa", &["is a unit of a stress"]),
        (Dimension::Length, "3 M", &["did you mean m ="]),
        (Dimension::Density, "3 kg/m2", &["unknown unit", "use one of kg/m3"]),
        (Dimension::Angle, "3 Rad", &["did you mean rad"]),
    ] {
        let message = dimension.parse(text).unwrap_err().to_string();
        for part in parts {
            assert!(message.contains(part), "{text}: {message}");
        }
    }
}
