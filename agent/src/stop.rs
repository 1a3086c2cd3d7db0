//! Stop signal, set once by a listener (signal handler, button) and observed by everything that
//! runs.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use descry_robots::CancellationToken;

/// Stop request with its signal; clones share one state.
#[derive(Debug, Clone, Default)]
pub struct Stop {
    token: CancellationToken,
    signal: Arc<AtomicU8>,
}

impl Stop {
    /// Asks to stop, by a signal's number.
    pub fn ask(&self, signal: u8) {
        self.signal.store(signal, Ordering::Relaxed);
        self.token.cancel();
    }

    /// True after the request.
    pub fn is_asked(&self) -> bool {
        self.token.is_cancelled()
    }

    /// Signal of the stop request; 2 (Ctrl-C) before any.
    pub fn signal(&self) -> u8 {
        match self.signal.load(Ordering::Relaxed) {
            0 => 2,
            signal => signal,
        }
    }

    /// Token on which skills and bodies wait.
    pub fn token(&self) -> &CancellationToken {
        &self.token
    }
}
