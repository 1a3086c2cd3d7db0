//! Plan formatter: one step per line, times and durations with three decimals if exact, comments
//! kept in place.

use super::{Plan, Reader, seconds};
use crate::diagnostic::{Findings, Source};

impl Plan {
    /// Formats a plan; steps keep their order, and reading the result gives the same plan.
    ///
    /// # Errors
    /// Every line that is no step: such a text is not touched.
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

/// Step text with runs of blanks reduced to one.
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

/// Number with the decimals of plans if exact; otherwise unchanged.
fn exact(text: &str) -> String {
    match text.parse::<f64>() {
        Ok(value) if seconds(value).parse() == Ok(value) => seconds(value),
        _ => text.to_string(),
    }
}
