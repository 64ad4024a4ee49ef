//! What can go wrong, said once: where, what, and what to do about it.

use std::fmt;
use std::path::{Path, PathBuf};

/// Result of every fallible operation of the library.
pub type Result<T> = std::result::Result<T, Error>;

/// A failure that the user can act on.
///
/// An infeasible or inexact calibration is *not* an error: it is an outcome that carries its evidence.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// Wrong input: one message with place, problem and remedy.
    Input {
        /// Where: file, line and key, or the name of a parameter. Empty when the caller knows it.
        place: String,
        /// What is wrong, with the offending value.
        problem: String,
        /// What to change.
        remedy: String,
    },
    /// A file could not be read or written.
    File {
        /// The path concerned.
        path: PathBuf,
        /// What was attempted: "read", "write", …
        action: &'static str,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The user asked to stop; what was finished before is kept.
    Interrupted {
        /// What was finished and how to go on.
        message: String,
    },
}

impl Error {
    /// Wrong input without a place yet; add it with [`Error::at`].
    pub fn input(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Error::Input { place: String::new(), problem: problem.into(), remedy: remedy.into() }
    }

    /// A failed file operation.
    pub fn file(action: &'static str, path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Error::File { path: path.as_ref().to_path_buf(), action, source }
    }

    /// The same error, placed: an inner place ("line 3") is kept behind the outer one ("rock.toml").
    pub fn at(self, outer: impl fmt::Display) -> Self {
        match self {
            Error::Input { place, problem, remedy } => {
                let place = if place.is_empty() { outer.to_string() } else { format!("{outer}, {place}") };
                Error::Input { place, problem, remedy }
            }
            other => other,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Input { place, problem, remedy } => {
                if !place.is_empty() {
                    write!(f, "{place}: ")?;
                }
                write!(f, "{problem}")?;
                if remedy.is_empty() { Ok(()) } else { write!(f, "; {remedy}") }
            }
            Error::File { path, action, source } => write!(f, "cannot {action} {}: {source}", path.display()),
            Error::Interrupted { message } => write!(f, "interrupted: {message}"),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Error::File { source, .. } => Some(source),
            _ => None,
        }
    }
}
