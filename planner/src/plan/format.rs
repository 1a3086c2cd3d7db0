//! Plan formatter: each step on its own line, times and durations with three decimals where these
//! are exact. Comments stay in place.

use super::{Plan, Reader, seconds};
use crate::diagnostic::{Findings, Source};

impl Plan {
    /// Formats a plan; the order of the steps is kept, and reading the result gives the same plan.
    ///
    /// # Errors
    /// Findings about lines that are not steps; such a text is not formatted.
    pub fn format(source: &Source) -> Result<String, Findings> {
        Plan::read(source)?;
        let mut reader = Reader { text: &source.text, at: 0, findings: Vec::new() };
        let mut out = String::new();
        loop {
            let rest = reader.rest();
            let blanks = &rest[..rest.len() - rest.trim_start().len()];
            let breaks = blanks.matches('\n').count();
            reader.at += blanks.len();
            let rest = reader.rest();
            if rest.is_empty() {
                break;
            }
            let is_comment = rest.starts_with(';');
            if !out.is_empty() {
                out += match (breaks, is_comment) {
                    (0, true) => "  ",
                    (0 | 1, _) => "\n",
                    _ => "\n\n",
                };
            }
            let from = reader.at;
            if is_comment {
                reader.at += rest.find('\n').unwrap_or(rest.len());
                out += source.text[from..reader.at].trim_end();
            } else if reader.try_step().is_ok() {
                out += &step(&source.text[from..reader.at]);
            } else {
                // It has been read once: this cannot be.
                return Ok(source.text.clone());
            }
        }
        if !out.is_empty() {
            out.push('\n');
        }
        Ok(out)
    }
}

/// Text of a step in normal form: single blanks, and times as [`seconds`] writes them.
fn step(text: &str) -> String {
    let (before, rest) = text.split_once('(').unwrap_or(("", text));
    let (inside, after) = rest.split_once(')').unwrap_or((rest, ""));
    let time =
        before.split_once(':').map(|(time, _)| format!("{}: ", exact(time.trim()))).unwrap_or_default();
    let call = inside.split_whitespace().collect::<Vec<_>>().join(" ");
    let inside = after.trim().trim_start_matches('[').trim_end_matches(']').trim();
    let duration = if inside.is_empty() { String::new() } else { format!(" [{}]", exact(inside)) };
    format!("{time}({call}){duration}")
}

/// Number as [`seconds`] writes it, if that is exact; otherwise the text as it is.
fn exact(text: &str) -> String {
    match text.parse::<f64>() {
        Ok(value) if seconds(value).parse() == Ok(value) => seconds(value),
        _ => text.to_string(),
    }
}
