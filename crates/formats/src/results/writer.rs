//! Files written in the background, while the next steps are computed.

use std::path::PathBuf;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

use anisobond::{Error, Result};

/// A piece of work for the writer: it makes and writes files, and says what failed.
type Work = Box<dyn FnOnce() -> Result<()> + Send>;

/// A thread that writes; at most two pieces of work wait, so that memory stays bounded.
pub struct BackgroundWriter {
    queue: Option<SyncSender<Work>>,
    thread: Option<JoinHandle<Result<()>>>,
}

impl BackgroundWriter {
    /// Start the thread.
    ///
    /// # Errors
    /// A system that gives no more threads.
    pub fn start() -> Result<Self> {
        let (queue, work) = sync_channel::<Work>(2);
        let thread = std::thread::Builder::new()
            .name("writer".into())
            .spawn(move || work.into_iter().try_for_each(|piece| piece()))
            .map_err(|e| Error::file("start a thread for", PathBuf::from("the results"), e))?;
        Ok(BackgroundWriter { queue: Some(queue), thread: Some(thread) })
    }

    /// Hand over a piece of work; waits while two are unfinished.
    ///
    /// # Errors
    /// What an earlier piece failed with.
    pub fn submit(&mut self, work: impl FnOnce() -> Result<()> + Send + 'static) -> Result<()> {
        match &self.queue {
            Some(queue) if queue.send(Box::new(work)).is_ok() => Ok(()),
            _ => self.finish(),
        }
    }

    /// Wait until all that was handed over is written.
    ///
    /// # Errors
    /// What a piece failed with.
    pub fn drain(&mut self) -> Result<()> {
        self.finish()?;
        *self = BackgroundWriter::start()?;
        Ok(())
    }

    /// Wait until all is written, and end.
    ///
    /// # Errors
    /// What a piece failed with.
    pub fn finish(&mut self) -> Result<()> {
        self.queue = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(result)) => result,
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            None => Ok(()),
        }
    }
}

impl Drop for BackgroundWriter {
    fn drop(&mut self) {
        self.queue = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn everything_is_done_before_finish_returns() {
        let done = Arc::new(AtomicUsize::new(0));
        let mut writer = BackgroundWriter::start().unwrap();
        for _ in 0..20 {
            let done = Arc::clone(&done);
            writer
                .submit(move || {
                    done.fetch_add(1, Ordering::SeqCst);
                    Ok(())
                })
                .unwrap();
        }
        writer.finish().unwrap();
        assert_eq!(done.load(Ordering::SeqCst), 20);
    }

    #[test]
    fn a_failure_comes_back() {
        let mut writer = BackgroundWriter::start().unwrap();
        writer.submit(|| Err(Error::input("the disk is full", "make room"))).unwrap();
        let later = (0..10).find_map(|_| {
            std::thread::sleep(std::time::Duration::from_millis(5));
            writer.submit(|| Ok(())).err()
        });
        let error = later.or_else(|| writer.finish().err());
        assert!(error.unwrap().to_string().contains("disk is full"));
    }
}
