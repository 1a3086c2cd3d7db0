//! Drawing of findings on very long lines: only an excerpt around the span is shown.

use std::fmt::Write;
use std::ops::Range;

use super::{Diagnostic, Severity, Source, Span};

/// Length above which a line is shortened, bytes.
const LONG_LINE_BYTES: usize = 400;
/// Number of characters shown on each side of a span.
const AROUND: usize = 40;
/// Maximum number of characters of the span itself that are shown.
const MOST_SHOWN: usize = 60;

/// Line and column (in characters) of a byte offset, both from 1; (1, 1) for an offset outside the
/// text.
pub(super) fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let Some(before) = text.get(..byte) else { return (1, 1) };
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// True if a finding points into a line that is too long to draw.
pub(super) fn is_needed(sources: &[Source], finding: &Diagnostic) -> bool {
    finding.labels.iter().any(|label| {
        let line = sources.get(label.span.source as usize).map(|source| line_of(&source.text, label.span));
        line.is_some_and(|line| line.len() > LONG_LINE_BYTES)
    })
}

/// Byte range of the line in which a span begins; a span over several lines extends the range to
/// the line in which it ends.
fn line_of(text: &str, span: Span) -> Range<usize> {
    let at = (span.start as usize).min(text.len());
    let (before, after) = (text.as_bytes()[..at].iter(), text.as_bytes()[at..].iter());
    let start = before.rev().position(|&byte| byte == b'\n').map_or(0, |back| at - back);
    let end = after.copied().position(|byte| byte == b'\n').map_or(text.len(), |ahead| at + ahead);
    start..end
}

/// Renders a finding with an excerpt around each of its spans.
pub(super) fn draw(sources: &[Source], finding: &Diagnostic) -> String {
    let kind = match finding.severity {
        Severity::Error => "Error",
        Severity::Warning => "Warning",
    };
    let mut drawn = format!("[{}] {kind}: {}\n", finding.code, finding.message);
    for (number, label) in finding.labels.iter().enumerate() {
        let Some(source) = sources.get(label.span.source as usize) else { continue };
        let (line, column) = line_and_column(&source.text, label.span.start as usize);
        let corner = if number == 0 { "╭" } else { "├" };
        let (shown, indent, width) = excerpt(&source.text, label.span);
        let _ = writeln!(drawn, "   {corner}─[ {}:{line}:{column} ]\n   │", source.name);
        let _ = writeln!(drawn, "   │ {shown}\n   │ {}{}", " ".repeat(indent), "─".repeat(width));
        let _ = writeln!(drawn, "   │ {}╰── {}\n   │", " ".repeat(indent), label.text);
    }
    if let Some(help) = &finding.help {
        let _ = writeln!(drawn, "   │ Help: {help}");
    }
    drawn.push_str("───╯\n");
    drawn
}

/// Excerpt of one line around a span, with the span's column and width in the excerpt, in
/// characters (column from 0).
fn excerpt(text: &str, span: Span) -> (String, usize, usize) {
    let line = line_of(text, span);
    let start = (span.start as usize).clamp(line.start, line.end);
    let end = (span.end as usize).clamp(start, line.end);
    let (Some(before), Some(place), Some(after)) =
        (text.get(line.start..start), text.get(start..end), text.get(end..line.end))
    else {
        return (String::new(), 0, 1);
    };
    let from = before.char_indices().rev().nth(AROUND).map(|(at, _)| at);
    let before = from.map_or(before.to_string(), |at| format!("…{}", &before[at..]));
    let cut = |text: &str, most: usize| match text.char_indices().nth(most) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text.to_string(),
    };
    let (place, after) = (cut(place, MOST_SHOWN), cut(after, AROUND));
    let (indent, width) = (before.chars().count(), place.chars().count().max(1));
    (format!("{before}{place}{after}").replace('\t', " "), indent, width)
}
