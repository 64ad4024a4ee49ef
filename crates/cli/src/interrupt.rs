//! Ctrl-C, and a request to terminate, during long work.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

static STOP: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// A flag that Ctrl-C (or SIGTERM) sets; a second one ends the program at once, whatever it is doing. Where no handler can be set Ctrl-C simply ends the
/// program, and what was finished is kept all the same.
pub fn flag() -> &'static Arc<AtomicBool> {
    let _ = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    &STOP
}
