//! Long work is watched: Ctrl-C, a time limit, and whoever wants it to stop.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// Python is asked no more often than this: it takes the interpreter's lock.
const ASKED_EVERY_MS: u64 = 20;

/// Watches over work that runs without the interpreter's lock.
pub struct Watch {
    started: Instant,
    limit: Option<Duration>,
    stop: Option<Py<PyAny>>,
    asked_ms: AtomicU64,
    over: AtomicBool,
    raised: Mutex<Option<PyErr>>,
}

impl Watch {
    /// Over after `limit`, or once `stop()` is true.
    pub fn new(limit: Option<Duration>, stop: Option<Py<PyAny>>) -> Self {
        Self {
            started: Instant::now(),
            limit,
            stop,
            asked_ms: AtomicU64::new(0),
            over: AtomicBool::new(false),
            raised: Mutex::new(None),
        }
    }

    /// Seconds since the work began.
    pub fn elapsed_s(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// Whether the work is to end now. Asked often, from any thread that does not hold the interpreter's lock.
    pub fn is_over(&self) -> bool {
        if self.over.load(Ordering::Relaxed) {
            return true;
        }
        let elapsed = self.started.elapsed();
        if self.limit.is_some_and(|limit| elapsed >= limit) {
            self.over.store(true, Ordering::Relaxed);
            return true;
        }
        let now_ms = elapsed.as_millis() as u64;
        let asked_ms = self.asked_ms.load(Ordering::Relaxed);
        if now_ms >= asked_ms + ASKED_EVERY_MS {
            self.asked_ms.store(now_ms, Ordering::Relaxed);
            Python::attach(|py| self.ask(py));
        }
        self.over.load(Ordering::Relaxed)
    }

    fn ask(&self, py: Python<'_>) {
        let wanted = || -> PyResult<bool> {
            py.check_signals()?;
            self.stop.as_ref().map_or(Ok(false), |stop| stop.call0(py)?.is_truthy(py))
        };
        match wanted() {
            Ok(false) => {}
            Ok(true) => self.over.store(true, Ordering::Relaxed),
            Err(error) => self.raise(error),
        }
    }

    /// Ends the work because of an exception, which [`Watch::end`] hands on.
    pub fn raise(&self, error: PyErr) {
        self.over.store(true, Ordering::Relaxed);
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }

    /// Whether the work was ended before its time.
    ///
    /// # Errors
    /// The exception that ended it.
    pub fn end(&self, py: Python<'_>) -> PyResult<bool> {
        py.check_signals()?;
        match self.raised.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(error) => Err(error),
            None => Ok(self.over.load(Ordering::Relaxed)),
        }
    }
}
