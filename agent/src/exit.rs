//! Exit codes, on which scripts depend, and the conversion of errors to text.

use std::process::ExitCode;

use descry_domains::error::WorldError;

/// Exit of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// Success: achieved, plan found, valid, no findings.
    Done = 0,
    /// Truthful negative: not found after every useful view, plan invalid, findings.
    No = 1,
    /// Bad input or usage.
    BadInput = 2,
    /// Proven unsolvable.
    Unsolvable = 3,
    /// Out of time or memory.
    OutOfTime = 4,
    /// The robot or a store failed for good.
    Broken = 5,
    /// Terminal is gone.
    HungUp = 129,
    /// Stopped by Ctrl-C.
    Interrupted = 130,
    /// Terminated by a signal.
    Terminated = 143,
    /// A bug of descry.
    Bug = 70,
}

impl Exit {
    /// Exit of a command that a signal stopped.
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

/// Error of a command, ready to be shown.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    /// Unusable input; the text points at the place and suggests a remedy.
    #[error("{0}")]
    BadInput(String),
    /// The robot or a store failed for good.
    #[error("{0}")]
    Broken(String),
    /// The run was stopped; the text tells how to resume it.
    #[error("{said}")]
    Stopped {
        /// Message about kept results, and how to resume.
        said: String,
        /// Signal that stopped the run.
        signal: u8,
    },
    /// Internal error of descry.
    #[error("{0}\n  this is a bug of descry; please report it with the command and its input")]
    Bug(String),
}

impl CommandError {
    /// Error of unusable input.
    pub fn bad_input(error: impl std::fmt::Display) -> Self {
        Self::BadInput(error.to_string())
    }

    /// Error of a robot or store that failed for good.
    pub fn broken(error: impl std::fmt::Display) -> Self {
        Self::Broken(error.to_string())
    }

    /// Exit code for this error.
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
