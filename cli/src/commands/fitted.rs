//! Wrapping of lines to the width of the terminal; without a terminal, lines stay unwrapped.

use std::io::IsTerminal;

/// Width of a terminal that does not report one, columns.
const USUAL_WIDTH: usize = 80;

/// Width of the terminal behind a stream, columns; `None` without a terminal.
pub fn width(stream: &(impl IsTerminal + std::os::fd::AsFd)) -> Option<usize> {
    let known = || terminal_size::terminal_size_of(stream).map(|(width, _)| usize::from(width.0));
    stream.is_terminal().then(|| known().filter(|width| *width > 0).unwrap_or(USUAL_WIDTH))
}

/// Escapes control characters as Rust does, except colour codes, so that the text cannot steer the terminal.
pub fn harmless(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(sign) = rest.chars().next() {
        let colour = colour(rest);
        let length = if colour > 0 { colour } else { sign.len_utf8() };
        let is_harmless = colour > 0 || !sign.is_control() || matches!(sign, '\n' | '\t');
        match is_harmless {
            true => out.push_str(&rest[..length]),
            false => out.extend(sign.escape_default()),
        }
        rest = &rest[length..];
    }
    out
}

/// Length of a colour code (`ESC [`, numbers, `m`) at the start of a text, bytes; 0 without one.
fn colour(text: &str) -> usize {
    let Some(numbers) = text.strip_prefix("\u{1b}[") else { return 0 };
    let end = numbers.find(|sign: char| !sign.is_ascii_digit() && sign != ';').unwrap_or(numbers.len());
    if numbers[end..].starts_with('m') { 2 + end + 1 } else { 0 }
}

/// Wraps a text to a width; `None`: unchanged. Continuation lines are indented to the second column.
pub fn fitted(text: &str, width: Option<usize>) -> String {
    let Some(width) = width else { return text.to_string() };
    text.lines().map(|line| folded(line, width)).collect::<Vec<_>>().join("\n")
}

pub fn folded(line: &str, width: usize) -> String {
    // What is drawn under a text stays under it.
    let is_drawn = line.chars().any(|sign| ('\u{2500}'..='\u{257f}').contains(&sign));
    if is_drawn || line.chars().count() <= width {
        return line.to_string();
    }
    let indent = " ".repeat(hang(line, width * 3 / 5));
    let mut lines = Vec::new();
    let mut rest: Vec<char> = line.chars().collect();
    let from = indent.len();
    while rest.len() > width {
        let ends = (from + 1..=width).rev().find(|&at| rest[at] == ' ' && rest[at - 1] != ' ');
        // A word that is longer than a line stays whole.
        let Some(at) = ends.or_else(|| (width..rest.len()).find(|&at| rest[at] == ' ')) else { break };
        let next = rest[at..].iter().skip_while(|sign| **sign == ' ');
        let next: Vec<char> = indent.chars().chain(next.copied()).collect();
        rest.truncate(at);
        lines.push(rest.into_iter().collect());
        rest = next;
    }
    lines.push(rest.into_iter().collect::<String>());
    lines.join("\n")
}

/// Start of the second column of a line; a line without one in its left part hangs a little beyond its own
/// indent.
fn hang(line: &str, most: usize) -> usize {
    let signs: Vec<char> = line.chars().collect();
    let first = signs.iter().position(|sign| *sign != ' ').unwrap_or(0);
    let gap = (first..signs.len().saturating_sub(1)).find(|&at| signs[at] == ' ' && signs[at + 1] == ' ');
    let column = gap.and_then(|gap| Some(gap + signs[gap..].iter().position(|sign| *sign != ' ')?));
    column.filter(|at| *at <= most).unwrap_or(first + 2).min(most)
}
