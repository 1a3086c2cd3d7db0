//! Errors in files that people write: the place, the expectation, and a fix.

use serde::de::DeserializeOwned;
use std::fs::{File, FileType};
use std::io::{Error, ErrorKind, Read};
use std::ops::Range;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use toml::de::{DeTable, DeValue};

/// Error in a file, displayed with the affected line and a mark below the place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.drawn())]
pub struct InputError {
    /// File or folder, as given.
    pub file: String,
    /// Line, from 1; 0 for an error of the whole file.
    pub line: usize,
    /// Column in characters, from 1; 0 with `line` 0.
    pub column: usize,
    /// The line, clipped around the error.
    pub excerpt: String,
    /// Column of the error within the excerpt, in characters, from 1.
    caret: usize,
    /// Description of the error: what was found, and what was expected.
    pub problem: String,
    /// Suggested fix.
    pub mend: String,
}

impl InputError {
    /// Creates an error of the whole file.
    pub fn whole(file: impl Into<String>, problem: impl Into<String>, mend: impl Into<String>) -> Self {
        InputError {
            file: file.into(),
            line: 0,
            column: 0,
            excerpt: String::new(),
            caret: 0,
            problem: problem.into(),
            mend: mend.into(),
        }
    }

    /// Creates an error at a byte offset of the text.
    pub fn at(
        file: &str,
        text: &str,
        byte: usize,
        problem: impl Into<String>,
        mend: impl Into<String>,
    ) -> Self {
        let mut end = byte.min(text.len());
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &text[..end];
        let line = before.matches('\n').count() + 1;
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        let column = before[line_start..].chars().count() + 1;
        let hidden = column.saturating_sub(EXCERPT / 2);
        let shown = text[line_start..].lines().next().unwrap_or("");
        let excerpt = clipped(shown.char_indices().nth(hidden).map_or("", |(at, _)| &shown[at..]));
        let problem = problem.into().lines().map(clipped).collect::<Vec<_>>().join("\n");
        let caret = column - hidden;
        InputError { file: file.into(), line, column, excerpt, caret, problem, mend: mend.into() }
    }

    fn drawn(&self) -> String {
        if self.line == 0 {
            return format!("{}: {}; {}", self.file, self.problem, self.mend);
        }
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        let caret = " ".repeat(self.caret.saturating_sub(1));
        format!(
            "{}:{}:{}: {}\n{margin} |\n{number} | {}\n{margin} | {caret}^ {}",
            self.file, self.line, self.column, self.problem, self.excerpt, self.mend
        )
    }
}

/// Maximum length of an excerpt, characters. From: chosen, twice the width of a terminal.
const EXCERPT: usize = 240;

/// Clips a line to `EXCERPT` characters, with `…` in place of the rest.
pub fn clipped(line: &str) -> String {
    match line.char_indices().nth(EXCERPT) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line.into(),
    }
}

/// Maximum size, bytes, of a text written by a person: a domain, a scene, settings. From: chosen.
pub const MOST_TEXT_BYTES: u64 = 16 << 20;

/// Reads a file of at most `most` bytes. Named pipes, devices and sockets are refused at once, without
/// waiting for data.
///
/// # Errors
/// The system's error, or the reason for the refusal.
pub fn read_bytes(path: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        let text = format!("it is {}, and a file was expected", kind_of(metadata.file_type()));
        return Err(Error::new(ErrorKind::InvalidInput, text));
    }
    let mut bytes = Vec::new();
    if metadata.len() <= most {
        File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    }
    if metadata.len() > most || bytes.len() as u64 > most {
        let text = format!("it has more than {} MB, and a smaller file was expected", most / 1_000_000);
        return Err(Error::new(ErrorKind::FileTooLarge, text));
    }
    Ok(bytes)
}

/// Reads a text file of at most [`MOST_TEXT_BYTES`].
///
/// # Errors
/// Those of [`read_bytes`], and an error if the content is not UTF-8.
pub fn read_text(path: &Path) -> std::io::Result<String> {
    String::from_utf8(read_bytes(path, MOST_TEXT_BYTES)?).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        Error::new(ErrorKind::InvalidData, format!("it is no text: byte {at} is not UTF-8"))
    })
}

/// Name for people of a file type other than a regular file.
pub fn kind_of(file_type: FileType) -> &'static str {
    match file_type {
        kind if kind.is_dir() => "a folder",
        kind if kind.is_fifo() => "a named pipe",
        kind if kind.is_socket() => "a socket",
        kind if kind.is_char_device() || kind.is_block_device() => "a device",
        _ => "no file",
    }
}

/// One step of a path into a TOML document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// Into a table, by key.
    Key(&'static str),
    /// Into an array, by index from 0.
    Index(usize),
}

/// An invalid value in a well-formed document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Objection {
    /// Path of the value in the document.
    pub path: Vec<Step>,
    /// Description of the error: what was found, and what was expected.
    pub problem: String,
    /// Suggested fix.
    pub mend: String,
}

/// Parses TOML; a syntax error is displayed with its line.
pub fn parse_toml<T: DeserializeOwned>(file: &str, text: &str) -> Result<T, InputError> {
    toml::from_str(text).map_err(|e| {
        let byte = e.span().map_or(0, |s| s.start);
        let (problem, mend) = toml_problem(&e);
        InputError::at(file, text, byte, &problem, mend.unwrap_or("this is no TOML from here on"))
    })
}

/// Message for people about an error of the TOML parser, and a suggested fix, if one is known for that error.
pub fn toml_problem(error: &toml::de::Error) -> (String, Option<&'static str>) {
    const TYPES: [(&str, &str); 4] = [
        ("f64", "a number"),
        ("u8", "a number from 0 to 255"),
        ("usize", "a whole number of at least 0"),
        ("u64", "a whole number of at least 0"),
    ];
    let problem = error.message().replace('\n', " ");
    let problem = TYPES.iter().fold(problem, |problem, (of, said)| problem.replace(of, said));
    let mend = mend_of(&problem);
    (problem, mend)
}

fn mend_of(problem: &str) -> Option<&'static str> {
    let mends = [
        ("unknown field", "take one of the names that are known, or remove it"),
        ("unknown variant", "take one of the names that are known"),
        ("missing field", "add it here"),
        ("duplicate", "keep one of them"),
        ("invalid", "write what is expected"),
    ];
    mends.iter().find(|(word, _)| problem.contains(word)).map(|(_, mend)| *mend)
}

/// Converts an objection to an error at the deepest part of its path that exists in the text.
pub fn draw(file: &str, text: &str, objection: Objection) -> InputError {
    let span = span_of(text, &objection.path).unwrap_or(0..0);
    InputError::at(file, text, span.start, objection.problem, objection.mend)
}

fn span_of(text: &str, path: &[Step]) -> Option<Range<usize>> {
    let document = DeTable::parse(text).ok()?;
    let mut span = document.span();
    let mut table = Some(document.get_ref());
    let mut array = None;
    for step in path {
        let value = match step {
            Step::Key(key) => table.and_then(|t| t.get(*key)),
            Step::Index(i) => array.and_then(|a: &toml::de::DeArray| a.get(*i)),
        };
        let Some(value) = value else { break };
        span = value.span();
        table = match value.get_ref() {
            DeValue::Table(t) => Some(t),
            _ => None,
        };
        array = match value.get_ref() {
            DeValue::Array(a) => Some(a),
            _ => None,
        };
    }
    Some(span)
}
