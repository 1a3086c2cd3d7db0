//! A mistake in a file that a person wrote or recorded: where, what was expected, how to mend it.

use serde::de::DeserializeOwned;
use std::fs::{File, FileType};
use std::io::{Error, ErrorKind, Read};
use std::ops::Range;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use toml::de::{DeTable, DeValue};

/// Fault in a file, drawn under its text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.drawn())]
pub struct InputError {
    /// The file or folder, as it was given.
    pub file: String,
    /// Line, from 1; 0 if the mistake is not in one line.
    pub line: usize,
    /// Column in characters, from 1; 0 with `line` 0.
    pub column: usize,
    /// The line itself, as much of it as a person reads around the mistake.
    pub excerpt: String,
    /// Column of the mistake within the excerpt, in characters, from 1.
    caret: usize,
    /// Found and expected values.
    pub problem: String,
    /// Mend.
    pub mend: String,
}

impl InputError {
    /// A mistake of the file as a whole.
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

    /// A mistake at a byte of the text.
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

/// Most characters of a line that an error shows. From: chosen, twice the width of a terminal.
const EXCERPT: usize = 240;

/// A line as an error shows it: the beginning, and a mark where more follows.
pub fn clipped(line: &str) -> String {
    match line.char_indices().nth(EXCERPT) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line.into(),
    }
}

/// Bytes of the longest text that a person writes: a domain, a scene, settings. From: chosen.
pub const MOST_TEXT_BYTES: u64 = 16 << 20;

/// Reads a file of at most so many bytes. Named pipes, devices and sockets are refused before anything is awaited from them.
///
/// # Errors
/// The system's, or the reason why it is not read.
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

/// Reads a text that a person wrote.
///
/// # Errors
/// As [`read_bytes`], and if it is no UTF-8.
pub fn read_text(path: &Path) -> std::io::Result<String> {
    String::from_utf8(read_bytes(path, MOST_TEXT_BYTES)?).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        Error::new(ErrorKind::InvalidData, format!("it is no text: byte {at} is not UTF-8"))
    })
}

/// Kind of what is no file, in words.
pub fn kind_of(file_type: FileType) -> &'static str {
    match file_type {
        kind if kind.is_dir() => "a folder",
        kind if kind.is_fifo() => "a named pipe",
        kind if kind.is_socket() => "a socket",
        kind if kind.is_char_device() || kind.is_block_device() => "a device",
        _ => "no file",
    }
}

/// One step into a TOML document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// Into a table.
    Key(&'static str),
    /// Into an array.
    Index(usize),
}

/// A value that the format allows and the meaning does not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Objection {
    /// Path in the document.
    pub path: Vec<Step>,
    /// Found and expected values.
    pub problem: String,
    /// Mend.
    pub mend: String,
}

/// Reads a TOML text; mistakes of form are drawn under it.
pub fn parse_toml<T: DeserializeOwned>(file: &str, text: &str) -> Result<T, InputError> {
    toml::from_str(text).map_err(|e| {
        let byte = e.span().map_or(0, |s| s.start);
        let problem =
            e.message().replace('\n', " ").replace("f64", "a number").replace("u8", "a number from 0 to 255");
        InputError::at(file, text, byte, &problem, mend_of(&problem))
    })
}

fn mend_of(problem: &str) -> &'static str {
    let mends = [
        ("unknown field", "take one of the names that are known, or remove it"),
        ("unknown variant", "take one of the names that are known"),
        ("missing field", "add it here"),
        ("duplicate", "keep one of them"),
        ("invalid", "write what is expected"),
    ];
    mends
        .iter()
        .find(|(word, _)| problem.contains(word))
        .map_or("this is no TOML from here on", |(_, mend)| mend)
}

/// Draws an objection under the deepest part of its path that stands in the text.
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
