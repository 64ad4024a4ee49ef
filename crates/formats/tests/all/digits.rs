//! Tables of three digits, matrices with noise: read within the digits they have, and by how much is said.

use anisobond::tensor::SymmetryClass;
use anisobond_formats::parse_reading;

fn read(text: &str) -> anisobond_formats::Reading {
    parse_reading(text, "rock.toml", None).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn message(text: &str) -> String {
    parse_reading(text, "rock.toml", None).map(|r| r.read_as).unwrap_err().to_string()
}

/// Tantalum carbide as printed: c66 in whole GPa is not half the difference of c11 and c12, in whole GPa.
#[test]
fn constants_of_three_digits_make_the_closest_tensor_of_their_class() {
    let text = "unit = \"GPa\"\nclass = \"trigonal\"\nc11 = 464\nc12 = 159\nc13 = 141\nc14 = -45\nc33 = 493\nc44 = 125\nc66 = 153\n";
    let found = read(text);
    assert_eq!(found.notes.len(), 1);
    assert!(
        found.read_as.contains("made trigonal within the digits given (c66 = 153 GPa, where the others say 152.5 GPa)")
    );
    let c = found.material.stiffness;
    assert!(c.relative_error(&SymmetryClass::Trigonal.project(&c)) < 1e-14);
    let v = c.voigt();
    assert!((v[(5, 5)] - 0.5 * (v[(0, 0)] - v[(0, 1)])).abs() < 1.0 && v[(5, 5)] > 152.5e9 && v[(5, 5)] < 153e9);
    // Nothing is moved by more than its digits.
    assert!((v[(0, 0)] - 464e9).abs() < 0.5e9 && (v[(0, 1)] - 159e9).abs() < 0.5e9);
    assert!(read(&text.replace("153", "152.5")).notes.is_empty());
    assert!(message(&text.replace("153", "155")).contains("c66 = 155 GPa contradicts (c11 − c12)/2"));
}

/// A matrix with noise is of the class it is said to be, within a percent of its norm; the closest of the class is taken.
#[test]
fn matrices_with_noise_are_made_symmetric_and_of_their_class() {
    let row = |k: usize| {
        let mut row = [0.2, -0.3, 0.4, 0.1, -0.2, 0.3].map(|x: f64| x * (1.0 + k as f64 / 7.0));
        (0..3).for_each(|a| row[a] += if k < 3 { 64.0 } else { 0.0 });
        row[k] = if k < 3 { 166.0 + 0.3 * k as f64 } else { 79.6 - 0.2 * k as f64 };
        format!("[{}]", row.map(|x| format!("{x:.3}")).join(", "))
    };
    let matrix = (0..6).map(row).collect::<Vec<_>>().join(",\n");
    let found = read(&format!("unit = \"GPa\"\nclass = \"cubic\"\nstiffness = [{matrix}]\n"));
    let c = found.material.stiffness;
    assert!(c.relative_error(&SymmetryClass::Cubic.project(&c)) < 1e-14);
    assert!(
        found.read_as.contains("made symmetric (entries differ by up to")
            && found.read_as.contains("made cubic (it was")
    );
    assert_eq!(found.notes.len(), 2);
    let wrong = matrix.replacen("64.", "74.", 1);
    assert!(message(&format!("unit = \"GPa\"\nstiffness = [{wrong}]\n")).contains("not symmetric"));
    let tetragonal = matrix.replacen("166.600", "190.0", 1);
    assert!(message(&format!("unit = \"GPa\"\nclass = \"cubic\"\nstiffness = [{tetragonal}]\n")).contains("not cubic"));
}

/// Engineering constants of three digits: the shear modulus of a handbook beside E and ν.
#[test]
fn engineering_constants_agree_within_their_digits() {
    let text = "unit = \"GPa\"\n[engineering]\ne = 210\nnu = 0.3\ng = 80.8\n";
    let found = read(text);
    assert!(found.notes[0].contains("within their digits"), "{:?}", found.notes);
    let c = found.material.stiffness.voigt();
    assert!((c[(3, 3)] - 210e9 / 2.6).abs() < 1.0);
    assert!(message(&text.replace("80.8", "82")).contains("contradicts"));
}

/// A Poisson ratio of the wrong pair: its bound, and the key that is likely meant.
#[test]
fn ratios_beyond_their_bound_name_the_likely_key() {
    let ply = |ratio: &str| {
        format!(
            "unit = \"GPa\"\n[engineering]\nex = 140\ney = 10\nez = 10\ngyz = 3.6\ngzx = 5\ngxy = 5\nnu_yz = 0.4\n\
             nu_zx = 0.02\n{ratio}\n"
        )
    };
    let wrong = message(&ply("nu_yx = 0.3"));
    assert!(wrong.contains("line 11, engineering: nu_yx = 0.3 must be below √(ey/ex) = 0.2672612"), "{wrong}");
    assert!(wrong.contains("under tension along x") || wrong.contains("its key is nu_xy"), "{wrong}");
    assert!(read(&ply("nu_xy = 0.3")).material.doubts().is_empty());
    let doubts = read(&ply("nu_yx = 0.2")).material.doubts();
    assert!(doubts.len() == 1 && doubts[0].contains("nu_xy is 2.8"), "{doubts:?}");
}

/// A suggestion names no key of another meaning.
#[test]
fn keys_of_another_meaning_are_not_suggested() {
    let cubic = "unit = \"GPa\"\nclass = \"cubic\"\nc11 = 166\nc12 = 64\nc44 = 80\n";
    for (text, part) in [
        (format!("{cubic}c47 = 1"), "components are c11 … c66"),
        (format!("{cubic}s12 = 1"), "give compliances as a matrix"),
        (format!("{cubic}rho = 2330"), "here it is called density"),
        (format!("{cubic}nu = 0.3"), "below [engineering]"),
        ("[engineering]\ne = \"70 GPa\"\nmu = \"26 GPa\"".to_string(), "here it is called g, the shear modulus"),
        ("[engineering]\ne = \"70 GPa\"\npoisson = 0.3".to_string(), "here it is called nu"),
        (format!("{cubic}orientation = {{ y = [1, 0, 0] }}"), "use bunge, axis"),
        (format!("{cubic}orientation = {{ euler = [1, 2, 3] }}"), "here it is called bunge"),
    ] {
        let said = message(&text);
        assert!(said.contains(part) && !said.contains("did you mean"), "{text}: {said}");
    }
}
