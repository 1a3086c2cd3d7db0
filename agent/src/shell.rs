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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_of_the_shell_stays_one() {
        let check = |text: &str, expected: &str| assert_eq!(word(text), expected);
        check("runs/find-cup-a", "runs/find-cup-a");
        check("mongodb://host/base", "mongodb://host/base");
        check("my runs/one", "'my runs/one'");
        check("it's $HOME", r"'it'\''s $HOME'");
        check("mongodb://host/base#run", "'mongodb://host/base#run'");
        check("", "''");
    }
}
