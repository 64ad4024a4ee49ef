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
