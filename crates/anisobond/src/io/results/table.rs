//! A table that grows while a run goes on (CSV), and that a resumed run cuts back to where its checkpoint was.

use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// A CSV file of numbers, one row at a time.
pub struct ProbeTable {
    path: PathBuf,
    file: BufWriter<File>,
    bytes: u64,
}

impl ProbeTable {
    /// Begin a table with named columns; an old file of that name is replaced.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(path: impl AsRef<Path>, columns: &[String]) -> Result<Self> {
        let path = path.as_ref().to_path_buf();
        let file = File::create(&path).map_err(|e| Error::file("create", &path, e))?;
        let mut table = ProbeTable { path, file: BufWriter::new(file), bytes: 0 };
        table.line(&columns.join(","))?;
        Ok(table)
    }

    /// Go on with a table that was so many bytes long; what comes after is dropped.
    ///
    /// # Errors
    /// A file that cannot be opened, or that is shorter.
    pub fn resume(path: impl AsRef<Path>, bytes: u64) -> Result<Self> {
        let path = path.as_ref().to_path_buf();
        let failed = |e| Error::file("open", &path, e);
        let mut file = OpenOptions::new().write(true).open(&path).map_err(failed)?;
        if file.metadata().map_err(failed)?.len() < bytes {
            return Err(Error::input(
                format!("{} is shorter than the checkpoint says", path.display()),
                "start the run anew, in another folder",
            ));
        }
        file.set_len(bytes).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        Ok(ProbeTable { path, file: BufWriter::new(file), bytes })
    }

    /// Add a row. Numbers are text that reads back to the same bits.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn row(&mut self, values: &[f64]) -> Result<()> {
        let words: Vec<String> = values.iter().map(|v| format!("{v:?}")).collect();
        self.line(&words.join(","))
    }

    /// Write out what is buffered; returns the length of the file (bytes).
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn flush(&mut self) -> Result<u64> {
        self.file.flush().map_err(|e| Error::file("write", &self.path, e))?;
        Ok(self.bytes)
    }

    fn line(&mut self, text: &str) -> Result<()> {
        self.bytes += text.len() as u64 + 1;
        writeln!(self.file, "{text}").map_err(|e| Error::file("write", &self.path, e))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resumed_table_goes_on_where_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("probes.csv");
        let mut table = ProbeTable::create(&path, &["time".into(), "u".into()]).unwrap();
        table.row(&[0.0, 0.1]).unwrap();
        let at = table.flush().unwrap();
        table.row(&[1.0, 1.0 / 3.0]).unwrap();
        drop(table);
        let mut again = ProbeTable::resume(&path, at).unwrap();
        again.row(&[2.0, -1e-300]).unwrap();
        again.flush().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "time,u\n0.0,0.1\n2.0,-1e-300\n");
        assert!(ProbeTable::resume(&path, 10_000).is_err());
        assert!(ProbeTable::resume(folder.path().join("none"), 0).is_err());
    }
}
