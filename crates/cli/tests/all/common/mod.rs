//! The program as a user runs it.
#![allow(dead_code)] // each test file uses its own part

pub mod torn;

use std::process::{Command, Output};

use serde_json::Value;

pub fn anisobond(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_anisobond")).args(args).output().unwrap()
}

/// stdout of a run that must succeed.
pub fn stdout(args: &[&str]) -> String {
    let output = anisobond(args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

pub fn json(args: &[&str]) -> Value {
    serde_json::from_str(&stdout(args)).unwrap()
}

/// stdout of a run that must end with a code.
pub fn ended(args: &[&str], code: i32) -> String {
    let output = anisobond(args);
    assert_eq!(output.status.code(), Some(code), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// stderr of a run that must end with a code, printing nothing on stdout.
pub fn refused(args: &[&str], code: i32) -> String {
    let output = anisobond(args);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{args:?}: {message}");
    assert!(output.stdout.is_empty(), "{args:?} prints on stdout");
    assert!(!message.contains("panicked"), "{message}");
    message
}

pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

pub fn write(folder: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_string()
}

/// A table of twelve cubic crystals, one with a broken number, one that is not positive definite.
pub fn table_rows(dir: &tempfile::TempDir) -> String {
    let names: Vec<String> = (1..=6).flat_map(|a| (a..=6).map(move |b| format!("c{a}{b}"))).collect();
    let mut text = format!("material_id,formula,{}\n", names.join(","));
    for i in 0..12 {
        let (c11, c12, c44) = (200.0 + f64::from(i), if i == 7 { 300.0 } else { 80.0 }, 90.0 - f64::from(i));
        let value = |a: usize, b: usize| match (a, b) {
            (1..=3, _) if a == b => c11,
            (1..=3, 1..=3) => c12,
            _ if a == b => c44,
            _ => 0.0,
        };
        let mut row: Vec<String> =
            (1..=6).flat_map(|a| (a..=6).map(move |b| (a, b))).map(|(a, b)| value(a, b).to_string()).collect();
        if i == 3 {
            row[0] = "abc".into();
        }
        text += &format!("x-{i},A{i}B,{}\n", row.join(","));
    }
    write(dir, "table.csv", &text)
}
