//! What is wrong in a material is said with its place and a remedy, whatever the text.

use crate::given::reading as reading_common;

use anisobond_formats::{parse_material, parse_orientation, parse_table};
use nalgebra::Matrix6;
use proptest::prelude::*;
use reading_common::{GOOD, HEADER, ROCK, generic, message, rows};

/// A wrong file, and what its message must say.
#[test]
fn wrong_materials_are_refused_with_place_problem_and_remedy() {
    let trigonal =
        "unit = \"GPa\"\nclass = \"trigonal\"\nc11 = 464\nc33 = 493\nc12 = 159\nc13 = 141\nc44 = 125\nc14 = -45\n";
    let with = |line: &str| format!("{ROCK}{line}\n");
    let replaced = |old: &str, new: &str| ROCK.replace(old, new);
    let engineering = |lines: &str| format!("unit = \"GPa\"\n[engineering]\n{lines}");
    let nested = "[".repeat(200_000);
    for (text, parts) in [
        // Syntax.
        ("name = \"rock\nunit = 1".to_string(), &["rock.toml:1:", "this is not TOML"][..]),
        ("{\"unit\": \"GPa\",\n \"c11\": }".into(), &["rock.toml:2:9: this is not JSON"]),
        (format!("stiffness = {nested}"), &["rock.toml:1:", "not TOML"]),
        (format!("{{\"stiffness\": {nested}{}}}", "]".repeat(200_000)), &["rock.toml, line 1", "too deep"]),
        ("[3, 4]\n".into(), &["rock.toml"]),
        ("{\"c11\": 3,\n\"c11\": 4}".into(), &["rock.toml, line 2, c11: the key is given twice"]),
        (with("c11 = 3"), &["rock.toml:10:1: this is not TOML: duplicate key"]),
        // Keys.
        (with("stifness = 3"), &["rock.toml, line 10: unknown key \"stifness\"; did you mean stiffness?"]),
        (with("c17 = 3"), &["unknown key \"c17\"; components are c11 … c66"]),
        (with("viscosity = 3"), &["unknown key \"viscosity\"; use one of name, unit"]),
        ("name = \"nothing\"".into(), &["rock.toml, line 1: no stiffness is given; add stiffness (a 6×6 matrix)"]),
        (String::new(), &["rock.toml, line 1: no stiffness is given"]),
        (with("compliance = [1]"), &["line 10, compliance: c11 and compliance both give the stiffness; keep one"]),
        ("unit = \"GPa\"\nstiffness = []\n[engineering]\ne = 1".into(), &["stiffness and engineering both"]),
        (with("order = \"abaqus\""), &["line 10, order: order says nothing here; remove it"]),
        (replaced("\"my rock\"", "3"), &["rock.toml, line 2, name: a text is needed, not 3; put it in quotes"]),
        // Units.
        (replaced("unit = \"MPa\"", ""), &["line 5, c11: 130 has no unit; add unit = \"GPa\""]),
        (replaced("MPa", "mPa"), &["line 3, unit: unknown unit \"mPa\"", "it reads as 1e-3 Pa; use one of Pa"]),
        (replaced("MPa", "mm"), &["line 3, unit: \"mm\" is a unit of a length, but a stress is needed; use one of Pa"]),
        (replaced("MPa", "1/GPa"), &["line 3, unit:", "is a unit of a compliance"]),
        (replaced("130", "\"130\""), &["line 5, c11: \"130\" has no unit; write a stress with its unit"]),
        (replaced("130", "\"1,3 GPa\""), &["comma", "point"]),
        (replaced("130", "nan"), &["line 5, c11: a finite number is needed, not NaN"]),
        (replaced("130", "-inf"), &["line 5, c11: a finite number is needed, not -inf"]),
        (replaced("130", "1e308"), &["line 5, c11: the number is too large"]),
        (replaced("130", "true"), &["line 5, c11: a finite number is needed, not a truth value"]),
        (replaced("130", "2020-01-01"), &["not a date"]),
        // Matrices.
        ("unit = \"GPa\"\n\nstiffness = [[1, 2], [3, 4]]".into(), &["line 3, stiffness: a 6×6 matrix is needed, not rows of [2, 2] numbers; give six rows"]),
        ("unit = \"GPa\"\nstiffness = [1, 2, 3]".into(), &["line 2, stiffness: a 6×6 matrix is needed, not a list of 3"]),
        ("unit = \"GPa\"\nstiffness = 3".into(), &["a 6×6 matrix is needed, not 3"]),
        (
            "unit = \"GPa\"\nstiffness = [\n[1, 0, 0, 0, 0, 0],\n[1, 0, \"x\", 0, 0],\n[1, 0, 0, 0], [1, 0, 0], [1, 0], [1]]".into(),
            &["rock.toml, line 4, stiffness row 2 column 4: \"x\" is not a finite number"],
        ),
        (
            format!("unit = \"GPa\"\nstiffness = {}", rows(&(Matrix6::identity() * 9.0 + Matrix6::from_fn(|a, b| (2 * a + b) as f64)), 1.0, |_| 0..6)),
            &["line 2, stiffness: the matrix is not symmetric: c12", "upper triangle only"],
        ),
        (
            "unit = \"GPa\"\norder = \"abacus\"\nstiffness = 3".into(),
            &["line 2, order: unknown order \"abacus\"; did you mean abaqus?"],
        ),
        (format!("unit = \"GPa\"\ncompliance = {}", rows(&Matrix6::zeros(), 1.0, |_| 0..6)), &["line 2, compliance: the compliance matrix is singular"]),
        (
            format!("unit = \"GPa\"\nstiffness = {}", rows(&(-Matrix6::identity()), 1.0, |_| 0..6)),
            &["rock.toml, line 2, stiffness: the stiffness is not positive definite: eigenvalue -2"],
        ),
        (
            format!("unit = \"GPa\"\nclass = \"cubic\"\nstiffness = {}", rows(&generic().voigt(), 1e9, |_| 0..6)),
            &["line 3, stiffness: the matrix is not cubic: it is ", "remove class"],
        ),
        // Components.
        (
            format!("{trigonal}c66 = 155"),
            &["rock.toml, line 9, c66: c66 = 155 GPa contradicts (c11 − c12)/2 = 152.5 GPa of class trigonal; correct it, leave c66 out"],
        ),
        (format!("{trigonal}c24 = 44"), &["c24 = 44 GPa contradicts −c14 = 45 GPa of class trigonal"]),
        (format!("{trigonal}c34 = 1"), &["c34 = 1 GPa contradicts class trigonal, where it is 0"]),
        (with("c22 = 131"), &["line 10, c22: c22 = 131 MPa contradicts c11 = 130 MPa of class transversely-isotropic"]),
        (with("c21 = 41"), &["line 10, c21: c21 = 41 MPa contradicts c12 = 40 MPa; the matrix is symmetric"]),
        (
            replaced("c12 = 40\nc44 = 32.25\n", ""),
            &["line 5, c11: class transversely-isotropic needs 5 independent constants but has 3 (from c11, c33 and c13); add c12 (or c66) and c44 (or c55)"],
        ),
        (
            "unit = \"GPa\"\nclass = \"isotropic\"\nc44 = 3".into(),
            &["class isotropic needs 2 independent constants but has 1 (from c44); add c11 (or c12"],
        ),
        (replaced("class = \"transversely-isotropic\"", ""), &["line 5, c11: c22, c23, c55 and c66 missing; add at least the nine"]),
        (replaced("transversely-isotropic", "transversly isotropic"), &["line 4, class: unknown symmetry class \"transversly isotropic\"; did you mean transversely-isotropic?"]),
        (replaced("transversely-isotropic", "glassy"), &["use one of isotropic, cubic"]),
        (
            format!("unit = \"GPa\"\nclass = \"monoclinic\"\nc11 = 1\nc22 = 1\nc33 = 1\nc12 = 0\nc13 = 0\nc23 = 0\nc44 = 1\nc55 = 1\nc66 = 1\n{}", "c15 = 0.1\nc25 = 0\nc35 = 0\nc46 = 0\nc16 = 0.1\n"),
            &["c16 = 0.1 GPa contradicts class monoclinic (mirror normal to e2), where it is 0"],
        ),
        (replaced("c44 = 32.25", "c44 = -32.25"), &["line 5, c11: the stiffness is not positive definite"]),
        // Turning.
        (with("axis = [0, 0, 0]"), &["line 10, axis: the direction has length zero"]),
        (with("axis = [0, 1]"), &["line 10, axis: three numbers are needed, not a list of 2"]),
        (with("axis = \"z\""), &["three numbers are needed, not \"z\""]),
        (with("axis = [0, 0, nan]"), &["line 10, axis: a finite number is needed, not NaN"]),
        (with("axis = [0, 0, 1]\norientation = { mirror = [1, 0, 0] }"), &["axis and orientation both turn the material; keep one"]),
        (
            "unit = \"GPa\"\nclass = \"cubic\"\naxis = [0, 0, 1]\nc11 = 3\nc12 = 1\nc44 = 1".into(),
            &["line 3, axis: axis is for class transversely-isotropic, tetragonal or trigonal", "orientation"],
        ),
        (with("orientation = { bunge = [10, 20] }"), &["line 10, orientation.bunge: 3 numbers are needed, not 2"]),
        (with("orientation = { x = [1, 0, 0], z = [1, 0, 1] }"), &["line 10, orientation: x and z are 45.000° apart, not 90°"]),
        (with("orientation = \"bunge:1,2\""), &["line 10, orientation, bunge: 3 numbers are needed, not 2"]),
        // Density.
        (with("density = 2650"), &["line 10, density: 2650 has no unit; write density = \"2650 kg/m3\""]),
        (with("density = \"2650 kg\""), &["line 10, density: unknown unit \"kg\""]),
        (with("density = \"-1 g/cm3\""), &["a density of -1000 kg/m3 is not possible"]),
        // Engineering constants.
        (engineering("e = 70"), &["line 2, engineering: class isotropic needs two of e, nu, g, k, lambda; add"]),
        (engineering("e = 70\nnu = 0.5"), &["line 4, engineering: no isotropic material has e and nu of these values"]),
        (engineering("e = 70\nnu = 0.25\nk = 50"), &["line 5, engineering: k = 50 GPa contradicts that of e and nu = 46.66667 GPa"]),
        (engineering("e = 70\nnu = 0.7"), &["the stiffness is not positive definite"]),
        (engineering("e = -70\nnu = 0.2"), &["line 3, engineering.e: the modulus is not positive"]),
        (engineering("e = 70\nnu = \"0.2 GPa\""), &["line 4, engineering.nu: a finite number is needed, not \"0.2 GPa\""]),
        (engineering("e = 70\nnuxq = 0.2"), &["line 4, engineering: unknown key \"nuxq\"; did you mean nu"]),
        (engineering("e = 70\nnu = 0.2\nclass = \"isotropic\""), &["put class above [engineering]"]),
        (engineering("e = 70\nnu_xy = 0.2"), &["are mixed with those of one"]),
        (engineering("ex = 70\nez = 60\ngyz = 30"), &["class transversely-isotropic needs nu_zx or nu_xz and nu_xy or nu_yx"]),
        (engineering("ex = 70\ney = 65\nez = 60\nnu_xy = 0.2\nnu_zx = 0.2\ngyz = 30"), &["class orthotropic needs nu_yz or nu_zy, gzx and gxy"]),
        (
            format!("class = \"hexagonal\"\n{}", engineering("ex = 70\ney = 71\nez = 60\nnu_xy = 0.2\nnu_zx = 0.2\ngyz = 30")),
            &["ey = 71 GPa contradicts ex = 70 GPa of class transversely-isotropic"],
        ),
        (engineering("ex = 70\nez = 60\nnu_xy = 0.2\nnu_zx = 0.2\ngyz = 30\ngxy = 30"), &["gxy = 30 GPa contradicts ex/(2(1 + nu_xy)) = 29.16667 GPa"]),
        (engineering("ex = 70\nez = 60\nnu_xy = 0.2\nnu_zx = 0.2\nnu_xz = 0.2\ngyz = 30"), &["nu_zx = 0.2 contradicts nu_xz ez/ex = 0.1714286"]),
        (format!("class = \"monoclinic\"\n{}", engineering("ex = 70")), &["class monoclinic has no engineering constants here"]),
        (format!("class = \"cubic\"\n{}", engineering("e = 70\nnu = 0.3")), &["class cubic needs e, nu and g"]),
        ("engineering = 3".into(), &["a table of constants is needed, not 3"]),
    ] {
        let message = message(&text);
        for part in parts {
            assert!(message.contains(part), "wanted {part:?}\n in    {message:?}\n of\n{}", &text[..text.len().min(400)]);
        }
        assert!(message.starts_with("rock.toml") && message.len() < 600 && !message.contains('\n'), "{message}");
    }
}

/// Valid texts to mutate.
fn valid() -> Vec<String> {
    vec![
        ROCK.into(),
        format!("{ROCK}axis = [0, 1, 2]\ndensity = \"2650 kg/m3\""),
        format!("{ROCK}orientation = {{ strike = 270, dip = \"25 deg\" }}"),
        format!("unit = \"1/TPa\"\norder = \"mandel\"\ncompliance = {}", rows(&Matrix6::identity(), 1.0, |a| a..6)),
        "unit = \"GPa\"\n[engineering]\nex = 11\ney = 0.9\nez = 0.5\ngyz = 0.2\ngzx = 0.7\ngxy = 0.75\nnu_xy = 0.37\nnu_yz = 0.47\nnu_zx = 0.02".into(),
        "unit = \"GPa\"\n[engineering]\ne = 70\nlambda = 20".into(),
        "{\"material_id\": \"mp-1\", \"unit\": \"GPa\", \"class\": \"cubic\",\n\"c11\": 3, \"c12\": 1, \"c44\": 1, \"density\": 3}".into(),
        format!("{HEADER},density (g/cm3)\nmp-1,AB,{GOOD},3\nmp-2,AB,{GOOD},"),
        "[{\"id\": 1, \"class\": \"cubic\", \"c11\": 3, \"c12\": 1, \"c44\": 1},\n{\"elasticity\": {\"elastic_tensor\": [[1, 2]]}}]".into(),
        "axis:1,0,0,30 deg".into(),
        "matrix:1,0,0,0,1,0,0,0,-1".into(),
        "xz:1,0,0,0,0,1".into(),
    ]
}

/// A valid text with a few pieces cut, repeated, or replaced.
fn mutated() -> impl Strategy<Value = String> {
    let piece = prop_oneof![
        any::<String>(),
        prop::sample::select(vec![
            "nan",
            "inf",
            "-",
            "1e308",
            "1e-320",
            "0",
            "[",
            "]",
            "{",
            "\"",
            "=",
            ",",
            "\n",
            ":",
            "é",
            "\u{feff}",
            "c11 = 3\n"
        ])
        .prop_map(String::from),
    ];
    let edit = (any::<prop::sample::Index>(), 0..12_usize, piece);
    (prop::sample::select(valid()), prop::collection::vec(edit, 0..4)).prop_map(|(text, edits)| {
        let mut letters: Vec<char> = text.chars().collect();
        for (at, cut, piece) in edits {
            let at = at.index(letters.len() + 1);
            let end = (at + cut).min(letters.len());
            letters.splice(at..end, piece.chars());
        }
        letters.into_iter().collect()
    })
}

/// Reads a text as everything; whatever is accepted must be sound.
fn read_as_everything(text: &str) {
    use anisobond_formats::Dimension::{Angle, Compliance, Density, Length, Stress};
    for place in ["x.toml", "x.json"] {
        if let Ok(m) = parse_material(text, place) {
            assert!(m.stiffness.require_positive_definite().is_ok() && m.stiffness.norm().is_finite());
        }
    }
    for place in ["x.csv", "x.tsv", "x.json", "x.jsonl", "x"] {
        if let Ok(table) = parse_table(text, place, Some("MPa")) {
            assert!(!table.rows.is_empty());
        }
    }
    if let Ok(q) = parse_orientation(text) {
        assert!((q * q.transpose() - nalgebra::Matrix3::identity()).amax() < 1e-12);
    }
    for dimension in [Stress, Compliance, Length, Density, Angle] {
        if let Ok(value) = dimension.parse(text) {
            assert!(value.is_finite());
        }
    }
}

proptest! {
    #[test]
    fn arbitrary_text_never_panics(text in any::<String>()) {
        read_as_everything(&text);
    }

    #[test]
    fn nearly_valid_text_never_panics(text in mutated()) {
        read_as_everything(&text);
    }

    #[test]
    fn quantities_round_trip(value in -1e12..1e12_f64) {
        prop_assert_eq!(anisobond_formats::parse_stress(&format!("{value} Pa")).unwrap(), value);
        prop_assert_eq!(anisobond_formats::parse_length(&format!("{value:e}m")).unwrap(), value);
    }
}
