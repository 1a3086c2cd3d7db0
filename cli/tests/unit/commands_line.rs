//! Tests of `commands::line`.

use descry_cli::commands::line::*;

/// The words of a line as a shell splits them, up to a redirection.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for letter in line.chars() {
        match (letter, quote) {
            ('"' | '\'', None) => quote = Some(letter),
            (end, Some(open)) if end == open => quote = None,
            ('<' | '>' | '|', None) => break,
            (' ', None) => words.push(String::new()),
            _ => words.last_mut().expect("there is one").push(letter),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

#[test]
fn every_command_has_examples_that_are_understood() {
    line().debug_assert();
    for command in line().get_subcommands() {
        let name = command.get_name();
        let examples = EXAMPLES.iter().find(|(known, _)| *known == name);
        let (_, examples) = examples.unwrap_or_else(|| panic!("{name} has no example"));
        for example in *examples {
            let read = line().try_get_matches_from(words(example));
            assert!(read.is_ok(), "{example}: {}", read.expect_err("it is refused"));
        }
    }
}

#[test]
fn help_fits_a_terminal() {
    fn check(command: &mut clap::Command, path: &str) {
        let help = command.clone().max_term_width(WIDTH).term_width(WIDTH).render_long_help().to_string();
        // A name cannot be broken.
        let long = help.lines().find(|l| l.chars().count() > WIDTH && l.trim().contains("  "));
        assert_eq!(long, None, "{path}");
        for inner in command.get_subcommands().map(|c| c.get_name().to_string()).collect::<Vec<_>>() {
            if let Some(inner_command) = command.find_subcommand_mut(&inner) {
                check(&mut inner_command.clone(), &format!("{path} {inner}"));
            }
        }
    }
    check(&mut line(), "descry");
}
