//! Stop signal. A listener (a signal handler, a button) asks once; everything that runs sees it soon.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use descry_robots::CancellationToken;

/// Request to stop a run, with its signal. Clones share one state.
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

    /// The signal by which it was asked for; 2, that of Ctrl-C, before.
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
