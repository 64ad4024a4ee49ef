//! A line on stderr while element tests and corrections go on, and Ctrl-C that ends them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anisobond::Result;
use anisobond::solver::Watch;
use indicatif::ProgressBar;

use crate::interrupt;

/// How often the line is written.
const PACE: Duration = Duration::from_millis(100);

/// Work under a watch that Ctrl-C stops; what the watch tells is shown where stderr is a terminal.
pub fn watched<T: Send>(work: impl FnOnce(&Arc<Watch>) -> Result<T> + Send) -> Result<T> {
    let watch = Watch::stopped_by(interrupt::flag().clone());
    let (line, over) = (ProgressBar::new_spinner(), AtomicBool::new(false));
    let result = std::thread::scope(|scope| {
        let show = scope.spawn(|| {
            while !over.load(Ordering::Relaxed) {
                std::thread::park_timeout(PACE);
                let (stage, iterations) = (watch.stage(), watch.iterations());
                let stage = if stage.is_empty() { "element test".into() } else { stage };
                line.set_message(format!("{stage}: {iterations} iterations"));
                line.tick();
            }
        });
        let result = work(&watch);
        over.store(true, Ordering::Relaxed);
        show.thread().unpark();
        result
    });
    line.finish_and_clear();
    result
}

/// Work that cannot be stopped; what it does is said after a second, where stderr is a terminal.
pub fn said<T>(what: &'static str, work: impl FnOnce() -> Result<T>) -> Result<T> {
    let (line, over) = (ProgressBar::new_spinner(), AtomicBool::new(false));
    let result = std::thread::scope(|scope| {
        let show = scope.spawn(|| {
            std::thread::park_timeout(Duration::from_secs(1));
            while !over.load(Ordering::Relaxed) {
                line.set_message(what);
                line.tick();
                std::thread::park_timeout(PACE);
            }
        });
        let result = work();
        over.store(true, Ordering::Relaxed);
        show.thread().unpark();
        result
    });
    line.finish_and_clear();
    result
}
