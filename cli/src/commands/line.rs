//! The whole command line with examples, for help, man pages and shell completions.

use clap::{CommandFactory, FromArgMatches, Parser};

use super::Command;

/// Width of help, columns.
pub const WIDTH: usize = 80;

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

/// Example lines, by command.
pub const EXAMPLES: [(&str, &[&str]); 25] = [
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
    ("serve", &["descry serve", "descry serve --folder ~/agent --domain home --robot socket:/tmp/robot"]),
    ("mcp", &["descry mcp", "descry mcp --folder ~/runs --robot socket:/tmp/robot"]),
    (
        "recognise",
        &["descry recognise cloud.pcd --picture seen.svg", "descry recognise one.ply two.ply --json"],
    ),
    ("import", &["descry import rgbd_dataset_freiburg1_desk desk", "descry find mug --robot recorded:desk"]),
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

/// Command line of descry, with the examples of each command.
pub fn line() -> clap::Command {
    EXAMPLES.iter().filter(|(_, lines)| !lines.is_empty()).fold(Line::command(), |line, (name, lines)| {
        let text = format!("Examples:\n  {}", lines.join("\n  "));
        line.mut_subcommand(name, |command| command.after_help(text))
    })
}

/// Parses the command line; on an error, prints it and exits.
pub fn asked() -> Command {
    let read = line().try_get_matches().and_then(|matches| Line::from_arg_matches(&matches));
    read.unwrap_or_else(|error| refuse(&error)).command
}

/// Prints a parse error, or the requested help, and exits.
fn refuse(error: &clap::Error) -> ! {
    let words: Vec<String> = std::env::args_os().skip(1).map(|w| w.to_string_lossy().into_owned()).collect();
    if error.use_stderr() {
        // Where nobody reads it, the exit code still says it.
        let _ = super::find::refuse(&words, &error.render().to_string());
    }
    error.exit()
}
