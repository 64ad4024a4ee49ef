//! What users write is read the same in every form, and what is wrong is said with its place and a remedy.

use std::path::{Path, PathBuf};

use anisobond::io::{is_table, parse_class, parse_material, parse_orientation, parse_table, read_material, read_table};
use anisobond::tensor::{Material, Stiffness, SymmetryClass, closure, project};
use nalgebra::{Matrix6, Rotation3, Vector3};
use proptest::prelude::*;

const ROCK: &str = r#"
name = "my rock"
unit = "MPa"
class = "transversely-isotropic"
c11 = 130
c33 = 55
c13 = 28
c12 = 40
c44 = 32.25
"#;

/// Šmilauer's rock, from first principles.
fn rock() -> Stiffness {
    let (c11, c33, c13, c12, c44) = (130e6, 55e6, 28e6, 40e6, 32.25e6);
    let mut voigt = Matrix6::from_diagonal(&[c11, c11, c33, c44, c44, (c11 - c12) / 2.0].into());
    for (a, b, value) in [(0, 1, c12), (0, 2, c13), (1, 2, c13)] {
        voigt[(a, b)] = value;
        voigt[(b, a)] = value;
    }
    Stiffness::from_voigt(&voigt).unwrap()
}

/// A positive definite tensor without symmetry (Pa), repeatable.
fn generic() -> Stiffness {
    let m = Matrix6::from_fn(|a, b| ((5 * a + b) as f64).sin() + ((5 * b + a) as f64).sin());
    Stiffness::from_mandel((m * 8.0 + Matrix6::identity() * 100.0) * 1e9)
}

fn read(text: &str) -> Material {
    parse_material(text, "rock.toml").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn message(text: &str) -> String {
    match parse_material(text, "rock.toml") {
        Ok(material) => panic!("accepted as {material:?}:\n{text}"),
        Err(e) => e.to_string(),
    }
}

fn assert_same(a: &Stiffness, b: &Stiffness, what: &str) {
    assert!(a.relative_error(b) < 1e-12, "{what}: {:e}", a.relative_error(b));
}

/// The upper triangle of the Voigt matrix in GPa as ragged rows.
fn rows(m: &Matrix6<f64>, unit: f64, columns: impl Fn(usize) -> std::ops::Range<usize>) -> String {
    let row = |a: usize| columns(a).map(|b| format!("{:e}", m[(a, b)] / unit)).collect::<Vec<_>>().join(", ");
    format!("[{}]", (0..6).map(|a| format!("[{}]", row(a))).collect::<Vec<_>>().join(",\n  "))
}

fn list(values: impl Iterator<Item = f64>) -> String {
    format!("[{}]", values.map(|v| format!("{v:e}")).collect::<Vec<_>>().join(", "))
}

#[test]
fn every_shape_and_order_of_a_matrix_is_the_same_tensor() {
    let c = generic();
    let (voigt, mandel) = (c.voigt() / 1e9, *c.mandel() / 1e9);
    let compliance = c.compliance_voigt().unwrap() * 1e9;
    let mandel_compliance = c.compliance().unwrap() * 1e9;
    let abaqus = [0, 1, 2, 5, 4, 3];
    let reordered = Matrix6::from_fn(|a, b| voigt[(abaqus[a], abaqus[b])]);
    let upper = |m: Matrix6<f64>| list((0..6).flat_map(move |a| (a..6).map(move |b| m[(a, b)])));
    let by_column = |m: Matrix6<f64>| list((0..6).flat_map(move |b| (0..=b).map(move |a| m[(a, b)])));
    let zero_below = Matrix6::from_fn(|a, b| if b < a { 0.0 } else { voigt[(a, b)] });
    let all = list(voigt.transpose().iter().copied());
    for (what, text) in [
        ("full", format!("stiffness = {}", rows(&voigt, 1.0, |_| 0..6))),
        ("ragged", format!("stiffness = {}", rows(&voigt, 1.0, |a| a..6))),
        ("zero below", format!("stiffness = {}", rows(&zero_below, 1.0, |_| 0..6))),
        ("flat 21", format!("stiffness = {}", upper(voigt))),
        ("flat 36", format!("stiffness = {all}")),
        ("named voigt", format!("stiffness = {all}\norder = \"voigt\"")),
        ("abaqus card", format!("order = \"abaqus\"\nstiffness = {}", by_column(reordered))),
        ("abaqus full", format!("order = \"abaqus\"\nstiffness = {}", rows(&reordered, 1.0, |_| 0..6))),
        ("lammps 21", format!("order = \"lammps\"\nstiffness = {}", upper(reordered))),
        ("mandel", format!("order = \"mandel\"\nstiffness = {}", rows(&mandel, 1.0, |a| a..6))),
        ("compliance", format!("compliance = {}", rows(&compliance, 1.0, |_| 0..6))),
        ("compliance mandel", format!("order = \"mandel\"\ncompliance = {}", upper(mandel_compliance))),
    ] {
        assert_same(&c, &read(&format!("unit = \"GPa\"\n{text}")).stiffness, what);
    }
    let tera = rows(&compliance, 1e-3, |a| a..6);
    assert_same(&c, &read(&format!("unit = \"1/TPa\"\ncompliance = {tera}")).stiffness, "1/TPa");
    let json = format!("{{\"unit\": \"GPa\", \"stiffness\": {}}}", rows(&voigt, 1.0, |_| 0..6));
    assert_same(&c, &parse_material(&json, "rock.json").unwrap().stiffness, "json");
    assert_same(&c, &read(&json).stiffness, "json by its first letter");
}

#[test]
fn units_of_numbers_and_texts() {
    let gpa = ROCK.replace("MPa", "GPa").replace("= 130", "= 0.13").replace("= 55", "= \"55 MPa\"");
    let gpa = gpa.replace("= 28", "= \"28 N/mm²\"").replace("= 40", "= 4e-2").replace("= 32.25", "= \"322.5 bar\"");
    for text in
        [ROCK.to_string(), gpa.replace("322.5 bar", "322.5bar"), ROCK.replace('\n', "\r\n"), format!("\u{feff}{ROCK}")]
    {
        assert_same(&rock(), &read(&text).stiffness, &text);
    }
    let m = read(&format!("{ROCK}density = \"2.65 g/cm3\"\nsource = \"report\""));
    assert_eq!((m.name.as_str(), m.density, m.source.as_str()), ("my rock", Some(2650.0), "report"));
    let unnamed = parse_material(&ROCK.replace("name = \"my rock\"", ""), "/somewhere/shale.toml").unwrap();
    assert_eq!((unnamed.name.as_str(), unnamed.density), ("shale", None));
}

/// Names only the independent constants of every class and setting; the reader completes them.
#[test]
fn every_class_round_trips_from_its_minimal_constants() {
    let turn = |axis: Vector3<f64>, fold: f64| {
        closure(&[*Rotation3::from_scaled_axis(axis * std::f64::consts::TAU / fold).matrix()])
    };
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let c = generic();
    let nine = "c11 c22 c33 c12 c13 c23 c44 c55 c66";
    let every = "c11 c12 c13 c14 c15 c16 c22 c23 c24 c25 c26 c33 c34 c35 c36 c44 c45 c46 c55 c56 c66";
    let own = |class: SymmetryClass| class.project(&c);
    for (class, tensor, constants) in [
        ("isotropic", own(SymmetryClass::Isotropic), "c11 c12".to_string()),
        ("isotropic", own(SymmetryClass::Isotropic), "c44 c12".into()),
        ("isotropic", own(SymmetryClass::Isotropic), "c33 c66".into()),
        ("cubic", own(SymmetryClass::Cubic), "c11 c12 c44".into()),
        ("transversely-isotropic", own(SymmetryClass::TransverselyIsotropic), "c11 c33 c12 c13 c44".into()),
        ("Hexagonal", own(SymmetryClass::TransverselyIsotropic), "c22 c33 c66 c23 c55".into()),
        ("transverse isotropic", own(SymmetryClass::TransverselyIsotropic), "c66 c33 c12 c13 c44".into()),
        ("tetragonal", own(SymmetryClass::Tetragonal), "c11 c33 c12 c13 c44 c66".into()),
        ("tetragonal", project(&turn(z, 4.0), &c), "c11 c33 c12 c13 c44 c66 c16".into()),
        ("tetragonal", project(&turn(z, 4.0), &c), "c11 c33 c12 c13 c44 c66 c26".into()),
        ("trigonal", own(SymmetryClass::Trigonal), "c11 c33 c12 c13 c44 c14".into()),
        ("trigonal", own(SymmetryClass::Trigonal), "c11 c33 c66 c13 c44 c24".into()),
        ("trigonal", project(&turn(z, 3.0), &c), "c11 c33 c12 c13 c44 c14 c15".into()),
        ("trigonal", project(&turn(z, 3.0), &c), "c11 c33 c12 c13 c44 c56 c46".into()),
        ("orthorhombic", own(SymmetryClass::Orthotropic), nine.into()),
        ("monoclinic", own(SymmetryClass::Monoclinic), format!("{nine} c16 c26 c36 c45")),
        ("monoclinic", project(&turn(y, 2.0), &c), format!("{nine} c15 c25 c35 c46")),
        ("monoclinic", project(&turn(x, 2.0), &c), format!("{nine} c14 c24 c34 c56")),
        ("triclinic", c, every.into()),
    ] {
        let voigt = tensor.voigt();
        let number = |key: &str| {
            let digit = |n: usize| (key.as_bytes()[n] - b'1') as usize;
            voigt[(digit(1), digit(2))]
        };
        let line = |key: &str| format!("{key} = {:e}\n", number(key));
        let minimal: String = constants.split(' ').map(line).collect();
        let complete: String = every.split(' ').map(line).collect();
        for components in [minimal, complete] {
            let text = format!("unit = \"Pa\"\nclass = \"{class}\"\n{components}");
            assert_same(&tensor, &read(&text).stiffness, &text);
        }
        let lower: String = every.split(' ').map(|k| line(k).replacen(k, &swapped(k), 1)).collect();
        assert_same(&tensor, &read(&format!("unit = \"Pa\"\n{lower}")).stiffness, "lower names, no class");
        let matrix = format!("unit = \"Pa\"\nclass = \"{class}\"\nstiffness = {}", rows(&voigt, 1.0, |_| 0..6));
        assert_same(&tensor, &read(&matrix).stiffness, "a matrix that claims its class");
    }
}

fn swapped(key: &str) -> String {
    let b = key.as_bytes();
    format!("c{}{}", b[2] as char, b[1] as char)
}

#[test]
fn given_constants_are_kept_to_rounding() {
    let voigt = read(ROCK).stiffness.voigt();
    for ((a, b), value) in [((0, 0), 130e6), ((1, 1), 130e6), ((0, 1), 40e6), ((4, 4), 32.25e6), ((5, 5), 45e6)] {
        assert!((voigt[(a, b)] / value - 1.0_f64).abs() < 1e-15, "c{}{}", a + 1, b + 1);
    }
    assert_eq!(voigt[(0, 3)], 0.0);
}

#[test]
fn axis_and_orientation_turn_the_material() {
    let about_y = *Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2).matrix();
    let turned = rock().rotated(&about_y);
    assert!((turned.voigt()[(0, 0)] / 55e6 - 1.0).abs() < 1e-14);
    for line in [
        "axis = [1, 0, 0]",
        "axis = [-3, 0, 0.0]",
        "orientation = { axis = [0, 1, 0], angle = 90 }",
        "orientation = { strike = 0, dip = 90 }",
        "orientation = { x = [0, 0, -1], z = [1, 0, 0] }",
        "orientation = { bunge = [90, 90, 0] }",
        "orientation = \"axis:0,1,0,1.5707963267948966rad\"",
    ] {
        assert_same(&turned, &read(&format!("{ROCK}{line}")).stiffness, line);
    }
    assert_same(&rock(), &read(&format!("{ROCK}axis = [0, 0, -1]")).stiffness, "turned over");
    let q = parse_orientation("bunge:10,20,30").unwrap();
    let text = format!(
        "unit = \"GPa\"\norientation = {{ bunge = [10, 20, 30] }}\nstiffness = {}",
        rows(&generic().voigt(), 1e9, |_| 0..6)
    );
    assert_same(&generic().rotated(&q), &read(&text).stiffness, "Q as in rotated(Q)");
}

/// Any two of E, ν, G, K, λ, as textbooks relate them.
#[test]
fn isotropic_engineering_constants() {
    let (e, nu) = (70e9_f64, 0.2_f64);
    let (g, k, lambda) = (e / 2.4, e / (3.0 * 0.6), e * nu / (1.2 * 0.6));
    let c = Stiffness::isotropic(lambda, g);
    let all = [("e", e), ("nu", nu), ("g", g), ("k", k), ("lambda", lambda)];
    for (n, first) in all.iter().enumerate() {
        for second in &all[n + 1..] {
            let text =
                format!("unit = \"Pa\"\n[engineering]\n{} = {:e}\n{} = {:e}", first.0, first.1, second.0, second.1);
            assert_same(&c, &read(&text).stiffness, &text);
        }
    }
    let every: String = all.iter().map(|(key, value)| format!("{key} = {value:e}\n")).collect();
    assert_same(
        &c,
        &read(&format!("unit = \"Pa\"\nclass = \"isotropic\"\n[engineering]\n{every}")).stiffness,
        "all five",
    );
}

#[test]
fn directional_engineering_constants() {
    let ortho = |e: [f64; 3], nu: [f64; 3], g: [f64; 3]| {
        let mut s = Matrix6::zeros();
        for i in 0..3 {
            s[(i, i)] = 1.0 / e[i];
            s[(3 + i, 3 + i)] = 1.0 / g[i];
        }
        // nu: xy, yz, zx.
        for (i, j, nu) in [(0, 1, nu[0]), (1, 2, nu[1]), (2, 0, nu[2])] {
            s[(i, j)] = -nu / e[i];
            s[(j, i)] = s[(i, j)];
        }
        Stiffness::from_compliance_voigt(&s).unwrap()
    };
    let wood = ortho([11e9, 0.9e9, 0.5e9], [0.37, 0.47, 0.02], [0.2e9, 0.7e9, 0.75e9]);
    let (yx, zy, xz) = (0.37 * 0.9 / 11.0, 0.47 * 0.5 / 0.9, 0.02 * 11.0 / 0.5);
    let head = "unit = \"GPa\"\n[engineering]\n";
    for text in [
        format!(
            "{head}ex = 11\ney = 0.9\nez = 0.5\ngyz = 0.2\ngzx = 0.7\ngxy = 0.75\nnu_xy = 0.37\nnu_yz = 0.47\nnu_zx = 0.02"
        ),
        format!(
            "{head}e1 = 11\ne2 = 0.9\ne3 = 0.5\ng23 = 0.2\ng13 = 0.7\ng12 = 0.75\nnu21 = {yx}\nnu_32 = {zy}\nnu13 = {xz}"
        ),
        format!(
            "{head}e_x = 11\ney = 0.9\nez = 0.5\ngyz = 0.2\ngxz = 0.7\ngxy = 0.75\nnuxy = 0.37\nnu_yx = {yx}\nnu_yz = 0.47\nnu_zx = 0.02"
        ),
    ] {
        assert_same(&wood, &read(&text).stiffness, &text);
    }

    let (e, ez, nu, nu_zx, g) = (105e6, 44.3e6, 0.17, 0.16, 32e6);
    let shale = ortho([e, e, ez], [nu, nu_zx * e / ez, nu_zx], [g, g, e / (2.0 * (1.0 + nu))]);
    let head = "unit = \"MPa\"\n[engineering]\n";
    for text in [
        format!("{head}ex = 105\nez = 44.3\nnu_xy = 0.17\nnu_zx = 0.16\ngyz = 32"),
        format!("{head}ex = 105\nez = 44.3\nnu_xy = 0.17\nnu_xz = {}\ngzx = 32", nu_zx * e / ez),
        format!("{head}ex = 105\nez = 44.3\ngxy = {}\nnu_zx = 0.16\ngyz = 32", 105.0 / 2.34),
        format!("{head}ex = 105\nez = 44.3\ngxy = {}\nnu_xy = 0.17\nnu_zy = 0.16\ngyz = 32\ngzx = 32", 105.0 / 2.34),
        format!("class = \"hexagonal\"\n{head}ex = 105\ney = 105\nez = 44.3\nnu_xy = 0.17\nnu_zx = 0.16\ngyz = 32"),
    ] {
        assert_same(&shale, &read(&text).stiffness, &text);
    }
    let turned =
        read(&format!("axis = [1, 1, 0]\n{head}ex = 105\nez = 44.3\nnu_xy = 0.17\nnu_zx = 0.16\ngyz = 32")).stiffness;
    assert!((turned.norm() / shale.norm() - 1.0).abs() < 1e-12 && turned.relative_error(&shale) > 0.1);

    let cubic = read("unit = \"GPa\"\nclass = \"cubic\"\n[engineering]\ne = 100\nnu = 0.3\ng = 60").stiffness;
    assert_same(&ortho([100e9; 3], [0.3; 3], [60e9; 3]), &cubic, "cubic");
    let head = "unit = \"GPa\"\nclass = \"tetragonal\"\n[engineering]\n";
    let tetragonal = read(&format!("{head}ex = 100\nez = 80\nnu_xy = 0.3\nnu_zx = 0.2\ngyz = 50\ngxy = 30")).stiffness;
    assert_same(&ortho([100e9, 100e9, 80e9], [0.3, 0.25, 0.2], [50e9, 50e9, 30e9]), &tetragonal, "tetragonal");
}

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
        (with("c17 = 3"), &["unknown key \"c17\"; did you mean c"]),
        (with("viscosity = 3"), &["unknown key \"viscosity\"; use one of name, unit"]),
        ("name = \"nothing\"".into(), &["rock.toml, line 1: no stiffness is given; add stiffness (a 6×6 matrix)"]),
        (String::new(), &["rock.toml, line 1: no stiffness is given"]),
        (with("compliance = [1]"), &["line 10, compliance: c11 and compliance both give the stiffness; keep one"]),
        ("unit = \"GPa\"\nstiffness = []\n[engineering]\ne = 1".into(), &["stiffness and engineering both"]),
        (with("order = \"abaqus\""), &["line 10, order: order says nothing here; remove it"]),
        (replaced("\"my rock\"", "3"), &["rock.toml, line 2, name: a text is needed, not 3; put it in quotes"]),
        // Units.
        (replaced("unit = \"MPa\"", ""), &["line 5, c11: 130 has no unit; add unit = \"GPa\""]),
        (replaced("MPa", "mPa"), &["line 3, unit: unknown unit \"mPa\"", "did you mean MPa"]),
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
            format!("{trigonal}c66 = 153"),
            &["rock.toml, line 9, c66: c66 = 153 GPa contradicts (c11 − c12)/2 = 152.5 GPa of class trigonal; correct it, leave c66 out"],
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

#[test]
fn files_are_read_and_named_in_messages() {
    let folder = Folder::new("materials");
    let path = folder.file("shale.toml", ROCK.as_bytes());
    assert_eq!(read_material(&path).unwrap().name, "my rock");
    let latin = folder.file("latin.toml", b"unit = \"GPa\"\nname = \"gr\xfcn\"\n");
    let message = read_material(&latin).unwrap_err().to_string();
    assert!(message.contains("latin.toml, line 2: the file is not UTF-8"), "{message}");
    let message = read_material(folder.0.join("none.toml")).unwrap_err().to_string();
    assert!(message.starts_with("cannot read ") && message.contains("none.toml"), "{message}");
    assert_eq!(parse_class("Transversely_Isotropic").unwrap(), SymmetryClass::TransverselyIsotropic);
}

// ---------------------------------------------------------------------------------------------------------------- tables

const HEADER: &str =
    "material_id,formula,c11,c12,c13,c14,c15,c16,c22,c23,c24,c25,c26,c33,c34,c35,c36,c44,c45,c46,c55,c56,c66";
const GOOD: &str = "270,100,100,0,0,0,270,100,0,0,0,270,0,0,0,85,0,0,85,0,85";

fn table_of(text: &str) -> Vec<anisobond::io::Row> {
    parse_table(text, "rocks", None).unwrap_or_else(|e| panic!("{e}\n{text}")).rows
}

fn cubic() -> Stiffness {
    read("unit = \"GPa\"\nclass = \"cubic\"\nc11 = 270\nc12 = 100\nc44 = 85").stiffness
}

#[test]
fn tables_in_every_format_are_the_same_materials() {
    let rows6 =
        "[[270,100,100,0,0,0],[100,270,100,0,0,0],[100,100,270,0,0,0],[0,0,0,85,0,0],[0,0,0,0,85,0],[0,0,0,0,0,85]]";
    let upper = HEADER.replace("material_id,formula,", "");
    for (what, text) in [
        ("plain", format!("{HEADER}\nmp-1,AB,{GOOD}\n")),
        ("no newline, Windows", format!("\u{feff}{HEADER}\r\n\r\nmp-1,AB,{GOOD}")),
        ("comment", format!("# from a paper\n{HEADER}\n# a remark\nmp-1,AB,{GOOD}\n")),
        ("capitals", format!("{}\nmp-1,AB,{GOOD}", HEADER.to_uppercase())),
        ("unit in header", format!("{}\nmp-1,AB,270000{}", HEADER.replace("c11", "C11 (MPa)"), &GOOD[3..])),
        ("semicolons", format!("{HEADER}\nmp-1,AB,{GOOD}").replace(',', ";")),
        ("tabs", format!("{HEADER}\nmp-1,AB,{GOOD}").replace(',', "\t")),
        ("lower names", format!("{}\nmp-1,AB,{GOOD}", HEADER.replace("c12", "c21"))),
        ("own unit", format!("{HEADER}\nmp-1,AB,\"0.27 TPa\"{}", &GOOD[3..])),
        ("json", format!("[{{\"material_id\": \"mp-1\", \"formula\": \"AB\", \"elastic_tensor\": {rows6}}}]")),
        ("json nested", format!("[{{\"material_id\": \"mp-1\", \"formula_pretty\": \"AB\", \"elastic_tensor\": {{\"raw\": [], \"ieee_format\": {rows6}}}, \"x\": null}}]")),
        ("json dotted", format!("[{{\"material_id\": \"mp-1\", \"formula_pretty\": \"AB\", \"elasticity.elastic_tensor\": {rows6}}}]")),
        ("json deep", format!("[{{\"material_id\": \"mp-1\", \"formula\": \"AB\", \"elasticity\": {{\"elastic_tensor\": {rows6}}}}}]")),
        ("lines", format!("{{\"material_id\": \"mp-1\", \"formula\": \"AB\", \"stiffness\": {rows6}}}\n\n")),
        ("components", "{\"material_id\": \"mp-1\", \"formula\": \"AB\", \"class\": \"cubic\", \"c11\": 270, \"c12\": 100, \"c44\": 85}".into()),
        ("record unit", "{\"material_id\": \"mp-1\", \"formula\": \"AB\", \"unit\": \"TPa\", \"class\": \"cubic\", \"c11\": 0.27, \"c12\": 0.1, \"c44\": 0.085}".into()),
    ] {
        let rows = table_of(&text);
        let material = rows[0].material.as_ref().unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!((rows.len(), rows[0].id.as_str(), material.name.as_str()), (1, "mp-1", "AB"), "{what}");
        assert_same(&cubic(), &material.stiffness, what);
    }
    let unnamed = table_of(&format!("{upper}\n{GOOD}\n{GOOD}\n"));
    assert_eq!((unnamed[1].id.as_str(), unnamed[1].line), ("2", 3));
    let mega = parse_table(&format!("{HEADER}\na,b,{GOOD}"), "t.csv", Some("MPa")).unwrap();
    assert_same(&cubic().scaled(1e-3), &mega.rows[0].material.as_ref().unwrap().stiffness, "asked unit");
}

#[test]
fn densities_of_tables() {
    let csv = table_of(&format!("{HEADER},density (g/cm3)\nmp-1,AB,{GOOD},2.65\nmp-2,AB,{GOOD},\nmp-3,AB,{GOOD},-1"));
    assert_eq!(csv[0].material.as_ref().unwrap().density, Some(2650.0));
    assert_eq!(csv[1].material.as_ref().unwrap().density, None);
    assert!(
        csv[2]
            .material
            .as_ref()
            .unwrap_err()
            .to_string()
            .contains("rocks, line 4, density (g/cm3): a density of -1000")
    );
    let json =
        table_of("[{\"id\": 7, \"density\": 2.65, \"class\": \"cubic\", \"c11\": 270, \"c12\": 100, \"c44\": 85}]");
    assert_eq!((json[0].id.as_str(), json[0].material.as_ref().unwrap().density), ("7", Some(2650.0)));
}

#[test]
fn a_broken_row_carries_its_error_and_the_others_go_on() {
    let bad = GOOD.replacen("270", "x", 1);
    let csv = format!(
        "{HEADER}\na,A,{GOOD}\n\nb,B,{bad}\nc,C,{GOOD},9\nd,D,-{GOOD}\n\"e\ne\",E,{GOOD}\nf,F,{}\ng,G,,{}\n",
        GOOD.replace("85,0,85", "85,0,nan"),
        &GOOD[4..]
    );
    let expected = [
        ("a", 2, ""),
        ("b", 4, "rocks, line 4, column c11: \"x\" is not a finite number"),
        ("c", 5, "rocks, line 5: the row has 24 fields, the header 23"),
        ("d", 6, "rocks, line 6: the stiffness is not positive definite"),
        ("e\ne", 7, ""),
        ("f", 9, "rocks, line 9, column c66: \"nan\" is not a finite number"),
        ("g", 10, "rocks, line 10, column c11: \"\" is not a finite number"),
    ];
    check_rows(&table_of(&csv), &expected);

    let good = "\"class\": \"cubic\", \"c11\": 270, \"c12\": 100, \"c44\": 85";
    let lines = format!(
        "{{\"id\": \"a\", {good}}}\n{{\"id\": \"b\", {good}\n\n{{\"id\": \"c\"}}\n{{\"id\": \"d\", \"elastic_tensor\": [[1]]}}\nnull\n{{\"id\": \"f\", \"elastic_tensor\": null, {good}}}\n"
    );
    let expected = [
        ("a", 1, ""),
        ("2", 2, "rocks, line 2, column 63: this is not JSON"),
        ("c", 4, "rocks, line 4: no stiffness is given"),
        ("d", 5, "rocks, line 5, elastic_tensor: a 6×6 matrix is needed, not rows of [1] numbers"),
        ("5", 6, "rocks, line 6: no stiffness is given"),
        ("f", 7, ""),
    ];
    check_rows(&table_of(&lines), &expected);

    let list = format!(
        "[\n{{\"id\": \"a\", {good}}},\n{{\"id\": \"b\",\n\"class\": \"cubical\", \"c11\": 3}},\n[],\n{{\"id\": \"d\", {good}}}]"
    );
    let expected = [
        ("a", 2, ""),
        ("b", 3, "rocks, line 4, class: unknown symmetry class \"cubical\"; did you mean cubic?"),
        ("3", 5, "rocks, line 5: no stiffness is given"),
        ("d", 6, ""),
    ];
    check_rows(&table_of(&list), &expected);
}

fn check_rows(rows: &[anisobond::io::Row], expected: &[(&str, usize, &str)]) {
    assert_eq!(rows.len(), expected.len());
    for (row, (id, line, message)) in rows.iter().zip(expected) {
        assert_eq!((row.id.as_str(), row.line), (*id, *line), "{row:?}");
        match &row.material {
            Ok(_) => assert_eq!(*message, "", "{id}"),
            Err(e) => assert!(!message.is_empty() && e.to_string().starts_with(message), "{id}: {e}"),
        }
    }
}

#[test]
fn wrong_tables_are_refused_as_a_whole() {
    for (text, unit, parts) in [
        (String::new(), None, &["rocks: the table has no rows"][..]),
        (format!("{HEADER}\n"), None, &["rocks: the table has no rows; add a line"]),
        ("[]".into(), None, &["the table has no rows"]),
        (HEADER.replace("c13", "c_13") + "\n", None, &["rocks, line 1: column c13 missing; is \"c_13\" meant as c13?"]),
        ("a,b\n1,2".into(), None, &["columns c11, c12", "missing", "other columns there: \"a\", \"b\""]),
        (HEADER.replace("c13", "c12"), None, &["rocks, line 1: column \"c12\" is there twice"]),
        (HEADER.replace("c13", "c21 (MPa)"), None, &["column \"c21 (MPa)\" is there twice"]),
        (HEADER.replace("c13", "c13 (mm)"), None, &["column c13 (mm): \"mm\" is a unit of a length"]),
        (format!("{HEADER},density\na,b,{GOOD},3"), None, &["column density has no unit; name it in the header"]),
        (HEADER.replace("c13", "c13 (MPa)"), Some("GPa"), &["column \"c13 (MPa)\" contradicts the unit GPa asked for"]),
        (HEADER.into(), Some("gpa"), &["unit: unknown unit \"gpa\"", "did you mean GPa"]),
        ("[{\"id\": 1},\n{\"c11\": NaN}]".into(), None, &["rocks:2:", "this is not JSON"]),
    ] {
        let message = parse_table(&text, "rocks", unit).unwrap_err().to_string();
        for part in parts {
            assert!(message.contains(part), "wanted {part:?} in {message:?}");
        }
    }
    let message = parse_table("3", "rocks.json", None).unwrap_err().to_string();
    assert!(message.contains("rocks.json: a list of materials is needed, not \"3\""), "{message}");
}

#[test]
fn tables_are_known_by_their_names() {
    let folder = Folder::new("tables");
    for (name, content, table) in [
        ("a.csv", &b""[..], true),
        ("a.TSV", b"", true),
        ("a.jsonl", b"", true),
        ("a.ndjson", b"", true),
        ("a.json", b"\xef\xbb\xbf \n[{}]", true),
        ("b.json", b"{}", false),
        ("a.toml", b"", false),
        ("a", b"", false),
    ] {
        assert_eq!(is_table(folder.file(name, content)), table, "{name}");
    }
    assert!(!is_table(folder.0.join("none.json")));
    let latin = folder.file("latin.csv", b"a\n\xff\n");
    let message = read_table(latin, None).unwrap_err().to_string();
    assert!(message.contains("latin.csv, line 2: the file is not UTF-8"), "{message}");
}

#[test]
fn a_single_object_of_the_materials_project_is_a_material() {
    let rows6 =
        "[[270,100,100,0,0,0],[100,270,100,0,0,0],[100,100,270,0,0,0],[0,0,0,85,0,0],[0,0,0,0,85,0],[0,0,0,0,0,85]]";
    let json = format!(
        "{{\"material_id\": \"mp-1\", \"formula_pretty\": \"AB\", \"nsites\": 3, \"density\": 5, \"elastic_tensor\": {{\"ieee_format\": {rows6}}}}}"
    );
    let m = parse_material(&json, "mp-1.json").unwrap();
    assert_same(&cubic(), &m.stiffness, "single");
    assert_eq!((m.name.as_str(), m.density, m.source.as_str()), ("AB", Some(5000.0), "mp-1"));
    let message = parse_material("[{}]", "x.json").unwrap_err().to_string();
    assert!(message.contains("x.json: the file holds a list of 1, not one material"), "{message}");
}

#[test]
fn a_hundred_thousand_rows_stream() {
    let mut text = format!("{HEADER}\n");
    for n in 0..100_000 {
        text += &format!("mp-{n},AB,{GOOD}\n");
    }
    let rows = table_of(&text);
    assert_eq!((rows.len(), rows[99_999].line), (100_000, 100_001));
    assert!(rows.iter().all(|row| row.material.is_ok()));
}

/// The sample of the Materials Project, where it is at hand.
#[test]
fn the_materials_project_sample() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/mp-elastic-sample.csv");
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return;
    }
    let table = read_table(&path, None).unwrap();
    assert_eq!(table.rows.len(), 202);
    let good: Vec<&Material> = table.rows.iter().filter_map(|row| row.material.as_ref().ok()).collect();
    assert!(good.len() > 150 && good.len() < 202, "{}", good.len());
    for row in table.rows.iter().filter(|row| row.material.is_err()) {
        let message = row.material.as_ref().unwrap_err().to_string();
        assert!(message.contains(&format!("line {}: the stiffness is not positive definite", row.line)), "{message}");
    }
}

/// A folder of its own that is removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("anisobond-reading-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn file(&self, name: &str, content: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, content).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

// ------------------------------------------------------------------------------------------------------------- no panics

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
    use anisobond::io::Dimension::{Angle, Compliance, Density, Length, Stress};
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
        prop_assert_eq!(anisobond::io::parse_stress(&format!("{value} Pa")).unwrap(), value);
        prop_assert_eq!(anisobond::io::parse_length(&format!("{value:e}m")).unwrap(), value);
    }
}
