//! The log of one job: a text file of its own.

use std::fmt::Display;
use std::fs::{File, OpenOptions, create_dir_all};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::job::Job;
use anisobond::{Error, Result};

/// Most letters of a job's title in the name of its log.
const LETTERS: usize = 80;

/// The log of one job; lines carry the seconds since the job began.
pub struct JobLog {
    path: PathBuf,
    file: File,
    began: Instant,
    failed: Option<std::io::Error>,
}

impl JobLog {
    /// The log of a job in a folder, made if need be; a job run again continues its log.
    pub(super) fn open(folder: &Path, job: &Job) -> Result<Self> {
        create_dir_all(folder).map_err(|e| Error::file("create", folder, e))?;
        let path = folder.join(name(job));
        let file =
            OpenOptions::new().create(true).append(true).open(&path).map_err(|e| Error::file("open", &path, e))?;
        let mut log = JobLog { path, file, began: Instant::now(), failed: None };
        log.write(&format!("{} (job {}, anisobond {})\n", job.title, job.id, env!("CARGO_PKG_VERSION")));
        for (name, value) in &job.parameters {
            log.write(&format!("  {name} = {value}\n"));
        }
        Ok(log)
    }

    /// Adds a line.
    pub fn line(&mut self, text: impl Display) {
        let line = format!("{:10.3} s  {text}\n", self.began.elapsed().as_secs_f64());
        self.write(&line);
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn write(&mut self, text: &str) {
        if self.failed.is_none()
            && let Err(error) = self.file.write_all(text.as_bytes())
        {
            self.failed = Some(error);
        }
    }

    /// Ends the log; what could not be written is an error now.
    pub(super) fn close(mut self, outcome: &str) -> Result<()> {
        self.line(outcome);
        self.failed.map_or(Ok(()), |error| Err(Error::file("write", &self.path, error)))
    }
}

/// "contact_radius=1.8-2f3a90c1.log": the title in plain letters, and enough of the id to be unique.
fn name(job: &Job) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "=.+-_".contains(c) { c } else { '_' };
    let title: String = job.title.replace(", ", ",").chars().take(LETTERS).map(plain).collect();
    format!("{}-{}.log", title.trim_start_matches('.'), job.id)
}
