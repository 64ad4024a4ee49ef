//! Tables with a row per job: CSV text and spreadsheets, as Woo's batch tables.

use std::io::{Cursor, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};

use calamine::{Data, DataRef, Ods, Range, Reader, Sheets, Xls, Xlsx, XlsxError};

use super::bounded::{Format, refuse_cells, refuse_endless};
use super::job::{Job, Value};
use super::table::{MOST_JOBS, Name};
use anisobond::{Error, Result};
use anisobond_formats::table::{csv_reader, first_line, has_decimal_commas, without_separator};
use anisobond_formats::tree::Lines;
use anisobond_formats::units::split;
use anisobond_formats::words::quoted;

/// Most sheets that are read until one is not empty: all may be one large part of an archive.
const MOST_EMPTY: usize = 100;

/// A row that is not empty; the cells without comments and spaces, `None` where empty.
pub(super) struct Row {
    number: usize,
    /// Column of the first cell of a spreadsheet, from 0; `None` for text.
    first_column: Option<usize>,
    cells: Vec<Option<Value>>,
}

impl Row {
    /// "B7" in a spreadsheet, "line 7, field 2" in a text.
    fn place(&self, column: usize) -> String {
        match self.first_column {
            Some(first) => format!("{}{}", letters(first + column), self.number),
            None => format!("line {}, field {}", self.number, column + 1),
        }
    }

    /// "row 7" in a spreadsheet, "line 7" in a text.
    fn name(&self) -> String {
        format!("{} {}", if self.first_column.is_some() { "row" } else { "line" }, self.number)
    }

    /// Without comments and trailing empty cells; `None` if nothing is left.
    fn tidy(mut self) -> Option<Self> {
        let comment = |cell: &Option<Value>| matches!(cell, Some(Value::Text(text)) if text.starts_with('#'));
        if let Some(at) = self.cells.iter().position(comment) {
            self.cells.truncate(at);
        }
        let filled = self.cells.iter().rposition(Option::is_some)?;
        if self.first_column.is_some() {
            self.cells.truncate(filled + 1);
        }
        Some(self)
    }
}

/// "A", "B", …, "Z", "AA", …
fn letters(column: usize) -> String {
    let last = char::from(b'A' + (column % 26) as u8);
    if column < 26 { last.to_string() } else { format!("{}{last}", letters(column / 26 - 1)) }
}

/// The rows of a CSV text.
pub(super) fn text_cells(text: &str) -> Result<Vec<Row>> {
    let text = &*without_separator(text);
    let mut reader = csv_reader(text);
    let lines = Lines::new(text);
    let commas = has_decimal_commas(text);
    let mut rows = Vec::new();
    for record in reader.records() {
        let record =
            record.map_err(|e| Error::input(format!("the table cannot be read: {e}"), "save it as CSV in UTF-8"))?;
        let number = record.position().map_or(0, |p| first_line(text, &lines, p.byte() as usize));
        let value = |field: &str| match decimal(field).filter(|_| commas) {
            Some(pointed) => Value::of_text(&pointed),
            None => Value::of_text(field),
        };
        let cells = record.iter().map(|field| (!field.is_empty()).then(|| value(field))).collect();
        rows.extend(Row { number, first_column: None, cells }.tidy());
    }
    Ok(rows)
}

/// A number, or a quantity, whose decimal mark is a comma, with a point: "1,5" and "1,5 MPa", but not "0,0,1" or "a 1,5".
fn decimal(field: &str) -> Option<String> {
    let (whole, rest) = field.split_once(',')?;
    let whole = whole.trim_start_matches(['-', '+']);
    let digits = !whole.is_empty() && whole.bytes().all(|b| b.is_ascii_digit());
    let fits = digits && rest.starts_with(|c: char| c.is_ascii_digit()) && !rest.contains(',');
    let pointed = field.replacen(',', ".", 1);
    let (_, unit) = split(&pointed).ok().filter(|_| fits)?;
    unit.chars().next().is_none_or(|c| c.is_alphabetic() || "°%1".contains(c)).then_some(pointed)
}

/// The name and the rows of the first sheet that is not empty.
pub(super) fn workbook_cells(bytes: &[u8], format: Format, file: &str) -> Result<(String, Vec<Row>)> {
    // A damaged workbook is an error of the file, whatever its reader makes of it.
    let read = catch_unwind(AssertUnwindSafe(|| first_sheet(bytes, format)));
    read.unwrap_or_else(|_| Err("it is damaged".into()))
        .map_err(|reason| {
            Error::input(format!("the spreadsheet cannot be read: {reason}"), "save it again as .xlsx, or as .csv")
                .at(file)
        })
        .and_then(|(sheet, range)| {
            let rows = rows_of(&range).map_err(|e| e.at(format!("{file}, sheet {}", quoted(&sheet))))?;
            Ok((quoted(&sheet), rows))
        })
}

fn opened(bytes: &[u8], format: Format) -> std::result::Result<Sheets<Cursor<&[u8]>>, calamine::Error> {
    let bytes = Cursor::new(bytes);
    Ok(match format {
        Format::Xls => Sheets::Xls(Xls::new(bytes)?),
        Format::Xlsx => Sheets::Xlsx(Xlsx::new(bytes)?),
        Format::Ods => Sheets::Ods(Ods::new(bytes)?),
    })
}

fn first_sheet(bytes: &[u8], format: Format) -> std::result::Result<(String, Range<Data>), String> {
    refuse_endless(bytes, format)?;
    let mut workbook = opened(bytes, format).map_err(|e| e.to_string())?;
    let names = workbook.sheet_names();
    let mut first = None;
    for name in names.into_iter().take(MOST_EMPTY) {
        if let Sheets::Xlsx(workbook) = &mut workbook {
            refuse_large(workbook, &name)?;
        }
        let range = workbook.worksheet_range(&name).map_err(|e| e.to_string())?;
        if !range.is_empty() {
            return Ok((name, range));
        }
        first.get_or_insert((name, range));
    }
    first.ok_or_else(|| "it has no sheet".into())
}

/// Refuses a sheet whose used cells are far apart, for its reader makes room for all between them, and one that holds a long
/// text many times.
fn refuse_large<R: Read + Seek>(workbook: &mut Xlsx<R>, name: &str) -> std::result::Result<(), String> {
    let mut cells = match workbook.worksheet_cells_reader(name) {
        // A sheet of a chart has no cells.
        Err(XlsxError::NotAWorksheet(_)) => return Ok(()),
        cells => cells.map_err(|e| e.to_string())?,
    };
    let (mut rows, mut columns, mut letters) = (0_u64, 0_u64, 0_u64);
    while let Some(cell) = cells.next_cell().map_err(|e| e.to_string())? {
        if *cell.get_value() != DataRef::Empty {
            let (row, column) = cell.get_position();
            rows = rows.max(u64::from(row) + 1);
            columns = columns.max(u64::from(column) + 1);
        }
        letters += match cell.get_value() {
            DataRef::String(text) => text.len() as u64,
            DataRef::SharedString(text) => text.len() as u64,
            _ => 0,
        };
    }
    refuse_cells(rows, columns, letters).map_err(|e| format!("{e} (sheet {})", quoted(name)))
}

fn rows_of(range: &Range<Data>) -> Result<Vec<Row>> {
    let (top, left) = range.start().map_or((0, 0), |(row, column)| (row as usize, column as usize));
    let mut rows = Vec::new();
    let filled = |(_, row): &(usize, &[Data])| row.iter().any(|cell| *cell != Data::Empty);
    for (index, data) in range.rows().enumerate().filter(filled) {
        let mut row = Row { number: top + index + 1, first_column: Some(left), cells: Vec::new() };
        for cell in data {
            let value = value_of(cell).map_err(|problem| {
                let place = row.place(row.cells.len());
                Error::input(problem, "write a number, a text or =").at(place)
            })?;
            let comment = matches!(&value, Some(Value::Text(text)) if text.starts_with('#'));
            row.cells.push(value);
            if comment {
                break;
            }
        }
        rows.extend(row.tidy());
    }
    Ok(rows)
}

fn value_of(cell: &Data) -> std::result::Result<Option<Value>, String> {
    match cell {
        Data::Empty => Ok(None),
        Data::Int(n) => Ok(Some(Value::Number(*n as f64))),
        Data::Float(x) if x.is_finite() => Ok(Some(Value::Number(*x))),
        Data::String(text) if text.trim().is_empty() => Ok(None),
        Data::String(text) => Ok(Some(Value::of_text(text))),
        Data::Bool(yes) => Ok(Some(Value::Text(yes.to_string()))),
        Data::Error(error) => Err(format!("the cell holds the error {error}")),
        Data::DateTime(_) | Data::DateTimeIso(_) | Data::DurationIso(_) => Err("the cell holds a date".into()),
        other => Err(format!("the cell holds {other}")),
    }
}

/// What a column is for.
struct Column {
    name: String,
    /// A parameter of the jobs, not only a label.
    parameter: bool,
    /// Part of the title.
    label: bool,
    /// The title itself.
    title: bool,
}

/// The jobs below a header, and the names of their parameters.
pub(super) fn jobs_of_cells(rows: &[Row]) -> Result<(Vec<Job>, Vec<Name>)> {
    let Some((header, rows)) = rows.split_first() else {
        return Err(Error::input("the table is empty", "name the parameters in the first row, one job per row below"));
    };
    let columns = columns(header)?;
    if rows.len() > MOST_JOBS {
        return Err(Error::input(format!("there are {} jobs", rows.len()), format!("give at most {MOST_JOBS}")));
    }
    let mut table: Vec<Vec<Value>> = Vec::with_capacity(rows.len());
    for row in rows {
        let filled = filled(row, &columns, table.last())?;
        table.push(filled);
    }
    let jobs = table.iter().zip(rows).map(|(values, row)| job(&columns, values, &table, row)).collect();
    let name = |(at, column): (usize, &Column)| Name { name: column.name.clone(), place: header.place(at) };
    Ok((jobs, columns.iter().enumerate().filter(|(_, column)| column.parameter).map(name).collect()))
}

fn columns(header: &Row) -> Result<Vec<Column>> {
    let mut columns: Vec<Column> = Vec::new();
    for (at, cell) in header.cells.iter().enumerate() {
        let wrong = |problem: String, remedy: &str| Error::input(problem, remedy).at(header.place(at));
        let heading = match cell {
            Some(Value::Text(text)) => text.as_str(),
            Some(Value::Number(x)) => {
                let remedy = "the first row names the parameters: write a name";
                return Err(wrong(format!("the number {x} stands where a name is needed"), remedy));
            }
            None => return Err(wrong("the column has no name".into(), "name it, or empty the whole column")),
        };
        if matches!(heading, "..." | "…") {
            let remedy = "write the whole value in one column, with its unit";
            return Err(wrong("a column that continues the one before is not read".into(), remedy));
        }
        let label = heading.starts_with('!') || heading.ends_with('!');
        let name = heading.trim_matches('!').trim().to_string();
        if name.is_empty() || heading == "=" {
            return Err(wrong(format!("{} is no name", quoted(heading)), "name the parameter"));
        }
        if columns.iter().any(|column| column.name == name) {
            return Err(wrong(format!("column {} is there twice", quoted(&name)), "keep one of them"));
        }
        let title = name == "title";
        columns.push(Column { parameter: !title && !heading.starts_with('!'), label, title, name });
    }
    if !columns.iter().any(|column| column.parameter) {
        return Err(Error::input("no column is a parameter", "name one in the first row").at(header.name()));
    }
    Ok(columns)
}

/// The values of a row, with those it repeats from the row above.
fn filled(row: &Row, columns: &[Column], above: Option<&Vec<Value>>) -> Result<Vec<Value>> {
    let ragged = row.first_column.is_none() && row.cells.len() != columns.len();
    if ragged || row.cells.len() > columns.len() {
        return Err(Error::input(
            format!("the row has {} fields, the header {}", row.cells.len(), columns.len()),
            "give every column one field; put quotes around a text with a comma",
        )
        .at(row.name()));
    }
    let value = |at: usize| match (row.cells.get(at).and_then(Option::as_ref), above) {
        (Some(Value::Text(text)), Some(above)) if text == "=" => Ok(above[at].clone()),
        (None, Some(above)) => Ok(above[at].clone()),
        (Some(Value::Text(text)), None) if text == "=" => Err((at, "= has no value above to repeat")),
        (None, None) => Err((at, "the first job has no value here")),
        (Some(value), _) => Ok(value.clone()),
    };
    let missing = |(at, problem): (usize, &str)| {
        let problem = format!("{problem} (column {})", quoted(&columns[at].name));
        Error::input(problem, "write a value, or - to leave the parameter at its default").at(row.place(at))
    };
    (0..columns.len()).map(|at| value(at).map_err(missing)).collect()
}

/// Whether a cell leaves its parameter at the default.
fn is_default(value: &Value) -> bool {
    value.text() == Some("-")
}

fn job(columns: &[Column], values: &[Value], table: &[Vec<Value>], row: &Row) -> Job {
    let pairs = || columns.iter().zip(values);
    let parameters = pairs()
        .filter(|(column, value)| column.parameter && !is_default(value))
        .map(|(column, value)| (column.name.clone(), value.clone()))
        .collect();
    let own = pairs().find(|(column, value)| column.title && !is_default(value)).map(|(_, value)| value.to_string());
    let labelled = columns.iter().any(|column| column.label);
    let varies = |at: usize| table.iter().any(|other| other[at] != table[0][at]);
    let shown = |at: usize, column: &Column| if labelled { column.label } else { column.parameter && varies(at) };
    let built = || {
        let named = pairs().enumerate().filter(|(at, (column, value))| shown(*at, column) && !is_default(value));
        let parts: Vec<String> = named.map(|(_, (column, value))| format!("{}={value}", column.name)).collect();
        parts.join(", ")
    };
    let title = own.unwrap_or_else(built);
    Job::new(if title.is_empty() { row.name() } else { title }, parameters, row.name())
}
