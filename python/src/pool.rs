//! Threads of a scene's own.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Mutex, PoisonError};
use vastlight::Error;

/// A pool that is made when it is needed, and again in a process that was forked.
#[derive(Debug)]
pub(crate) struct Pool {
    threads: Option<usize>,
    made: Mutex<Option<(u32, Arc<ThreadPool>)>>,
}

impl Pool {
    /// Of so many threads, or one for each processor.
    pub(crate) fn new(threads: Option<usize>) -> Self {
        Self { threads, made: Mutex::new(None) }
    }

    /// The pool, or one of `threads` threads for this time.
    pub(crate) fn get(&self, threads: Option<usize>) -> Result<Arc<ThreadPool>, Error> {
        if threads.is_some() && threads != self.threads {
            return build(threads).map(Arc::new);
        }
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        let process = std::process::id();
        match &*made {
            Some((of, pool)) if *of == process => Ok(Arc::clone(pool)),
            _ => {
                let pool = Arc::new(build(self.threads)?);
                // The threads of another process are not here to be ended.
                std::mem::forget(made.replace((process, Arc::clone(&pool))));
                Ok(pool)
            }
        }
    }
}

fn build(threads: Option<usize>) -> Result<ThreadPool, Error> {
    let pool = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
    pool.map_err(|error| Error::usage(error.to_string(), "threads", ""))
}
