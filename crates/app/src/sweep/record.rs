//! What the store of a sweep knows of a job: a row with a checksum.

use rusqlite::types::ValueRef;
use rusqlite::{Connection, Row, params};
use serde_json::Value as Json;

use super::job::Job;
use anisobond_formats::inputs::{Inputs, checksum};

/// The tables of a store.
pub(super) const TABLES: &str = "
CREATE TABLE sweep (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE jobs (
    id TEXT PRIMARY KEY,
    position INTEGER,
    title TEXT NOT NULL,
    parameters TEXT NOT NULL,
    inputs TEXT NOT NULL,
    state TEXT NOT NULL,
    result TEXT,
    message TEXT,
    seconds REAL,
    attempts INTEGER NOT NULL,
    checksum TEXT NOT NULL
) WITHOUT ROWID;
CREATE INDEX jobs_in_order ON jobs (position);
";

/// What has become of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Not begun.
    Pending,
    /// Under way, or interrupted.
    Started,
    /// Finished with a result.
    Done,
    /// Finished with a message.
    Failed,
}

impl State {
    pub(super) fn name(self) -> &'static str {
        match self {
            State::Pending => "pending",
            State::Started => "started",
            State::Done => "done",
            State::Failed => "failed",
        }
    }

    fn of(name: &str) -> Self {
        [State::Started, State::Done, State::Failed].into_iter().find(|s| s.name() == name).unwrap_or(State::Pending)
    }
}

/// A job as the store knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Index in the table, from 0.
    pub position: usize,
    /// The job's id.
    pub id: String,
    /// The job's title.
    pub title: String,
    /// Its parameters, a JSON object.
    pub parameters: Json,
    /// What its parameters name, by content.
    pub inputs: Inputs,
    /// What has become of it.
    pub state: State,
    /// The result of a finished job.
    pub result: Option<Json>,
    /// Why it failed.
    pub message: Option<String>,
    /// How long it took (s).
    pub seconds: Option<f64>,
    /// How often it was begun.
    pub attempts: u32,
    /// Whether its record is not what was written: then it has no result, and is to be done again.
    pub damaged: bool,
}

impl Record {
    pub(super) fn new(position: usize, job: &Job, inputs: Inputs) -> Self {
        Record {
            position,
            id: job.id.clone(),
            title: job.title.clone(),
            parameters: job.json(),
            inputs,
            state: State::Pending,
            result: None,
            message: None,
            seconds: None,
            attempts: 0,
            damaged: false,
        }
    }

    pub(super) fn is_finished(&self) -> bool {
        matches!(self.state, State::Done | State::Failed)
    }

    /// Takes what became of another record of the same job.
    pub(super) fn take_outcome(&mut self, other: Record) {
        let Record { state, result, message, seconds, attempts, .. } = other;
        (self.state, self.result, self.message) = (state, result, message);
        (self.seconds, self.attempts) = (seconds, attempts);
    }

    /// Checksum of all that a finished job is known by.
    fn checksum(&self) -> String {
        let texts = [
            self.id.clone(),
            self.title.clone(),
            self.parameters.to_string(),
            self.inputs.text(),
            self.state.name().into(),
            self.result.as_ref().map(ToString::to_string).unwrap_or_default(),
            self.message.clone().unwrap_or_default(),
        ];
        checksum(texts.iter().map(String::as_bytes))
    }

    /// From a row of the columns of [`COLUMNS`]. Whatever a damaged file has in it, no result comes out of it that was not
    /// put in.
    pub(super) fn of_row(row: &Row) -> rusqlite::Result<Self> {
        let text = |at: usize| -> rusqlite::Result<Option<String>> {
            Ok(match row.get_ref(at)? {
                ValueRef::Text(bytes) | ValueRef::Blob(bytes) => Some(String::from_utf8_lossy(bytes).into_owned()),
                _ => None,
            })
        };
        let words = |at: usize| -> rusqlite::Result<String> { Ok(text(at)?.unwrap_or_default()) };
        let json = |text: String| serde_json::from_str::<Json>(&text).unwrap_or(Json::Null);
        let mut record = Record {
            position: row.get::<_, i64>(0).unwrap_or(0).max(0) as usize,
            id: words(1)?,
            title: words(2)?,
            parameters: json(words(3)?),
            inputs: Inputs::of_text(&words(4)?),
            state: State::of(&words(5)?),
            result: text(6)?.map(json),
            message: text(7)?,
            seconds: row.get(8).unwrap_or(None),
            attempts: row.get(9).unwrap_or(0),
            damaged: false,
        };
        if words(10)? != record.checksum() {
            record.damaged = true;
            (record.state, record.result, record.message) = (State::Pending, None, None);
        }
        Ok(record)
    }
}

/// The columns of a record.
pub(super) const COLUMNS: &str =
    "position, id, title, parameters, inputs, state, result, message, seconds, attempts, checksum";

/// How many jobs are in which state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// All jobs of the table (or shard).
    pub all: usize,
    /// Those with a result.
    pub done: usize,
    /// Those that failed.
    pub failed: usize,
}

/// Writes a record in the place of the job's record, if it has one.
pub(super) fn write(connection: &Connection, record: &Record) -> rusqlite::Result<()> {
    let sql = format!("INSERT OR REPLACE INTO jobs ({COLUMNS}) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11)");
    let values = params![
        record.position as i64,
        record.id,
        record.title,
        record.parameters.to_string(),
        record.inputs.text(),
        record.state.name(),
        record.result.as_ref().map(ToString::to_string),
        record.message,
        record.seconds,
        record.attempts,
        record.checksum(),
    ];
    connection.prepare_cached(&sql)?.execute(values).map(drop)
}
