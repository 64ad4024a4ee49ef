//! The results of a sweep in one SQLite file.
//!
//! Every finished job is one committed transaction with a rollback journal and full synchronisation: a process killed at
//! any moment loses the jobs under way and nothing else, on network file systems too (where a write-ahead log is not
//! allowed). While a sweep runs it holds a lock on `STORE.lock`; others may read meanwhile.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension};
use serde_json::Value as Json;

use super::job::Job;
use super::record::{COLUMNS, Counts, Record, State, TABLES, write};
use super::table::ParameterTable;
use crate::claim::{say_who, who};
use anisobond::{Error, Result};
use anisobond_formats::flat::{FlatRow, FlatTable, columns, header, text_of};
use anisobond_formats::inputs::Inputs;
use anisobond_formats::words::{quoted, suggestion};

/// "anbs": marks our files among all SQLite files.
const APPLICATION: i32 = 0x616e_6273;
/// Version of the tables.
const SCHEMA: i32 = 2;
/// How long one waits for another process that reads or writes.
const PATIENCE: Duration = Duration::from_secs(20);

/// A part of a sweep: the jobs whose index in the table leaves the remainder `index` when divided by `count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// i, from 0.
    pub index: usize,
    /// n, at least 1.
    pub count: usize,
}

impl Shard {
    /// From "i/n" with 0 ≤ i < n.
    ///
    /// # Errors
    /// Anything else.
    pub fn parse(text: &str) -> Result<Self> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
        match numbers {
            Some((index, count)) if index < count => Ok(Shard { index, count }),
            _ => Err(Error::input(
                format!("{} is no shard", quoted(text)),
                "write i/n with i from 0 to n − 1, as 0/8 for the first of eight",
            )),
        }
    }

    /// Whether a job belongs to the shard.
    pub fn has(&self, position: usize) -> bool {
        position % self.count == self.index
    }

    /// The shard's own store beside that of the whole sweep: `results.0-of-8.sqlite` of `results.sqlite`.
    pub fn store(&self, whole: impl AsRef<Path>) -> PathBuf {
        let whole = whole.as_ref();
        let stem = whole.file_stem().unwrap_or_default().to_string_lossy();
        let extension = whole.extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
        whole.with_file_name(format!("{stem}.{}-of-{}{extension}", self.index, self.count))
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// The store of a sweep.
pub struct Store {
    path: PathBuf,
    connection: Mutex<Connection>,
    notes: Vec<String>,
    /// Held while the store may be written.
    _lock: Option<WriterLock>,
}

/// What a store's jobs have in common.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sweep {
    pub version: String,
    pub settings: Json,
    pub table: String,
    pub shard: Option<Shard>,
}

impl Sweep {
    fn of(table: &ParameterTable, shard: Option<Shard>, settings: &Json) -> Self {
        let version = env!("CARGO_PKG_VERSION").into();
        Sweep { version, settings: settings.clone(), table: table.fingerprint(), shard }
    }

    /// Refuses another sweep; the table may have grown or shrunk.
    pub(super) fn refuse_other(&self, other: &Sweep, ours: &str) -> Result<()> {
        let wrong = |what: &str, theirs: String, own: String| {
            let problem = format!("the store was made with {what} {theirs}, {ours} has {own}");
            Err(Error::input(problem, "give another store, or the same settings again"))
        };
        let shard = |s: &Sweep| s.shard.map_or("0/1 (the whole)".into(), |s| s.to_string());
        if self.version != other.version {
            return wrong("version", other.version.clone(), self.version.clone());
        }
        if self.shard != other.shard {
            return wrong("shard", shard(other), shard(self));
        }
        if self.settings != other.settings {
            let (what, theirs, own) = difference("settings", &other.settings, &self.settings);
            return wrong(&what, theirs, own);
        }
        Ok(())
    }
}

/// The first place where two JSON values differ, and both values there.
fn difference(name: &str, a: &Json, b: &Json) -> (String, String, String) {
    if let (Json::Object(x), Json::Object(y)) = (a, b) {
        for key in x.keys().chain(y.keys()) {
            let (x, y) = (x.get(key).unwrap_or(&Json::Null), y.get(key).unwrap_or(&Json::Null));
            if x != y {
                return difference(&format!("{name}.{key}"), x, y);
            }
        }
    }
    let short = |value: &Json| {
        let text = value.to_string();
        if text.chars().count() > 60 { text.chars().take(60).chain(['…']).collect() } else { text }
    };
    (name.into(), short(a), short(b))
}

impl Store {
    /// Opens the store of a table, or begins one. `settings` is all that results depend on besides a job's parameters.
    /// Jobs that are new in the table are added; those no longer in it are kept aside.
    ///
    /// # Errors
    /// A file that is no store, is damaged, belongs to another sweep (other settings, version or shard), or is in use.
    pub fn open(path: impl AsRef<Path>, table: &ParameterTable, shard: Option<Shard>, settings: &Json) -> Result<Self> {
        Self::open_with(path, table, shard, settings, |_| Inputs::default())
    }

    /// [`Store::open`] of jobs whose parameters name files: `inputs` knows them by content. A job whose inputs have changed is
    /// to be done anew, and [`Store::notes`] names what changed.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open_with(
        path: impl AsRef<Path>,
        table: &ParameterTable,
        shard: Option<Shard>,
        settings: &Json,
        inputs: impl Fn(&Job) -> Inputs,
    ) -> Result<Self> {
        let mut store = Self::create(path.as_ref(), &Sweep::of(table, shard, settings), table.file())?;
        let jobs = table.jobs().iter().enumerate().filter(|(at, _)| shard.is_none_or(|shard| shard.has(*at)));
        store.put(jobs.map(|(position, job)| Record::new(position, job, inputs(job))))?;
        Ok(store)
    }

    /// What a user should know: inputs that have changed, records that are damaged.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Makes these the jobs of the store, all or none; what it knows of them already is kept if it is of the same inputs.
    pub(super) fn put(&mut self, records: impl Iterator<Item = Record>) -> Result<()> {
        let mut changes: BTreeMap<String, usize> = BTreeMap::new();
        let mut damaged = 0;
        let path = self.path.clone();
        let failed = |e| failure(&path, e);
        let mut connection = self.connection();
        let transaction = connection.transaction().map_err(failed)?;
        transaction.execute("UPDATE jobs SET position = NULL", ()).map_err(failed)?;
        for mut record in records {
            let sql = format!("SELECT {COLUMNS} FROM jobs WHERE id = ?1");
            let known = transaction
                .prepare_cached(&sql)
                .and_then(|mut one| one.query_row([&record.id], Record::of_row).optional())
                .map_err(failed)?;
            match known {
                Some(known) if known.damaged => damaged += 1,
                // A result is not taken back by what is not finished yet.
                Some(known) if known.is_finished() && (known.state == State::Done || !record.is_finished()) => {
                    match record.inputs.changed_since(&known.inputs) {
                        None => record.take_outcome(known),
                        Some(changed) => *changes.entry(changed).or_default() += 1,
                    }
                }
                Some(known) => record.attempts = record.attempts.max(known.attempts),
                None => {}
            }
            write(&transaction, &record).map_err(failed)?;
        }
        transaction.commit().map_err(failed)?;
        drop(connection);
        let jobs = |n: usize| if n == 1 { "1 job is".into() } else { format!("{n} jobs are") };
        self.notes.extend(changes.into_iter().map(|(what, n)| format!("{what}: {} done anew", jobs(n))));
        if damaged > 0 {
            self.notes.push(format!("{} done again: their records in the store are damaged", jobs(damaged)));
        }
        Ok(())
    }

    /// Opens or begins a store with the lock of a writer, checks that it is of this sweep and notes the table.
    pub(super) fn create(path: &Path, sweep: &Sweep, ours: &str) -> Result<Self> {
        if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(|e| Error::file("create", folder, e))?;
        }
        refuse_foreign(path)?;
        let lock = lock(path)?;
        let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let store = Self::connect(path, flags, Some(lock))?;
        if store.is_new()? {
            store.begin(sweep)?;
        }
        store.check()?;
        sweep.refuse_other(&store.sweep()?, ours).map_err(|e| e.at(path.display()))?;
        store.set("table", &sweep.table)?;
        Ok(store)
    }

    /// Opens an existing store to read it; another process may be writing.
    ///
    /// # Errors
    /// A file that cannot be read, is no store or is damaged.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        std::fs::metadata(path).map_err(|e| Error::file("read", path, e))?;
        refuse_foreign(path)?;
        // Not read-only: what a killed process left half written is rolled back on opening.
        let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let store = Self::connect(path, flags, None)?;
        store.check()?;
        Ok(store)
    }

    fn connect(path: &Path, flags: OpenFlags, lock: Option<WriterLock>) -> Result<Self> {
        let connection = Connection::open_with_flags(path, flags).map_err(|e| failure(path, e))?;
        let settings = || {
            connection.busy_timeout(PATIENCE)?;
            connection.pragma_update(None, "synchronous", "FULL")
        };
        settings().map_err(|e| failure(path, e))?;
        Ok(Store { path: path.into(), connection: Mutex::new(connection), notes: Vec::new(), _lock: lock })
    }

    /// Whether the file holds nothing yet: it is new, or its maker was killed before the tables were committed.
    fn is_new(&self) -> Result<bool> {
        let tables = self.connection().query_row("SELECT count(*) FROM sqlite_master", (), |row| row.get::<_, i64>(0));
        Ok(tables.map_err(|e| failure(&self.path, e))? == 0)
    }

    /// Makes the tables, all or none.
    fn begin(&self, sweep: &Sweep) -> Result<()> {
        let mut connection = self.connection();
        let failed = |e| failure(&self.path, e);
        let transaction = connection.transaction().map_err(failed)?;
        transaction.execute_batch(TABLES).map_err(failed)?;
        transaction.pragma_update(None, "application_id", APPLICATION).map_err(failed)?;
        transaction.pragma_update(None, "user_version", SCHEMA).map_err(failed)?;
        let shard = sweep.shard.map_or(String::new(), |s| s.to_string());
        let settings = sweep.settings.to_string();
        for (key, value) in
            [("version", &sweep.version), ("settings", &settings), ("table", &sweep.table), ("shard", &shard)]
        {
            transaction.execute("INSERT INTO sweep VALUES (?1, ?2)", [key, value]).map_err(failed)?;
        }
        transaction.commit().map_err(failed)
    }

    /// Refuses a file that is another program's, of another schema, or damaged.
    fn check(&self) -> Result<()> {
        let connection = self.connection();
        let number = |name: &str| {
            connection.pragma_query_value(None, name, |row| row.get::<_, i32>(0)).map_err(|e| failure(&self.path, e))
        };
        let wrong = |problem: String, remedy: &str| Err(Error::input(problem, remedy).at(self.path.display()));
        if number("application_id")? != APPLICATION {
            return wrong("this SQLite file is not the store of a sweep".into(), "give another name");
        }
        let schema = number("user_version")?;
        if schema != SCHEMA {
            let problem = format!("the store has schema {schema}, this program reads {SCHEMA}");
            return wrong(problem, "use the program that made it");
        }
        let verdict: String =
            connection.query_row("PRAGMA quick_check(1)", (), |row| row.get(0)).map_err(|e| failure(&self.path, e))?;
        if verdict != "ok" {
            return wrong(format!("the store is damaged: {verdict}"), DAMAGED);
        }
        Ok(())
    }

    pub(super) fn connection(&self) -> MutexGuard<'_, Connection> {
        self.connection.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The store's file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the jobs have in common.
    pub(super) fn sweep(&self) -> Result<Sweep> {
        let settings = serde_json::from_str(&self.value("settings")?).map_err(|e| self.damaged(&e))?;
        let shard = match self.value("shard")?.as_str() {
            "" => None,
            text => Some(Shard::parse(text).map_err(|e| e.at(self.path.display()))?),
        };
        Ok(Sweep { version: self.value("version")?, settings, table: self.value("table")?, shard })
    }

    fn value(&self, key: &str) -> Result<String> {
        let sql = "SELECT value FROM sweep WHERE key = ?1";
        let value = self.connection().query_row(sql, [key], |row| row.get(0)).optional();
        value.map_err(|e| failure(&self.path, e))?.ok_or_else(|| self.damaged(&format!("no {key}")))
    }

    fn set(&self, key: &str, value: &str) -> Result<()> {
        let sql = "UPDATE sweep SET value = ?2 WHERE key = ?1 AND value <> ?2";
        self.connection().execute(sql, [key, value]).map(drop).map_err(|e| failure(&self.path, e))
    }

    fn damaged(&self, why: &dyn fmt::Display) -> Error {
        Error::input(format!("the store is damaged: {why}"), DAMAGED).at(self.path.display())
    }

    /// Notes that a job begins.
    pub(super) fn start(&self, id: &str) -> Result<()> {
        self.change(id, |record| {
            record.state = State::Started;
            record.attempts += 1;
        })
    }

    /// Takes back the beginning of a job that was interrupted.
    pub(super) fn reset(&self, id: &str) -> Result<()> {
        self.change(id, |record| record.state = State::Pending)
    }

    /// Keeps a result, or the message of a failure; on the disk when this returns.
    pub(super) fn finish(&self, id: &str, result: std::result::Result<Json, String>, seconds: f64) -> Result<()> {
        self.change(id, |record| {
            record.seconds = Some(seconds);
            (record.state, record.result, record.message) = match result {
                Ok(value) => (State::Done, Some(value), None),
                Err(message) => (State::Failed, None, Some(message)),
            };
        })
    }

    /// Changes a job's record.
    fn change(&self, id: &str, to: impl FnOnce(&mut Record)) -> Result<()> {
        let connection = self.connection();
        let sql = format!("SELECT {COLUMNS} FROM jobs WHERE id = ?1");
        let found = connection.prepare_cached(&sql).and_then(|mut one| one.query_row([id], Record::of_row));
        let changed = found.and_then(|mut record| {
            to(&mut record);
            write(&connection, &record)
        });
        changed.map_err(|e| failure(&self.path, e))
    }

    /// The jobs of the table, in its order.
    ///
    /// # Errors
    /// A store that cannot be read.
    pub fn records(&self) -> Result<Vec<Record>> {
        let connection = self.connection();
        let failed = |e| failure(&self.path, e);
        let sql = format!("SELECT {COLUMNS} FROM jobs WHERE position IS NOT NULL ORDER BY position");
        let mut statement = connection.prepare_cached(&sql).map_err(failed)?;
        let rows = statement.query_map((), Record::of_row).map_err(failed)?;
        rows.collect::<rusqlite::Result<_>>().map_err(failed)
    }

    /// How many jobs there are, are done and have failed; one whose record is damaged is neither.
    ///
    /// # Errors
    /// A store that cannot be read.
    pub fn counts(&self) -> Result<Counts> {
        let mut counts = Counts::default();
        for record in self.records()? {
            counts.all += 1;
            counts.done += usize::from(record.state == State::Done);
            counts.failed += usize::from(record.state == State::Failed);
        }
        Ok(counts)
    }

    /// The table of [`Store::table`] as CSV text.
    ///
    /// # Errors
    /// A store that cannot be read.
    pub fn csv(&self) -> Result<String> {
        self.table()?.csv()
    }

    /// Writes the CSV table, whole or not at all.
    ///
    /// # Errors
    /// A store that cannot be read, a path that cannot be written.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<()> {
        anisobond_formats::write_atomically(path, self.csv()?)
    }

    /// Points (x, y) of two columns of the CSV table, for the jobs that have both as numbers, in the table's order.
    ///
    /// # Errors
    /// A column that is not there, with the nearest name.
    pub fn points(&self, x: &str, y: &str) -> Result<Vec<[f64; 2]>> {
        Ok(self.grouped_points(x, y, None)?.into_iter().map(|(_, point)| point).collect())
    }

    /// The same, each with its value of a third column.
    pub(super) fn grouped_points(&self, x: &str, y: &str, by: Option<&str>) -> Result<Vec<(String, [f64; 2])>> {
        let table = self.table()?;
        let names: Vec<&str> = table.header().iter().map(String::as_str).collect();
        if let Some(name) = [x, y].into_iter().chain(by).find(|name| !names.contains(name)) {
            return Err(Error::input(format!("there is no column {}", quoted(name)), suggestion(name, &names)));
        }
        let text = |row: &FlatRow, name: &str| {
            row.iter().find(|(own, _)| own == name).map(|(_, value)| text_of(value).into_owned())
        };
        let number = |row: &FlatRow, name: &str| text(row, name)?.parse::<f64>().ok().filter(|x| x.is_finite());
        let group = |row: &FlatRow| by.and_then(|by| text(row, by)).unwrap_or_default();
        Ok(table.rows().iter().filter_map(|row| Some((group(row), [number(row, x)?, number(row, y)?]))).collect())
    }

    /// A row per job in the order of the parameter table: `id`, `title`, `state`, the parameters, the numbers and words of
    /// the results under dotted names (with `result.` before a name that a parameter has too), and `error`.
    ///
    /// # Errors
    /// A store that cannot be read.
    pub fn table(&self) -> Result<FlatTable> {
        let records = self.records()?;
        let parameters: Vec<_> = records.iter().map(|record| columns(&record.parameters)).collect();
        let mut names: Vec<String> = ["id", "title", "state"].map(String::from).to_vec();
        let own = |name: &str| matches!(name, "id" | "title" | "state" | "error");
        let parameter = |name: &str| if own(name) { format!("parameter.{name}") } else { name.to_string() };
        names.extend(header(&parameters).iter().map(|name| parameter(name)));
        let taken: std::collections::HashSet<String> = names.iter().cloned().chain(["error".into()]).collect();
        let results: Vec<FlatRow> = records
            .iter()
            .map(|record| {
                let flat = record.result.as_ref().map(result_columns).unwrap_or_default();
                let apart = |name: String| if taken.contains(&name) { format!("result.{name}") } else { name };
                flat.into_iter().map(|(name, value)| (apart(name), value)).collect()
            })
            .collect();
        names.extend(header(&results));
        names.push("error".into());
        let rows = records.into_iter().zip(parameters).zip(results).map(|((record, parameters), results)| {
            let mut row = vec![
                ("id".to_string(), Json::from(record.id)),
                ("title".into(), record.title.into()),
                ("state".into(), record.state.name().into()),
            ];
            row.extend(parameters.into_iter().map(|(name, value)| (parameter(&name), value)));
            row.extend(results);
            row.extend(record.message.map(|message| ("error".to_string(), message.into())));
            row
        });
        Ok(FlatTable::new(names, rows.collect()))
    }
}

/// The columns of a result that is an object; another value is `result`.
fn result_columns(value: &Json) -> FlatRow {
    match value {
        Json::Object(_) => columns(value),
        other => columns(&serde_json::json!({ "result": other })),
    }
}

const DAMAGED: &str = "restore a copy, or move it away and compute again";

/// Refuses what is no SQLite file, without touching it; nothing, or an empty file, is the beginning of a store.
fn refuse_foreign(path: &Path) -> Result<()> {
    use std::io::Read;
    let mut start = Vec::new();
    match File::open(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(Error::file("read", path, e)),
        Ok(file) => file.take(16).read_to_end(&mut start).map_err(|e| Error::file("read", path, e))?,
    };
    if start.is_empty() || start == b"SQLite format 3\0" {
        return Ok(());
    }
    let remedy = "give the name of a new file, or of the store of this sweep";
    Err(Error::input("the file is not the store of a sweep", remedy).at(path.display()))
}

/// The lock of a store's writer; gone with the process, however it ends.
struct WriterLock(File);

impl Drop for WriterLock {
    /// Unlocks and does not only close: a process that is just being started holds a copy of every open file until its
    /// program is loaded, and with the copy the lock.
    fn drop(&mut self) {
        // Where a file system knows no locks there is nothing to release.
        let _ = self.0.unlock();
    }
}

fn lock(path: &Path) -> Result<WriterLock> {
    let mut name = path.as_os_str().to_owned();
    name.push(".lock");
    let name = PathBuf::from(name);
    let file = File::options().create(true).truncate(false).read(true).write(true).open(&name);
    let mut file = file.map_err(|e| Error::file("write", &name, e))?;
    match file.try_lock() {
        Ok(()) => {
            let _ = say_who(&mut file);
            Ok(WriterLock(file))
        }
        Err(std::fs::TryLockError::WouldBlock) => Err(in_use(path, &who(&mut file))),
        // Some network file systems know no locks; SQLite's own keep the file whole.
        Err(std::fs::TryLockError::Error(_)) => Ok(WriterLock(file)),
    }
}

fn in_use(path: &Path, who: &str) -> Error {
    let remedy = "wait for it, stop it, or give this one a store or shard of its own";
    Error::input(format!("another process is running this sweep: {who}"), remedy).at(path.display())
}

/// What SQLite says, in our words.
pub(super) fn failure(path: &Path, error: rusqlite::Error) -> Error {
    match error.sqlite_error_code() {
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => in_use(path, "it holds the store"),
        Some(ErrorCode::NotADatabase) => {
            Error::input("the file is not the store of a sweep", "give another name").at(path.display())
        }
        Some(ErrorCode::DatabaseCorrupt) => {
            Error::input(format!("the store is damaged: {error}"), DAMAGED).at(path.display())
        }
        Some(ErrorCode::DiskFull) => {
            let message = "the disk is full; make room and run the same command again, what is finished is kept";
            Error::file("write", path, std::io::Error::new(std::io::ErrorKind::StorageFull, message))
        }
        _ => Error::file("use", path, std::io::Error::other(error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As while another thread starts a process: the file is still open elsewhere when its writer is done.
    #[test]
    fn a_copy_of_the_open_file_does_not_keep_the_lock() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.sqlite");
        let first = lock(&path).unwrap();
        let inherited = first.0.try_clone().unwrap();
        assert!(lock(&path).is_err(), "two writers at once");
        drop(first);
        assert!(lock(&path).is_ok(), "the lock outlived its writer");
        drop(inherited);
    }
}
