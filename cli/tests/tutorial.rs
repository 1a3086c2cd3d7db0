//! The tutorial, followed word for word in an empty folder: its files are written, its commands run, its
//! outputs compared.

use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

/// Task for a reader of the tutorial.
#[derive(Debug)]
enum Task<'a> {
    /// Change a file as the sentence says.
    Edit { sentence: String, text: String },
    /// Type commands and compare their output.
    Run { lines: Vec<&'a str> },
}

/// The fenced blocks of the text; each block of a file comes with the sentence before it.
fn tasks(markdown: &str) -> Vec<Task<'_>> {
    let mut tasks = Vec::new();
    let mut paragraph: Vec<&str> = Vec::new();
    let mut ended = false;
    let mut lines = markdown.lines();
    while let Some(line) = lines.next() {
        if let Some(language) = line.strip_prefix("```") {
            let block: Vec<&str> = lines.by_ref().take_while(|l| *l != "```").collect();
            match language {
                "console" => tasks.push(Task::Run { lines: block }),
                // For a shell elsewhere: what is installed here is what is tested.
                "sh" => {}
                _ => tasks.push(Task::Edit {
                    sentence: last_sentence(&paragraph.join(" ")),
                    text: block.join("\n") + "\n",
                }),
            }
            paragraph.clear();
        } else if line.is_empty() {
            ended = true;
        } else {
            if std::mem::take(&mut ended) {
                paragraph.clear();
            }
            paragraph.push(line);
        }
    }
    tasks
}

fn last_sentence(paragraph: &str) -> String {
    let starts = ["Write `", "Add ", "In `"];
    let at = starts.iter().filter_map(|s| paragraph.rfind(s)).max();
    paragraph[at.unwrap_or_else(|| panic!("no file is named: {paragraph}"))..].to_string()
}

/// Changes a file as the sentence before the text says.
fn edit(folder: &Path, sentence: &str, text: &str) {
    let quoted: Vec<&str> = sentence.split('`').skip(1).step_by(2).collect();
    let path = folder.join(quoted[0]);
    let before = || std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{sentence}: {e}"));
    let line_of = |before: &str, wanted: &str| {
        let is_it = |l: &str| l == wanted || l.trim_start() == wanted;
        let found: Vec<usize> =
            before.lines().enumerate().filter(|(_, l)| is_it(l)).map(|(n, _)| n).collect();
        assert_eq!(found.len(), 1, "{sentence}: the line stands there {} times", found.len());
        found[0]
    };
    let around = |before: &str, keep: bool| {
        let at = line_of(before, quoted[1]);
        let head: String = before.lines().take(at + usize::from(keep)).map(|l| format!("{l}\n")).collect();
        let tail: String = before.lines().skip(at + 1).map(|l| format!("{l}\n")).collect();
        head + text + &tail
    };
    let after = if sentence.starts_with("Write ") {
        text.to_string()
    } else if sentence.starts_with("Add at the end of ") {
        format!("{}\n{text}", before())
    } else if sentence.starts_with("Add before the last parenthesis of ") {
        let before = before();
        let (head, tail) = before.rsplit_once(')').expect("a parenthesis");
        format!("{head}\n{text}){tail}")
    } else if sentence.contains("below the line") {
        around(&before(), true)
    } else if sentence.contains("replace the line") {
        around(&before(), false)
    } else {
        panic!("what is to be done is not understood: {sentence}");
    };
    std::fs::write(&path, after).unwrap_or_else(|e| panic!("{sentence}: {e}"));
}

/// Runs a command as typed, with descry on the path; returns both output streams in order, and true if it
/// succeeded.
fn run(folder: &Path, command: &str) -> (String, bool) {
    let descry = Path::new(env!("CARGO_BIN_EXE_descry")).parent().expect("a folder");
    let path = format!("{}:{}", descry.display(), std::env::var("PATH").unwrap_or_default());
    let output = Command::new("sh")
        .args(["-c", &format!("{command} 2>&1")])
        .current_dir(folder)
        .env("PATH", path)
        .output()
        .expect("sh runs");
    (String::from_utf8_lossy(&output.stdout).into_owned(), output.status.success())
}

/// True if lines are as expected; `…` stands for any part of a line, or alone for any lines.
fn fits(expected: &[&str], found: &[&str]) -> bool {
    match expected.split_first() {
        None => found.is_empty(),
        Some((&"…", rest)) => (0..=found.len()).any(|n| fits(rest, &found[n..])),
        Some((line, rest)) => found.first().is_some_and(|f| line_fits(line, f)) && fits(rest, &found[1..]),
    }
}

fn line_fits(expected: &str, found: &str) -> bool {
    let Some((head, tail)) = expected.split_once('…') else { return expected == found };
    let Some(rest) = found.strip_prefix(head) else { return false };
    let ends = |at: usize| rest.is_char_boundary(at) && line_fits(tail, &rest[at..]);
    (0..=rest.len()).any(ends)
}

#[test]
fn the_tutorial_holds_word_for_word() {
    if Command::new("python3").arg("--version").output().is_err() {
        eprintln!("skipped: there is no python3");
        return;
    }
    let folder = TempDir::new().expect("a folder can be made");
    follow(&page("docs/tutorial.md"), folder.path());
}

/// Text of a page of the repository.
pub fn page(path: &str) -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Carries out in a folder what a text asks of a reader, and compares the output with the text.
pub fn follow(text: &str, folder: &Path) {
    for task in tasks(text) {
        match task {
            Task::Edit { sentence, text } => edit(folder, &sentence, &text),
            Task::Run { lines } => {
                let mut rest = lines.as_slice();
                while let Some((first, behind)) = rest.split_first() {
                    let command = first.strip_prefix("$ ").expect("a command is typed");
                    let end = behind.iter().position(|l| l.starts_with("$ ")).unwrap_or(behind.len());
                    let (said, well) = run(folder, command);
                    // A command of which nothing is shown must end well, whatever it prints.
                    if end == 0 {
                        assert!(well, "$ {command}\nfails:\n{said}");
                        rest = behind;
                        continue;
                    }
                    let found: Vec<&str> = said.trim_end().lines().collect();
                    assert!(fits(&behind[..end], &found), "$ {command}\nthe output is not as shown:\n{said}");
                    rest = &behind[end..];
                }
            }
        }
    }
}
