//! Exit codes of commands, on which scripts depend, and errors as text.

use std::process::ExitCode;

use descry_domains::error::WorldError;

/// Exit code of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// Success: achieved, plan found, valid, no findings.
    Done = 0,
    /// Valid negative result: not found after every useful view, plan invalid, or findings.
    No = 1,
    /// Bad input or usage.
    BadInput = 2,
    /// Proven unsolvable.
    Unsolvable = 3,
    /// Out of time or memory.
    OutOfTime = 4,
    /// The robot or a store failed for good.
    Broken = 5,
    /// The terminal is gone (SIGHUP).
    HungUp = 129,
    /// Stopped by Ctrl-C (SIGINT).
    Interrupted = 130,
    /// Stopped by SIGTERM.
    Terminated = 143,
    /// An error in descry itself.
    Bug = 70,
}

impl Exit {
    /// Exit code of a command that a signal stopped.
    pub fn of_signal(signal: u8) -> Self {
        match signal {
            1 => Self::HungUp,
            15 => Self::Terminated,
            _ => Self::Interrupted,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        ExitCode::from(exit as u8)
    }
}

/// Error of a command, with its text for the user.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    /// Unusable input; the text points at the place and suggests a remedy.
    #[error("{0}")]
    BadInput(String),
    /// The robot or a store failed for good.
    #[error("{0}")]
    Broken(String),
    /// The run was stopped.
    #[error("{said}")]
    Stopped {
        /// Text that says where results are kept and how to resume.
        said: String,
        /// Number of the signal that stopped the run.
        signal: u8,
    },
    /// Internal error of descry.
    #[error("{0}\n  this is a bug of descry; please report it with the command and its input")]
    Bug(String),
}

impl CommandError {
    /// Wraps an error as unusable input.
    pub fn bad_input(error: impl std::fmt::Display) -> Self {
        Self::BadInput(error.to_string())
    }

    /// Wraps an error as a final failure of the robot or a store.
    pub fn broken(error: impl std::fmt::Display) -> Self {
        Self::Broken(error.to_string())
    }

    /// Exit code of the error.
    pub fn exit(&self) -> Exit {
        match self {
            Self::BadInput(_) => Exit::BadInput,
            Self::Broken(_) => Exit::Broken,
            Self::Stopped { signal, .. } => Exit::of_signal(*signal),
            Self::Bug(_) => Exit::Bug,
        }
    }
}

impl From<WorldError> for CommandError {
    fn from(error: WorldError) -> Self {
        match error {
            WorldError::Store(error) => Self::broken(error),
            WorldError::Domain(text) => Self::BadInput(text),
            WorldError::Bug(text) => Self::Bug(text),
        }
    }
}
