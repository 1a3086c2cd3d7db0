//! The invariants of ARCHITECTURE.md that can be read off the source.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace holds this crate").to_path_buf()
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut found: Vec<PathBuf> = entries
        .flatten()
        .flat_map(|e| if e.path().is_dir() { sources(&e.path()) } else { vec![e.path()] })
        .filter(|p| p.extension().is_some_and(|e| e == "rs"))
        .collect();
    found.sort();
    found
}

/// The code of a file without its comment lines.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a source file is text");
    text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

fn dependencies(package: &str) -> Vec<String> {
    let text =
        fs::read_to_string(root().join(package).join("Cargo.toml")).expect("every crate has a manifest");
    let manifest: toml::Table = text.parse().expect("a manifest is TOML");
    let table = manifest.get("dependencies").and_then(|d| d.as_table()).cloned().unwrap_or_default();
    table.keys().cloned().collect()
}

/// No line of `folder`'s code may hold any of `words`, but in the files of `allowed`.
fn check_absent(folder: &str, words: &[&str], allowed: &[&str]) {
    let files = sources(&root().join(folder));
    assert!(!files.is_empty(), "{folder} holds no source");
    for file in files {
        let name = file.strip_prefix(root()).expect("sources lie below the root").display().to_string();
        if allowed.iter().any(|a| name.starts_with(a)) {
            continue;
        }
        let code = code(&file);
        for word in words {
            let line = code.lines().find(|l| l.contains(word));
            assert!(line.is_none(), "{name} must not use {word}: {}", line.unwrap_or_default().trim());
        }
    }
}

#[test]
fn a_crate_uses_only_the_floors_below_its_own() {
    let floors: BTreeMap<&str, &[&str]> = BTreeMap::from([
        ("planner", &[] as &[&str]),
        ("perception", &[]),
        ("memory", &["descry-perception"]),
        ("robots", &["descry-perception"]),
        ("skills", &["descry-memory", "descry-perception", "descry-robots"]),
        ("domains", &["descry-memory", "descry-perception", "descry-planner", "descry-robots"]),
        (
            "agent",
            &[
                "descry-domains",
                "descry-memory",
                "descry-perception",
                "descry-planner",
                "descry-robots",
                "descry-skills",
            ],
        ),
        ("tests", &["descry-agent"]),
    ]);
    for (package, allowed) in floors {
        for d in dependencies(package).iter().filter(|d| d.starts_with("descry-")) {
            assert!(allowed.contains(&d.as_str()), "{package} must not depend on {d}");
        }
    }
}

#[test]
fn planner_and_perception_know_no_clock_no_files_no_threads_of_a_runtime() {
    let words = [
        "std::fs",
        "std::time",
        "Instant::now",
        "SystemTime",
        "tokio",
        "std::env",
        "static mut",
        "thread_rng",
    ];
    check_absent("planner/src", &words, &[]);
    check_absent("perception/src", &words, &[]);
}

#[test]
fn only_the_simulator_reads_the_truth_and_only_a_report_shows_it() {
    let words = ["truth"];
    for folder in ["skills/src", "domains/src", "memory/src"] {
        check_absent(folder, &words, &[]);
    }
    check_absent(
        "agent/src",
        &words,
        &["agent/src/report", "agent/src/commands/experiment", "agent/src/experiment", "agent/src/body.rs"],
    );
}

#[test]
fn only_memory_writes_what_was_seen() {
    check_absent("skills/src", &["std::fs", "File::create"], &[]);
    check_absent("domains/src", &["fs::write", "File::create"], &[]);
}

#[test]
fn versions_are_written_once() {
    for package in ["planner", "perception", "memory", "robots", "skills", "domains", "agent", "tests"] {
        let text =
            fs::read_to_string(root().join(package).join("Cargo.toml")).expect("every crate has a manifest");
        let manifest: toml::Table = text.parse().expect("a manifest is TOML");
        for table in ["dependencies", "dev-dependencies"] {
            let Some(d) = manifest.get(table).and_then(|d| d.as_table()) else { continue };
            for (name, value) in d {
                let inherited = value.get("workspace").and_then(toml::Value::as_bool) == Some(true);
                assert!(inherited, "{package}: {name} must take its version from the workspace");
            }
        }
    }
}
