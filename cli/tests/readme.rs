//! The commands of README and of the book: each exists, exits as documented, and prints what is shown.

use crate::binary;
use crate::tutorial;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Pages with commands.
const PAGES: [&str; 18] = [
    "README.md",
    "cli/README.md",
    "docs/agent.md",
    "docs/commands.md",
    "docs/cookbook.md",
    "docs/editors.md",
    "docs/introduction.md",
    "docs/reference/recordings.md",
    "docs/ros.md",
    "docs/scale.md",
    "docs/see.md",
    "docs/tutorial.md",
    "domains/home/README.md",
    "domains/learning/README.md",
    "domains/multi-object-search/README.md",
    "domains/shapes/README.md",
    "domains/survey/README.md",
    "domains/template/README.md",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The lines of a text's fenced blocks, block by block.
fn blocks(text: &str) -> Vec<Vec<&str>> {
    let parts = text.split("\n```").skip(1).step_by(2);
    parts.map(|block| block.lines().skip(1).collect()).collect()
}

/// The help text of a command, such as `memory query` or `plan`; cached.
fn help<'a>(known: &'a mut BTreeMap<String, String>, command: &str) -> &'a str {
    known.entry(command.to_owned()).or_insert_with(|| {
        let arguments: Vec<&str> = std::iter::once("help").chain(command.split(' ')).collect();
        let said = binary::outcome(Path::new("."), &arguments);
        assert!(said.status.success(), "`descry {command}` is no command");
        String::from_utf8_lossy(&said.stdout).into_owned()
    })
}

#[test]
fn every_command_that_is_shown_is_one_with_these_options() {
    let mut known = BTreeMap::new();
    let mut checked = 0;
    for page in PAGES {
        let text = std::fs::read_to_string(root().join(page)).expect("the page is there");
        for line in blocks(&text).concat() {
            let Some(rest) = line.trim_start_matches("$ ").strip_prefix("descry ") else { continue };
            // What stands behind a gap is said of it.
            let typed = rest.split("   ").next().unwrap_or_default();
            let words: Vec<&str> = typed.split_whitespace().collect();
            let command = match words.as_slice() {
                [group @ ("memory" | "robot"), name, ..] => format!("{group} {name}"),
                [name, ..] => (*name).to_owned(),
                [] => panic!("{page}: {line}"),
            };
            let said = help(&mut known, &command);
            for option in words.iter().filter(|word| word.starts_with("--")) {
                let name = option.split('=').next().unwrap_or(option).trim_end_matches([',', ';', ':']);
                assert!(said.contains(name), "{page}: `descry {command}` has no {name}: {line}");
            }
            checked += 1;
        }
    }
    assert!(checked > 50, "{checked} commands");
}

#[test]
fn the_explanation_that_is_shown_is_what_is_said() {
    let text = std::fs::read_to_string(root().join("docs/see.md")).expect("it is there");
    let all = blocks(&text);
    let at = all.iter().position(|block| block.contains(&"descry explain runs/ten")).expect("it is shown");
    let shown = all[at + 1].join("\n");
    let folder = tempfile::tempdir().expect("a folder");
    let run = binary::outcome(folder.path(), &["find", "cup A", "--seed", "10", "--run", "runs/ten"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let said = binary::outcome(folder.path(), &["explain", "runs/ten"]);
    let said = String::from_utf8_lossy(&said.stdout);
    assert!(said.contains(&shown), "the page shows\n{shown}\nbut this is said:\n{said}");
}

/// A folder that resembles a clone of the repository, as far as the pages use it.
fn clone() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["docs", "domains", "robots"] {
        let target = root().join(name).canonicalize().expect("it is there");
        std::os::unix::fs::symlink(target, folder.path().join(name)).expect("it can be linked");
    }
    folder
}

/// Part of a page from one heading to another, or to its end.
fn part(page: &str, from: &str, to: &str) -> String {
    let text = tutorial::page(page);
    let (_, rest) = text.split_once(from).unwrap_or_else(|| panic!("{page} has no {from}"));
    rest.split_once(to).map_or(rest, |(part, _)| part).to_owned()
}

#[test]
fn readme_is_short_and_its_links_lead_somewhere() {
    let text = tutorial::page("README.md");
    assert!(text.lines().count() <= 120, "{} lines", text.lines().count());
    let links = text
        .split("](")
        .skip(1)
        .chain(text.split("src").skip(1).filter_map(|s| s.split_once("=\"").map(|p| p.1)));
    let ends = |c: char| c == ')' || c == '"';
    let mut checked = 0;
    for link in links.filter_map(|rest| rest.split(ends).next()).filter(|link| !link.contains("://")) {
        let (path, heading) = link.split_once('#').unwrap_or((link, ""));
        assert!(root().join(path).exists(), "README leads to {path}, which is not there");
        let plain = |line: &str| {
            let kept = line.to_lowercase().replace(' ', "-");
            kept.chars().filter(|c| c.is_alphanumeric() || *c == '-').collect::<String>()
        };
        let text = if heading.is_empty() { String::new() } else { tutorial::page(path) };
        let is_there =
            text.lines().filter_map(|line| line.strip_prefix("## ")).any(|line| plain(line) == heading);
        assert!(heading.is_empty() || is_there, "{path} has no heading {heading}");
        checked += 1;
    }
    assert!(checked > 20, "{checked} links");
}

#[test]
fn readme_s_first_run_prints_what_is_shown() {
    tutorial::follow(&part("README.md", "## Install", "## Three"), clone().path());
}

#[test]
fn readme_s_domain_and_plan_print_what_is_shown() {
    tutorial::follow(&part("README.md", "**2. Your own", "## Beside"), clone().path());
}

#[test]
fn commands_that_end_at_once_end_well() {
    let text = part("docs/commands.md", "## Plan, validate", "## Batches")
        + &part("docs/commands.md", "## Editors", "## Rooms");
    tutorial::follow(&text, clone().path());
}

#[test]
#[ignore = "slow: searches, a batch, exploring and learning; the tests above type what ends at once"]
fn readme_and_all_commands_in_their_order_end_well() {
    tutorial::follow(&tutorial::page("README.md"), clone().path());
    tutorial::follow(&tutorial::page("docs/commands.md"), clone().path());
}

/// Prefixes of commands in the book that do not simply succeed, with the reason.
const NOT_TYPED: [(&str, &str); 1] =
    [("descry experiment two-tables.toml --out all --merge", "needs the folders of three machines")];

/// Placeholders on the pages, with their values in the folder of [`scratch`].
const MEANT: [(&str, &str); 4] = [
    ("DOMAIN PROBLEM", "docs/cookbook/fuel/domain.pddl docs/cookbook/fuel/problem.pddl"),
    ("--shards 16", "--shards 8"),
    ("--out results --merge results", "--out shared --merge shared"),
    (" runs/mug", " run"),
];

/// Point cloud in PCD format: a table 0.8 m below the sensor, with a block on it.
fn cloud() -> String {
    let table =
        (0..120 * 80).map(|n| (f64::from(n % 120) / 120.0 - 0.5, 1.0 + f64::from(n / 120) / 130.0, -0.8));
    let top = (0..400).map(|n| (f64::from(n % 20) / 250.0, 1.3 + f64::from(n / 20) / 250.0, -0.7));
    let front = (0..400).map(|n| (f64::from(n % 20) / 250.0, 1.3, -0.8 + f64::from(n / 20) / 200.0));
    let points: Vec<String> =
        table.chain(top).chain(front).map(|(x, y, z)| format!("{x:.4} {y:.4} {z:.4}\n")).collect();
    let n = points.len();
    format!(
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA ascii\n{}",
        points.concat()
    )
}

/// A folder with the files that the book mentions: a run, a cloud, a small experiment.
fn scratch() -> tempfile::TempDir {
    let folder = clone();
    let path = folder.path();
    std::fs::write(path.join("cloud.pcd"), cloud()).expect("it can be written");
    let batch = tutorial::page("domains/tabletop/experiments/two-tables.toml");
    std::fs::write(path.join("two-tables.toml"), batch.replace("runs = 200", "runs = 3"))
        .expect("it can be written");
    for below in [".local/share/bash-completion/completions", ".zfunc", ".config/fish/completions"] {
        std::fs::create_dir_all(path.join(below)).expect("it can be made");
    }
    assert!(binary::outcome(path, &["find", "cup A", "--run", "run"]).status.success());
    folder
}

/// Runs a typed command in a folder, which is also its home.
fn typed(folder: &Path, command: &str) -> std::process::Output {
    let descry = Path::new(env!("CARGO_BIN_EXE_descry")).parent().expect("a folder");
    let path = format!("{}:{}", descry.display(), std::env::var("PATH").unwrap_or_default());
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", command]).current_dir(folder).env("PATH", path).env("HOME", folder);
    shell.stdin(std::process::Stdio::null()).output().expect("sh runs")
}

#[test]
#[ignore = "slow: batches in shards; the options of each command are checked above, shards in the tests of clusters"]
fn what_the_book_shows_ends_well() {
    let folder = scratch();
    for page in ["docs/see.md", "docs/scale.md", "docs/editors.md", "docs/introduction.md"] {
        for line in
            blocks(&tutorial::page(page)).concat().into_iter().filter(|line| line.starts_with("descry "))
        {
            // What stands behind a gap is said of it.
            let shown = line.split("   ").next().unwrap_or_default();
            if let Some((_, why)) = NOT_TYPED.iter().find(|(begins, _)| shown.starts_with(begins)) {
                println!("SKIPPED: {shown}: {why}");
                continue;
            }
            let command = MEANT.iter().fold(shown.to_string(), |said, (from, to)| said.replace(from, to));
            let ended = typed(folder.path(), &command);
            let said = String::from_utf8_lossy(&ended.stderr);
            assert!(ended.status.success(), "{page}: {command}: {:?}\n{said}", ended.status.code());
        }
    }
}
