//! Stop signal, given once by a signal handler or button and checked by everything that runs.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use descry_robots::CancellationToken;

/// Stop request with the number of its signal; clones share one state.
#[derive(Debug, Clone, Default)]
pub struct Stop {
    token: CancellationToken,
    signal: Arc<AtomicU8>,
}

impl Stop {
    /// Requests a stop with a signal's number.
    pub fn ask(&self, signal: u8) {
        self.signal.store(signal, Ordering::Relaxed);
        self.token.cancel();
    }

    /// True once a stop was requested.
    pub fn is_asked(&self) -> bool {
        self.token.is_cancelled()
    }

    /// Number of the signal that requested the stop; 2 (Ctrl-C) before any.
    pub fn signal(&self) -> u8 {
        match self.signal.load(Ordering::Relaxed) {
            0 => 2,
            signal => signal,
        }
    }

    /// Token that is cancelled by the request; skills and bodies wait on it.
    pub fn token(&self) -> &CancellationToken {
        &self.token
    }
}
