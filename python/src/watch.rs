//! Cancellation of long work by Ctrl-C, a time limit, or a stop function.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// Minimum interval between calls into Python, which take the interpreter's lock, milliseconds.
const ASKED_EVERY_MS: u64 = 20;

/// Supervision of work that runs without the interpreter's lock: Ctrl-C, a time limit, and a stop function.
pub struct Watch {
    started: Instant,
    limit: Option<Duration>,
    stop: Option<Py<PyAny>>,
    asked_ms: AtomicU64,
    over: AtomicBool,
    raised: Mutex<Option<PyErr>>,
}

impl Watch {
    /// Watch that ends the work after `limit`, or once `stop()` returns true.
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

    /// True if the work must end now. Quick enough to be called often, from any thread that does not hold the
    /// interpreter's lock.
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

    /// Ends the work with an exception, which [`Watch::end`] returns.
    pub fn raise(&self, error: PyErr) {
        self.over.store(true, Ordering::Relaxed);
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }

    /// True if the work was ended early.
    ///
    /// # Errors
    /// The exception that ended the work.
    pub fn end(&self, py: Python<'_>) -> PyResult<bool> {
        py.check_signals()?;
        match self.raised.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(error) => Err(error),
            None => Ok(self.over.load(Ordering::Relaxed)),
        }
    }
}
