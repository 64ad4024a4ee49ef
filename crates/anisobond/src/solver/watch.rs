//! Long work seen from outside: where it is, how far it has come, and the wish that it stop.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::{Error, Result};

/// Sees a solve after each of its iterations, with how many are done and the relative residual, and says whether to go on.
/// Before the first it is asked with 0. Nothing of this changes a result.
pub type Look<'a> = &'a dyn Fn(usize, f64) -> bool;

/// Shared by long work and whoever waits for it, in an [`Arc`]. The work counts its iterations here and says where it is;
/// told to stop, it ends within an iteration and returns [`Error::Interrupted`]. Nothing of this changes a result.
#[derive(Debug, Default)]
pub struct Watch {
    stop: Arc<AtomicBool>,
    iterations: AtomicU64,
    /// The most iterations the work may do.
    most: Option<u64>,
    stage: Mutex<String>,
}

impl Watch {
    /// A watch that is told to stop by a flag, too, which it may share with other work.
    pub fn stopped_by(flag: Arc<AtomicBool>) -> Arc<Watch> {
        Arc::new(Watch { stop: flag, ..Watch::default() })
    }

    /// A watch that tells the work to stop after so many iterations or steps, on all threads together.
    pub fn stopped_after(iterations: u64) -> Arc<Watch> {
        Arc::new(Watch { most: Some(iterations), ..Watch::default() })
    }

    /// Tell the work to stop.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Whether the work was told to stop.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Iterations and steps done so far, on all threads and in all that the watch was given to.
    pub fn iterations(&self) -> u64 {
        self.iterations.load(Ordering::Relaxed)
    }

    /// Where the work is, in a few words ("correction 3, error 0.20 %"); empty where there is nothing to tell apart.
    pub fn stage(&self) -> String {
        self.stage.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Say where the work is.
    pub fn enter(&self, stage: impl Into<String>) {
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = stage.into();
    }

    /// Count one iteration, or step, that is done.
    pub fn count(&self) {
        let done = self.iterations.fetch_add(1, Ordering::Relaxed) + 1;
        if self.most.is_some_and(|most| done >= most) {
            self.stop();
        }
    }

    /// Sees a solve: counts its iterations, and ends it when told to stop.
    pub fn look(&self) -> impl Fn(usize, f64) -> bool + '_ {
        |iterations, _| {
            if iterations > 0 {
                self.count();
            }
            !self.stopped()
        }
    }

    /// Go on, unless told to stop.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if the work was told to stop, which names what is unfinished and says where it was.
    pub fn check(&self, unfinished: &str) -> Result<()> {
        if !self.stopped() {
            return Ok(());
        }
        let (iterations, stage) = (self.iterations(), self.stage());
        let place = if stage.is_empty() { stage } else { format!(" ({stage})") };
        let message = format!("{unfinished} was not finished{place}; {iterations} iterations were done");
        Err(Error::Interrupted { message: message.into() })
    }
}
