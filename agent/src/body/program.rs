//! Program as a body; placeholders in its command line are filled in when it starts.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use descry_robots::program::{Limits, ProgramRobot};

use super::{Body, Told};
use crate::exit::CommandError;
use crate::shell;

/// Placeholder in a command line that stands for the seed.
pub const SEED: &str = "{seed}";
/// Placeholder in a command line that stands for the path of a file to which the program writes
/// ground truth.
pub const TRUTH: &str = "{truth}";
/// Placeholder in a command line that stands for the kinds of objects to leave out,
/// comma-separated, as one shell word.
pub const WITHOUT: &str = "{without}";

/// Path of a temporary file to which a program writes ground truth for reports; the file is removed
/// on drop.
pub struct TruthFile(PathBuf);

impl TruthFile {
    fn new() -> Self {
        static FILES: AtomicUsize = AtomicUsize::new(0);
        let number = FILES.fetch_add(1, Ordering::Relaxed);
        Self(std::env::temp_dir().join(format!("descry-truth-{}-{number}.json", std::process::id())))
    }

    /// Path of the file; the program creates it.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for TruthFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Starts a shell command line as a body, with [`SEED`], [`TRUTH`] and [`WITHOUT`] filled in.
///
/// # Errors
/// [`CommandError::Broken`] if the program does not complete the handshake.
pub fn open(command: &str, seed: u64, without: &[String]) -> Result<Body, CommandError> {
    let truth = command.contains(TRUTH).then(TruthFile::new);
    let file = truth.as_ref().map(|t| t.path().display().to_string()).unwrap_or_default();
    let command = command
        .replace(SEED, &seed.to_string())
        .replace(TRUTH, &shell::word(&file))
        .replace(WITHOUT, &shell::word(&without.join(",")));
    let robot = ProgramRobot::start(&command, Limits::default()).map_err(CommandError::broken)?;
    Ok(Body { truth: truth.map(Told::Program), ..Body::new(Arc::new(robot)) })
}

/// Connects to a body that is running already, at `HOST:PORT` or the path of a Unix socket.
///
/// # Errors
/// [`CommandError::Broken`] if nothing answers there, or the handshake fails.
pub fn connect(address: &str) -> Result<Body, CommandError> {
    ProgramRobot::connect(address, Limits::default())
        .map(|r| Body::new(Arc::new(r)))
        .map_err(CommandError::broken)
}
