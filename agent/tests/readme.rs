//! The commands of README and of the book are commands, and what README shows of an explanation is what is said.

mod binary;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The lines of a text's fenced blocks, block by block.
fn blocks(text: &str) -> Vec<Vec<&str>> {
    let parts = text.split("\n```").skip(1).step_by(2);
    parts.map(|block| block.lines().skip(1).collect()).collect()
}

/// What help says of a command, `memory query` or `plan`; asked once.
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
    for page in ["README.md", "docs/see.md", "docs/scale.md", "docs/editors.md", "docs/introduction.md"] {
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
    let text = std::fs::read_to_string(root().join("README.md")).expect("it is there");
    let all = blocks(&text);
    let at = all.iter().position(|block| block.contains(&"descry explain runs/three")).expect("it is shown");
    let shown = all[at + 1].join("\n");
    let folder = tempfile::tempdir().expect("a folder");
    let run = binary::outcome(folder.path(), &["find", "cup A", "--seed", "3", "--run", "runs/three"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let said = binary::outcome(folder.path(), &["explain", "runs/three"]);
    let said = String::from_utf8_lossy(&said.stdout);
    assert!(said.contains(&shown), "README shows\n{shown}\nbut this is said:\n{said}");
}
