//! Text for people: numbers, lists and line wrapping.

use descry_domains::english;
use descry_memory::belief::Track;

pub use descry_agent::numbers::{count, share, share_of};

/// Joins the first `most` texts to a list; the rest are counted.
pub fn listed(all: &[String], most: usize) -> String {
    let named = all[..all.len().min(most)].join(", ");
    match (all, all.len().saturating_sub(most)) {
        ([before @ .., last], 0) if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        (_, 0) => named,
        (_, more) => format!("{named} and {more} more"),
    }
}

/// Joins texts with their probabilities to a list; neighbours whose probabilities look equal share
/// one figure.
pub fn by_share(all: impl IntoIterator<Item = (f64, String)>) -> String {
    let mut alike: Vec<(String, Vec<String>)> = Vec::new();
    for (value, of) in all {
        let said = share(value);
        match alike.last_mut().filter(|(last, _)| *last == said) {
            Some((_, like)) => like.push(of),
            None => alike.push((said, vec![of])),
        }
    }
    let one = |(said, of): &(String, Vec<String>)| {
        let each = if of.len() > 1 { " each" } else { "" };
        format!("{said}{each} {}", listed(of, of.len()))
    };
    alike.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// Text with its first letter in upper case.
pub fn capital(text: &str) -> String {
    let mut signs = text.chars();
    signs.next().map(|first| first.to_uppercase().chain(signs).collect()).unwrap_or_default()
}

/// Position of an object in the map frame, as text.
pub fn place(track: &Track) -> String {
    english::position(track.position_m.coords.into())
}

/// Wraps a text at `most` characters per line. The first line begins with `first`; the others are
/// indented by its width.
pub fn wrapped(text: &str, first: &str, most: usize) -> String {
    let indent = " ".repeat(first.chars().count());
    let mut lines: Vec<String> = Vec::new();
    let mut line = first.to_string();
    let mut is_empty = true;
    for word in words(text) {
        if !is_empty && line.chars().count() + 1 + word.chars().count() > most {
            lines.push(std::mem::replace(&mut line, indent.clone()));
            is_empty = true;
        }
        if !is_empty {
            line.push(' ');
        }
        line += &word;
        is_empty = false;
    }
    lines.push(line);
    lines.join("\n")
}

/// Units that line wrapping keeps together: words, short bracketed calls or figures, and numbers
/// with their `%`.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut open: Vec<&str> = Vec::new();
    let mut depth = 0_i32;
    for word in text.split_whitespace() {
        let signs = |of: &[char]| word.matches(of).count() as i32;
        depth += signs(&['(', '[']) - signs(&[')', ']']);
        open.push(word);
        if depth <= 0 {
            take(&mut words, &std::mem::take(&mut open));
            depth = 0;
        }
    }
    take(&mut words, &open);
    words
}

/// Adds a bracketed group, or a single word, to the units of a text. A long group, or one in
/// parentheses with a comma (prose), may be broken.
fn take(words: &mut Vec<String>, open: &[&str]) {
    const LONGEST_CALL: usize = 60;
    let whole = open.join(" ");
    let in_passing = whole.starts_with('(') && whole.contains(", ");
    match words.last_mut() {
        Some(last) if open.len() == 1 && whole.starts_with('%') => *last += &format!(" {whole}"),
        _ if whole.chars().count() <= LONGEST_CALL && !in_passing && !whole.is_empty() => words.push(whole),
        _ => words.extend(open.iter().map(|word| word.to_string())),
    }
}
