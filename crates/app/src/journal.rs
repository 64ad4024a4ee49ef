//! A journal of finished jobs: one JSON line each, written as they finish, so that an interrupted run goes on where it
//! was stopped.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use anisobond::{Error, Result};
use anisobond_formats::inputs::{Inputs, checksum};
use anisobond_formats::json::{json_file, refuse_non_finite};
use anisobond_formats::write_atomically;

/// Finished jobs on disk, keyed by what they were computed from.
///
/// Every line has a checksum: one that a crash left unfinished, or that was damaged since, is not read back, and its job is
/// computed again.
pub struct Journal {
    path: PathBuf,
    file: BufWriter<File>,
    finished: HashMap<String, Box<RawValue>>,
    damaged: usize,
}

/// One line of the file.
#[derive(Serialize, Deserialize)]
struct Line {
    key: String,
    result: Box<RawValue>,
    /// Checksum of key and result.
    check: String,
}

impl Line {
    fn new(key: String, result: Box<RawValue>) -> Self {
        let check = Line::check(&key, &result);
        Line { key, result, check }
    }

    fn check(key: &str, result: &RawValue) -> String {
        checksum([key.as_bytes(), result.get().as_bytes()])
    }

    fn is_whole(&self) -> bool {
        self.check == Line::check(&self.key, &self.result)
    }
}

impl Journal {
    /// Open a journal, or begin one, and read what is finished.
    ///
    /// # Errors
    /// A file that cannot be read or written.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref().to_path_buf();
        let mut file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(&path)
            .map_err(|e| Error::file("open", &path, e))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(|e| Error::file("read", &path, e))?;
        let (mut finished, mut damaged) = (HashMap::new(), 0);
        for line in bytes.split(|&b| b == b'\n').filter(|line| !line.is_empty()) {
            match serde_json::from_slice::<Line>(line).ok().filter(Line::is_whole) {
                Some(Line { key, result, .. }) => drop(finished.insert(key, result)),
                None => damaged += 1,
            }
        }
        // A torn last line gets its end, so that the next one starts afresh.
        if bytes.last().is_some_and(|&b| b != b'\n') {
            file.write_all(b"\n").map_err(|e| Error::file("write", &path, e))?;
        }
        Ok(Journal { path, file: BufWriter::new(file), finished, damaged })
    }

    /// The result of a finished job, as it was written (JSON).
    pub fn get(&self, key: &str) -> Option<&RawValue> {
        self.finished.get(key).map(AsRef::as_ref)
    }

    /// Lines that are not whole; their jobs are not among the finished ones.
    pub fn damaged(&self) -> usize {
        self.damaged
    }

    /// Note, in a file beside the journal, what jobs are computed from; what has changed since it was noted last, in words.
    /// (Results are known by their keys: if the note is lost, only these words are.)
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn computed_from(&mut self, inputs: &Inputs) -> Result<Option<String>> {
        let path = self.path.with_extension("inputs.json");
        let before = std::fs::read(&path).ok().and_then(|bytes| serde_json::from_slice::<Inputs>(&bytes).ok());
        let changed = before.as_ref().and_then(|before| inputs.changed_since(before));
        if before.as_ref() != Some(inputs) {
            write_atomically(path, json_file(inputs)?)?;
        }
        Ok(changed)
    }

    /// Add a finished job; it is on its way to the disk when this returns.
    ///
    /// # Errors
    /// A full disk, or a result that cannot be written as JSON.
    pub fn add(&mut self, key: String, result: &impl Serialize) -> Result<()> {
        let result = self.raw(result)?;
        self.write(Line::new(key.clone(), result.clone()))?;
        self.finished.insert(key, result);
        Ok(())
    }

    fn raw(&self, value: &impl Serialize) -> Result<Box<RawValue>> {
        refuse_non_finite(value)?;
        serde_json::value::to_raw_value(value).map_err(|e| Error::file("write", &self.path, e.into()))
    }

    fn write(&mut self, line: Line) -> Result<()> {
        let failed = |e: std::io::Error| Error::file("write", &self.path, e);
        let text = serde_json::to_string(&line).map_err(|e| failed(e.into()))?;
        self.file.write_all(text.as_bytes()).map_err(failed)?;
        self.file.write_all(b"\n").map_err(failed)?;
        self.file.flush().map_err(failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torn_line_is_dropped_and_the_rest_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal.jsonl");
        let mut journal = Journal::open(&path).unwrap();
        journal.add("a".into(), &[1.5, 2.0]).unwrap();
        journal.add("b \"quoted\"".into(), &"text").unwrap();
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        for cut in 0..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let mut journal = Journal::open(&path).unwrap();
            let first_whole = whole.iter().position(|&b| b == b'\n').unwrap();
            assert_eq!(journal.get("a").is_some(), cut >= first_whole, "{cut}");
            journal.add("c".into(), &1).unwrap();
            drop(journal);
            let journal = Journal::open(&path).unwrap();
            assert_eq!(journal.get("c").unwrap().get(), "1");
            assert_eq!(journal.get("a").is_some(), cut >= first_whole, "{cut}");
        }
        std::fs::write(&path, &whole).unwrap();
        assert_eq!(Journal::open(&path).unwrap().get("b \"quoted\"").unwrap().get(), "\"text\"");
    }

    /// Whatever happens to a byte, nothing wrong is read back: the job is there as it was, or not at all.
    #[test]
    fn damage_is_seen() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal.jsonl");
        let mut journal = Journal::open(&path).unwrap();
        journal.add("a".into(), &[1.5, 2.0]).unwrap();
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        for (at, with) in (0..whole.len()).flat_map(|at| [0, b' ', b'\n', b'7', whole[at] ^ 1].map(|with| (at, with))) {
            let mut bytes = whole.clone();
            bytes[at] = with;
            std::fs::write(&path, &bytes).unwrap();
            let journal = Journal::open(&path).unwrap();
            let read = journal.get("a").map(|result| result.get().to_string());
            assert!(read.is_none() || read.as_deref() == Some("[1.5,2.0]"), "byte {at} to {with}: {read:?}");
            assert!(bytes == whole || journal.damaged() > 0 || read.is_some(), "byte {at} to {with}");
        }
        std::fs::write(&path, vec![0; whole.len()]).unwrap();
        let mut journal = Journal::open(&path).unwrap();
        assert!(journal.get("a").is_none() && journal.damaged() == 1);
        journal.add("a".into(), &3).unwrap();
        drop(journal);
        assert_eq!(Journal::open(&path).unwrap().get("a").unwrap().get(), "3");
    }

    #[test]
    fn changed_inputs_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal.jsonl");
        let inputs = |table: &str| Inputs::default().and("the table", table.as_bytes()).and("horizon", b"3");
        for (table, changed) in [("1", None), ("1", None), ("2", Some("the table has changed")), ("2", None)] {
            let said = Journal::open(&path).unwrap().computed_from(&inputs(table)).unwrap();
            assert_eq!(said.as_deref(), changed);
        }
    }
}
