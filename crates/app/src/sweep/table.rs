//! Tables of parameters: TOML with lists and ranges, CSV, and spreadsheets.

use std::collections::HashMap;
use std::path::Path;

use super::bounded::Format;
use super::combinations::jobs_of_toml;
use super::job::{Hash, Job};
use super::sheet::{jobs_of_cells, text_cells, workbook_cells};
use anisobond::{Error, Result};
use anisobond_formats::inputs::read_bytes;
use anisobond_formats::tree::{parse_toml, read_text, without_mark};
use anisobond_formats::words::{quoted, suggestion};

/// Most jobs of one table.
pub(super) const MOST_JOBS: usize = 1_000_000;

/// The jobs of a sweep, in the table's order; at least one, and no two with the same parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterTable {
    jobs: Vec<Job>,
    file: String,
    names: Vec<Name>,
}

/// A parameter's name and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Name {
    pub name: String,
    pub place: String,
}

impl ParameterTable {
    /// Reads a table of parameters, by the ending of its name.
    ///
    /// `.toml`: every combination of the entries of `[parameters]`, the first varying slowest. An entry is a list, a
    /// range `{ from = 1.2, to = 2.8, step = 0.2 }` or `{ from, to, count, spacing = "linear" | "log" }`, or one value.
    /// `zip = [["a", "b"]]` lets parameters vary together; `[fixed]` and single values at the top are common to all.
    ///
    /// `.csv`, `.tsv`, `.xls`, `.xlsx`, `.ods` (its first sheet that is not empty): the first row names the parameters,
    /// every further row is a job. `=` or an empty cell repeats the cell above, `-` leaves the parameter at its default,
    /// `#` begins a comment to the end of the row. The column `title` names the jobs; a column `!name` is no parameter
    /// but part of the title, and `name!` is both.
    ///
    /// # Errors
    /// A file that cannot be read; what is wrong in it, with line or cell; no job; two jobs with the same parameters.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let file = path.display().to_string();
        match Format::of_ending(&extension(&file)) {
            Some(format) => Self::of_workbook(&read_bytes(path)?, format, file),
            None => Self::parse(&read_text(path)?, &file),
        }
    }

    /// A table from the bytes of a spreadsheet; the ending of `file` (`.xls`, `.xlsx`, `.xlsm`, `.ods`) says of which kind.
    ///
    /// # Errors
    /// As [`ParameterTable::read`].
    pub fn parse_workbook(bytes: &[u8], file: &str) -> Result<Self> {
        match Format::of_ending(&extension(file)) {
            Some(format) => Self::of_workbook(bytes, format, file.into()),
            None => Err(unknown_kind(file)),
        }
    }

    fn of_workbook(bytes: &[u8], format: Format, file: String) -> Result<Self> {
        let (sheet, rows) = workbook_cells(bytes, format, &file)?;
        let (jobs, names) = jobs_of_cells(&rows).map_err(|e| e.at(format!("{file}, sheet {sheet}")))?;
        Self::of(jobs, names, file)
    }

    /// A table from the text of a TOML, CSV or TSV file; the ending of `file` says which.
    ///
    /// # Errors
    /// As [`ParameterTable::read`].
    pub fn parse(text: &str, file: &str) -> Result<Self> {
        let text = without_mark(text);
        let (jobs, names) = match extension(file).as_str() {
            "toml" => jobs_of_toml(&parse_toml(text, file)?).map_err(|e| e.at(file))?,
            "csv" | "tsv" => {
                let rows = text_cells(text).map_err(|e| e.at(file))?;
                jobs_of_cells(&rows).map_err(|e| e.at(file))?
            }
            _ => return Err(unknown_kind(file)),
        };
        Self::of(jobs, names, file.into())
    }

    fn of(jobs: Vec<Job>, names: Vec<Name>, file: String) -> Result<Self> {
        if jobs.is_empty() {
            return Err(Error::input("the table has no job", "add a row of values below the names").at(file));
        }
        refuse_repeated_jobs(&jobs).map_err(|e| e.at(&file))?;
        Ok(ParameterTable { jobs, file, names })
    }

    /// The jobs, in the table's order.
    pub fn jobs(&self) -> &[Job] {
        &self.jobs
    }

    /// The file's name, for messages.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The names of the parameters, in the table's order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(|n| n.name.as_str())
    }

    /// Refuses parameters that are not among `known`.
    ///
    /// # Errors
    /// The first unknown one, with its place and the nearest known name.
    pub fn check_names(&self, known: &[&str]) -> Result<()> {
        match self.names.iter().find(|n| !known.contains(&n.name.as_str())) {
            None => Ok(()),
            Some(n) => {
                let problem = format!("unknown parameter {}", quoted(&n.name));
                Err(Error::input(problem, suggestion(&n.name, known)).at(&n.place).at(&self.file))
            }
        }
    }

    /// What identifies the table as a whole: its jobs in their order.
    pub(super) fn fingerprint(&self) -> String {
        let mut hash = Hash::new();
        self.jobs.iter().for_each(|job| hash.add(job.id.as_bytes()));
        hash.digits()
    }
}

fn unknown_kind(file: &str) -> Error {
    let remedy = "end the name in .toml, .csv, .tsv, .xls, .xlsx or .ods";
    Error::input("not a table of parameters by its name", remedy).at(file)
}

fn extension(file: &str) -> String {
    Path::new(file).extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

fn refuse_repeated_jobs(jobs: &[Job]) -> Result<()> {
    let mut seen: HashMap<&str, &Job> = HashMap::new();
    for job in jobs {
        if let Some(first) = seen.insert(&job.id, job) {
            let problem = format!("{} has the same parameters as {}: {}", job.place, first.place, all(job));
            return Err(Error::input(problem, "remove one of them, or add a parameter that tells them apart"));
        }
    }
    Ok(())
}

/// "a = 1, b = x", cut to a readable length.
fn all(job: &Job) -> String {
    let pairs: Vec<String> = job.parameters.iter().take(6).map(|(name, value)| format!("{name} = {value}")).collect();
    let more = if job.parameters.len() > 6 { ", …" } else { "" };
    let text = pairs.join(", ");
    let short: String = text.chars().take(200).collect();
    format!("{short}{}", if short.len() < text.len() { "…" } else { more })
}
