//! One thread that works; of the questions that wait for it the newest counts.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};

/// A question and the way back to who asked it.
type Waiting<Q, A> = Mutex<Option<(Q, Sender<A>)>>;

/// The worker's door.
pub struct Worker<Q, A> {
    waiting: Waiting<Q, A>,
    asked: Condvar,
}

impl<Q: Send + 'static, A: Send + 'static> Worker<Q, A> {
    /// A thread that answers questions by `work`.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(work: impl Fn(Q) -> A + Send + 'static) -> std::io::Result<Arc<Self>> {
        let worker = Arc::new(Worker { waiting: Mutex::new(None), asked: Condvar::new() });
        let own = Arc::clone(&worker);
        std::thread::Builder::new().name("calibration".into()).spawn(move || {
            loop {
                let (question, back) = own.next();
                // Whatever happens to one question, the next is answered; who asked sees that there is no answer.
                if let Ok(answer) = catch_unwind(AssertUnwindSafe(|| work(question))) {
                    let _ = back.send(answer);
                }
            }
        })?;
        Ok(worker)
    }

    fn next(&self) -> (Q, Sender<A>) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            match waiting.take() {
                Some(next) => return next,
                None => waiting = self.asked.wait(waiting).unwrap_or_else(PoisonError::into_inner),
            }
        }
    }

    /// The answer to a question; `None` if a newer one came before the worker was free.
    pub fn ask(&self, question: Q) -> Option<A> {
        let (back, answer) = channel();
        *self.waiting.lock().unwrap_or_else(PoisonError::into_inner) = Some((question, back));
        self.asked.notify_one();
        answer.recv().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::sync_channel;

    #[test]
    fn of_questions_that_wait_the_newest_is_answered() {
        let (begun, has_begun) = channel();
        let (go, may_go) = sync_channel::<()>(0);
        let may_go = Mutex::new(may_go);
        let worker = Worker::start(move |n: u32| {
            let _ = begun.send(n);
            let _ = may_go.lock().unwrap().recv();
            10 * n
        })
        .unwrap();
        let ask = |n| {
            let worker = Arc::clone(&worker);
            std::thread::spawn(move || worker.ask(n))
        };
        let waits_for = |n| {
            while worker.waiting.lock().unwrap().as_ref().is_none_or(|(q, _)| *q != n) {
                std::thread::yield_now();
            }
        };
        let first = ask(1);
        assert_eq!(has_begun.recv().unwrap(), 1);
        let second = ask(2);
        waits_for(2);
        let third = ask(3);
        waits_for(3);
        assert_eq!(second.join().unwrap(), None);
        go.send(()).unwrap();
        assert_eq!(first.join().unwrap(), Some(10));
        go.send(()).unwrap();
        assert_eq!(third.join().unwrap(), Some(30));
    }

    #[test]
    fn a_question_that_breaks_does_not_end_the_worker() {
        let worker = Worker::start(|n: u32| if n == 0 { panic!("for the test") } else { n }).unwrap();
        assert_eq!((worker.ask(0), worker.ask(1)), (None, Some(1)));
    }
}
