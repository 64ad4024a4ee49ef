//! What can go wrong, said once: where, what, and what to do about it.

mod wording;

use std::fmt;
use std::path::{Path, PathBuf};

pub use wording::{Choice, Wording};

/// Result of every fallible operation of the library.
pub type Result<T> = std::result::Result<T, Error>;

/// What an error is, for programs; the sentence is for people.
///
/// ```
/// use anisobond::ErrorKind;
/// let retry = |kind: ErrorKind| matches!(kind, ErrorKind::Diverged | ErrorKind::NotConverged);
/// assert!(retry(ErrorKind::Diverged) && !retry(ErrorKind::Input));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// What was given is wrong, or is not possible together.
    Input,
    /// A motion left what its time step can follow.
    Diverged,
    /// A solver or a search ended before it found what was asked.
    NotConverged,
    /// Something moves that nothing holds, or gains energy where it moves.
    Mechanism,
    /// A file could not be read or written.
    File,
    /// The user asked to stop.
    Interrupted,
}

impl ErrorKind {
    /// The kind in lower case, its words joined by a dash.
    ///
    /// ```
    /// assert_eq!(anisobond::ErrorKind::NotConverged.name(), "not-converged");
    /// ```
    pub fn name(self) -> &'static str {
        match self {
            ErrorKind::Input => "input",
            ErrorKind::Diverged => "diverged",
            ErrorKind::NotConverged => "not-converged",
            ErrorKind::Mechanism => "mechanism",
            ErrorKind::File => "file",
            ErrorKind::Interrupted => "interrupted",
        }
    }
}

/// A failure that the user can act on: a sentence for people, and a [kind](Error::kind) for programs.
///
/// An infeasible or inexact calibration is *not* an error: it is an outcome that carries its evidence.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// Wrong input, or work that came to no result: one message with place, problem and remedy.
    Failure {
        /// Which of the two, for programs.
        kind: ErrorKind,
        /// Where: file, line and key, or the name of a parameter. Empty when the caller knows it.
        place: String,
        /// What is wrong, with the offending value.
        problem: String,
        /// What to change.
        remedy: Wording,
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
        message: Wording,
    },
}

impl Error {
    /// Wrong input without a place yet; add it with [`Error::at`].
    pub fn input(problem: impl Into<String>, remedy: impl Into<Wording>) -> Self {
        Error::failure(ErrorKind::Input, problem, remedy)
    }

    /// A motion that left what its time step can follow.
    ///
    /// ```
    /// use anisobond::{Error, ErrorKind};
    /// let error = Error::diverged("the motion explodes", "use a smaller time step").at("step 7");
    /// assert_eq!(error.kind(), ErrorKind::Diverged);
    /// assert_eq!(error.to_string(), "step 7: the motion explodes; use a smaller time step");
    /// ```
    pub fn diverged(problem: impl Into<String>, remedy: impl Into<Wording>) -> Self {
        Error::failure(ErrorKind::Diverged, problem, remedy)
    }

    /// A solver or a search that ended before it found what was asked.
    ///
    /// ```
    /// use anisobond::{Error, ErrorKind};
    /// let error = Error::not_converged("equilibrium was not reached", "allow more iterations");
    /// assert_eq!(error.kind(), ErrorKind::NotConverged);
    /// ```
    pub fn not_converged(problem: impl Into<String>, remedy: impl Into<Wording>) -> Self {
        Error::failure(ErrorKind::NotConverged, problem, remedy)
    }

    /// Something that moves and that nothing holds, or that gains energy where it moves.
    ///
    /// ```
    /// use anisobond::{Error, ErrorKind};
    /// let error = Error::mechanism("nothing holds 2 spheres", "give a larger contact radius");
    /// assert_eq!(error.kind(), ErrorKind::Mechanism);
    /// ```
    pub fn mechanism(problem: impl Into<String>, remedy: impl Into<Wording>) -> Self {
        Error::failure(ErrorKind::Mechanism, problem, remedy)
    }

    fn failure(kind: ErrorKind, problem: impl Into<String>, remedy: impl Into<Wording>) -> Self {
        Error::Failure { kind, place: String::new(), problem: problem.into(), remedy: remedy.into() }
    }

    /// What the error is, for programs.
    ///
    /// ```
    /// use anisobond::{Error, ErrorKind};
    /// let error = anisobond::lattice::Packing::new(None, vec![], vec![]).unwrap_err();
    /// assert_eq!(error.kind(), ErrorKind::Input);
    /// assert_eq!(error.kind().name(), "input");
    /// ```
    pub fn kind(&self) -> ErrorKind {
        match self {
            Error::Failure { kind, .. } => *kind,
            Error::File { .. } => ErrorKind::File,
            Error::Interrupted { .. } => ErrorKind::Interrupted,
        }
    }

    /// A failed file operation.
    pub fn file(action: &'static str, path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Error::File { path: path.as_ref().to_path_buf(), action, source }
    }

    /// The sentence, the options that it names spelled as they are where it is read.
    ///
    /// ```
    /// use anisobond::{Error, Wording};
    /// let error = Error::input("there is a run", Wording::from("go on with ").choice("resume", ""));
    /// assert_eq!(error.to_string(), "there is a run; go on with \"resume\"");
    /// assert_eq!(error.spelled(&|choice| format!("--{}", choice.name)), "there is a run; go on with --resume");
    /// ```
    pub fn spelled(&self, spell: &dyn Fn(&Choice) -> String) -> String {
        match self {
            Error::Failure { place, problem, remedy, .. } => {
                let (remedy, place) =
                    (remedy.spelled(spell), if place.is_empty() { "" } else { &format!("{place}: ") });
                if remedy.is_empty() { format!("{place}{problem}") } else { format!("{place}{problem}; {remedy}") }
            }
            Error::File { path, action, source } => format!("cannot {action} {}: {source}", path.display()),
            Error::Interrupted { message } => format!("interrupted: {}", message.spelled(spell)),
        }
    }

    /// The same error, placed: an inner place ("line 3") is kept behind the outer one ("rock.toml").
    pub fn at(self, outer: impl fmt::Display) -> Self {
        match self {
            Error::Failure { kind, place, problem, remedy } => {
                let place = if place.is_empty() { outer.to_string() } else { format!("{outer}, {place}") };
                Error::Failure { kind, place, problem, remedy }
            }
            other => other,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.spelled(&Choice::to_string))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_stays_where_an_error_is_placed() {
        let placed = |error: Error| error.at("line 3").at("rock.toml");
        for (error, kind) in [
            (Error::input("x", "y"), ErrorKind::Input),
            (Error::diverged("x", "y"), ErrorKind::Diverged),
            (Error::not_converged("x", "y"), ErrorKind::NotConverged),
            (Error::mechanism("x", "y"), ErrorKind::Mechanism),
        ] {
            assert_eq!(error.kind(), kind);
            let error = placed(error);
            assert_eq!((error.kind(), error.to_string().as_str()), (kind, "rock.toml, line 3: x; y"));
        }
        let missing = || std::io::Error::from(std::io::ErrorKind::NotFound);
        assert_eq!(placed(Error::file("read", "a", missing())).kind(), ErrorKind::File);
        assert_eq!(placed(Error::Interrupted { message: "now".into() }).kind(), ErrorKind::Interrupted);
    }
}
