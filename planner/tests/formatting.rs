//! Laying a text out changes nothing that is read, keeps every comment, and is done after once.

use std::path::{Path, PathBuf};

use descry_planner::Source;
use descry_planner::pddl::{self, lex};

/// Tokens of a text in order, with names in lower case, and its comments.
fn read(text: &str) -> (Vec<String>, Vec<String>) {
    let mut symbols = lex::Symbols::default();
    let mut findings = Vec::new();
    let tree = lex::read(text, 0, &mut symbols, &mut findings);
    assert!(findings.is_empty(), "{findings:?}");
    let node = |node: &lex::Node| match node.kind {
        lex::Kind::Word(symbol) => symbols.name(symbol).to_string(),
        other => format!("{other:?} of {}", node.next),
    };
    let comments =
        text.lines().filter_map(|line| line.split_once(';')).map(|(_, c)| c.trim_end().to_string());
    (tree.nodes.iter().map(node).collect(), comments.collect())
}

/// Checks a text; returns whether it was laid out already, none where its parentheses do not fit.
fn check(name: &str, text: &str) -> Option<bool> {
    let once = pddl::format(&Source::new(name, text)).ok()?;
    assert_eq!(read(text), read(&once), "{name}");
    let twice = pddl::format(&Source::new(name, once.as_str())).expect("it is read as before");
    let parts = once.lines().zip(twice.lines()).enumerate().find(|(_, (a, b))| a != b);
    assert!(once == twice, "{name} is laid out otherwise the second time: {parts:?}");
    Some(once == text)
}

fn files(path: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(path).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "pddl") {
            found.push(path);
        }
    }
}

#[test]
#[ignore = "data: the published tasks of ../shared/pddl"]
fn published_tasks_are_read_as_before() {
    check_all(&["../../shared/pddl"]);
}

#[test]
fn tasks_of_the_tree_are_read_as_before() {
    check_all(&["../domains", "tests/data"]);
}

fn check_all(folders: &[&str]) {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    folders.iter().for_each(|folder| files(&here.join(folder), &mut found));
    let mut laid_out = 0;
    for path in &found {
        let text = String::from_utf8_lossy(&std::fs::read(path).expect("it is there")).into_owned();
        laid_out += usize::from(check(&path.display().to_string(), &text).is_some());
    }
    println!("{laid_out} of {} files are laid out; the parentheses of the others do not fit", found.len());
    assert!(laid_out >= 5 && laid_out * 20 >= found.len() * 19, "{laid_out} of {}", found.len());
}

#[test]
fn the_built_in_domains_are_laid_out() {
    let mut found = Vec::new();
    files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../domains"), &mut found);
    for path in found {
        let text = std::fs::read_to_string(&path).expect("it is text");
        assert_eq!(
            check(&path.display().to_string(), &text),
            Some(true),
            "{}: run descry fmt",
            path.display()
        );
    }
}
