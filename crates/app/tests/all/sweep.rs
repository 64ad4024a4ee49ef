//! Sweeps: tables in all forms, a store that survives every stop, shards that merge to the whole.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use anisobond::{Error, Result};
use anisobond_app::sweep::{
    Job, JobLog, Options, ParameterTable, Shard, SlurmScript, State, Store, Summary, Value, merge, run_sweep,
    slurm_script, sweep_chart,
};
use anisobond_formats::Inputs;
use proptest::prelude::*;
use serde_json::json;

fn toml(text: &str) -> Result<ParameterTable> {
    ParameterTable::parse(text, "sweep.toml")
}

fn csv(text: &str) -> Result<ParameterTable> {
    ParameterTable::parse(text, "batch.csv")
}

/// The values of one parameter over the jobs, as text.
fn column(table: &ParameterTable, name: &str) -> Vec<String> {
    table.jobs().iter().map(|job| job.get(name).map_or("-".into(), ToString::to_string)).collect()
}

fn refused(result: Result<ParameterTable>, parts: &[&str]) {
    let message = result.unwrap_err().to_string();
    for part in parts {
        assert!(message.contains(part), "{part:?} is not in: {message}");
    }
}

#[test]
fn every_combination_with_the_first_parameter_slowest() {
    let table = toml(
        "material = \"cross.toml\"\nzip = [[\"b\", \"d\"]]\n[parameters]\na = [1, 2]\nb = [\"x\", \"y\"]\n\
         c = [0.5]\nd = [10, 20]\n[fixed]\nseed = 7\n",
    )
    .unwrap();
    assert_eq!(column(&table, "a"), ["1", "1", "2", "2"]);
    assert_eq!(column(&table, "b"), ["x", "y", "x", "y"]);
    assert_eq!(column(&table, "d"), ["10", "20", "10", "20"]);
    assert_eq!(column(&table, "seed"), ["7"; 4]);
    assert_eq!(column(&table, "material"), ["cross.toml"; 4]);
    assert_eq!(table.jobs()[1].title, "a=1, b=y, d=20");
    assert_eq!(table.names().collect::<Vec<_>>(), ["a", "b", "c", "d", "material", "seed"]);
}

#[test]
fn ranges_have_both_ends_whatever_rounding() {
    for (range, values) in [
        ("from = 1.2, to = 2.8, step = 0.2", vec![1.2, 1.4, 1.6, 1.8, 2.0, 2.2, 2.4, 2.6, 2.8]),
        ("from = 0, to = 1, step = 0.1", (0..=10).map(|i| f64::from(i) / 10.0).collect()),
        ("from = 1, to = 2, step = 0.3", vec![1.0, 1.3, 1.6, 1.9]),
        ("from = 3, to = 1, step = -1", vec![3.0, 2.0, 1.0]),
        ("from = 5, to = 5, step = 1", vec![5.0]),
        ("from = 1, to = 2, count = 5", vec![1.0, 1.25, 1.5, 1.75, 2.0]),
        ("from = 1, to = 1000, count = 4, spacing = \"log\"", vec![1.0, 10.0, 100.0, 1000.0]),
        ("from = 4, to = 4, count = 1", vec![4.0]),
    ] {
        let table = toml(&format!("[parameters]\na = {{ {range} }}")).unwrap();
        let found: Vec<f64> = table.jobs().iter().filter_map(|job| job.get("a")?.number()).collect();
        assert_eq!(found, values, "{range}");
    }
}

#[test]
fn wrong_toml_says_where_and_what() {
    let parameter = |value: &str| toml(&format!("seed = 1\n[parameters]\na = {value}"));
    refused(parameter("{ from = 1, to = 2 }"), &["sweep.toml, line 3, a", "neither step nor count"]);
    refused(parameter("{ from = 1, to = 2, setp = 1 }"), &["unknown key \"setp\"", "did you mean step?"]);
    refused(parameter("{ from = 1, to = 2, step = -1 }"), &["do not lead from 1 to 2"]);
    refused(parameter("{ from = 1, to = 2, step = 0 }"), &["do not lead"]);
    refused(parameter("{ from = 1, to = 2, step = 1e-9 }"), &["at most 100000"]);
    refused(parameter("{ from = 1, to = 2, step = 1, count = 2 }"), &["both step and count"]);
    refused(parameter("{ from = 1, to = 2, count = 2.5 }"), &["count = 2.5"]);
    refused(parameter("{ from = 0, to = 2, count = 3, spacing = \"log\" }"), &["positive ends"]);
    refused(parameter("{ from = 1, to = 2, count = 3, spacing = \"cubic\" }"), &["\"cubic\"", "\"log\""]);
    refused(parameter("[]"), &["the list is empty"]);
    refused(parameter("[true]"), &["a truth value"]);
    refused(parameter("[nan]"), &["finite number"]);
    refused(parameter("[[1]]"), &["a list of 1"]);
    refused(parameter("[1, 2, 1]"), &["combination 3 has the same parameters as combination 1", "a = 1"]);
    refused(toml("a = 1"), &["no table [parameters]"]);
    refused(toml("[parameters]"), &["no job"]);
    refused(toml("a = [1, 2]\n[parameters]\nb = 1"), &["line 1, a", "move what varies"]);
    refused(toml("[paramters]\nb = 1"), &["[paramters]", "did you mean parameters?"]);
    refused(toml("a = 1\n[parameters]\na = 1"), &["\"a\" is given twice, on lines 3 and 1"]);
    refused(toml("zip = [[\"a\", \"c\"]]\n[parameters]\na = [1]\nb = [1]"), &["\"c\" is not among"]);
    refused(toml("zip = [[\"a\", \"b\"]]\n[parameters]\na = [1, 2]\nb = [1]"), &["a has 2 values, but b has 1"]);
    refused(toml("zip = [\"a\"]\n[parameters]\na = [1, 2]"), &["list of lists"]);
    refused(toml("[parameters"), &["sweep.toml:1:"]);
    refused(ParameterTable::parse("a\n1", "table.doc"), &["end the name in"]);
    let list = (0..1100).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
    refused(toml(&format!("[parameters]\na = [{list}]\nb = [{list}]")), &["more than 1000000 combinations"]);
}

#[test]
fn csv_rows_repeat_skip_and_label() {
    let table = csv("# Woo's habits\ncontact_radius, material, !note, seed\n1.2, 130 MPa, first, 7\n\n# 9, 9, 9, 9\n\
                     1.4, =, second, =\n1.8, = , , -\n")
    .unwrap();
    assert_eq!(column(&table, "contact_radius"), ["1.2", "1.4", "1.8"]);
    assert_eq!(column(&table, "material"), ["130 MPa"; 3]);
    assert_eq!(column(&table, "seed"), ["7", "7", "-"]);
    assert!(table.jobs().iter().all(|job| job.get("note").is_none()));
    let titles: Vec<&str> = table.jobs().iter().map(|job| job.title.as_str()).collect();
    assert_eq!(titles, ["note=first", "note=second", "note=second"]);
    let places: Vec<&str> = table.jobs().iter().map(|job| job.place.as_str()).collect();
    assert_eq!(places, ["line 3", "line 6", "line 7"]);

    let own = csv("title;a;b!\nsoft;1;2\nhard;3;4\n").unwrap();
    assert_eq!(own.jobs()[1].title, "hard");
    assert_eq!(own.jobs()[1].get("b"), Some(&Value::Number(4.0)));
    assert_eq!(csv("a,b!\n1,2\n1,3\n").unwrap().jobs()[1].title, "b=3");
    assert_eq!(csv("a,b\n1,2\n1,3\n").unwrap().jobs()[1].title, "b=3");
}

#[test]
fn wrong_rows_say_where_and_what() {
    refused(csv("a,b\n=,1\n"), &["batch.csv, line 2, field 1", "no value above", "column \"a\""]);
    refused(csv("a,b\n1,\n"), &["line 2, field 2", "the first job has no value"]);
    refused(csv("a,b\n1,2\n3\n"), &["line 3", "1 fields, the header 2"]);
    refused(csv("a,a\n1,2\n"), &["column \"a\" is there twice"]);
    refused(csv("a,\n1,2\n"), &["line 1, field 2", "no name"]);
    refused(csv("a,...\n1,2\n"), &["continues the one before"]);
    refused(csv("1,2\n1,2\n"), &["the number 1 stands where a name"]);
    refused(csv("title\nx\n"), &["no column is a parameter"]);
    refused(csv("a,b\n1,2\n3,4\n# x\n1,2\n"), &["line 5 has the same parameters as line 2: a = 1, b = 2"]);
    refused(csv(""), &["the table is empty"]);
    refused(csv("a,b\n"), &["no job"]);
    let table = csv("contact_radios,seed\n1,2\n").unwrap();
    let message = table.check_names(&["contact_radius", "seed"]).unwrap_err().to_string();
    assert!(message.contains("batch.csv, line 1, field 1"), "{message}");
    assert!(message.contains("unknown parameter \"contact_radios\"; did you mean contact_radius?"), "{message}");
    assert!(table.check_names(&["contact_radios", "seed"]).is_ok());
}

#[test]
fn spreadsheets_are_the_same_table() {
    let folder = tempfile::tempdir().unwrap();
    let xlsx = folder.path().join("batch.xlsx");
    let mut book = rust_xlsxwriter::Workbook::new();
    book.add_worksheet();
    let sheet = book.add_worksheet();
    let rows: [&[&str]; 6] = [
        &["contact_radius", "material", "!note", "seed"],
        &["1.2", "130 MPa", "first", "7"],
        &["# a comment", "1"],
        &[],
        &["1.4", "=", "second", ""],
        &["1.8", "=", "=", "8", "# aside"],
    ];
    for (r, row) in rows.iter().enumerate() {
        for (c, text) in row.iter().enumerate() {
            let (r, c) = (r as u32 + 1, c as u16 + 1);
            match text.parse::<f64>() {
                Ok(number) => sheet.write(r, c, number).unwrap(),
                Err(_) => sheet.write(r, c, *text).unwrap(),
            };
        }
    }
    book.save(&xlsx).unwrap();
    let xls = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/batch.xls");
    let text = csv("contact_radius,material,!note,seed\n1.2,130 MPa,first,7\n1.4,=,second,\n1.8,=,=,8\n").unwrap();
    for path in [xlsx, xls] {
        let table = ParameterTable::read(&path).unwrap();
        for (job, same) in table.jobs().iter().zip(text.jobs()) {
            assert_eq!((&job.id, &job.title, &job.parameters), (&same.id, &same.title, &same.parameters), "{path:?}");
        }
        let places: Vec<&str> = table.jobs().iter().map(|job| job.place.as_str()).collect();
        assert_eq!(places, ["row 3", "row 6", "row 7"]);
        let message = table.check_names(&["material", "seed"]).unwrap_err().to_string();
        assert!(message.contains("B2: unknown parameter \"contact_radius\""), "{message}");
    }
}

#[test]
fn wrong_spreadsheets_name_the_cell() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("batch.xlsx");
    let write = |cells: &[(u32, u16, &str)]| {
        let mut book = rust_xlsxwriter::Workbook::new();
        let sheet = book.add_worksheet();
        for (r, c, text) in cells {
            sheet.write(*r, *c, *text).unwrap();
        }
        book.save(&path).unwrap();
        ParameterTable::read(&path)
    };
    refused(write(&[(0, 0, "a"), (0, 1, "b"), (6, 0, "x"), (6, 1, "=")]), &["batch.xlsx", "Sheet1", "B7: = has no"]);
    refused(write(&[(0, 0, "a"), (1, 0, "x"), (1, 1, "y")]), &["row 2", "2 fields, the header 1"]);
    refused(write(&[]), &["the table is empty"]);
    refused(write(&[(0, 0, "a"), (1_048_575, 16_383, "x")]), &["1048576 × 16384 cells"]);
    for bytes in [&b"no spreadsheet"[..], b"PK\x03\x04 torn", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1 torn", b""] {
        for name in ["bad.xlsx", "bad.xls", "bad.ods"] {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            refused(ParameterTable::read(&path), &[name, "cannot be read"]);
        }
    }
    assert!(matches!(ParameterTable::read(folder.path().join("none.xlsx")), Err(Error::File { .. })));
    assert!(matches!(ParameterTable::read(folder.path().join("none.csv")), Err(Error::File { .. })));
}

#[test]
fn ids_depend_on_parameters_alone() {
    let a = csv("a,b\n1,x\n").unwrap();
    let b = csv("title,b,a\nname,x,1.0\n").unwrap();
    assert_eq!(a.jobs()[0].id, b.jobs()[0].id);
    let others = csv("a,b\n1,y\n2,x\n-,x\n1,-\n").unwrap();
    assert!(others.jobs().iter().all(|job| job.id != a.jobs()[0].id));
    assert_eq!(csv("a\n-0.0\n").unwrap().jobs()[0].id, csv("a\n0\n").unwrap().jobs()[0].id);
    // A number is not the text of the same letters.
    let number = toml("[parameters]\na = [1]").unwrap();
    assert_ne!(number.jobs()[0].id, toml("[parameters]\na = [\"1\"]").unwrap().jobs()[0].id);
    // Kept in stores: the hash may not change from version to version.
    assert_eq!(a.jobs()[0].id, ID_OF_A1_BX);
}

const ID_OF_A1_BX: &str = "089881cc1e1df3e8";

proptest! {
    #[test]
    fn no_text_is_a_panic(text in "([a-z=!#\"',;\\[\\]{}. \n\t0-9-]|from|to|step|count|zip|parameters|title){0,60}") {
        let tables = [
            csv(&text),
            toml(&text),
            toml(&format!("[parameters]\na = {text}")),
            toml(&format!("zip = {text}\n[parameters]\na = [1]")),
        ];
        for table in tables {
            match table {
                Ok(table) => prop_assert!(!table.jobs().is_empty()),
                Err(e) => prop_assert!(e.to_string().starts_with("batch.csv") || e.to_string().starts_with("sweep.toml")),
            }
        }
        let _ = Shard::parse(&text);
    }
}

/// A folder with a store in it.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        Place(tempfile::tempdir().unwrap())
    }

    fn store(&self) -> PathBuf {
        self.0.path().join("results.sqlite")
    }

    fn options(&self, retry: bool) -> Options {
        Options { retry, logs: self.0.path().join("logs") }
    }
}

fn table() -> ParameterTable {
    toml("[parameters]\na = { from = 1, to = 4, step = 1 }\nb = [\"x\", \"y\", \"z\"]\n[fixed]\nunit = \"MPa\"")
        .unwrap()
}

fn open(place: &Place, shard: Option<Shard>) -> Store {
    let path = shard.map_or(place.store(), |shard| shard.store(place.store()));
    Store::open(path, &table(), shard, &json!({ "rotations": "free" })).unwrap()
}

/// A result that depends on the job alone.
fn square(job: &Job, log: &mut JobLog) -> Result<serde_json::Value> {
    let a = job.get("a").and_then(Value::number).unwrap();
    log.line(format_args!("a² of {a}"));
    Ok(json!({ "square": a * a, "nested": { "b": job.get("b").map(ToString::to_string) } }))
}

fn run(place: &Place, store: &Store, retry: bool) -> Summary {
    run_sweep(&table(), store, &place.options(retry), &AtomicBool::new(false), square, |_| ()).unwrap()
}

#[test]
fn a_sweep_runs_logs_and_exports_in_the_tables_order() {
    let place = Place::new();
    let store = open(&place, None);
    let seen = Mutex::new(Vec::new());
    let summary = run_sweep(&table(), &store, &place.options(false), &AtomicBool::new(false), square, |progress| {
        seen.lock().unwrap().push(progress);
    })
    .unwrap();
    assert_eq!((summary.counts.all, summary.counts.done, summary.counts.failed), (12, 12, 0));
    assert!(!summary.interrupted && summary.failed.is_empty());
    let seen = seen.into_inner().unwrap();
    assert_eq!(seen.iter().map(|p| p.left).collect::<Vec<_>>(), (0..=12).rev().collect::<Vec<_>>());
    assert!(seen[0].remaining.is_none() && seen[12].remaining.unwrap().is_zero());
    let text = store.csv().unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 13);
    assert_eq!(lines[0], "id,title,state,a,b,unit,square,nested.b,error");
    assert!(lines[1].ends_with("\"a=1, b=x\",done,1.0,x,MPa,1.0,x,"), "{}", lines[1]);
    assert!(lines[12].ends_with("done,4.0,z,MPa,16.0,z,"), "{}", lines[12]);
    assert_eq!(store.points("a", "square").unwrap()[11], [4.0, 16.0]);
    assert!(store.points("a", "sqare").unwrap_err().to_string().contains("did you mean square?"));
    let chart = sweep_chart(&store, "squares", "a", &["square"], Some("b")).unwrap();
    assert_eq!(chart.csv().unwrap().lines().next(), Some("a,square: b = x,square: b = y,square: b = z"));
    assert_eq!(chart.csv().unwrap().lines().nth(2), Some("2,4,4,4"));
    assert!(sweep_chart(&store, "", "a", &["square"], Some("c")).unwrap_err().to_string().contains("\"c\""));
    assert!(sweep_chart(&store, "", "a", &["title"], None).unwrap_err().to_string().contains("has no point"));
    let logs: Vec<_> = std::fs::read_dir(place.options(false).logs).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(logs.len(), 12);
    let log = logs
        .iter()
        .find(|path| path.to_string_lossy().contains("a=2,b=y") || path.to_string_lossy().contains("a=2_b=y"));
    let log = std::fs::read_to_string(log.unwrap()).unwrap();
    assert!(log.contains("unit = MPa") && log.contains("a² of 2") && log.trim_end().ends_with("done"), "{log}");
}

#[test]
fn resumed_after_a_stop_at_every_point_it_is_the_same() {
    let whole = Place::new();
    let store = open(&whole, None);
    run(&whole, &store, false);
    let expected = store.csv().unwrap();
    for point in 0..=12 {
        let place = Place::new();
        let stop = AtomicBool::new(point == 0);
        let store = open(&place, None);
        let summary = run_sweep(&table(), &store, &place.options(false), &stop, square, |progress| {
            if progress.finished_now >= point {
                stop.store(true, Ordering::Relaxed);
            }
        })
        .unwrap();
        assert!(summary.counts.done >= point && summary.interrupted == (summary.counts.done < 12));
        let before = summary.counts.done;
        drop(store);
        let store = open(&place, None);
        let runs = AtomicUsize::new(0);
        let count = |job: &Job, log: &mut JobLog| {
            runs.fetch_add(1, Ordering::Relaxed);
            square(job, log)
        };
        run_sweep(&table(), &store, &place.options(false), &AtomicBool::new(false), count, |_| ()).unwrap();
        assert_eq!(runs.into_inner(), 12 - before, "stopped at {point}");
        assert_eq!(store.csv().unwrap(), expected, "stopped at {point}");
    }
}

#[test]
fn failures_and_panics_are_kept_and_retried_on_demand() {
    let place = Place::new();
    let store = open(&place, None);
    let flaky = |job: &Job, log: &mut JobLog| match job.title.as_str() {
        "a=2, b=x" => Err(Error::input("the lattice is a mechanism", "raise the contact radius")),
        "a=3, b=z" => panic!("index out of {}", "bounds"),
        "a=4, b=y" => Err(Error::Interrupted { message: "now".into() }),
        _ => square(job, log),
    };
    let go = AtomicBool::new(false);
    let summary = run_sweep(&table(), &store, &place.options(false), &go, flaky, |_| ()).unwrap();
    let failed = [
        ("a=2, b=x".to_string(), "the lattice is a mechanism; raise the contact radius".to_string()),
        ("a=3, b=z".to_string(), "the job panicked: index out of bounds".to_string()),
    ];
    assert_eq!(summary.failed, failed);
    assert_eq!((summary.counts.done, summary.interrupted), (9, true));
    assert!(store.csv().unwrap().contains(",the lattice is a mechanism; raise the contact radius\n"));
    // Without retry only the interrupted one is done.
    let summary = run(&place, &store, false);
    assert_eq!((summary.counts.done, summary.counts.failed, summary.failed.len()), (10, 2, 2));
    let summary = run(&place, &store, true);
    assert_eq!((summary.counts.done, summary.counts.failed), (12, 0));
    let record = store.records().unwrap().into_iter().find(|r| r.title == "a=2, b=x").unwrap();
    assert_eq!((record.state, record.attempts, record.message), (State::Done, 2, None));
}

#[test]
fn shards_merge_to_the_unsharded_result() {
    let whole = Place::new();
    let store = open(&whole, None);
    run(&whole, &store, false);
    let expected = store.csv().unwrap();
    let place = Place::new();
    let paths: Vec<PathBuf> = (0..3)
        .map(|index| {
            let shard = Shard { index, count: 3 };
            let store = open(&place, Some(shard));
            assert_eq!(store.path().file_name().unwrap().to_string_lossy(), format!("results.{index}-of-3.sqlite"));
            assert_eq!(run(&place, &store, false).counts.all, 4);
            store.path().to_path_buf()
        })
        .collect();
    for (paths, part) in [
        (vec![&paths[0], &paths[2]], "shard 1/3 missing"),
        (vec![&paths[0]], "shards 1/3 and 2/3 missing"),
        (vec![&paths[0], &paths[0], &paths[1]], "shard 0/3 is given twice"),
        (vec![&whole.store()], "of a whole sweep"),
        (vec![], "no shard to merge"),
    ] {
        let message = merge(place.store(), &paths).map(drop).unwrap_err().to_string();
        assert!(message.contains(part), "{part}: {message}");
        assert!(!place.store().exists());
    }
    let merged = merge(place.store(), &paths).unwrap();
    assert_eq!(merged.csv().unwrap(), expected);
    drop(merged);
    // Merging again changes nothing, and the merged store is that of the whole sweep.
    assert_eq!(merge(place.store(), &paths).unwrap().csv().unwrap(), expected);
    let merged = open(&place, None);
    assert_eq!(run(&place, &merged, true).counts.done, 12);
    assert_eq!(merged.csv().unwrap(), expected);
    // A shard of another table.
    let other = place.0.path().join("other.sqlite");
    let table = csv("a\n1\n2\n3\n").unwrap();
    drop(Store::open(&other, &table, Some(Shard { index: 1, count: 3 }), &json!({ "rotations": "free" })).unwrap());
    let message = merge(place.store(), &[&paths[0], &other, &paths[2]]).map(drop).unwrap_err().to_string();
    assert!(message.contains("another table or division"), "{message}");
}

#[test]
fn foreign_and_damaged_stores_are_refused_and_left_alone() {
    let place = Place::new();
    let settings = json!({ "rotations": "free" });
    let refused = |path: &Path, part: &str| {
        let before = std::fs::read(path).unwrap();
        let message = Store::open(path, &table(), None, &settings).map(drop).unwrap_err().to_string();
        assert!(message.contains(part) && message.contains("sqlite"), "{part}: {message}");
        assert_eq!(std::fs::read(path).unwrap(), before);
    };
    let path = place.0.path().join("notes.sqlite");
    std::fs::write(&path, "my notes, not to be lost").unwrap();
    refused(&path, "not the store of a sweep");
    let foreign = place.0.path().join("foreign.sqlite");
    rusqlite::Connection::open(&foreign).unwrap().execute_batch("CREATE TABLE mine (x)").unwrap();
    refused(&foreign, "not the store of a sweep");
    let store = open(&place, None);
    run(&place, &store, false);
    drop(store);
    let other = |settings: serde_json::Value, shard: Option<Shard>| {
        Store::open(place.store(), &table(), shard, &settings).map(drop).unwrap_err().to_string()
    };
    let message = other(json!({ "rotations": "blocked" }), None);
    assert!(message.contains("settings.rotations \"free\", sweep.toml has \"blocked\""), "{message}");
    let message = other(settings.clone(), Some(Shard { index: 0, count: 2 }));
    assert!(message.contains("shard 0/1 (the whole), sweep.toml has 0/2"), "{message}");
    // Every kind of damage is refused or harmless, never a panic.
    let whole = std::fs::read(place.store()).unwrap();
    for at in (100..whole.len()).step_by(197) {
        let mut bytes = whole.clone();
        bytes[at..].iter_mut().take(150).for_each(|b| *b = !*b);
        std::fs::write(place.store(), &bytes).unwrap();
        if let Ok(store) = Store::open(place.store(), &table(), None, &settings) {
            let _ = store.csv();
        }
    }
    for length in [1, 15, 16, 99, 100, 512, 4096, whole.len() - 4096] {
        std::fs::write(place.store(), &whole[..length]).unwrap();
        refused(&place.store(), "store");
    }
}

/// Whatever is changed in the record of a finished job, its result is not trusted, not blank, and computed again.
#[test]
fn damaged_records_are_computed_again() {
    let place = Place::new();
    let store = open(&place, None);
    run(&place, &store, false);
    let expected = store.csv().unwrap();
    drop(store);
    let whole = std::fs::read(place.store()).unwrap();
    for (column, value) in [
        ("result", "NULL"),
        ("result", "''"),
        ("result", "'{\"square\":7.0}'"),
        ("result", "x'0000000000000000'"),
        ("result", "substr(result, 1, length(result) - 1)"),
        ("state", "'failed'"),
        ("state", "'d\u{6f}nf'"),
        ("inputs", "'[[\"x\",\"y\"]]'"),
        ("checksum", "''"),
        ("message", "x'ff'"),
    ] {
        std::fs::write(place.store(), &whole).unwrap();
        let sql = format!("UPDATE jobs SET {column} = {value} WHERE position = 5");
        rusqlite::Connection::open(place.store()).unwrap().execute_batch(&sql).unwrap();
        let read = Store::read(place.store()).unwrap();
        let record = &read.records().unwrap()[5];
        assert!(record.damaged && record.state == State::Pending && record.result.is_none(), "{column} {value}");
        assert_eq!(read.counts().unwrap().done, 11);
        drop(read);
        let store = open(&place, None);
        assert_eq!(store.notes(), ["1 job is done again: their records in the store are damaged"]);
        assert_eq!(run(&place, &store, false).counts.done, 12);
        assert_eq!(store.csv().unwrap(), expected, "{column} {value}");
    }
}

/// A job is known by what its files hold, and what changed is named.
#[test]
fn jobs_of_changed_inputs_are_computed_anew() {
    let place = Place::new();
    let open = |content: &str| {
        let inputs = |job: &Job| match job.get("a").and_then(Value::number) {
            Some(a) if a > 2.0 => Inputs::default().and("spheres.txt", content.as_bytes()),
            _ => Inputs::default(),
        };
        Store::open_with(place.store(), &table(), None, &json!({ "rotations": "free" }), inputs).unwrap()
    };
    let first = open("one");
    run(&place, &first, false);
    drop(first);
    let same = open("one");
    assert!(same.notes().is_empty() && same.counts().unwrap().done == 12);
    drop(same);
    let changed = open("two");
    assert_eq!(changed.notes(), ["spheres.txt has changed: 6 jobs are done anew"]);
    assert_eq!(changed.counts().unwrap().done, 6);
    assert_eq!(run(&place, &changed, false).counts.done, 12);
    drop(changed);
    assert!(open("two").notes().is_empty());
}

#[test]
fn hostile_spreadsheets_are_refused_at_once() {
    use std::io::Write;
    let folder = tempfile::tempdir().unwrap();
    let archive = |name: &str, files: &[(&str, &str)]| {
        let path = folder.path().join(name);
        let mut zip = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
        for (name, text) in files {
            zip.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
            zip.write_all(text.as_bytes()).unwrap();
        }
        zip.finish().unwrap();
        ParameterTable::read(path)
    };
    refused(
        archive("count.xlsx", &[("xl/sharedStrings.xml", "<sst uniqueCount=\"4000000000\"/>")]),
        &["claims more texts"],
    );
    let ods = |rows: &str| {
        format!(
            "<o:document-content xmlns:o='urn:o' xmlns:t='urn:t'><o:spreadsheet><t:table>{rows}</t:table></o:spreadsheet>\
             </o:document-content>"
        )
    };
    let row = ods("<t:table-row t:number-rows-repeated='1000000'><t:table-cell o:value-type='string' \
         t:number-columns-repeated='1000'><p>x</p></t:table-cell></t:table-row>");
    refused(archive("cells.ods", &[("content.xml", &row)]), &["1000000 × 1000 cells"]);
    // A compound file, .xls, whose directory's sectors lead in a circle; and tables of sectors that do.
    let compound = |words: &[(usize, u32)]| {
        let mut bytes = vec![0xff_u8; 512 * 4];
        bytes[..8].copy_from_slice(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1");
        bytes[26..34].copy_from_slice(&[3, 0, 0xfe, 0xff, 9, 0, 6, 0]);
        for (at, word) in
            [(44, 1), (48, 1), (60, u32::MAX - 1), (64, 0), (68, u32::MAX - 1), (72, 0), (76, 0)].iter().chain(words)
        {
            bytes[*at..at + 4].copy_from_slice(&word.to_le_bytes());
        }
        let path = folder.path().join("loop.xls");
        std::fs::write(&path, bytes).unwrap();
        ParameterTable::read(path)
    };
    refused(compound(&[(512 + 4, 2), (512 + 8, 1)]), &["lead in a circle"]);
    refused(compound(&[(512 + 4, 1)]), &["lead in a circle"]);
    refused(compound(&[(68, 2), (512 * 3 + 508, 2)]), &["lead in a circle"]);
}

#[test]
fn a_store_in_use_is_refused_and_still_readable() {
    let place = Place::new();
    let store = open(&place, None);
    run(&place, &store, false);
    let message =
        Store::open(place.store(), &table(), None, &json!({ "rotations": "free" })).map(drop).unwrap_err().to_string();
    assert!(message.contains("another process is running this sweep: process"), "{message}");
    assert_eq!(Store::read(place.store()).unwrap().counts().unwrap().done, 12);
    drop(store);
    open(&place, None);
    assert!(matches!(Store::read(place.0.path().join("none.sqlite")), Err(Error::File { .. })));
}

#[test]
fn a_table_may_grow_and_shrink() {
    let place = Place::new();
    let settings = json!(null);
    let go = AtomicBool::new(false);
    let count = |text: &str| {
        let table = csv(text).unwrap();
        let store = Store::open(place.store(), &table, None, &settings).unwrap();
        let runs = AtomicUsize::new(0);
        let job = |job: &Job, log: &mut JobLog| {
            runs.fetch_add(1, Ordering::Relaxed);
            square(job, log)
        };
        run_sweep(&table, &store, &place.options(false), &go, job, |_| ()).unwrap();
        (runs.into_inner(), store.records().unwrap().len())
    };
    assert_eq!(count("a\n1\n2\n"), (2, 2));
    assert_eq!(count("a\n0\n2\n3\n"), (2, 3));
    assert_eq!(count("a\n1\n2\n"), (0, 2));
}

/// Runs a sweep of many small jobs where another test asks for it by the environment; that one kills it.
#[test]
fn swept_until_killed() {
    let Ok(folder) = std::env::var("ANISOBOND_TEST_SWEEP") else { return };
    let folder = Path::new(&folder);
    let table = many();
    let store = Store::open(folder.join("results.sqlite"), &table, None, &json!(null)).unwrap();
    let options = Options { retry: false, logs: folder.join("logs") };
    let job = |job: &Job, _: &mut JobLog| Ok(json!({ "double": 2.0 * job.get("a").and_then(Value::number).unwrap() }));
    run_sweep(&table, &store, &options, &AtomicBool::new(false), job, |_| ()).unwrap();
}

fn many() -> ParameterTable {
    toml("[parameters]\na = { from = 1, to = 3000, step = 1 }").unwrap()
}

#[test]
fn a_killed_process_loses_nothing_that_was_finished() {
    let place = Place::new();
    let mut done: HashSet<String> = HashSet::new();
    let mut round = 0;
    // On a busy machine the first may be killed before they finish anything.
    while round < 6 || done.is_empty() {
        round += 1;
        let mut child = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "sweep::swept_until_killed", "--test-threads=1"])
            .env("ANISOBOND_TEST_SWEEP", place.0.path())
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(120 + 37 * round));
        child.kill().unwrap();
        child.wait().unwrap();
        if !place.store().exists() {
            continue;
        }
        let store = Store::open(place.store(), &many(), None, &json!(null)).unwrap();
        let now: HashSet<String> = store
            .records()
            .unwrap()
            .into_iter()
            .filter(|r| r.state == State::Done)
            .map(|r| {
                assert_eq!(r.result.unwrap()["double"], json!(2.0 * r.parameters["a"].as_f64().unwrap()));
                r.id
            })
            .collect();
        assert!(done.is_subset(&now));
        done = now;
    }
    assert!(!done.is_empty());
}

#[test]
fn shards_are_read_from_text() {
    assert_eq!(Shard::parse(" 3 / 8").unwrap(), Shard { index: 3, count: 8 });
    for text in ["8/8", "0/0", "1", "a/b", "-1/3", "1/2/3", ""] {
        assert!(Shard::parse(text).unwrap_err().to_string().contains("write i/n"), "{text}");
    }
}

#[test]
fn the_slurm_script_is_one_the_shell_accepts() {
    let words = |text: &str| text.split('|').map(String::from).collect();
    let script = slurm_script(&SlurmScript {
        command: words("anisobond|sweep|my table.toml|-o|it's out"),
        merge: words("anisobond|sweep|my table.toml|-o|it's out|--merge|4"),
        shards: 4,
        name: "rock\n#SBATCH --evil".into(),
        cpus: 2,
        time: "1-00:00:00".into(),
    });
    for part in [
        "#SBATCH --array=0-3\n",
        "#SBATCH --cpus-per-task=2\n",
        "#SBATCH --time=1-00:00:00\n",
        "exec anisobond sweep 'my table.toml' -o 'it'\\''s out' --shard \"${SLURM_ARRAY_TASK_ID}/4\"\n",
        "--merge 4",
    ] {
        assert!(script.contains(part), "{part:?} is not in\n{script}");
    }
    assert_eq!(script.lines().filter(|line| line.starts_with("#SBATCH")).count(), 6);
    if let Ok(status) = std::process::Command::new("bash").args(["-n", "-c", &script]).status() {
        assert!(status.success());
    }
}

#[test]
fn decimal_commas_of_tables_that_semicolons_or_tabs_part() {
    let values = |text: &str| -> Vec<Value> {
        let table = ParameterTable::parse(text, "t.csv").unwrap();
        table.jobs()[0].parameters.iter().map(|(_, value)| value.clone()).collect()
    };
    let number = Value::Number;
    let text = |text: &str| Value::Text(text.into());
    let german = "sep=;\na;b;c;axis;d\n1,5;-0,25e-3;130,5 MPa;0,0,1;x 1,5";
    let read = [number(1.5), number(-0.25e-3), text("130.5 MPa"), text("0,0,1"), text("x 1,5")];
    assert_eq!(values(german), read);
    assert_eq!(values(&german.replace("sep=;\n", "").replace(';', "\t")), read);
    // Where commas part the fields, one within quotes is none of ours to read; nor is one beside a point.
    assert_eq!(values("a,b\n\"1,234\",2"), [text("1,234"), number(2.0)]);
    assert_eq!(values("a;b\n1.234,5;2"), [text("1.234,5"), number(2.0)]);
}
