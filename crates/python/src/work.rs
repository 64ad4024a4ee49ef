//! Work without the interpreter's lock: errors as exceptions, progress, and Ctrl-C while it lasts.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

/// The package's own exceptions.
mod exceptions {
    pyo3::import_exception!(anisobond._errors, Error);
    pyo3::import_exception!(anisobond._errors, FileError);
    pyo3::import_exception!(anisobond._errors, Interrupted);
    pyo3::import_exception!(anisobond._errors, MissingFileError);
    pyo3::import_exception!(anisobond._errors, NotExact);
}
pub use exceptions::NotExact;

/// How often Ctrl-C is looked for, and progress is told at most.
const WATCH: Duration = Duration::from_millis(50);

/// A library error as the exception of its kind, with the text of the command line.
pub fn raised(error: anisobond::Error) -> PyErr {
    let text = error.to_string();
    match error {
        anisobond::Error::File { path, source, .. } => {
            let missing = source.kind() == std::io::ErrorKind::NotFound;
            let about = (text, source.raw_os_error(), path);
            if missing { exceptions::MissingFileError::new_err(about) } else { exceptions::FileError::new_err(about) }
        }
        anisobond::Error::Interrupted { .. } => exceptions::Interrupted::new_err(text),
        _ => exceptions::Error::new_err(text),
    }
}

/// Wrong input found on this side.
pub fn wrong(problem: impl Into<String>, remedy: impl Into<String>) -> PyErr {
    raised(anisobond::Error::input(problem, remedy))
}

/// `?` for library results.
pub trait OrRaise<T> {
    /// The value, or the exception.
    fn or_raise(self) -> PyResult<T>;
}

impl<T> OrRaise<T> for anisobond::Result<T> {
    fn or_raise(self) -> PyResult<T> {
        self.map_err(raised)
    }
}

/// How far work is.
#[derive(Clone)]
pub struct Beat {
    /// Steps done, and all (0: unknown).
    pub steps: [u64; 2],
    /// A few words.
    pub message: String,
}

/// Work that owns what it needs and cannot be stopped. Ctrl-C returns at once; the work then ends unseen.
pub fn background<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> anisobond::Result<T> + Send + 'static,
) -> PyResult<T> {
    let (send, receive) = mpsc::channel();
    let worker = std::thread::spawn(move || {
        let _ = send.send(work());
    });
    py.detach(move || {
        loop {
            match receive.recv_timeout(WATCH) {
                Ok(result) => return result.or_raise(),
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        // The work ended without a result: it panicked.
        match worker.join() {
            Err(panic) => std::panic::resume_unwind(panic),
            Ok(()) => Err(PyKeyboardInterrupt::new_err("the work ended without a result")),
        }
    })
}

/// Work that tells how far it is and stops when it is told to. `progress` is what the caller gave (see `_progress.py`).
/// On Ctrl-C the work is told to stop; what it says of that is the exception's text.
pub fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    title: &str,
    work: impl FnOnce(&AtomicBool, &(dyn Fn(Beat) + Sync)) -> anisobond::Result<T> + Send,
) -> PyResult<T> {
    let reporter = match progress {
        None => None,
        Some(given) => {
            let made = py.import("anisobond._progress")?.getattr("reporter")?.call1((given, title))?;
            (!made.is_none()).then(|| made.unbind())
        }
    };
    let told_to = reporter.as_ref();
    let tell = |beat: &Beat| -> PyResult<()> {
        Python::attach(|py| {
            py.check_signals()?;
            match told_to {
                Some(r) => r.call1(py, (beat.steps[0], beat.steps[1], &beat.message)).map(|_| ()),
                None => Ok(()),
            }
        })
    };
    let stop = AtomicBool::new(false);
    let (send, receive) = mpsc::channel::<Beat>();
    let (outcome, failure) = py.detach(move || {
        std::thread::scope(|scope| {
            let stop = &stop;
            let worker = scope.spawn(move || {
                work(stop, &|beat| {
                    let _ = send.send(beat);
                })
            });
            let mut failure: Option<PyErr> = None;
            let mut latest: Option<Beat> = None;
            let mut told = Instant::now();
            loop {
                let ended = match receive.recv_timeout(WATCH) {
                    Ok(beat) => {
                        latest = Some(beat);
                        false
                    }
                    Err(RecvTimeoutError::Timeout) => false,
                    Err(RecvTimeoutError::Disconnected) => true,
                };
                if failure.is_none() && (ended || told.elapsed() >= WATCH) {
                    told = Instant::now();
                    let result = match latest.take() {
                        Some(beat) => tell(&beat),
                        None => Python::attach(|py| py.check_signals()),
                    };
                    if let Err(error) = result {
                        failure = Some(error);
                        stop.store(true, Ordering::Relaxed);
                    }
                }
                if ended {
                    let outcome = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
                    return (outcome, failure);
                }
            }
        })
    });
    if let Some(reporter) = reporter {
        reporter.call_method0(py, "close")?;
    }
    match (outcome, failure) {
        (outcome, None) => outcome.or_raise(),
        // Ctrl-C: what the work says of it tells more.
        (Err(error @ anisobond::Error::Interrupted { .. }), Some(f)) if f.is_instance_of::<PyKeyboardInterrupt>(py) => {
            Err(raised(error))
        }
        (_, Some(failure)) => Err(failure),
    }
}
