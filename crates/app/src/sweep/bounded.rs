//! Spreadsheets whose reader would take memory or time without end are refused before it sees them: archives that unpack to
//! more than they may, counts that no file can hold, cells that are repeated or far apart, sectors of .xls that lead in circles,
//! and sheets of .xls that lie in one another.

use std::io::{Cursor, Read};

use roxmltree::{Document, Node, ParsingOptions};
use zip::ZipArchive;

use super::compound::Compound;

/// Largest spreadsheet that is read (cells of the boxes that hold all that are used).
pub(super) const MOST_CELLS: u64 = 20_000_000;

/// Most text in all cells (bytes).
pub(super) const MOST_TEXT: u64 = 1 << 30;

/// Most that an archive (.xlsx) may unpack to (bytes); of the contents of .ods, which is looked at as one tree; and the
/// largest .xls.
const MOST_UNPACKED: u64 = 512 << 20;
const MOST_CONTENT: u64 = 64 << 20;
const MOST_XLS: u64 = 16 << 20;

/// Columns of a sheet of .ods; its reader cuts off what is right of them.
const MOST_COLUMNS: u64 = 16_384;

pub(super) type Checked<T = ()> = std::result::Result<T, String>;

/// The formats of spreadsheets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Xls,
    Xlsx,
    Ods,
}

impl Format {
    /// By the ending of a file's name, in small letters.
    pub fn of_ending(ending: &str) -> Option<Self> {
        match ending {
            "xls" => Some(Format::Xls),
            "xlsx" | "xlsm" => Some(Format::Xlsx),
            "ods" => Some(Format::Ods),
            _ => None,
        }
    }
}

/// Refuses a spreadsheet that cannot be read in bounded memory and time.
pub(super) fn refuse_endless(bytes: &[u8], format: Format) -> Checked {
    match format {
        Format::Xls if bytes.len() as u64 > MOST_XLS => Err(format!("it is larger than {} MB", MOST_XLS >> 20)),
        Format::Xls => Compound::new(bytes)?.streams(&["Workbook", "Book"]).try_for_each(|stream| sheets(&stream?)),
        Format::Xlsx => unpacked(bytes).map(|_| ()),
        Format::Ods => contents(unpacked(bytes)?),
    }
}

/// A zip archive with bounded contents.
fn unpacked(bytes: &[u8]) -> Checked<ZipArchive<Cursor<&[u8]>>> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| e.to_string())?;
    let mut left = MOST_UNPACKED;
    for at in 0..archive.len() {
        let mut entry = archive.by_index(at).map_err(|e| e.to_string())?;
        left -= scanned(&mut entry, left)?;
    }
    Ok(archive)
}

/// The tables of .ods.
fn contents(mut archive: ZipArchive<Cursor<&[u8]>>) -> Checked {
    let mut text = String::new();
    let content = archive.by_name("content.xml").map_err(|e| e.to_string())?;
    content.take(MOST_CONTENT + 1).read_to_string(&mut text).map_err(|e| e.to_string())?;
    if text.len() as u64 > MOST_CONTENT {
        return Err(format!("its contents unpack to more than {} MB", MOST_CONTENT >> 20));
    }
    repeated(&text)
}

/// Reads an entry through, at most so many bytes; refuses a table of strings that claims more than a file can hold, for its
/// reader makes room for them.
fn scanned(entry: &mut impl Read, most: u64) -> Checked<u64> {
    const KEY: &[u8] = b"uniqueCount";
    let (mut total, mut piece, mut kept) = (0, vec![0; 1 << 16], Vec::new());
    loop {
        let n = entry.read(&mut piece).map_err(|e| e.to_string())?;
        total += n as u64;
        if total > most {
            return Err(format!("it unpacks to more than {} MB", MOST_UNPACKED >> 20));
        }
        // Without zeros UTF-16 is as plain as UTF-8.
        kept.extend(piece[..n].iter().copied().filter(|b| *b != 0));
        let end = if n == 0 { kept.len() } else { kept.len().saturating_sub(64) };
        for at in (0..end).filter(|&at| kept[at] == KEY[0] && kept[at..].starts_with(KEY)) {
            let rest = kept[at + KEY.len()..].iter().skip_while(|b| b" \t\r\n='\"".contains(b));
            let digits = rest.skip_while(|b| **b == b'0').take_while(|b| b.is_ascii_digit()).count();
            if digits > 7 {
                return Err("it claims more texts than a file can hold".into());
            }
        }
        if n == 0 {
            return Ok(total);
        }
        kept.drain(..end);
    }
}

/// What an OpenDocument's tables make of their cells, each as often as it is repeated.
fn repeated(text: &str) -> Checked {
    let options = ParsingOptions { nodes_limit: 20_000_000, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|e| e.to_string())?;
    let (mut boxes, mut held, mut letters) = (0_u64, 0_u64, 0_u64);
    for table in document.descendants().filter(|n| named(n, "table")) {
        let (mut rows, mut used, mut width) = (0_u64, 0_u64, 0_u64);
        for row in within(&table, "table")?.filter(|n| named(n, "table-row")) {
            let row_of = row_of(&row)?;
            let repeat = times(&row, "number-rows-repeated");
            rows = rows.saturating_add(repeat);
            held = held.saturating_add(row_of.held);
            letters = letters.saturating_add(row_of.letters.saturating_mul(repeat));
            if row_of.used > 0 {
                (used, width) = (rows, width.max(row_of.used));
            }
        }
        boxes = boxes.saturating_add(used.saturating_mul(width));
        refuse_cells(used, width, letters)?;
    }
    refuse_cells(boxes.max(held), 1, letters)
}

/// A row of an OpenDocument table.
struct OdsRow {
    /// Columns up to the last cell that says something.
    used: u64,
    /// Cells that its reader makes, among them all before the last one.
    held: u64,
    /// Bytes of text, with that of repeated cells.
    letters: u64,
}

fn row_of(row: &Node) -> Checked<OdsRow> {
    let (mut column, mut before, mut used, mut letters) = (0_u64, 0_u64, 0_u64, 0_u64);
    for cell in row.children().filter(|n| named(n, "table-cell") || named(n, "covered-table-cell")) {
        let again = times(&cell, "number-columns-repeated");
        before = column;
        column = column.saturating_add(again).min(MOST_COLUMNS);
        let written: usize = within(&cell, "table-row")?.filter_map(|n| n.text()).map(str::len).sum();
        let said = written + cell.attributes().map(|a| a.value().len()).sum::<usize>();
        if cell.has_children() || cell.attributes().any(|a| a.name().contains("value") || a.name() == "formula") {
            used = column;
            letters = letters.saturating_add((said as u64).saturating_mul(again.min(MOST_COLUMNS)));
        }
    }
    Ok(OdsRow { used, held: before.max(used), letters })
}

fn named(node: &Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

/// What is inside a node; an error if something of that name is, for it would be looked at again and again.
fn within<'a>(node: &Node<'a, 'a>, name: &str) -> Checked<impl Iterator<Item = Node<'a, 'a>>> {
    let inside = || node.descendants().skip(1);
    match inside().any(|n| named(&n, name)) {
        true => Err(format!("a {name} is within another")),
        false => Ok(inside()),
    }
}

/// How often something is repeated; its reader takes one of the attributes that are named so.
fn times(node: &Node, name: &str) -> u64 {
    let given = node.attributes().filter(|a| a.name() == name).filter_map(|a| a.value().parse::<u64>().ok());
    given.max().unwrap_or(1).max(1)
}

/// Refuses more cells, or more text, than are read.
pub(super) fn refuse_cells(rows: u64, columns: u64, letters: u64) -> Checked {
    if rows.saturating_mul(columns) > MOST_CELLS {
        return Err(format!("a sheet is {rows} × {columns} cells"));
    }
    if letters > MOST_TEXT {
        return Err(format!("its cells hold more than {} GB of text", MOST_TEXT >> 30));
    }
    Ok(())
}

/// The sheets of a stream of records (.xls), each of which may begin anywhere in it.
fn sheets(stream: &[u8]) -> Checked {
    let starts = records(stream).take_while(|r| r.kind != END_OF_SHEET).filter(|r| r.kind == BOUND_SHEET);
    let mut found = Sheet::default();
    for start in starts.map(|r| r.long(0) as usize) {
        let sheet = sheet(stream.get(start..).unwrap_or_default());
        found.bytes += sheet.bytes;
        found.cells += sheet.cells;
        found.texts += sheet.texts;
        // Sheets stand one behind the other.
        if found.bytes > 4 * stream.len() as u64 {
            return Err("its sheets lie in one another".into());
        }
        // A text of a cell is at most 64 Ki characters of three bytes.
        if found.texts > MOST_TEXT / 49_152 {
            return Err("it has too many cells of text for this old format".into());
        }
        refuse_cells(found.cells, 1, 0)?;
    }
    Ok(())
}

/// What a sheet of .xls makes its reader do.
#[derive(Default)]
struct Sheet {
    /// Bytes of its records.
    bytes: u64,
    /// Cells of the box that holds all, or of the box that it claims.
    cells: u64,
    /// Cells with a text from the table of texts.
    texts: u64,
}

const BOUND_SHEET: u16 = 0x85;
const BEGIN_OF_SHEET: u16 = 0x809;
const END_OF_SHEET: u16 = 0x0A;

fn sheet(stream: &[u8]) -> Sheet {
    let (mut sheet, mut rows, mut columns, mut claimed, mut open) = (Sheet::default(), 0, 0, 0, 0);
    for record in records(stream) {
        sheet.bytes += 4 + record.length as u64;
        match record.kind {
            BEGIN_OF_SHEET => open += 1,
            END_OF_SHEET if open <= 1 => break,
            END_OF_SHEET => open -= 1,
            0x200 => claimed = claimed.max(record.claimed()),
            // Cells: formulas, numbers, texts, truths; of several at once the last column stands at the end.
            0x06 | 0x7E | 0xBD | 0xFD | 0xD6 | 0x203..=0x205 | 0x27E if record.length >= 6 => {
                let last = if record.kind == 0xBD { record.short(record.length - 2) } else { 0 };
                sheet.texts += u64::from(record.kind == 0xFD);
                rows = rows.max(record.short(0) + 1);
                columns = columns.max(record.short(2).max(last) + 1);
            }
            _ => {}
        }
    }
    sheet.cells = claimed.max(rows * columns);
    sheet
}

/// A record of a stream: kind, length, content.
struct Record<'s> {
    kind: u16,
    length: usize,
    content: &'s [u8],
}

impl Record<'_> {
    fn short(&self, at: usize) -> u64 {
        self.content.get(at..at + 2).map_or(0, |b| u64::from(u16::from_le_bytes([b[0], b[1]])))
    }

    fn long(&self, at: usize) -> u64 {
        self.short(at) | self.short(at + 2) << 16
    }

    /// Cells of the box that the record of a sheet's dimensions names, for which its reader makes room.
    fn claimed(&self) -> u64 {
        let (first, last, left, right) = match self.length {
            10 => (self.short(0), self.short(2), self.short(4), self.short(6)),
            _ => (self.long(0), self.long(4), self.short(8), self.short(10)),
        };
        let left = if left > 0xFF || right < left { 0 } else { left };
        // A last row above the first is counted around.
        let rows = (last as u32).wrapping_sub(first as u32);
        if last == 0 || right == 0 { 0 } else { u64::from(rows) * (right - left) }
    }
}

fn records(stream: &[u8]) -> impl Iterator<Item = Record<'_>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let head = stream.get(at..at + 4)?;
        let length = usize::from(u16::from_le_bytes([head[2], head[3]]));
        let content = stream.get(at + 4..at + 4 + length)?;
        at += 4 + length;
        Some(Record { kind: u16::from_le_bytes([head[0], head[1]]), length, content })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An OpenDocument of tables of such rows.
    fn tables(tables: &[&str]) -> Checked {
        let tables: String = tables.iter().map(|rows| format!("<t:table>{rows}</t:table>")).collect();
        repeated(&format!("<d xmlns:t='urn:t' xmlns:o='urn:o'>{tables}</d>"))
    }

    fn row(rows: u64, columns: u64, text: &str) -> String {
        format!(
            "<t:table-row t:number-rows-repeated='{rows}'><t:table-cell t:number-columns-repeated='{columns}' \
             o:value-type='string'><p>{text}</p></t:table-cell></t:table-row>"
        )
    }

    #[test]
    fn repeated_cells_are_counted() {
        assert!(tables(&[&row(1000, 100, "x")]).is_ok());
        assert!(tables(&[&row(1 << 20, 1 << 10, "x")]).unwrap_err().contains("1048576 × 1024 cells"));
        assert!(tables(&[&row(1 << 20, 16, &"x".repeat(100))]).unwrap_err().contains("of text"));
        let formula =
            row(1 << 20, 1 << 10, "").replace("o:value-type='string'><p></p></t:table-cell>", "t:formula='f'/>");
        assert!(tables(&[&formula]).is_err());
        // Of two attributes that may be meant, the larger counts.
        let twice = row(1, 1 << 10, "x").replace("<t:table-row", "<t:table-row o:number-rows-repeated='1000000'");
        assert!(tables(&[&twice]).is_err());
        // Empty rows at the end are none.
        let empty = "<t:table-row t:number-rows-repeated='1048575'><t:table-cell t:number-columns-repeated='16384'/></t:table-row>";
        assert!(tables(&[&(row(1, 2, "x") + empty)]).is_ok());
    }

    #[test]
    fn cells_of_all_tables_are_counted() {
        let large = row(1 << 14, 1 << 10, "x");
        assert!(tables(&[&large]).is_ok());
        assert!(tables(&[&large, &large]).is_err());
    }

    /// Its reader makes cells of all that are before another, empty or not.
    #[test]
    fn empty_cells_before_others_are_counted() {
        let row = "<t:table-row><t:table-cell t:number-columns-repeated='16384'/><t:table-cell/></t:table-row>";
        assert!(tables(&[&row.repeat(1200)]).is_ok());
        assert!(tables(&[&row.repeat(1300)]).is_err());
    }

    /// What is within another would be looked at once for each that it is in.
    #[test]
    fn tables_and_rows_within_others_are_refused() {
        let deep = |tag: &str| {
            let text = format!("{}{}", format!("<t:{tag}>").repeat(100_000), format!("</t:{tag}>").repeat(100_000));
            if tag == "table" {
                tables(&[&text])
            } else {
                tables(&[&format!("<t:table-row><t:table-cell>{text}</t:table-cell></t:table-row>")])
            }
        };
        assert!(deep("table").unwrap_err().contains("a table is within another"));
        assert!(deep("table-row").unwrap_err().contains("a table-row is within another"));
    }

    /// A record of .xls.
    fn record(kind: u16, content: &[u8]) -> Vec<u8> {
        [&kind.to_le_bytes()[..], &(content.len() as u16).to_le_bytes(), content].concat()
    }

    /// A stream of .xls with sheets that begin so many bytes behind their records, and what stands there.
    fn stream(starts: &[u32], rest: &[u8]) -> Vec<u8> {
        let first = 12 * starts.len() as u32 + 4;
        let sheets =
            starts.iter().flat_map(|at| record(BOUND_SHEET, &[&(first + at).to_le_bytes()[..], &[0; 4]].concat()));
        sheets.chain(record(END_OF_SHEET, &[])).chain(rest.iter().copied()).collect()
    }

    const LAST_CELL: [u8; 14] = [0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];

    #[test]
    fn cells_of_old_sheets_are_counted() {
        let number = record(0x203, &LAST_CELL);
        assert!(sheets(&stream(&[0], &number)).unwrap_err().contains("cells"));
        // In the content of another record, where a sheet begins; else not.
        let inside = record(0xFFFF, &number);
        assert!(sheets(&stream(&[4], &inside)).is_err());
        assert!(sheets(&stream(&[0], &inside)).is_ok());
        // A box that is claimed and has nothing in it; a last row above the first is 2³² − 1 rows.
        let claimed = |first: u32, last: u32| {
            let content = [&first.to_le_bytes()[..], &last.to_le_bytes(), &[0, 0, 0xFF, 0, 0, 0]].concat();
            sheets(&stream(&[0], &record(0x200, &content)))
        };
        assert!(
            claimed(0, 1000).is_ok() && claimed(0, 1 << 24).is_err() && claimed(1, 0).is_ok() && claimed(2, 1).is_err()
        );
    }

    #[test]
    fn old_sheets_that_lie_in_one_another_are_refused() {
        let content = record(0xFFFF, &[0; 4000]);
        assert!(sheets(&stream(&[0], &content)).is_ok());
        assert!(sheets(&stream(&[0; 9], &content)).unwrap_err().contains("lie in one another"));
    }

    #[test]
    fn short_streams_of_old_files_are_looked_at() {
        let content = stream(&[0], &record(0x203, &LAST_CELL));
        let file = small_file(&content);
        let found: Vec<Checked<Vec<u8>>> = Compound::new(&file).unwrap().streams(&["workbook"]).collect();
        assert_eq!(found, [Ok(content)]);
        assert!(refuse_endless(&file, Format::Xls).unwrap_err().contains("cells"));
    }

    /// A compound file whose one stream is in small sectors: table of sectors, directory, small sectors, their table.
    fn small_file(content: &[u8]) -> Vec<u8> {
        let (mut bytes, end) = (vec![0xFF_u8; 512 * 5], 0xFFFF_FFFE);
        bytes[30..32].copy_from_slice(&[9, 0]);
        let root = 512 * 2;
        let small = content.len() as u32;
        let words = [
            (48, 1),
            (60, 3),
            (64, 1),
            (68, end),
            (76, 0),
            (root + 116, 2),
            (root + 120, 512),
            (root + 244, 0),
            (root + 248, small),
        ];
        let follows = (0..4).map(|n| (512 + 4 * n, end));
        let small_follows =
            (0..8_u32).map(|n| (512 * 4 + 4 * n as usize, if 64 * (n + 1) >= small { end } else { n + 1 }));
        for (at, word) in words.into_iter().chain(follows).chain(small_follows) {
            bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        }
        let name: Vec<u8> = "Workbook\0".encode_utf16().flat_map(u16::to_le_bytes).collect();
        bytes[root + 128..root + 128 + name.len()].copy_from_slice(&name);
        bytes[512 * 3..512 * 3 + content.len()].copy_from_slice(content);
        bytes
    }

    #[test]
    fn counts_that_no_file_holds_are_refused() {
        let scan = |text: &str, most| scanned(&mut text.as_bytes(), most);
        assert_eq!(scan("<sst uniqueCount=\"3\">", 100), Ok(21));
        assert!(scan("<sst uniqueCount = '4000000000'>", 100).unwrap_err().contains("claims"));
        let far = " ".repeat((1 << 16) - 5) + "uniqueCount=\"4000000000\"";
        assert!(scan(&far, 1 << 20).unwrap_err().contains("claims"));
        assert!(scan(&far, 1000).unwrap_err().contains("unpacks to more"));
        let wide: String = "uniqueCount=\"4000000000\"".chars().flat_map(|c| [c, '\0']).collect();
        assert!(scan(&wide, 1000).is_err());
    }
}
