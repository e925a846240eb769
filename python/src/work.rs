//! Work without the interpreter's lock: Ctrl-C stops it, and progress is told on the thread that waits for it.

use crate::errors::OrRaise;
use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};
use vastlight::film::{Accumulator, PngOptions, encode_png};
use vastlight::{Control, Error, ErrorClass, Progress, Snapshot};

/// How often it is looked whether somebody wants the work to end, or to hear of it.
const LOOK: Duration = Duration::from_millis(50);

/// Who is told how far a render is.
#[derive(Debug)]
pub(crate) struct Listener {
    /// Called with samples, samples in all, samples a pixel, seconds, seconds to go or none, and a PNG or none.
    pub(crate) call: Py<PyAny>,
    /// Time between two pictures; none for no pictures.
    pub(crate) preview: Option<Duration>,
}

/// What is seen of work from outside.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    cancel: AtomicBool,
    latest: Mutex<Option<Progress>>,
    wanted: AtomicBool,
    picture: Mutex<Option<Vec<u8>>>,
}

impl Watch {
    /// The flag that ends it.
    pub(crate) fn cancel(&self) -> &AtomicBool {
        &self.cancel
    }

    /// Refuses to go on, if somebody wants the work to end.
    pub(crate) fn check(&self, what: &str) -> Result<(), Error> {
        if self.cancel.load(Ordering::Relaxed) {
            return Err(Error::new(ErrorClass::Interrupted, what, "", ""));
        }
        Ok(())
    }

    /// Runs a render that is watched.
    pub(crate) fn control<T>(&self, render: impl FnOnce(&Control<'_>) -> T) -> T {
        let progress = |p: &Progress| *lock(&self.latest) = Some(*p);
        let take = |sums: &Accumulator| {
            *lock(&self.picture) = encode_png(&sums.develop(), &PngOptions::default()).ok();
        };
        let snapshot = Some(Snapshot { wanted: &self.wanted, take: &take });
        render(&Control { cancel: &self.cancel, progress: &progress, snapshot })
    }

    /// Tells the listener what is new.
    fn tell(&self, py: Python<'_>, listener: &Listener, asked: &mut Instant) -> PyResult<()> {
        if listener.preview.is_some_and(|every| asked.elapsed() >= every) {
            *asked = Instant::now();
            self.wanted.store(true, Ordering::Relaxed);
        }
        let Some(p) = lock(&self.latest).take() else { return Ok(()) };
        let picture = lock(&self.picture).take();
        let seconds = |time: Duration| time.as_secs_f64();
        let remaining = p.remaining.map(seconds);
        let said = (p.samples, p.samples_total, p.spp, seconds(p.elapsed), remaining, picture);
        listener.call.call1(py, said).map(drop)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does work on a thread of its own.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    listener: Option<&Listener>,
    work: impl FnOnce(&Watch) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let watch = Watch::default();
    let done = py.detach(|| {
        thread::scope(|scope| {
            let (sender, receiver) = channel();
            let worker = scope.spawn(|| {
                let _ = sender.send(work(&watch));
                drop(sender);
            });
            let (mut told, mut asked) = (Ok(()), Instant::now());
            loop {
                match receiver.recv_timeout(LOOK) {
                    Ok(done) => return told.map(|()| done),
                    Err(RecvTimeoutError::Disconnected) => break,
                    Err(RecvTimeoutError::Timeout) if told.is_ok() => {
                        told = Python::attach(|py| {
                            py.check_signals()?;
                            listener.map_or(Ok(()), |listener| watch.tell(py, listener, &mut asked))
                        });
                        watch.cancel.store(told.is_err(), Ordering::Relaxed);
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                }
            }
            // It ended without an answer.
            match worker.join() {
                Err(panic) => resume_unwind(panic),
                Ok(()) => told.map(|()| Err(Error::usage("the work has no result", "", ""))),
            }
        })
    });
    let done = done?.or_raise(py)?;
    // What ended before the first look may have been asked to end all the same.
    py.check_signals()?;
    Ok(done)
}
