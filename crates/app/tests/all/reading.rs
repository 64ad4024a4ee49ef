//! Materials are read the same in every form.

use crate::given::reading as reading_common;

use anisobond::tensor::{Stiffness, SymmetryClass, closure, project};
use anisobond_formats::{parse_class, parse_material, parse_orientation, read_material};
use nalgebra::{Matrix6, Rotation3, Vector3};
use reading_common::{Folder, ROCK, assert_same, generic, list, read, rock, rows};

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
