//! Tables: nothing that is known is passed over.

use anisobond_formats::{find_material, find_reading, parse_table};

const CUBIC: &str =
    "[[270,100,100,0,0,0],[100,270,100,0,0,0],[100,100,270,0,0,0],[0,0,0,85,0,0],[0,0,0,0,85,0],[0,0,0,0,0,86]]";

fn first(text: &str) -> Result<[f64; 3], String> {
    let mut rows = parse_table(text, "t", None).map_err(|e| e.to_string())?.rows;
    let c = rows.remove(0).material.map_err(|e| e.to_string())?.stiffness.voigt();
    Ok([c[(0, 0)], c[(3, 3)], c[(5, 5)]].map(|x| (x / 1e6).round() / 1e3))
}

#[test]
fn keys_count_in_any_letter_case() {
    let with = |more: &str| first(&format!("[{{\"elastic_tensor\": {CUBIC}{more}}}]"));
    assert_eq!(with(""), Ok([270.0, 85.0, 86.0]));
    assert_eq!(with(", \"Order\": \"abaqus\""), Ok([270.0, 86.0, 85.0]));
    assert_eq!(with(", \"UNITS\": \"kbar\""), Ok([27.0, 8.5, 8.6]));
    assert!(with(", \"Compliance\": [[1]]").unwrap_err().contains("both give the stiffness"));
    assert!(with(", \"C11\": 3").unwrap_err().contains("both give the stiffness"));
    assert!(with(", \"unit\": \"GPa\", \"Unit\": \"MPa\"").unwrap_err().contains("are the same key"));
    assert!(with(", \"ordr\": \"abaqus\"").unwrap_err().contains("did you mean order?"));
    assert!(with(", \"densty\": 3").unwrap_err().contains("did you mean density?"));
    assert!(with(", \"nsites\": 3, \"volume\": 4, \"K_VRH\": 3").is_ok());
    assert_eq!(
        first("[{\"class\": \"cubic\", \"C11\": 168.4, \"C12\": 121.4, \"C44\": 75.4}]"),
        Ok([168.4, 75.4, 75.4])
    );
}

#[test]
fn cards_of_few_constants() {
    let text = "id,class,C11 (GPa),C12,C44,C13,C33\nCu,cubic,168.4,121.4,75.4,,\nMg,hexagonal,59.7,26.2,16.4,21.7,61.7\nNo,hexagonal,59.7,26.2,16.4,,\n";
    let rows = parse_table(text, "t.csv", None).unwrap().rows;
    let c = |n: usize| rows[n].material.as_ref().unwrap().stiffness.voigt();
    assert!((c(0)[(5, 5)] - 75.4e9).abs() < 1.0 && (c(1)[(5, 5)] - 16.75e9).abs() < 1.0);
    assert!(rows[0].read_as.contains("3 constants by name, class cubic"), "{}", rows[0].read_as);
    let message = rows[2].material.as_ref().unwrap_err().to_string();
    assert!(
        message.starts_with("t.csv, line 4: class transversely-isotropic needs 5 independent constants but has 3"),
        "{message}"
    );
    assert!(message.contains("c13") && message.contains("c33"), "{message}");
    let nine = "c11,c22,c33,c12,c13,c23,c44,c55,c66\n328,199,235,69,69,73,66,81,80";
    assert_eq!(first(nine), Ok([328.0, 66.0, 80.0]));
    let kbar = first("id,class,C11 (kbar),C12,C44\nCu,cubic,1684,1214,754").unwrap_err();
    assert!(kbar.contains("\"C12\" may have the unit of \"C11 (kbar)\", or GPa"), "{kbar}");
    assert!(first("id,C11,C12,C44\na,1,2,3").unwrap_err().contains("column class"));
    assert!(first(&nine.replace("c11", "clas,c11").replace("\n", "\nx,")).unwrap_err().contains("did you mean class?"));
}

#[test]
fn decimal_commas_exponents_and_uncertainties() {
    assert_eq!(first("id;class;C11 (GPa);C12;C44\nCu;cubic;168,4;121,4;75,4"), Ok([168.4, 75.4, 75.4]));
    assert_eq!(first("id\tclass\tC11\tC12\tC44\nCu\tcubic\t1,684D+02\t121,4(3)\t75.4"), Ok([168.4, 75.4, 75.4]));
    assert_eq!(first("sep=;\nid;class;C11;C12;C44\nCu;cubic;168,4(2) GPa;121,4;75,4"), Ok([168.4, 75.4, 75.4]));
    let record = "[{\"class\": \"cubic\", \"c11\": \"168.4(2)\", \"c12\": \"121.4(3) GPa\", \"c44\": \"7.54D+01\"}]";
    assert_eq!(first(record), Ok([168.4, 75.4, 75.4]));
    assert!(first("id;class;C11;C12;C44\nCu;cubic;1.168,4;121,4;75,4").unwrap_err().contains("column C11"));
}

#[test]
fn thomsens_parameters_in_columns() {
    let text = "id,Vp (m/s),Vs (m/s),density (g/cm3),epsilon,delta,gamma\nshale,3300,1700,2.35,.195,-.22,.18";
    let rows = parse_table(text, "t", None).unwrap().rows;
    let material = rows[0].material.as_ref().unwrap();
    assert!((material.stiffness.voigt()[(2, 2)] - 2350.0 * 3300f64.powi(2)).abs() < 1.0);
    assert_eq!(material.density.map(f64::round), Some(2350.0));
    assert!(parse_table(&text.replace(" (m/s)", ""), "t", None).unwrap_err().to_string().contains("has no unit"));
}

#[test]
fn rows_of_one_name_have_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.csv");
    std::fs::write(&path, "id,class,C11,C12,C44\nQ,cubic,168.4,121.4,75.4\nQ,cubic,160,120,70\nR,cubic,150,110,65\n")
        .unwrap();
    let repeated = anisobond_formats::read_table(&path, None).unwrap().repeated();
    assert_eq!(repeated, ["2 rows are called Q, in lines 2 and 3"]);
    let path = path.to_str().unwrap();
    let c11 =
        |row: &str| find_material(path, Some(row), None).map(|m| (m.stiffness.voigt()[(0, 0)] / 1e7).round() / 100.0);
    assert_eq!(["Q#1", "Q#2", "R", "R#1", "line:3"].map(|row| c11(row).unwrap()), [168.4, 160.0, 150.0, 150.0, 160.0]);
    let message = |row: &str| c11(row).unwrap_err().to_string();
    assert!(message("Q").contains("2 rows are called Q, in lines 2 and 3") && message("Q").contains("row = \"Q#1\""));
    assert!(message("Q#3").contains("there is no row Q#3; there are 2 called Q"));
    let all = find_reading(path, None, None).unwrap_err().to_string();
    assert!(all.contains("a table of 3 materials: Q#1, Q#2, R"), "{all}");
}

#[test]
fn engineering_constants_in_columns() {
    let file = "unit = \"GPa\"\n[engineering]\nex = 11\ney = 0.9\nez = 0.5\ngyz = 0.2\ngzx = 0.7\ngxy = 0.75\nnu_xy = 0.37\nnu_yz = 0.4\nnu_xz = 0.3";
    let pine = anisobond_formats::parse_material(file, "pine.toml").unwrap().stiffness;
    for (heading, row) in [
        ("E1,E2,E3,nu12,nu13,nu23,G12,G13,G23", "11,0.9,0.5,0.37,0.3,0.4,0.75,0.7,0.2"),
        ("id;E1;e2;E_3;NU12;ν13;v23;G12;g13;G_23", "pine;11;0,9;0,5;0,37;0,3;0,4;0,75;0,7;0,2"),
        (
            "name,Ex (MPa),Ey (MPa),Ez (MPa),nu_xy (-),nu_xz,nu_yz,Gxy (MPa),Gxz (MPa),Gyz (GPa)",
            "pine,11000,900,500,0.37,0.3,0.4,750,700,0.2",
        ),
        ("E1,E2,E3,nu21,nu13,nu23,G12,G13,G23,unit", "110,9,5,0.030272727272727274,0.3,0.4,7.5,7,2,kbar"),
    ] {
        let mut rows = parse_table(&format!("{heading}\n{row}"), "t", None).unwrap().rows;
        let reading = rows.remove(0).reading().unwrap_or_else(|e| panic!("{heading}: {e}"));
        assert!(pine.relative_error(&reading.material.stiffness) < 1e-12, "{heading}");
        assert!(reading.read_as.contains("engineering constants e"), "{}", reading.read_as);
    }
    let glass = "E (GPa),nu\n60,0.25\n,0.25";
    let rows = parse_table(glass, "glass.csv", None).unwrap().rows;
    assert_eq!(first(glass), Ok([72.0, 24.0, 24.0]));
    let missing = rows[1].material.as_ref().unwrap_err().to_string();
    assert!(missing.starts_with("glass.csv, line 3") && missing.contains("two of"), "{missing}");
    assert!(first("E1 (MPa),E2,nu12\n1,2,3").unwrap_err().contains("\"E2\" may have the unit of \"E1 (MPa)\", or GPa"));
    assert!(first("E,nu (GPa)\n1,.2").unwrap_err().contains("\"nu (GPa)\" is a ratio and has no unit"));
    let both = "c11,c22,c33,c12,c13,c23,c44,c55,c66,E1,nu12\n328,199,235,69,69,73,66,81,80,1,.2";
    assert!(first(both).unwrap_err().contains("\"c11\" and \"E1\" both give the stiffness"));
    // Averages beside a tensor pass.
    assert!(first(&both.replace("E1,nu12", "K,G")).is_ok());
}

#[test]
fn one_unit_among_twenty_one_headings_is_asked_back() {
    let names: Vec<String> = (1..=6).flat_map(|a| (a..=6).map(move |b| format!("c{a}{b}"))).collect();
    let row = "328,69,69,0,0,0,199,73,0,0,0,235,0,0,0,66,0,0,81,0,80";
    let one = names.join(",").replacen("c11", "c11 (MPa)", 1);
    let said = first(&format!("{one}\n{row}")).unwrap_err();
    assert!(said.contains("\"c12\" may have the unit of \"c11 (MPa)\", or GPa"), "{said}");
    assert_eq!(first(&format!("{}\n{row}", one.replace("MPa", "GPa"))), Ok([328.0, 66.0, 80.0]));
    assert_eq!(first(&format!("{one},unit\n{row},MPa")), Ok([0.328, 0.066, 0.08]));
}
