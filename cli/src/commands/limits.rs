//! Resource limits of the process, reported as errors instead of a silent death by a signal.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use descry_agent::exit::Exit;
use signal_hook::consts::{SIGABRT, SIGXFSZ};
use signal_hook::flag;

/// Turns the file-size limit into an error of the write, and makes an exhausted memory or stack exit with
/// [`Exit::OutOfTime`], after the runtime's message on standard error.
pub fn heed_limits() {
    let always = || Arc::new(AtomicBool::new(true));
    let heard = flag::register(SIGXFSZ, always()).and_then(|_| {
        flag::register_conditional_shutdown(SIGABRT, i32::from(Exit::OutOfTime as u8), always())
    });
    if let Err(e) = heard {
        tracing::warn!("limits of the system end the program without a word: {e}");
    }
}
