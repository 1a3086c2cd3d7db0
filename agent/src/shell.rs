//! Command lines that people are told to run, and those that are run here.

/// A text as one word of the shell: in quotes where it needs them.
pub fn word(text: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./:@%+=,".contains(c);
    match !text.is_empty() && text.chars().all(is_plain) {
        true => text.into(),
        false => quoted(text),
    }
}

/// A text as one word of the shell, in quotes whatever it is.
pub fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', r"'\''"))
}
