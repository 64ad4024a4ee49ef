//! A table that grows while a run goes on (CSV), and that a resumed run cuts back to where its checkpoint was.

use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use twox_hash::XxHash3_128;

use crate::csv_text::line;
use anisobond::{Error, Result, Wording};

/// A CSV file of numbers, one row at a time.
pub struct ProbeTable {
    path: PathBuf,
    file: BufWriter<File>,
    bytes: u64,
    hash: XxHash3_128,
}

impl ProbeTable {
    /// Begin a table with named columns; an old file of that name is replaced.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(path: impl AsRef<Path>, columns: &[String]) -> Result<Self> {
        let path = path.as_ref().to_path_buf();
        let file = File::create(&path).map_err(|e| Error::file("create", &path, e))?;
        let mut table = ProbeTable { path, file: BufWriter::new(file), bytes: 0, hash: XxHash3_128::new() };
        table.line(&line(columns))?;
        Ok(table)
    }

    /// Go on with a table that was so many bytes long, of this checksum; what comes after is dropped.
    ///
    /// # Errors
    /// A file that cannot be opened, that is shorter, or of which something is not as it was written.
    pub fn resume(path: impl AsRef<Path>, bytes: u64, checksum: &str) -> Result<Self> {
        let path = path.as_ref().to_path_buf();
        let failed = |e| Error::file("open", &path, e);
        let mut file = OpenOptions::new().read(true).write(true).open(&path).map_err(failed)?;
        let wrong = |what: &str| {
            let problem = format!("{} {what}", path.display());
            let remedy = Wording::from("start the run anew, in another folder or with ").choice("force", "");
            Err(Error::input(problem, remedy))
        };
        if file.metadata().map_err(failed)?.len() < bytes {
            return wrong("is shorter than the checkpoint says");
        }
        let (mut hash, mut piece, mut left) = (XxHash3_128::new(), [0; 65536], bytes as usize);
        while left > 0 {
            let part = left.min(piece.len());
            file.read_exact(&mut piece[..part]).map_err(failed)?;
            hash.write(&piece[..part]);
            left -= part;
        }
        if digits(&hash) != checksum {
            return wrong("is damaged, or was changed: it is not what the checkpoint says");
        }
        file.set_len(bytes).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        Ok(ProbeTable { path, file: BufWriter::new(file), bytes, hash })
    }

    /// Checksum of the table so far.
    pub fn checksum(&self) -> String {
        digits(&self.hash)
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
        self.hash.write(text.as_bytes());
        self.hash.write(b"\n");
        writeln!(self.file, "{text}").map_err(|e| Error::file("write", &self.path, e))
    }
}

fn digits(hash: &XxHash3_128) -> String {
    format!("{:032x}", hash.finish_128())
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
        let (at, sum) = (table.flush().unwrap(), table.checksum());
        table.row(&[1.0, 1.0 / 3.0]).unwrap();
        drop(table);
        let mut again = ProbeTable::resume(&path, at, &sum).unwrap();
        again.row(&[2.0, -1e-300]).unwrap();
        again.flush().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "time,u\n0.0,0.1\n2.0,-1e-300\n");
        assert!(ProbeTable::resume(&path, 10_000, &sum).is_err());
        assert!(ProbeTable::resume(folder.path().join("none"), 0, &sum).is_err());
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replace("0.0,0.1", "0.0,0.2")).unwrap();
        assert!(ProbeTable::resume(&path, at, &sum).err().unwrap().to_string().contains("damaged, or was changed"));
    }
}
