//! Many independent jobs over the cores, with results handed out as they come and a way to stop.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::Result;

/// Run `job` for each of `pending`, in parallel, and hand every result to `each` (one call at a time, in the order of
/// completion). When `stop` turns true no further job is begun; those under way finish and are handed out. Returns
/// whether all jobs were done.
///
/// # Errors
/// The first error of `each`; no further job is begun after it.
pub fn run<T: Send>(
    pending: &[usize],
    stop: &AtomicBool,
    job: impl Fn(usize) -> T + Sync,
    each: impl FnMut(usize, T) -> Result<()> + Send,
) -> Result<bool> {
    let each = Mutex::new(each);
    pending.par_iter().try_for_each(|&index| {
        if stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        let result = job(index);
        // A poisoned lock means that `each` panicked on another thread; its panic is already on its way up.
        let mut each = each.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        each(index, result)
    })?;
    Ok(!stop.load(Ordering::Relaxed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_job_once_and_stop_is_heeded() {
        let pending: Vec<usize> = (0..1000).collect();
        let stop = AtomicBool::new(false);
        let mut seen = vec![0; 1000];
        let each = |i: usize, square: usize| {
            assert_eq!(square, i * i);
            seen[i] += 1;
            Ok(())
        };
        assert!(run(&pending, &stop, |i| i * i, each).unwrap());
        assert!(seen.iter().all(|&n| n == 1));

        let mut done = 0;
        let each = |_, ()| {
            done += 1;
            if done == 10 {
                stop.store(true, Ordering::Relaxed);
            }
            Ok(())
        };
        assert!(!run(&pending, &stop, |_| (), each).unwrap());
        assert!((10..100).contains(&done), "{done}");
    }

    #[test]
    fn an_error_of_the_receiver_ends_the_run() {
        let stop = AtomicBool::new(false);
        let each = |_, ()| Err(crate::Error::input("full", ""));
        assert!(run(&[1, 2, 3], &stop, |_| (), each).is_err());
    }
}
