//! Tables of materials: the same in every format, and what is wrong is said by row.

use crate::given::reading as reading_common;

use std::path::Path;

use anisobond::tensor::{Material, Stiffness, SymmetryClass};
use anisobond_formats::{is_table, parse_material, parse_table, read_table};
use reading_common::{Folder, GOOD, HEADER, assert_same, read};

fn table_of(text: &str) -> Vec<anisobond_formats::Row> {
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
        ("unit in header", format!("{}\nmp-1,AB,{GOOD}", HEADER.replace("c11", "C11 (GPa)"))),
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

fn check_rows(rows: &[anisobond_formats::Row], expected: &[(&str, usize, &str)]) {
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

const ROWS: &str =
    "[[270,100,100,0,0,0],[100,270,100,0,0,0],[100,100,270,0,0,0],[0,0,0,85,0,0],[0,0,0,0,85,0],[0,0,0,0,0,86]]";

fn only(text: &str) -> Result<Stiffness, String> {
    table_of(text).remove(0).material.map(|m| m.stiffness).map_err(|e| e.to_string())
}

/// What a record says beside its tensor counts, or is refused.
#[test]
fn known_keys_of_records_count() {
    let plain = only(&format!("[{{\"elastic_tensor\": {ROWS}}}]")).unwrap();
    let with = |more: &str| only(&format!("[{{\"elastic_tensor\": {ROWS}, {more}}}]"));
    // Shear rows in Abaqus' order: 12 13 23, so that the last of them is 23.
    let abaqus = with("\"order\": \"abaqus\"").unwrap().voigt();
    assert_eq!([abaqus[(3, 3)], abaqus[(5, 5)]], [86e9, 85e9]);
    // The Materials Project's order of the expansion is none of rows.
    assert_same(&plain, &with("\"order\": 2").unwrap(), "order 2");
    assert!(with("\"order\": 3").unwrap_err().contains("order"));
    assert!(with("\"order\": \"xy\"").unwrap_err().contains("unknown order"));
    let inner =
        only(&format!("[{{\"elasticity\": {{\"elastic_tensor\": {ROWS}, \"unit\": \"kbar\", \"order\": 2}}}}]"));
    assert_same(&plain.scaled(0.1), &inner.unwrap(), "unit beside the tensor");
    let turned = with("\"orientation\": {\"bunge\": [90, 90, 0]}").unwrap();
    assert!(plain.relative_error(&turned) > 1e-4 && (turned.norm() / plain.norm() - 1.0).abs() < 1e-14);
    // Within a percent of its norm: what computations scatter.
    let cubic = with("\"class\": \"cubic\"").unwrap();
    assert!(cubic.relative_error(&SymmetryClass::Cubic.project(&cubic)) < 1e-14);
    assert!(plain.relative_error(&cubic) > 1e-4 && plain.relative_error(&cubic) < 0.01);
    assert!(with("\"class\": \"tetragonal\"").is_ok());
    for second in ["compliance", "stiffness"] {
        let message = with(&format!("\"{second}\": {ROWS}")).unwrap_err();
        assert!(message.contains("elastic_tensor and") && message.contains(second), "{message}");
    }
    assert!(with("\"c11\": 3").unwrap_err().contains("both give the stiffness"));
    assert!(with(&format!("\"elasticity\": {{\"elastic_tensor\": {ROWS}}}")).is_ok());
    let other = ROWS.replace("86", "80");
    assert!(with(&format!("\"elasticity\": {{\"elastic_tensor\": {other}}}")).unwrap_err().contains("they differ"));
}

/// A column of units is that of its rows; other columns that say something of the stiffness count too.
#[test]
fn known_columns_of_tables_count() {
    let row = |more: &str, value: &str| only(&format!("{HEADER},{more}\na,b,{GOOD},{value}"));
    assert_same(&cubic().scaled(0.1), &row("unit", "kbar").unwrap(), "kbar");
    assert_same(&cubic(), &row("Unit", "").unwrap(), "no unit");
    assert!(row("unit", "parsec").unwrap_err().contains("column unit"));
    let headed = HEADER.replace("c44", "c44 (GPa)");
    let contradicted = only(&format!("{headed},unit\na,b,{GOOD},MPa")).unwrap_err();
    assert!(contradicted.contains("the row's unit \"MPa\" contradicts \"c44 (GPa)\""), "{contradicted}");
    assert_same(&cubic(), &only(&format!("{headed},unit\na,b,{GOOD},GPa")).unwrap(), "the same unit twice");
    let asked = parse_table(&format!("{HEADER},unit\na,b,{GOOD},MPa"), "t.csv", Some("GPa")).unwrap();
    assert!(asked.rows[0].material.as_ref().unwrap_err().to_string().contains("contradicts \"GPa\""));
    assert_same(&cubic(), &row("class", "cubic").unwrap(), "class");
    // Stiffer along one axis than along the others.
    let other = |more: &str, value: &str| only(&format!("{HEADER},{more}\na,b,{},{value}", GOOD.replace("270", "240")));
    assert!(other("class", "isotropic").unwrap_err().contains("column class"));
    let plain = other("unit", "GPa").unwrap();
    let q = anisobond_formats::parse_orientation("bunge:45,90,0").unwrap();
    let turned = other("orientation", "\"bunge:45,90,0\"").unwrap();
    assert!(plain.relative_error(&turned) > 1e-3);
    assert_same(&plain.rotated(&q), &turned, "orientation");
    assert!(row("orientation", "sideways").unwrap_err().contains("column orientation"));
    assert!(row("order", "abaqus").unwrap_err().contains("column order"));
    assert_same(&cubic(), &row("order", "7").unwrap(), "another order");
    let whole =
        |more: &str| parse_table(&format!("{HEADER},{more}\na,b,{GOOD},1"), "t.csv", None).unwrap_err().to_string();
    assert!(whole("compliance").contains("is not read beside c11"));
    assert!(whole("axis").contains("orientation"));
}

/// Rows of one name are told from each other by their lines.
#[test]
fn rows_of_one_name_are_chosen_by_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("temperatures.csv");
    let hot = GOOD.replace("270", "240");
    std::fs::write(&path, format!("{HEADER}\nQ,300 K,{GOOD}\nQ,600 K,{hot}\nR,,{GOOD}\n")).unwrap();
    let find = |row: &str| anisobond_formats::find_material(path.to_str().unwrap(), Some(row), None);
    let message = find("Q").unwrap_err().to_string();
    assert!(
        message.contains("2 rows are called Q, in lines 2 and 3") && message.contains("row = \"line:2\""),
        "{message}"
    );
    let [first, second] = ["line:2", "line:3"].map(|row| find(row).unwrap().stiffness.voigt()[(0, 0)]);
    assert_eq!([first, second], [270e9, 240e9]);
    assert!(find("R").is_ok());
    assert!(find("S").unwrap_err().to_string().contains("there is no row S"));
    assert!(find("line:9").unwrap_err().to_string().contains("there is no row line:9"));
}
