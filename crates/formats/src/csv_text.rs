//! Texts in CSV files. A spreadsheet runs a cell that begins with = + - @, a tab or a carriage return as a formula, whoever
//! wrote it: such a text gets an apostrophe in front, which spreadsheets show as none, and which our readers take away again.
//! Numbers stay as they are.

use std::borrow::Cow;

/// Whether a text begins as a formula does, or with the mark itself.
fn is_marked(text: &str) -> bool {
    text.starts_with(['=', '+', '-', '@', '\t', '\r', '\''])
}

/// A text as the cell of a CSV file; what reads as a number is none that is run.
pub(super) fn guarded(text: &str) -> Cow<'_, str> {
    if is_marked(text) && text.parse::<f64>().is_err() { Cow::Owned(format!("'{text}")) } else { Cow::Borrowed(text) }
}

/// The text of a cell of a CSV file that this program wrote.
pub fn unguarded(cell: &str) -> &str {
    cell.strip_prefix('\'').filter(|rest| is_marked(rest)).unwrap_or(cell)
}

/// A line of CSV, without its end.
pub(super) fn line<T: AsRef<str>>(cells: &[T]) -> String {
    let quoted = |cell: &T| {
        let cell = guarded(cell.as_ref());
        let plain = !cell.contains(['"', ',', '\n', '\r']) && !cell.starts_with('#');
        if plain { cell.into_owned() } else { format!("\"{}\"", cell.replace('"', "\"\"")) }
    };
    cells.iter().map(quoted).collect::<Vec<_>>().join(",")
}

/// A user's text in a comment of a CSV file: spreadsheets know no comments, and would begin a cell or a row within it.
pub(super) fn in_comment(text: &str) -> String {
    text.replace(|c: char| c.is_control() || matches!(c, ',' | ';' | '"'), " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_is_a_formula_and_every_text_comes_back() {
        for text in
            ["=1+1", "+x", "-x", "@SUM(A1)", "\tx", "\r=x", "'=x", "'quoted'", "''", "'", "-", "KIO3", "a=b", ""]
        {
            let cell = guarded(text);
            assert!(!cell.starts_with(['=', '+', '-', '@', '\t', '\r']), "{text:?}");
            assert_eq!(unguarded(&cell), text);
            let row = line(&[text, "next"]);
            let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(row.as_bytes());
            let record = reader.records().next().unwrap().unwrap();
            assert_eq!([unguarded(&record[0]), &record[1]], [text, "next"]);
        }
        for number in ["-1.5", "+2", "-1e-300", "7"] {
            assert_eq!(guarded(number), number);
        }
        assert_eq!(in_comment("a,=cmd()\n=x"), "a =cmd() =x");
    }
}
