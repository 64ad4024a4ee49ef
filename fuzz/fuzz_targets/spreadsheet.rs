//! A spreadsheet of any content is refused with a message that names the file, or each of its jobs is its own. The first byte
//! says what the others are: a whole file, or what stands in one, which is packed here so that checksums do not stop the search.
#![no_main]

use std::collections::HashSet;
use std::io::{Cursor, Write};

use anisobond_app::sweep::ParameterTable;
use zip::write::{SimpleFileOptions, ZipWriter};

libfuzzer_sys::fuzz_target!(init: let_readers_panic(), |input: &[u8]| {
    let Some((kind, rest)) = input.split_first() else { return };
    let (bytes, file) = match kind % 6 {
        0 => (rest.to_vec(), "sweep.xls"),
        1 => (rest.to_vec(), "sweep.xlsx"),
        2 => (rest.to_vec(), "sweep.ods"),
        3 => (compound(rest), "sweep.xls"),
        4 => (xlsx(rest), "sweep.xlsx"),
        _ => (ods(rest), "sweep.ods"),
    };
    match ParameterTable::parse_workbook(&bytes, file) {
        Ok(table) => {
            let ids: HashSet<&str> = table.jobs().iter().map(|job| job.id.as_str()).collect();
            assert!(!ids.is_empty() && ids.len() == table.jobs().len());
        }
        Err(e) => assert!(e.to_string().starts_with("sweep")),
    }
});

/// The spreadsheet's readers panic at damage, which is an error of the file; what else panics is caught by nobody and still stops the
/// search.
fn let_readers_panic() {
    std::panic::set_hook(Box::new(|panic| {
        if !panic.location().is_some_and(|at| at.file().contains("calamine")) {
            eprintln!("{panic}");
        }
    }));
}

const ODS: &str = "application/vnd.oasis.opendocument.spreadsheet";
const RELATED: &str = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
const PACKAGE: &str = "http://schemas.openxmlformats.org/package/2006/relationships";

/// A workbook whose sheet and whose table of texts are given, with a zero between them.
fn xlsx(parts: &[u8]) -> Vec<u8> {
    let at = parts.iter().position(|b| *b == 0).unwrap_or(parts.len());
    let (sheet, texts) = (&parts[..at], parts.get(at + 1..).unwrap_or_default());
    let book =
        format!("<workbook xmlns:r='{RELATED}'><sheets><sheet name='s' sheetId='1' r:id='a'/></sheets></workbook>");
    let related = format!(
        "<Relationships xmlns='{PACKAGE}'><Relationship Id='a' Type='{RELATED}/worksheet' Target='worksheets/sheet1.xml'/>\
         </Relationships>"
    );
    archive(&[
        ("xl/workbook.xml", book.as_bytes()),
        ("xl/_rels/workbook.xml.rels", related.as_bytes()),
        ("xl/worksheets/sheet1.xml", sheet),
        ("xl/sharedStrings.xml", texts),
    ])
}

fn ods(content: &[u8]) -> Vec<u8> {
    archive(&[("mimetype", ODS.as_bytes()), ("META-INF/manifest.xml", b"<manifest/>"), ("content.xml", content)])
}

fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in files {
        let stored = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        zip.start_file(*name, stored).expect("a file begins");
        zip.write_all(content).expect("a file is written");
    }
    zip.finish().expect("an archive ends").into_inner()
}

/// A compound file of one stream: header, table of sectors, directory, stream.
fn compound(stream: &[u8]) -> Vec<u8> {
    let (none, end) = (u32::MAX, 0xFFFF_FFFE_u32);
    let length = stream.len().clamp(4096, 60_000);
    let sectors = length.div_ceil(512) as u32;
    let mut bytes = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1".to_vec();
    bytes.resize(26, 0);
    bytes.extend([3, 0, 0xfe, 0xff, 9, 0, 6, 0]);
    bytes.resize(44, 0);
    let words = |words: &[u32]| words.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<u8>>();
    bytes.extend(words(&[1, 1, 0, 0, end, 0, end, 0, 0]));
    bytes.resize(80, 0xff);
    bytes.resize(512, 0xff);
    let mut follows = vec![0xFFFF_FFFD, end];
    follows.extend((0..sectors).map(|n| if n + 1 == sectors { end } else { n + 3 }));
    follows.resize(128, none);
    bytes.extend(words(&follows));
    bytes.extend(entry("Root Entry", 5, end, 0));
    bytes.extend(entry("Workbook", 2, 2, length as u32));
    bytes.resize(512 * 3, 0);
    bytes.extend(&stream[..stream.len().min(length)]);
    bytes.resize(512 * (3 + sectors as usize), 0);
    bytes
}

fn entry(name: &str, kind: u8, first: u32, length: u32) -> Vec<u8> {
    let mut bytes: Vec<u8> = name.encode_utf16().flat_map(u16::to_le_bytes).collect();
    bytes.resize(66, 0);
    bytes.push(kind);
    bytes.resize(116, 0);
    bytes.extend(first.to_le_bytes());
    bytes.extend(length.to_le_bytes());
    bytes.resize(128, 0);
    bytes
}
