//! Texts of other programs: every format gives the same crystal, and what is wrong or ambiguous is said.

use std::path::{Path, PathBuf};

use anisobond::tensor::Stiffness;
use anisobond_formats::{Reading, find_reading, is_table, parse_any, parse_reading};
use nalgebra::Matrix6;

/// The crystal of all samples (GPa): every order of rows makes another of it.
const C: [[f64; 6]; 6] = [
    [328.01, 69.02, 69.03, 0.0, 0.0, 0.0],
    [69.02, 199.04, 73.05, 0.0, 0.0, 0.0],
    [69.03, 73.05, 235.06, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 66.08, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 81.09, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 80.07],
];

fn crystal() -> Stiffness {
    Stiffness::from_voigt(&Matrix6::from_fn(|a, b| 1e9 * C[a][b])).unwrap()
}

pub fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/foreign").join(name)
}

fn text(name: &str) -> String {
    std::fs::read_to_string(sample(name)).unwrap()
}

fn found(name: &str, row: Option<&str>, unit: Option<&str>) -> Reading {
    find_reading(sample(name).to_str().unwrap(), row, unit).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn message(text: &str, unit: Option<&str>) -> String {
    match parse_reading(text, "text", unit) {
        Ok(reading) => panic!("read as {} from\n{text}", reading.read_as),
        Err(e) => e.to_string(),
    }
}

#[test]
fn every_format_is_the_same_crystal() {
    for (name, row, unit, words) in [
        ("OUTCAR", None, None, &["VASP OUTCAR, TOTAL ELASTIC MODULI", "kbar", "order XX YY ZZ XY YZ ZX"][..]),
        ("lammps.log", None, None, &["LAMMPS", "GPa"]),
        ("vaspkit.in", None, None, &["6×6 matrix", "GPa", "11 22 33 23 13 12"]),
        ("vaspkit.out", None, None, &["VASPKIT", "GPa"]),
        ("triangle.txt", None, Some("GPa"), &["6×6 matrix", "GPa"]),
        ("mtex.txt", None, None, &["MTEX", "GPa"]),
        ("dpgen.out", None, None, &["GPa", "made symmetric"]),
        ("thermo_pw.out", None, None, &["thermo_pw", "kbar"]),
        ("output_el_cons.dat", None, None, &["thermo_pw's output_el_cons.dat", "kbar"]),
        ("ELADAT", None, None, &["AELAS, 6×6 matrix", "GPa"]),
        ("elate.txt", None, Some("GPa"), &["6×6 matrix"]),
        ("fortran.txt", None, None, &["6×6 matrix", "GPa"]),
        ("uncertain.txt", None, None, &["9 constants", "class orthotropic"]),
        ("engineering.inp", None, None, &["Abaqus", "ENGINEERING CONSTANTS", "MPa"]),
        ("several.inp", Some("olivine"), None, &["ENGINEERING CONSTANTS"]),
        ("engineering.csv", Some("Fo"), None, &["engineering constants", "units as the header has them"]),
        ("castep.elastic", None, None, &["CASTEP", "GPa"]),
        ("crystal.out", None, None, &["CRYSTAL", "GPa"]),
        ("aniso.inp", None, None, &["Abaqus", "ANISOTROPIC", "temperature 20", "MPa", "DENSITY is not taken"]),
        ("aniso.inp", None, Some("MPa"), &["MPa"]),
        ("ortho.inp", None, Some("GPa"), &["ORTHOTROPIC", "order 11 22 33 12 13 23"]),
        ("ansys.mac", None, None, &["Ansys", "GPa", "x y z xy yz xz"]),
        ("comsol.java", None, None, &["COMSOL list D of 36", "GPa", "xx yy zz xy yz xz"]),
        ("comsol.txt", None, None, &["COMSOL list cE of 21", "Pa", "xx yy zz yz xz xy"]),
        ("msat.txt", None, None, &["MSAT", "GPa", "kg/m3"]),
        ("list.txt", None, None, &["9 constants", "class orthotropic", "GPa"]),
        ("elastool.out", None, None, &["ElasTool, 9 constants", "class orthotropic", "GPa"]),
        ("matlab.m", None, None, &["6×6 matrix", "GPa"]),
        ("german-matrix.csv", None, Some("GPa"), &["6×6 matrix"]),
        ("german.csv", Some("Fo"), None, &["9 constants", "class orthotropic"]),
        ("german.csv", None, None, &["row of a table"]),
        ("pymatgen.json", None, None, &["pymatgen", "3×3×3×3", "GPa"]),
        ("full.json", None, None, &["record", "3×3×3×3", "GPa"]),
        ("bare.json", None, Some("GPa"), &["list", "GPa", "11 22 33"]),
        ("bare-full.json", None, Some("GPa"), &["3×3×3×3"]),
        ("mp.json", None, None, &["ieee_format", "raw is there too", "GPa"]),
        ("list.json", Some("b"), None, &["elastic_tensor"]),
        ("by-id.json", Some("mp-2"), None, &["elastic_tensor"]),
        ("by-id.json", Some("mp-1"), None, &["elastic_tensor"]),
        ("matrices.json", Some("Fa"), None, &["elastic_tensor"]),
        ("pandas.json", Some("b"), None, &["elasticity.elastic_tensor"]),
        ("split.json", Some("a"), None, &["elastic_tensor"]),
        ("columns.json", Some("b"), None, &["elastic_tensor"]),
        ("answer.json", None, None, &["ieee_format"]),
        ("jarvis.json", None, None, &["JARVIS", "XX YY ZZ XY YZ ZX"]),
        ("dpgen.json", None, None, &["elastic_tensor", "GPa"]),
    ] {
        let reading = found(name, row, unit);
        let error = crystal().relative_error(&reading.material.stiffness);
        // Files of fewer digits.
        let digits = if ["dpgen.out", "output_el_cons.dat"].contains(&name) { 1e-6 } else { 1e-12 };
        assert!(error < digits, "{name}: {error:e} {}", reading.read_as);
        for word in words {
            assert!(reading.read_as.contains(word), "{name}: wanted {word:?} in {:?}", reading.read_as);
        }
        assert!(!reading.material.name.is_empty(), "{name}");
    }
    assert_eq!(found("OUTCAR", None, None).material.name, "forsterite");
    assert_eq!(found("aniso.inp", None, None).material.name, "FORSTERITE");
    assert_eq!(found("mtex.txt", None, None).material.name, "Forsterite (mmm)");
    assert_eq!(found("msat.txt", None, None).material.density, Some(3222.0));
    assert_eq!(found("german.csv", None, None).material.density, Some(3222.0));
    assert_eq!(found("pymatgen.json", None, None).material.name, "pymatgen");
}

#[test]
fn what_is_one_and_what_is_many() {
    for name in [
        "list.json",
        "by-id.json",
        "matrices.json",
        "pandas.json",
        "split.json",
        "columns.json",
        "answer.json",
        "german.csv",
    ] {
        assert!(is_table(sample(name)), "{name}");
    }
    for name in [
        "OUTCAR",
        "bare.json",
        "bare-full.json",
        "mp.json",
        "pymatgen.json",
        "german-matrix.csv",
        "msat.txt",
        "dpgen.json",
    ] {
        assert!(!is_table(sample(name)), "{name}");
    }
    // The same texts, pasted.
    for name in ["OUTCAR", "lammps.log", "pymatgen.json", "german.csv", "crystal.out", "answer.json"] {
        let reading = parse_any(&text(name), "material.toml", None).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(crystal().relative_error(&reading.material.stiffness) < 1e-12, "{name}");
    }
    assert!(
        parse_any(&text("list.json"), "pasted", None).unwrap_err().to_string().contains("table of 2 materials: a, b")
    );
}

#[test]
fn units_are_named_once_or_asked_for() {
    for (name, value) in [("triangle.txt", "328.01"), ("ortho.inp", "328.01"), ("bare.json", "328.01")] {
        let message = message(&text(name), None);
        assert!(message.contains("no unit is named") && message.contains(value), "{name}: {message}");
        assert!(
            message.contains("GPa in GPa and") && message.contains("GPa in MPa") && message.contains("unit = \"GPa\""),
            "{message}"
        );
    }
    for name in ["OUTCAR", "lammps.log", "vaspkit.in", "aniso.inp", "thermo_pw.out"] {
        let message = message(&text(name), Some("psi"));
        assert!(
            message.contains("unit asked for is psi") && message.contains("leave the unit out"),
            "{name}: {message}"
        );
    }
    let two = text("vaspkit.in").replace("GPa", "GPa or kbar");
    assert!(message(&two, None).contains("the text names the units GPa and kbar"));
    assert!(parse_reading(&two, "text", Some("GPa")).is_ok());
    let toml = "unit = \"GPa\"\nclass = \"cubic\"\nc11 = 3\nc12 = 1\nc44 = 1";
    assert!(message(toml, Some("MPa")).contains("the unit asked for, MPa, contradicts \"GPa\""));
    let unitless = toml.replace("unit = \"GPa\"\n", "");
    let read = parse_reading(&unitless, "text", Some("MPa")).unwrap();
    assert!((read.material.stiffness.voigt()[(0, 0)] / 3e6 - 1.0).abs() < 1e-14);
    assert_eq!(read.read_as, "material file, c11 … c66 by name, MPa, order 11 22 33 23 13 12, class cubic");
}

#[test]
fn two_readings_are_both_said() {
    // VASP's unit without VASP's order.
    let kbar = text("vaspkit.in").replace("GPa", "kbar");
    let said = message(&kbar, None);
    assert!(said.contains("C44 is 6.608 GPa if") && said.contains("8.109 GPa if they are XX YY ZZ XY YZ ZX"), "{said}");
    let ordered = kbar.replace("kbar", "kbar, XX YY ZZ XY YZ ZX");
    let c = parse_reading(&ordered, "text", None).unwrap().material.stiffness.voigt();
    assert!(
        [(3, 81.09), (4, 80.07), (5, 66.08)].iter().all(|&(n, x)| (c[(n, n)] / (0.1e9 * x) - 1.0).abs() < 1e-12),
        "{c}"
    );
    // Of a cubic crystal both are the same.
    assert!(parse_reading(&kbar.replace("81.09", "66.08").replace("80.07", "66.08"), "text", None).is_ok());
    let raw = text("jarvis.json").replace("\"jid\": \"JVASP-1\", ", "").replace("elastic_tensor", "raw_et_tensor");
    assert!(message(&raw, None).contains("no order of rows is named: C44 is 80.07 GPa if"), "{}", message(&raw, None));
    let several = format!("{}\n{}", text("vaspkit.in"), text("vaspkit.in").replace("66.08", "60"));
    assert!(
        message(&several, None).contains("2 matrices may be the stiffness, in lines 2 and 10"),
        "{}",
        message(&several, None)
    );
    let light = text("msat.txt").replace("3222", "3.222");
    assert!(message(&light, None).contains("3.222 kg/m3 as MSAT has it, or 3222 kg/m3 if it is in g/cm3"));
}

#[test]
fn wrong_texts_are_refused_with_their_place() {
    let cut = |name: &str, lines: usize| text(name).lines().take(lines).collect::<Vec<_>>().join("\n");
    for (what, text, parts) in [
        ("cut OUTCAR", cut("OUTCAR", 19), &["text, line 14", "are not whole: 3 rows of six numbers"][..]),
        ("stars", text("OUTCAR").replace("2350.6000", "*********"), &["line 14", "not whole"]),
        ("no total", cut("OUTCAR", 12), &["line 3", "but not the total ones"]),
        (
            "asymmetric OUTCAR",
            text("OUTCAR").replacen("690.2000", "790.2000", 1),
            &["line 14", "not symmetric: row 1 column 2 is 790.2, row 2 column 1 is 690.2"],
        ),
        ("cut log", cut("lammps.log", 20), &["elastic constants c34, c35", "missing"]),
        (
            "log with nan",
            text("lammps.log").replace("199.04", "nan"),
            &["text, line 6, line 7", "C22all is no finite number"],
        ),
        ("five rows", cut("vaspkit.in", 6), &["line 2: a 6×6 matrix is needed, not rows of [6, 6, 6, 6, 6] numbers"]),
        ("word", text("vaspkit.in").replace("235.06", "abc"), &["line 4: \"abc\" is not a finite number"]),
        (
            "asymmetric",
            text("vaspkit.in").replacen("73.05", "93.05", 1),
            &["row 2 column 3 is 93.05, row 3 column 2 is 73.05"],
        ),
        ("negative", text("vaspkit.in").replace("66.08", "-66.08"), &["not positive definite"]),
        ("huge", text("vaspkit.in").replace("66.08", "1e300"), &["too large"]),
        (
            "cut card",
            text("aniso.inp").replace(" 0., 0., 0., 0., 66080., 20.", " 0."),
            &["line 5", "ANISOTROPIC has 21 constants, and 17 numbers are there"],
        ),
        (
            "two cards",
            format!("{0}\n{0}", text("aniso.inp")),
            &["2 *ELASTIC cards: FORSTERITE (line 5)", "row = \"FORSTERITE\""],
        ),
        ("lamina", text("aniso.inp").replace("ANISOTROPIC", "LAMINA"), &["\"LAMINA\" is no stiffness"]),
        ("card with x", text("aniso.inp").replace("199040.", "x"), &["line 6: \"x\" is not a finite number"]),
        ("few constants", "C11 = 168.4 GPa\nC12 = 121.4\nC44 = 75.4".into(), &["class = \"cubic\""]),
        (
            "twice",
            "C11 = 168.4 GPa\nC11 = 121.4\nC44 = 75.4".into(),
            &["line 2: c11 is 168.4 in line 1 and 121.4 here"],
        ),
        ("no diagonal", text("msat.txt").replace("5 5 81.09\n", ""), &["C55 is not among them"]),
        (
            "compliance",
            "# Compliance Tensor S_ij (1/GPa)\n".to_string() + &cut("vaspkit.in", 7)[17..],
            &["a compliance and no stiffness"],
        ),
        (
            "prose",
            "What a wonderful day.".into(),
            &["this is not TOML", "none of the other formats that are known", "OUTCAR"],
        ),
    ] {
        let message = message(&text, None);
        for part in parts {
            assert!(message.contains(part), "{what}: wanted {part:?} in {message:?}");
        }
        assert!(message.len() < 700 && !message.contains('\n'), "{what}: {message}");
    }
}

#[test]
fn engineering_constants_and_isotropy_of_cards() {
    let e = "** GPa\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n 11, .9, .5, .37, .3, .4, .75, .7,\n .2";
    let m = "! GPa\nMP,EX,1,11\nMP,EY,1,.9\nMP,EZ,1,.5\nMP,PRXY,1,.37\nMP,PRXZ,1,.3\nMP,PRYZ,1,.4\nMP,GXY,1,.75\nMP,GXZ,1,.7\nMP,GYZ,1,.2";
    let t = "unit = \"GPa\"\n[engineering]\nex = 11\ney = 0.9\nez = 0.5\ngyz = 0.2\ngzx = 0.7\ngxy = 0.75\nnu_xy = 0.37\nnu_yz = 0.4\nnu_xz = 0.3";
    let [e, m, t] = [e, m, t].map(|text| parse_reading(text, "text", None).unwrap().material.stiffness);
    assert!(t.relative_error(&e) < 1e-13 && t.relative_error(&m) < 1e-13);
    let i = parse_reading("*ELASTIC\n210., .3", "text", Some("GPa")).unwrap().material.stiffness;
    assert!(i.relative_error(&Stiffness::isotropic(1e9 * 210.0 * 0.3 / 1.3 / 0.4, 1e9 * 105.0 / 1.3)) < 1e-14);
}

#[test]
fn a_deck_of_several_materials_has_rows() {
    let of = |row: &str| find_reading(sample("several.inp").to_str().unwrap(), Some(row), None);
    let young = |row: &str| {
        let s = of(row).unwrap().material.stiffness.voigt().try_inverse().unwrap();
        (1e-6 / s[(0, 0)]).round()
    };
    assert_eq!((young("line:6"), young("line:13")), (210_000.0, 200_000.0));
    assert!(of("line:6").unwrap().read_as.contains("DENSITY is not taken"));
    assert!(!of("OLIVINE").unwrap().read_as.contains("DENSITY"));
    let message = |row: &str| of(row).unwrap_err().to_string();
    assert!(message("steel").contains("2 materials are called \"steel\", in lines 3 and 12"), "{}", message("steel"));
    assert!(message("olivin").contains("did you mean OLIVINE?"), "{}", message("olivin"));
    let one = find_reading(sample("OUTCAR").to_str().unwrap(), Some("x"), None).unwrap_err().to_string();
    assert!(one.contains("OUTCAR is one material"), "{one}");
    let ansys = "! GPa\nMP,EX,1,210\nMP,PRXY,1,.3\nMP,DENS,1,7850";
    assert!(parse_reading(ansys, "text", None).unwrap().read_as.contains("MP,DENS is not taken"));
    // The unit in two comments is one.
    assert!(parse_reading("** GPa\n*ELASTIC\n210., .3\n** in GPa", "text", None).is_ok());
    // A stiffness and what is not its inverse is none of thermo_pw's.
    let other = text("output_el_cons.dat").replacen("0.3280100000E+04", "0.4280100000E+04", 1);
    assert!(parse_reading(&other, "text", Some("GPa")).is_err());
}

#[test]
fn thomsens_parameters_give_their_speeds() {
    let text = "vp = 3300 m/s\nVs: 1.7 km/s\ndensity = 2.35 g/cm3\nepsilon = 0.195\ndelta = -0.22\ngamma 0.18";
    let reading = parse_reading(text, "shale", None).unwrap();
    let (c, rho) = (reading.material.stiffness.voigt(), reading.material.density.unwrap());
    assert!((rho - 2350.0).abs() < 1e-9 && reading.read_as.contains("Thomsen"));
    assert!(((c[(2, 2)] / rho).sqrt() - 3300.0).abs() < 1e-9 && ((c[(3, 3)] / rho).sqrt() - 1700.0).abs() < 1e-9);
    assert!(((c[(0, 0)] - c[(2, 2)]) / 2.0 / c[(2, 2)] - 0.195).abs() < 1e-12);
    assert!(((c[(5, 5)] - c[(3, 3)]) / 2.0 / c[(3, 3)] - 0.18).abs() < 1e-12);
    let delta =
        ((c[(0, 2)] + c[(3, 3)]).powi(2) - (c[(2, 2)] - c[(3, 3)]).powi(2)) / 2.0 / c[(2, 2)] / (c[(2, 2)] - c[(3, 3)]);
    assert!((delta + 0.22).abs() < 1e-12);
    assert!(message(&text.replace(" m/s", ""), None).contains("3300 may be 3300 m/s or 3300 km/s"));
    assert!(message(&text.replace("gamma 0.18", ""), None).contains("gamma missing"));
}

#[test]
fn orders_are_spelled_out() {
    let rows: String = C.iter().map(|row| format!("{row:?},")).collect();
    let with =
        |order: &str| parse_reading(&format!("unit = \"GPa\"\norder = {order}\nstiffness = [{rows}]"), "m.toml", None);
    let shear = |order: &str| {
        let c = with(order).unwrap().material.stiffness.voigt();
        [c[(3, 3)], c[(4, 4)], c[(5, 5)]].map(|x| (x / 1e7).round() / 100.0)
    };
    assert_eq!(shear("\"xx yy zz xy yz zx\""), [81.09, 80.07, 66.08]);
    assert_eq!(shear("\"VASP\""), [81.09, 80.07, 66.08]);
    assert_eq!(shear("[\"11\", \"22\", \"33\", \"12\", \"23\", \"31\"]"), [81.09, 80.07, 66.08]);
    assert_eq!(shear("\"11,22,33,12,13,23\""), shear("\"abaqus\""));
    assert_eq!(shear("\"xx yy zz yz xz xy\""), shear("\"voigt\""));
    // Rows of normal components may change places, too.
    let turned = with("\"yy xx zz yz xz xy\"").unwrap().material.stiffness.voigt();
    assert!((turned[(0, 0)] / 199.04e9 - 1.0).abs() < 1e-14);
    let message = with("\"xx yy zz xy xy zx\"").unwrap_err().to_string();
    assert!(message.contains("is not six different rows"), "{message}");
    assert!(with("\"vapsp\"").unwrap_err().to_string().contains("did you mean vasp?"));
}

/// Whatever a text is, it is read or refused.
#[test]
fn no_text_is_too_much() {
    for text in [
        "1 2 3\n".repeat(200_000),
        "* ".repeat(100_000),
        "[".repeat(300_000),
        format!("[{}", "[1,".repeat(100_000)),
        "C11 ".repeat(100_000),
        "TOTAL ELASTIC MODULI\n".repeat(50_000),
        "*ELASTIC\n".repeat(50_000),
        "Elastic Constant C11all = 1 GPa\n".repeat(50_000),
        "1".repeat(1_000_000),
        "1 1 1\n".repeat(30),
        "(1)\n±\n1±\n1(2)(3)\n".into(),
    ] {
        assert!(parse_reading(&text, "text", Some("GPa")).is_err());
        assert!(parse_any(&text, "text", None).is_err());
    }
}
