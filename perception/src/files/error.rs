//! Errors of files, with place and remedy.

/// Place of an error in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of text, counted from 1.
    Line(usize),
    /// Offset from the beginning of the file, bytes.
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

/// Reason why a file cannot be read: place, expected and found content, and remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: expected {expected}, found {found}; {mend}")]
pub struct FileError {
    /// Place of the error in the file.
    pub place: Place,
    /// Content that was expected there.
    pub expected: String,
    /// Content that was found there.
    pub found: String,
    /// Suggested remedy.
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
