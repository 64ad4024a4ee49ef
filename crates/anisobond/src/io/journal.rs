//! A journal of finished jobs: one JSON line each, written as they finish, so that an interrupted run goes on where it
//! was stopped.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use crate::{Error, Result};

/// Finished jobs on disk, keyed by what they were computed from.
///
/// A line that a crash left unfinished is dropped when the journal is opened, so nothing wrong is ever read back.
pub struct Journal {
    path: PathBuf,
    file: BufWriter<File>,
    finished: HashMap<String, Box<RawValue>>,
}

/// One line of the file.
#[derive(Serialize, Deserialize)]
struct Line<'a> {
    key: std::borrow::Cow<'a, str>,
    result: Box<RawValue>,
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
        let mut finished = HashMap::new();
        for line in bytes.split(|&b| b == b'\n') {
            if let Ok(line) = serde_json::from_slice::<Line>(line) {
                finished.insert(line.key.into_owned(), line.result);
            }
        }
        // A torn last line gets its end, so that the next one starts afresh.
        if bytes.last().is_some_and(|&b| b != b'\n') {
            file.write_all(b"\n").map_err(|e| Error::file("write", &path, e))?;
        }
        Ok(Journal { path, file: BufWriter::new(file), finished })
    }

    /// The result of a finished job, as it was written (JSON).
    pub fn get(&self, key: &str) -> Option<&RawValue> {
        self.finished.get(key).map(AsRef::as_ref)
    }

    /// Add a finished job; it is on its way to the disk when this returns.
    ///
    /// # Errors
    /// A full disk, or a result that cannot be written as JSON.
    pub fn add(&mut self, key: String, result: &impl Serialize) -> Result<()> {
        let failed = |e: std::io::Error| Error::file("write", &self.path, e);
        let result = serde_json::value::to_raw_value(result).map_err(|e| failed(e.into()))?;
        let line = serde_json::to_string(&Line { key: key.as_str().into(), result: result.clone() })
            .map_err(|e| failed(e.into()))?;
        self.file.write_all(line.as_bytes()).map_err(failed)?;
        self.file.write_all(b"\n").map_err(failed)?;
        self.file.flush().map_err(failed)?;
        self.finished.insert(key, result);
        Ok(())
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
}
