//! Work without the interpreter's lock: errors as exceptions, progress, and Ctrl-C while it lasts.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anisobond::solver::Watch;
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
    let (text, kind) = (error.spelled(&keyword), error.kind().name());
    match error {
        anisobond::Error::File { path, source, .. } => {
            let missing = source.kind() == std::io::ErrorKind::NotFound;
            let about = (text, source.raw_os_error(), path);
            if missing { exceptions::MissingFileError::new_err(about) } else { exceptions::FileError::new_err(about) }
        }
        anisobond::Error::Interrupted { .. } => exceptions::Interrupted::new_err(text),
        _ => exceptions::Error::new_err((text, kind)),
    }
}

/// An option as it is given in Python.
fn keyword(choice: &anisobond::Choice) -> String {
    let (name, value) = (choice.name, choice.value.as_str());
    match value {
        "" => format!("{name}=True"),
        number if number.parse::<f64>().is_ok() => format!("{name}={number}"),
        text => format!("{name}={text:?}"),
    }
}

/// Wrong input found on this side.
pub fn wrong(problem: impl Into<String>, remedy: impl Into<anisobond::Wording>) -> PyErr {
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
#[derive(Clone, PartialEq)]
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
    work: impl FnOnce(&Arc<AtomicBool>, &(dyn Fn(Beat) + Sync)) -> anisobond::Result<T> + Send,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let latest = Mutex::new(None);
    let place = || latest.lock().unwrap_or_else(PoisonError::into_inner);
    let looks = Looks { far: &|| place().take(), stop: &|| stop.store(true, Ordering::Relaxed) };
    attended(py, progress, title, &looks, || work(&stop, &|beat| *place() = Some(beat)))
}

/// [`watched`], of work that counts its iterations and says where it is on a [`Watch`].
pub fn iterated<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    title: &str,
    work: impl FnOnce(&Arc<Watch>) -> anisobond::Result<T> + Send,
) -> PyResult<T> {
    let watch = Arc::new(Watch::default());
    let far = || Some(Beat { steps: [watch.iterations(), 0], message: watch.stage() });
    let looks = Looks { far: &far, stop: &|| watch.stop() };
    attended(py, progress, title, &looks, || work(&watch))
}

/// What the caller's thread sees of work on another.
struct Looks<'a> {
    /// How far it is; `None` where it has not said anything new.
    far: &'a (dyn Fn() -> Option<Beat> + Sync),
    /// Tells it to stop.
    stop: &'a (dyn Fn() + Sync),
}

/// Work on a thread of its own; this one tells its progress, and tells it to stop on Ctrl-C or where telling fails.
fn attended<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    title: &str,
    looks: &Looks<'_>,
    work: impl FnOnce() -> anisobond::Result<T> + Send,
) -> PyResult<T> {
    let reporter = match progress {
        None => None,
        Some(given) => {
            let made = py.import("anisobond._progress")?.getattr("reporter")?.call1((given, title))?;
            (!made.is_none()).then(|| made.unbind())
        }
    };
    let told_to = reporter.as_ref();
    let tell = |beat: Option<&Beat>| -> PyResult<()> {
        Python::attach(|py| {
            py.check_signals()?;
            match (told_to, beat) {
                (Some(r), Some(beat)) => r.call1(py, (beat.steps[0], beat.steps[1], &beat.message)).map(|_| ()),
                _ => Ok(()),
            }
        })
    };
    let (outcome, failure) = py.detach(move || {
        std::thread::scope(|scope| {
            // Nothing is sent: the channel ends with the work.
            let (send, ends) = mpsc::channel::<()>();
            let worker = scope.spawn(move || {
                let _ends_with_it = send;
                work()
            });
            let mut failure: Option<PyErr> = None;
            let mut told: Option<Beat> = None;
            loop {
                let ended = ends.recv_timeout(WATCH) == Err(RecvTimeoutError::Disconnected);
                if failure.is_none() {
                    let beat = (looks.far)().filter(|beat| told.as_ref() != Some(beat));
                    if let Err(error) = tell(beat.as_ref()) {
                        failure = Some(error);
                        (looks.stop)();
                    }
                    told = beat.or(told);
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

/// What to look at, as Python warnings.
pub fn warned(py: Python<'_>, all: &[String]) -> PyResult<()> {
    let warnings = py.import("warnings")?;
    all.iter().try_for_each(|warning| warnings.call_method1("warn", (warning,)).map(drop))
}
