//! The command line as a whole: its commands with examples, for help, man pages and the completions of shells.

use clap::{CommandFactory, FromArgMatches, Parser};

use super::Command;

/// Letters in a line of help.
const WIDTH: usize = 80;

/// Finds things by looking carefully: plans where to look, drives there, records, merges, recognises, and looks again.
#[derive(Parser)]
#[command(name = "descry", version, max_term_width = WIDTH, after_help = EXIT_CODES)]
struct Line {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "Exit codes:
  0   achieved, plan found, valid, no finding
  1   an honest no: not found after every useful view, plan invalid, findings
  2   bad input or usage
  3   proven unsolvable
  4   out of time or memory
  5   the robot or a store failed for good
  70  a bug of descry
  130, 143, 129  stopped by Ctrl-C, by SIGTERM, by the end of its terminal";

/// Each command with lines that show what it is for.
const EXAMPLES: [(&str, &[&str]); 22] = [
    (
        "find",
        &[
            "descry find \"cup A\"",
            "descry find mug --domain home --seed 7 --run runs/mug",
            "descry find \"cup A\" --robot recorded:FRAMES",
            "descry find \"cup A\" --live",
        ],
    ),
    (
        "do",
        &[
            "descry do \"is cup A on the table\"",
            "descry do \"bring cup A to the desk\" --domain home",
            "descry do --resume runs/mug",
        ],
    ),
    ("new", &["descry new own"]),
    ("goals", &["descry goals", "descry goals --domain home"]),
    (
        "plan",
        &[
            "descry plan domain.pddl problem.pddl --out plan.txt --gantt plan.svg",
            "descry plan domain.pddl problem.pddl --anytime --time-limit 30",
            "descry plan domain.pddl problem.pddl --why-not \"(move a b)\"",
            "descry plan domain.pddl problem.pddl --attach 'cost=python3 cost.py'",
        ],
    ),
    ("validate", &["descry validate domain.pddl problem.pddl plan.txt"]),
    ("check", &["descry check domain.pddl problem.pddl", "descry check own"]),
    (
        "fmt",
        &["descry fmt domain.pddl problem.pddl", "descry fmt --check domains", "descry fmt < domain.pddl"],
    ),
    ("lsp", &["descry lsp"]),
    (
        "recognise",
        &["descry recognise cloud.pcd --picture seen.svg", "descry recognise one.ply two.ply --json"],
    ),
    (
        "experiment",
        &[
            "descry experiment two-tables.toml --out results",
            "descry experiment two-tables.toml --out results --live",
            "descry experiment two-tables.toml --out part --shard 0/4",
            "descry experiment two-tables.toml --slurm batch.sh --shards 16 --jobs 4",
        ],
    ),
    ("robot", &["descry robot check \"program:python3 robot.py\""]),
    ("show", &["descry show runs/mug", "descry show runs/mug --html mug.html"]),
    ("explain", &["descry explain runs/mug", "descry explain runs/mug --figures"]),
    ("replay", &["descry replay runs/mug", "descry replay runs/mug --speed 10"]),
    ("runs", &["descry runs", "descry runs elsewhere --json"]),
    (
        "memory",
        &[
            "descry memory show runs/mug",
            "descry memory query runs/mug --kind percepts",
            "descry memory verify runs/mug",
        ],
    ),
    (
        "name",
        &[
            "descry name seen",
            "descry name seen \"thing 1\" \"the thing from Tuesday\"",
            "descry name seen \"the thing from Tuesday\" --points thing.ply",
        ],
    ),
    ("export", &["descry export runs/mug mug.mcap"]),
    ("completions", &["descry completions bash > ~/.local/share/bash-completion/completions/descry"]),
    ("man", &["descry man | man -l -", "descry man --out ~/.local/share/man/man1"]),
    ("help", &[]),
];

/// The commands, with their examples.
pub fn line() -> clap::Command {
    EXAMPLES.iter().filter(|(_, lines)| !lines.is_empty()).fold(Line::command(), |line, (name, lines)| {
        let text = format!("Examples:\n  {}", lines.join("\n  "));
        line.mut_subcommand(name, |command| command.after_help(text))
    })
}

/// The command that was asked for; what cannot be read ends the program with a word about it.
pub fn asked() -> Command {
    let read = line().try_get_matches().and_then(|matches| Line::from_arg_matches(&matches));
    read.unwrap_or_else(|error| refuse(&error)).command
}

/// Says why a line cannot be read, or the help that it asks for, and ends.
fn refuse(error: &clap::Error) -> ! {
    let words: Vec<String> = std::env::args_os().skip(1).map(|w| w.to_string_lossy().into_owned()).collect();
    if error.use_stderr() {
        // Where nobody reads it, the exit code still says it.
        let _ = super::find::refuse(&words, &error.render().to_string());
    }
    error.exit()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words of a line as a shell has them, up to where it would go elsewhere.
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
}
