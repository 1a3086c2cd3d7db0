//! A mistake in a file that a person wrote or recorded: where, what was expected, how to mend it.

use serde::de::DeserializeOwned;
use std::ops::Range;
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
    /// The line itself.
    pub excerpt: String,
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
        let excerpt = text[line_start..].lines().next().unwrap_or("").to_string();
        let column = before[line_start..].chars().count() + 1;
        InputError { file: file.into(), line, column, excerpt, problem: problem.into(), mend: mend.into() }
    }

    fn drawn(&self) -> String {
        if self.line == 0 {
            return format!("{}: {}; {}", self.file, self.problem, self.mend);
        }
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        let caret = " ".repeat(self.column.saturating_sub(1));
        format!(
            "{}:{}:{}: {}\n{margin} |\n{number} | {}\n{margin} | {caret}^ {}",
            self.file, self.line, self.column, self.problem, self.excerpt, self.mend
        )
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
