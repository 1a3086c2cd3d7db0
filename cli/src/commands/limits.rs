//! Limits that the system sets to a process, heard as errors instead of as a death without a word.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use descry_agent::exit::Exit;
use signal_hook::consts::{SIGABRT, SIGXFSZ};
use signal_hook::flag;

/// Makes a file that may grow no longer an error of the write, and ends with [`Exit::OutOfTime`] where memory or a stack is used up: the
/// runtime has said so on standard error by then.
pub fn heed_limits() {
    let always = || Arc::new(AtomicBool::new(true));
    let heard = flag::register(SIGXFSZ, always()).and_then(|_| {
        flag::register_conditional_shutdown(SIGABRT, i32::from(Exit::OutOfTime as u8), always())
    });
    if let Err(e) = heard {
        tracing::warn!("limits of the system end the program without a word: {e}");
    }
}
