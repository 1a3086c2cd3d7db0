//! Errors of files, with the place and a mend.

/// Place of an error in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of text, counted from 1.
    Line(usize),
    /// An offset in bytes from the beginning.
    Byte(usize),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Line(line) => write!(f, "line {line}"),
            Place::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// Error of an unreadable file: place, expected and found content, and remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: expected {expected}, found {found}; {mend}")]
pub struct FileError {
    /// Place of the error.
    pub place: Place,
    /// The expected content.
    pub expected: String,
    /// The content that was found.
    pub found: String,
    /// Remedy.
    pub mend: String,
}

impl FileError {
    pub(super) fn new(
        place: Place,
        expected: impl Into<String>,
        found: impl Into<String>,
        mend: impl Into<String>,
    ) -> Self {
        FileError { place, expected: expected.into(), found: found.into(), mend: mend.into() }
    }
}
