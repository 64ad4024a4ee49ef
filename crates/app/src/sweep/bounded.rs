//! Spreadsheets whose reader would take memory or time without end are refused before it sees them: archives that unpack to
//! more than they may, counts that no file can hold, cells that are repeated, and sectors of .xls that lead in circles.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};
use zip::ZipArchive;

/// Largest spreadsheet that is read (cells of the box that holds all that are used).
pub(super) const MOST_CELLS: u64 = 50_000_000;

/// Most text in all cells (bytes).
pub(super) const MOST_TEXT: u64 = 1 << 30;

/// Most that an archive (.xlsx) may unpack to (bytes); of the contents of .ods, which is looked at as one tree; and the
/// largest .xls.
const MOST_UNPACKED: u64 = 512 << 20;
const MOST_CONTENT: u64 = 64 << 20;
const MOST_XLS: u64 = 16 << 20;

type Checked<T = ()> = std::result::Result<T, String>;

/// Refuses a spreadsheet that cannot be read in bounded memory; formats by the ending of the name, as its reader has it.
pub(super) fn refuse_endless(path: &Path) -> Checked {
    let text = |e: std::io::Error| e.to_string();
    let mut file = File::open(path).map_err(text)?;
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    if ending != "xls" {
        let ods = ending == "ods";
        return archive(file, ods);
    }
    let size = file.metadata().map_err(text)?.len();
    if size > MOST_XLS {
        return Err(format!("it is larger than {} MB", MOST_XLS >> 20));
    }
    let mut bytes = Vec::new();
    (&mut file).take(MOST_XLS).read_to_end(&mut bytes).map_err(text)?;
    compound(&bytes)
}

/// A zip archive with bounded contents.
fn archive(file: File, ods: bool) -> Checked {
    let mut archive = ZipArchive::new(file).map_err(|e| e.to_string())?;
    let mut left = MOST_UNPACKED;
    for at in 0..archive.len() {
        let mut entry = archive.by_index(at).map_err(|e| e.to_string())?;
        left -= scanned(&mut entry, left)?;
    }
    if ods {
        let mut text = String::new();
        let content = archive.by_name("content.xml").map_err(|e| e.to_string())?;
        content.take(MOST_CONTENT + 1).read_to_string(&mut text).map_err(|e| e.to_string())?;
        if text.len() as u64 > MOST_CONTENT {
            return Err(format!("its contents unpack to more than {} MB", MOST_CONTENT >> 20));
        }
        return repeated(&text);
    }
    Ok(())
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
            if digits > 8 {
                return Err("it claims more texts than a file can hold".into());
            }
        }
        if n == 0 {
            return Ok(total);
        }
        kept.drain(..end);
    }
}

/// Cells of an OpenDocument table, each as often as it is repeated.
fn repeated(text: &str) -> Checked {
    let options = ParsingOptions { nodes_limit: 20_000_000, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|e| e.to_string())?;
    let named = |node: &Node, name: &str| node.is_element() && node.tag_name().name() == name;
    let times = |node: &Node, name: &str| {
        let given = node.attributes().find(|a| a.name() == name).and_then(|a| a.value().parse::<u64>().ok());
        given.unwrap_or(1).max(1)
    };
    for table in document.descendants().filter(|n| named(n, "table")) {
        let (mut rows, mut used, mut width, mut letters) = (0_u64, 0_u64, 0_u64, 0_u64);
        for row in table.descendants().filter(|n| named(n, "table-row")) {
            let repeat = times(&row, "number-rows-repeated");
            rows = rows.saturating_add(repeat);
            let mut column = 0_u64;
            for cell in row.children().filter(|n| named(n, "table-cell") || named(n, "covered-table-cell")) {
                let again = times(&cell, "number-columns-repeated");
                column = column.saturating_add(again);
                let said: usize = cell.descendants().filter_map(|n| n.text()).map(str::len).sum();
                let said = said + cell.attributes().map(|a| a.value().len()).sum::<usize>();
                if cell.has_children() || cell.attributes().any(|a| a.name() == "value-type") {
                    (used, width) = (rows, width.max(column));
                    letters = letters.saturating_add((said as u64).saturating_mul(again).saturating_mul(repeat));
                }
            }
        }
        refuse_cells(used, width, letters)?;
    }
    Ok(())
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

/// "No sector follows" in a compound file; larger numbers are no sectors.
const LAST: u32 = 0xFFFF_FFFA;

/// A compound file (.xls) whose chains of sectors end and whose sheets are bounded.
fn compound(bytes: &[u8]) -> Checked {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let torn = || "it is no compound file, or is torn".to_string();
    let size = match bytes.get(30..32).map(|b| u16::from_le_bytes([b[0], b[1]])) {
        Some(9) => 512,
        Some(12) => 4096,
        _ => return Err(torn()),
    };
    let sector = |id: u32| (id as usize + 1).checked_mul(size).filter(|start| start + size <= bytes.len());
    let words = |id: u32| -> Checked<Vec<u32>> {
        let start = sector(id).ok_or_else(torn)?;
        Ok((0..size / 4).filter_map(|n| word(start + 4 * n)).collect())
    };
    // The sectors of the table of what follows each sector: 109 in the header, others in a chain of their own.
    let mut tables: Vec<u32> = (0..109).filter_map(|n| word(76 + 4 * n)).collect();
    let (mut next, mut steps) = (word(68).ok_or_else(torn)?, 0);
    while next < LAST {
        let mut more = words(next)?;
        next = more.pop().ok_or_else(torn)?;
        tables.extend(more);
        steps += 1;
        if steps * size > bytes.len() {
            return Err("its sectors lead in a circle".into());
        }
    }
    let mut follows = Vec::new();
    for id in tables.into_iter().filter(|id| *id < LAST) {
        follows.extend(words(id)?);
        if follows.len() * size > 2 * bytes.len() + size * size {
            return Err("its sectors lead in a circle".into());
        }
    }
    refuse_circles(&follows)?;
    let chain = |first: u32| {
        let follow = |id: &u32| follows.get(*id as usize).copied().filter(|next| *next < LAST);
        std::iter::successors(Some(first).filter(|id| *id < LAST), follow)
    };
    let content = |first: u32| -> Vec<u8> {
        let sectors = chain(first).filter_map(sector);
        sectors.flat_map(|start| bytes[start..start + size].iter().copied()).collect()
    };
    let small = content(word(60).ok_or_else(torn)?);
    let small: Vec<u32> = small.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    refuse_circles(&small)?;
    // Every stream that is long enough to be in sectors of its own.
    for entry in content(word(48).ok_or_else(torn)?).chunks_exact(128) {
        let at = |n: usize| u32::from_le_bytes([entry[n], entry[n + 1], entry[n + 2], entry[n + 3]]);
        if entry[66] == 2 {
            records(&content(at(116)))?;
        }
    }
    Ok(())
}

/// Refuses a table of what follows what in which something follows itself.
fn refuse_circles(follows: &[u32]) -> Checked {
    let mut seen = vec![0_u32; follows.len()];
    for first in 0..follows.len() {
        let mut at = first;
        while at < follows.len() && seen[at] == 0 {
            seen[at] = first as u32 + 1;
            at = follows[at] as usize;
        }
        if seen.get(at).is_some_and(|by| *by == first as u32 + 1) && follows[first] < LAST {
            return Err("its sectors lead in a circle".into());
        }
    }
    Ok(())
}

/// The records of a stream of sheets: kind, length, content. Every sheet may begin anywhere, so all are taken together.
fn records(stream: &[u8]) -> Checked {
    let (mut at, mut sheets, mut texts, mut rows, mut columns) = (0, 0_u64, 0_u64, 0_u64, 0_u64);
    while let Some(head) = stream.get(at..at + 4) {
        let (kind, length) =
            (u16::from_le_bytes([head[0], head[1]]), usize::from(u16::from_le_bytes([head[2], head[3]])));
        let short =
            |n: usize| stream.get(at + n..at + n + 2).map_or(0, |b| u64::from(u16::from_le_bytes([b[0], b[1]])));
        match kind {
            0x85 => sheets += 1,
            // Cells: formulas, numbers, texts, truths; of several at once the last column stands at the end.
            0x06 | 0x7E | 0xBD | 0xFD | 0xD6 | 0x203..=0x205 | 0x27E if length >= 6 => {
                texts += u64::from(kind == 0xFD);
                rows = rows.max(short(4) + 1);
                columns = columns.max(short(6).max(if kind == 0xBD { short(2 + length) } else { 0 }) + 1);
            }
            _ => {}
        }
        at += 4 + length;
    }
    // A text of a cell is at most 64 Ki characters of three bytes.
    if sheets.max(1).saturating_mul(texts) > MOST_TEXT / 49_152 {
        return Err("it has too many cells of text for this old format".into());
    }
    refuse_cells(rows.saturating_mul(sheets.max(1)), columns, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_are_seen_and_chains_are_not_circles() {
        let last = 0xFFFF_FFFE;
        assert!(refuse_circles(&[1, 2, last, 2, 3]).is_ok());
        for circle in [&[0][..], &[1, 0], &[1, 2, 1], &[last, 2, 3, 4, 2]] {
            assert!(refuse_circles(circle).is_err(), "{circle:?}");
        }
    }

    #[test]
    fn repeated_cells_are_counted() {
        let sheet = |rows: &str| {
            let xmlns = "xmlns:t='urn:t' xmlns:o='urn:o'";
            repeated(&format!("<d {xmlns}><t:table>{rows}</t:table></d>"))
        };
        let row = |rows: u64, columns: u64, text: &str| {
            format!(
                "<t:table-row t:number-rows-repeated='{rows}'><t:table-cell t:number-columns-repeated='{columns}' \
                 o:value-type='string'><p>{text}</p></t:table-cell></t:table-row>"
            )
        };
        assert!(sheet(&row(1000, 100, "x")).is_ok());
        assert!(sheet(&row(1 << 20, 1 << 10, "x")).unwrap_err().contains("1048576 × 1024 cells"));
        assert!(sheet(&row(1 << 20, 40, &"x".repeat(100))).unwrap_err().contains("of text"));
        // Empty rows at the end are none.
        let empty = "<t:table-row t:number-rows-repeated='1048575'><t:table-cell t:number-columns-repeated='16384'/></t:table-row>";
        assert!(sheet(&(row(1, 2, "x") + empty)).is_ok());
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
